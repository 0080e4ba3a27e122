//! Which steps an adjustment takes, when it stops, and where its cofactors are then taken.

/// How an adjustment goes to the solution: the control of its steps, each with the rules by which it can stop.
///
/// Where a rule looks at a step before it is taken ([`Stop::Fraction`], [`Stop::Foreseen`], [`Published::Length`]) the last one is taken nevertheless, and the
/// cofactors are those of the normal equations that gave it; where it looks at the sum of squares after a step ([`Stop::Decrease`],
/// [`Published::Percent`]) the normal equations are formed once more, at the values reached. A trust region, whose last equations may
/// be damped, always forms them once more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Full steps (Gauss-Newton) whatever becomes of the sum of squares, in the unknowns of the published programs.
    Full(Published),
    /// Full steps; one that raises the sum of squares is taken back and damped (Levenberg-Marquardt), and so are those after it until they
    /// do without. Where the last steps fall slowly ([`super::Model::ends_slowly`]) one of them is followed by a chord.
    Damped(Stop),
    /// Steps damped from the first one on, by how well the linearized equations predict what they do (Levenberg-Marquardt with the gain
    /// ratio of Nielsen 1999): for far starts. The damping takes the place of a datum where there is none; one is held at the end, for
    /// the cofactors.
    TrustRegion(Stop),
}

/// Damping of the first step in a trust region.
pub(super) const FIRST_DAMPING: f64 = 1e-4;

impl Default for Method {
    /// Full steps, damped where they fail, to a hundred-thousandth of the standard deviations.
    fn default() -> Self {
        Self::Damped(Stop::Fraction(1e-5))
    }
}

/// When steps that are controlled have led to the solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// When no unknown changes by more than this fraction of its standard deviation (a priori unit weight), or when the rate of
    /// convergence shows that none would in the next iteration.
    Fraction(f64),
    /// When a step lowers the sum of squares, or would by the linearized equations, by less than this fraction of it.
    Decrease(f64),
    /// When a full step moves no unknown by more than this multiple of its standard deviation, or when the next one would not: with c^2
    /// the decrease of the sum of squares that the linearized equations foresee, what it falls short of that is, in the order that counts,
    /// the decrease that the next step would bring. For adjustments that are gone on from, where a step is dearer than its last digits.
    Foreseen(f64),
}

impl Stop {
    /// Whether a step is the last one that changes no unknown by more than `change` standard deviations.
    pub(super) fn at_change(self, change: f64) -> bool {
        matches!(self, Self::Fraction(fraction) | Self::Foreseen(fraction) if change <= fraction)
    }

    /// Whether a step is the last one that lowers a sum of squares by `decrease`.
    pub(super) fn at_decrease(self, decrease: f64, sum: f64) -> bool {
        self.least_decrease(sum).is_some_and(|least| decrease <= least)
    }

    /// By how much a step must lower a sum of squares to go on, where that counts.
    pub(super) fn least_decrease(self, sum: f64) -> Option<f64> {
        if let Self::Decrease(fraction) = self { Some(fraction * sum) } else { None }
    }
}

/// When published programs stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Published {
    /// When the weighted sum of squares changes by less than this percentage from one iteration to the next, as in the 1987 program
    /// (GIANT guide, section 6); diverged when it rises by more.
    Percent(f64),
    /// When the corrections of some unknowns, taken as one vector, are shorter than `limit`, as in program W5344 (USGS Computer
    /// Contribution 2, 1969).
    Length {
        /// The first of these unknowns, in the order of the layout.
        first: usize,
        /// How many there are.
        count: usize,
        /// In their units.
        limit: f64,
    },
}

/// A Gauss-Newton step that changes no unknown by more than this multiple of its standard deviation is accepted as it is:
/// it lowers the sum of squares by less than the square of this, which may drown in the rounding errors of the computed
/// observations (geocentric coordinates are good to a nanometre only).
pub(super) const NEGLIGIBLE: f64 = 1e-3;
/// Nor does one that changes them by no more than this in the mean bring about other cofactors: the bound on the change of any one unknown
/// grows with the root of their number.
pub(super) const IN_THE_MEAN: f64 = 1e-5;

/// Whether cofactors before a step that changes so many unknowns by `change` standard deviations together are those after it.
pub(super) fn leaves_cofactors(change: f64, unknowns: usize) -> bool {
    change <= NEGLIGIBLE.max(IN_THE_MEAN * (unknowns as f64).sqrt())
}
