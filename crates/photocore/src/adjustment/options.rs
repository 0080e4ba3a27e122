//! How to adjust, and what is told while it goes on.

use super::loss::Loss;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// When no unknown changes by more than this fraction of its standard deviation (a priori unit weight), or when the rate of
    /// convergence shows that none would in the next iteration. Steps that raise the sum of squares are damped
    /// (Levenberg-Marquardt).
    Fraction(f64),
    /// When the weighted sum of squares changes by less than this percentage from one iteration to the next, as in the
    /// 1987 program (GIANT guide, section 6); no damping.
    Percent(f64),
    /// When the corrections of some unknowns, taken as one vector, are shorter than `limit`, as in program W5344 (USGS Computer
    /// Contribution 2, 1969); no damping. The cofactors are those of the normal equations that gave the last corrections.
    Length {
        /// The first of these unknowns, in the order of the layout.
        first: usize,
        /// How many there are.
        count: usize,
        /// In their units.
        limit: f64,
    },
    /// When a step lowers the sum of squares, or would by the linearized equations, by less than this fraction of it. Steps are damped
    /// from the first one on, by how well the linearized equations predict what they do (Levenberg-Marquardt with the gain
    /// ratio of Nielsen 1999): for far starts, and for networks without a datum, whose cofactors are those of the
    /// datum that [`super::Model::datum`] chooses.
    Decrease(f64),
}

impl Criterion {
    /// Whether these are the full steps of a published program.
    pub(crate) fn is_published(&self) -> bool {
        matches!(self, Criterion::Percent(_) | Criterion::Length { .. })
    }
}

/// Damping of the first step of [`Criterion::Decrease`].
pub(super) const FIRST_DAMPING: f64 = 1e-4;

/// How to adjust. By default: squares, to a hundred-thousandth of the standard deviations, with cofactors.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop.
    pub criterion: Criterion,
    /// Iterations at the most.
    pub max_iterations: usize,
    /// Whether to compute cofactors and redundancy numbers.
    pub covariance: bool,
    /// What takes the place of the squares of the observations; None for least squares.
    pub loss: Option<Loss>,
}

impl Default for Options {
    fn default() -> Self {
        Self { criterion: Criterion::Fraction(1e-5), max_iterations: 100, covariance: true, loss: None }
    }
}

/// How an adjustment ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The criterion was met.
    Converged,
    /// The iterations ran out.
    NotConverged,
    /// The sum of squares rose, and no shorter step lowered it.
    Diverged,
}

/// One iteration.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    /// From 1.
    pub number: usize,
    /// Weighted sum of squares after its corrections, of losses instead of squares where the options ask for a loss.
    pub sum_of_squares: f64,
    /// No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    pub largest_change: f64,
    /// Damping of its step, a fraction of the diagonal of the normal matrix; 0 for a Gauss-Newton step.
    pub damping: f64,
}

/// What the adjustment is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Forming the normal equations and factoring them, which go together.
    Form,
    /// Solving them.
    Solve,
    /// Inverting them, with cofactors and redundancy numbers.
    Invert,
}

/// What is told while the adjustment runs.
#[derive(Debug, Clone, Copy)]
pub enum Event {
    /// A phase has come so far: `done` of `total` local blocks.
    Progress {
        /// The phase.
        phase: Phase,
        /// Local blocks done.
        done: usize,
        /// Local blocks in all.
        total: usize,
    },
    /// An iteration is over.
    Iteration(Iteration),
}
