//! Robust losses: how much an observation that fits badly counts.

/// A robust loss. It takes the place of s, the weighted sum of squares of one group of observations (the coordinates of an image
/// point), in what is minimised; `scale` is the root of s at which it sets in, in standard deviations a priori.
///
/// The observations of a group are reweighted by the slope of the loss in every iteration (iteratively reweighted least
/// squares), which gives the gradient of the loss exactly. Both losses are concave in s, so that the reweighted sum lies nowhere
/// below the loss and a step that lowers the one lowers the other. That is safe, but converges linearly, and slowly where what fits
/// badly holds a point. Close to the end the second-order term of Triggs and others (2000, section 4.3) is therefore taken in;
/// from far starts it would lead to wrong places, because it takes nearly all weight from what fits badly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Huber 1964: s, and beyond scale^2 a straight line in the root of s: 2 scale sqrt(s) - scale^2.
    Huber(f64),
    /// scale^2 log(1 + s / scale^2): what fits badly hardly counts any more; there may be several minima.
    Cauchy(f64),
}

impl Loss {
    /// The loss of a group whose weighted sum of squares is `s`.
    pub fn value(self, s: f64) -> f64 {
        match self {
            Loss::Huber(scale) if s > scale * scale => 2.0 * scale * s.sqrt() - scale * scale,
            Loss::Huber(_) => s,
            Loss::Cauchy(scale) => scale * scale * (s / (scale * scale)).ln_1p(),
        }
    }

    /// Its slope: the factor by which the weights of the group's observations are multiplied, 0 to 1.
    #[inline]
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Loss::Huber(scale) if s > scale * scale => scale / s.sqrt(),
            Loss::Huber(_) => 1.0,
            Loss::Cauchy(scale) => (1.0 + s / (scale * scale)).recip(),
        }
    }

    /// 1 + 2 s r'' / r' of the loss r, at least [`LEAST_CURVATURE`]: its second derivative along the residual of a group, in units
    /// of its slope, which is that across.
    #[inline]
    pub(super) fn curvature(self, s: f64) -> f64 {
        let curvature = match self {
            Loss::Huber(scale) if s > scale * scale => 0.0,
            Loss::Huber(_) => 1.0,
            Loss::Cauchy(scale) => 2.0 / (1.0 + s / (scale * scale)) - 1.0,
        };
        curvature.max(LEAST_CURVATURE)
    }
}

/// Keeps the normal matrix positive definite.
const LEAST_CURVATURE: f64 = 1e-3;

/// What a loss makes of the equations of a group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reweighting {
    pub loss: Loss,
    /// Whether the second-order term is taken in.
    pub curved: bool,
}

impl Reweighting {
    /// Without the second-order term.
    pub fn plain(loss: Loss) -> Self {
        Self { loss, curved: false }
    }

    /// Reweights the equations of a group, given with unit weight.
    ///
    /// With v the residuals, s = |v|^2, w the slope and c the curvature of the loss, the rows A and l become
    /// sqrt(w) (A - (1 - sqrt(c)) v (v^T A) / s) and sqrt(w / c) l: A^T l is the gradient either way.
    #[inline]
    pub fn apply(self, constant: &mut [f64], parts: &mut [&mut [f64]]) {
        let square: f64 = constant.iter().map(|v| v * v).sum();
        let factor = self.loss.weight(square).sqrt();
        let root = if self.curved { self.loss.curvature(square).sqrt() } else { 1.0 };
        let count = constant.len();
        for part in parts {
            let width = part.len() / count;
            for column in (0..width).filter(|_| root < 1.0) {
                let along: f64 = (0..count).map(|row| constant[row] * part[row * width + column]).sum();
                let excess = (1.0 - root) * along / square;
                (0..count).for_each(|row| part[row * width + column] -= excess * constant[row]);
            }
            part.iter_mut().for_each(|value| *value *= factor);
        }
        constant.iter_mut().for_each(|value| *value *= factor / root);
    }
}
