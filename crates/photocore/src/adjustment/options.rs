//! How to adjust, and the events of it.

use super::loss::Loss;
use super::method::Method;

/// How to adjust. By default: squares, to a hundred-thousandth of the standard deviations, with cofactors.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Which steps to take, and when to stop.
    pub method: Method,
    /// Iterations at the most.
    pub max_iterations: usize,
    /// Whether to compute cofactors and redundancy numbers.
    pub covariance: bool,
    /// What takes the place of the squares of the observations; None for least squares.
    pub loss: Option<Loss>,
    /// Threads that are started for it; 0 for one on each processor. Without meaning where the caller gives its own.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::default(), max_iterations: 100, covariance: true, loss: None, threads: 0 }
    }
}

/// How an adjustment ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The rule of the method was met.
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

/// An event of an adjustment that runs.
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
