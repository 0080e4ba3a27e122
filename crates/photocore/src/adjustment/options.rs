//! Options and step history of an adjustment.

use super::loss::Loss;
use crate::Iteration;

/// Options of an adjustment. Default: least squares without a loss, converged to 1e-5 standard deviations, with cofactors.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Step control and stopping rule.
    pub method: Method,
    /// Maximum number of iterations.
    pub max_iterations: usize,
    /// Whether to compute cofactors and redundancy numbers.
    pub covariance: bool,
    /// Robust loss of the observations; None for least squares.
    pub loss: Option<Loss>,
    /// Number of threads to start; 0 means one per processor. Ignored if the caller passes threads.
    pub threads: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::default(), max_iterations: 100, covariance: true, loss: None, threads: 0 }
    }
}

/// Final state of an adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The stopping rule was satisfied.
    Converged,
    /// The maximum number of iterations was reached.
    NotConverged,
    /// The sum of squares increased, and shorter steps did not lower it.
    Diverged,
}

/// Step control, with the stopping rules that it supports.
///
/// [`Stop::Fraction`], [`Stop::Foreseen`] and [`Published::Length`] test a step before it is applied. The last step is applied
/// nevertheless, and cofactors are taken from the normal equations before it. [`Stop::Decrease`] and [`Published::Percent`] test the sum of
/// squares after a step; normal equations are then formed again at the final values. A trust region always forms them again, because its
/// last equations may be damped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Full Gauss-Newton steps without control of the sum of squares, in the unknowns of the published programs.
    Full(Published),
    /// Full steps; a step that raises the sum of squares is repeated with damping (Levenberg-Marquardt) until damping is unnecessary. In
    /// case of slow convergence ([`super::Model::converges_linearly`]) a full step is followed by a chord.
    Damped(Stop),
    /// Damped steps from the start, controlled by the gain ratio of actual to predicted decrease (Levenberg-Marquardt, Nielsen 1999): for
    /// poor initial values. Damping replaces a missing datum; the datum is constrained at the end, for the cofactors.
    TrustRegion(Stop),
}

impl Default for Method {
    /// Full steps, damped after failures, converged to 1e-5 standard deviations.
    fn default() -> Self {
        Self::Damped(Stop::Fraction(1e-5))
    }
}

/// Stopping rule of controlled steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// The change of every unknown is at most this fraction of its standard deviation (a priori unit weight). The rate of convergence may
    /// predict this for the next iteration.
    Fraction(f64),
    /// The actual or predicted decrease of the sum of squares is less than this fraction of it.
    Decrease(f64),
    /// No unknown changes by more than this multiple of its standard deviation in a full step, or would in the next one. The next decrease
    /// is predicted, to leading order, from the difference between the actual and the linearized decrease c^2. For restarted adjustments,
    /// in which another iteration costs more than the digits it adds.
    Foreseen(f64),
}

impl Stop {
    /// Whether a step with a change of `change` standard deviations is the last one.
    pub(super) fn at_change(self, change: f64) -> bool {
        matches!(self, Self::Fraction(fraction) | Self::Foreseen(fraction) if change <= fraction)
    }

    /// Whether a step that lowers the sum of squares by `decrease` is the last one.
    pub(super) fn at_decrease(self, decrease: f64, sum: f64) -> bool {
        self.least_decrease(sum).is_some_and(|least| decrease <= least)
    }

    /// Returns the minimum decrease for a further step, if the rule has one.
    pub(super) fn least_decrease(self, sum: f64) -> Option<f64> {
        if let Self::Decrease(fraction) = self { Some(fraction * sum) } else { None }
    }
}

/// Stopping rule of published programs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Published {
    /// The weighted sum of squares changes by less than this percentage between iterations, as in the program of 1987 (GIANT guide, section
    /// 6). Diverged if it rises by more.
    Percent(f64),
    /// The norm of the corrections of some unknowns is below `limit`, as in program W5344 (USGS Computer Contribution 2, 1969).
    Length {
        /// First of these unknowns, in the order of the layout.
        first: usize,
        /// Number of these unknowns.
        count: usize,
        /// Limit of the length, in their units.
        limit: f64,
    },
}

/// Maximum change, in standard deviations, of a Gauss-Newton step that is accepted without a test. Its decrease of the sum of squares may
/// be smaller than the rounding errors of computed observations. Geocentric coordinates, for example, are accurate to one nanometre only.
pub(super) const NEGLIGIBLE: f64 = 1e-3;
/// Change per root of the number of unknowns below which cofactors count as unchanged: the bound of a change grows with this root.
pub(super) const IN_THE_MEAN: f64 = 1e-5;

/// Whether a step of `change` standard deviations in total leaves the cofactors of all unknowns practically unchanged.
pub(super) fn leaves_cofactors(change: f64, unknowns: usize) -> bool {
    change <= NEGLIGIBLE.max(IN_THE_MEAN * (unknowns as f64).sqrt())
}

/// Number of full steps for the test of stagnation, and the minimum ratio of the last change to the first.
const ALIKE: usize = 5;
const ALIKE_FALL: f64 = 0.9;
/// Upper bound of the change, in standard deviations, for a chord: the normal equations then change much less than a chord gains.
const CLOSE: f64 = 30.0;
/// Lower bound of the change for a chord: after a shorter step the next one is the last.
const NOT_YET: f64 = 10.0 * NEGLIGIBLE;
/// Maximum ratio of two successive changes for a chord; also of a chord to its step.
const FALLING: f64 = 0.1;

/// Previous steps of an adjustment.
#[derive(Debug, Clone, Copy)]
pub struct History<'a> {
    /// Iterations in sequence.
    pub iterations: &'a [Iteration],
    /// Length of the chord after the last step, if any.
    pub chord: Option<f64>,
    /// Number of unknowns.
    pub unknowns: usize,
}

impl History<'_> {
    /// Whether a full step leaves cofactors unchanged and the sum of all further steps is within a limit. Their convergence rate is taken
    /// from the last two steps, including chords (Hairer and Wanner 1996, section IV.8).
    pub fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let rate = self.before().map_or(1.0, |before| change / self.chord.unwrap_or(before.largest_change));
        leaves_cofactors(change, self.unknowns) && rate < 1.0 && rate / (1.0 - rate) * change <= limit
    }

    /// Whether full steps are negligible and no longer decrease: the remaining changes are rounding errors of weakly determined unknowns.
    pub fn falls_no_more(&self, change: f64) -> bool {
        let last = self.iterations.len().checked_sub(ALIKE).map(|first| &self.iterations[first..]);
        last.is_some_and(|last| {
            let negligible = |step: &Iteration| step.damping == 0.0 && step.largest_change <= NEGLIGIBLE;
            change <= NEGLIGIBLE
                && last.iter().all(negligible)
                && change > ALIKE_FALL * last[0].largest_change
        })
    }

    /// Whether a chord is useful after a full step.
    pub fn is_for_chord(&self, change: f64) -> bool {
        (NOT_YET..CLOSE).contains(&change)
            && self.before().is_some_and(|before| change <= FALLING * before.largest_change)
    }

    /// Whether to accept a chord after a full step; a chord of NaN length is rejected.
    pub fn is_chord(chord: f64, change: f64) -> bool {
        chord <= FALLING * change
    }

    /// Returns the last step if it was a full step.
    fn before(&self) -> Option<&Iteration> {
        self.iterations.last().filter(|iteration| iteration.damping == 0.0)
    }
}
