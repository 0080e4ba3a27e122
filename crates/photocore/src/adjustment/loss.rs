//! Robust losses: functions that reduce the weight of poorly fitting observations.

/// Robust loss, which replaces s, the weighted sum of squares of one group of observations (the coordinates of an image point). `scale` is
/// the root of s, in a priori standard deviations, at which the loss deviates from s.
///
/// Observations are reweighted by the derivative of the loss in every iteration (iteratively reweighted least squares); the gradient is
/// exact. Both losses are concave in s: the reweighted sum bounds the loss from above, and a step that lowers the former also lowers the
/// latter. Convergence is safe but linear, and slow if poorly fitting observations determine a point. Near the solution the second-order
/// term is added (Triggs and others 2000, section 4.3). Far from it, this term would remove nearly all weight of poorly fitting
/// observations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Huber 1964: s up to scale^2, and 2 scale sqrt(s) - scale^2 above it.
    Huber(f64),
    /// scale^2 log(1 + s / scale^2): poorly fitting observations have little influence, and several minima are possible.
    Cauchy(f64),
}

impl Loss {
    /// Loss of a group with the weighted sum of squares `s`.
    pub fn value(self, s: f64) -> f64 {
        match self {
            Loss::Huber(scale) if s > scale * scale => 2.0 * scale * s.sqrt() - scale * scale,
            Loss::Huber(_) => s,
            Loss::Cauchy(scale) => scale * scale * (s / (scale * scale)).ln_1p(),
        }
    }

    /// Derivative of the loss: the weight factor of the group's observations, 0 to 1.
    #[inline]
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Loss::Huber(scale) if s > scale * scale => scale / s.sqrt(),
            Loss::Huber(_) => 1.0,
            Loss::Cauchy(scale) => (1.0 + s / (scale * scale)).recip(),
        }
    }

    /// 1 + 2 s r'' / r' of the loss r, at least [`LEAST_CURVATURE`]: ratio of its second derivatives along and across the residual of a
    /// group.
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

/// Minimum curvature, for a positive definite normal matrix.
const LEAST_CURVATURE: f64 = 1e-3;

/// Reweighting of the equations of a group.
#[derive(Debug, Clone, Copy)]
#[doc(hidden)]
pub struct Reweighting {
    pub loss: Loss,
    /// Whether the second-order term is used.
    pub curved: bool,
}

impl Reweighting {
    /// Reweights without the second-order term.
    pub fn plain(loss: Loss) -> Self {
        Self { loss, curved: false }
    }

    /// Reweights the equations of a group, given with unit weight.
    ///
    /// Let v be the residuals, s = |v|^2, w the slope and c the curvature of the loss. The rows become sqrt(w) (A - (1 - sqrt(c)) v (v^T A)
    /// / s) and sqrt(w / c) l. A^T l is the exact gradient for any c.
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
