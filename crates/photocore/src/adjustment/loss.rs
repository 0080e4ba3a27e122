//! Robust losses: how much an observation that fits badly counts.

/// A robust loss. It takes the place of s, the weighted sum of squares of one group of observations (the coordinates of an image
/// point), in what is minimised; `scale` is the root of s at which it sets in, in standard deviations a priori.
///
/// The observations of a group are reweighted by the slope of the loss in every iteration (iteratively reweighted least
/// squares), which gives the gradient of the loss exactly. Both losses are concave in s, so that the reweighted sum lies nowhere
/// below the loss and a step that lowers the one lowers the other. The second-order term of Triggs and others (2000, section
/// 4.3) is left out, as Ceres does: it takes nearly all weight from what fits badly along its residual, and far starts then end in
/// wrong places. The price is linear convergence at the end.
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
}
