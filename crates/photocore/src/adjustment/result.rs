//! Results of an adjustment.

use thiserror::Error;

use super::options::{NEGLIGIBLE, Status};
use super::statistics::{Counts, Observed, square, standardized};
use crate::normals::{Cofactors, Factor, LayoutError, Operations, Ordering, SelectedInverse, SystemError};
use crate::{Iteration, Stopped};

/// Computing time of each phase in seconds, over all iterations.
#[derive(Debug, Clone, Copy, Default)]
pub struct PhaseTimes {
    /// Formation, with the reduction of local blocks.
    pub form: f64,
    /// Factorisation.
    pub factor: f64,
    /// Solution.
    pub solve: f64,
    /// Selected inversion.
    pub invert: f64,
    /// Cofactors and redundancy numbers.
    pub cofactors: f64,
}

impl PhaseTimes {
    pub(super) fn add(&mut self, other: &Self) {
        self.form += other.form;
        self.factor += other.factor;
        self.solve += other.solve;
        self.invert += other.invert;
        self.cofactors += other.cofactors;
    }
}

/// Computational effort and elimination order of an adjustment.
#[derive(Debug, Clone)]
pub struct SolverStats {
    /// Predicted multiply-adds per execution of each phase.
    pub operations: Operations,
    /// Number of formations and factorisations.
    pub formations: usize,
    /// Time by phase.
    pub seconds: PhaseTimes,
    /// The chosen ordering.
    pub ordering: Ordering,
    /// Compared orderings with predicted multiply-adds of a factorisation; None if the layout is too large for one.
    pub predictions: Vec<(Ordering, Option<f64>)>,
    /// Retained blocks in elimination order.
    pub order: Vec<usize>,
}

/// Adjusted unknowns with their statistics.
#[derive(Debug)]
pub struct Adjustment {
    /// Final state.
    pub status: Status,
    /// Weighted sum of squares at the initial values; with a loss, the sum of losses.
    pub initial_sum_of_squares: f64,
    /// All iterations.
    pub iterations: Vec<Iteration>,
    /// Requested retained unknowns in the order of the layout ([`super::Requests::history`]): initially and after each iteration. Empty if
    /// none are requested.
    pub history: Vec<Vec<f64>>,
    /// Corrections of the unknowns in the last iteration; zero without iterations.
    pub last_corrections: Vec<f64>,
    /// Adjusted unknowns, in the order of the layout.
    pub unknowns: Vec<f64>,
    /// Observed minus computed, in the order of groups and rows, then of terms and rows, in the units of the observations.
    pub residuals: Vec<f64>,
    /// Weight factor from the loss for each group of observations, then for each term; None without a loss.
    pub weights: Option<Vec<f64>>,
    /// Cofactors (a priori unit weight, weights modified by the loss), if requested; None if the final values leave unknowns undetermined.
    pub cofactors: Option<Cofactors>,
    /// The inverse from which they were computed, if tests of groups will follow.
    pub(super) selected: Option<SelectedInverse>,
    /// The factor before it was inverted, if tests of groups will follow and it is small.
    pub(super) factor: Option<Factor>,
    /// Cofactors of all pairs of the requested unknowns, row by row (see [`super::Requests::by_groups`]).
    pub joint: Option<Vec<f64>>,
    /// Reason for missing cofactors, if they were requested.
    pub undetermined: Option<AdjustError>,
    /// Local blocks that became ill-conditioned in the last step (see [`super::Evaluated::collapsed`]). The iterations have stopped;
    /// restart the adjustment without these blocks.
    pub collapsed: Vec<usize>,
    /// Retained unknowns in a combination that is determined too weakly: the sum of squares stagnated while full steps along it failed.
    /// Empty if the adjustment ended otherwise.
    pub weak: Vec<usize>,
    /// Unknowns constrained for a datum (see [`super::Model::motions`]); empty if the problem defines one.
    pub datum: Vec<usize>,
    /// Approximate relative rounding error of the variances, if the cofactors refer to the requested datum.
    pub lost: Option<f64>,
    /// Redundancy number of each observation, if requested.
    pub redundancy: Option<Vec<f64>>,
    /// Redundancy number of each unknown as an observation of itself (zero unless weighted), if requested.
    pub prior_redundancy: Option<Vec<f64>>,
    /// Sum of all redundancy numbers minus the degrees of freedom: zero except for rounding errors. In weakly connected networks, cofactors
    /// and redundancy numbers lose about as many digits. None without cofactors, and with a loss.
    pub redundancy_excess: Option<f64>,
    /// Numbers of observations and unknowns.
    pub counts: Counts,
    /// Computational effort.
    pub effort: SolverStats,
}

impl Adjustment {
    /// Whether cofactors from before the last step are valid after it: the step was short and the adjustment converged.
    pub fn holds_after_last_step(&self) -> bool {
        let last = self.iterations.last().map_or(0.0, |iteration| iteration.largest_change);
        let plain = self.weights.is_none() && self.lost.is_none();
        self.status == Status::Converged && last <= NEGLIGIBLE && plain
    }

    /// Returns the corrections of the requested retained unknowns in every iteration, in the order of the layout.
    pub fn corrections(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.history.windows(2).map(|pair| pair[0].iter().zip(&pair[1]).map(|(from, to)| to - from).collect())
    }

    /// Prepends the iterations and effort of an earlier adjustment of the same observations.
    pub(crate) fn prepend(&mut self, before: Option<Self>) {
        let Some(before) = before else { return };
        let done = before.iterations.len();
        self.iterations.iter_mut().for_each(|iteration| iteration.number += done);
        self.iterations.splice(0..0, before.iterations);
        if !before.history.is_empty() {
            self.history.splice(0..self.history.len().min(1), before.history);
        }
        self.initial_sum_of_squares = before.initial_sum_of_squares;
        self.effort.formations += before.effort.formations;
        self.effort.seconds.add(&before.effort.seconds);
    }

    /// Returns residuals and test statistics of a group of observations with the given a priori standard deviations.
    pub fn observed<const ROWS: usize>(&self, group: usize, sd: [f64; ROWS]) -> Observed<ROWS> {
        let residual = std::array::from_fn(|row| self.residuals[ROWS * group + row]);
        let redundancy: [f64; ROWS] = std::array::from_fn(|row| {
            self.redundancy.as_ref().map_or(f64::NAN, |all| all[ROWS * group + row])
        });
        Observed {
            residual,
            redundancy,
            standardized: std::array::from_fn(|row| standardized(residual[row], sd[row], redundancy[row])),
            weight: self.weights.as_ref().map_or(1.0, |all| all[group]),
        }
    }

    /// Releases the arrays used by [`Adjustment::observed`], which are large in large problems.
    pub(crate) fn release_observations(&mut self) {
        self.residuals = vec![];
        self.redundancy = None;
        self.weights = None;
    }

    /// Returns the weighted sum of squares of the first residuals, with weights modified by the loss. `sd` contains their standard
    /// deviations, in groups of `rows` rows.
    pub fn reweighted_sum_of_squares(&self, sd: &[f64], rows: usize) -> f64 {
        let squares = self.residuals.iter().zip(sd).map(square);
        match &self.weights {
            None => squares.sum(),
            Some(weights) => squares.enumerate().map(|(i, square)| weights[i / rows] * square).sum(),
        }
    }

    /// Returns the redundancy numbers of N unknowns from `first` as observations of themselves; NaN without cofactors.
    pub fn prior_redundancy<const N: usize>(&self, first: usize) -> [f64; N] {
        std::array::from_fn(|k| self.prior_redundancy.as_ref().map_or(f64::NAN, |all| all[first + k]))
    }
}

/// Error of an adjustment.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AdjustError {
    /// Local blocks are not determined by their observations.
    #[error("{} local blocks are not determined by their observations", .0.len())]
    UndeterminedLocals(Vec<usize>),
    /// Combinations of retained unknowns are not determined: the retained blocks in each.
    #[error("{} combinations of unknowns are not determined by the observations", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// Computed observations at the initial values are not finite.
    #[error("the initial values give computed observations that are not finite")]
    NotFinite,
    /// The problem contradicts its layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The work was stopped by the progress callback or for lack of memory or threads.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<SystemError> for AdjustError {
    fn from(error: SystemError) -> Self {
        match error {
            SystemError::Layout(error) => Self::Layout(error),
            SystemError::Stopped(stopped) => Self::Stopped(stopped),
        }
    }
}

/// Formats a number of bytes for a message.
pub(crate) fn format_bytes(bytes: usize) -> String {
    let format_bytes = bytes as f64 / f64::from(1 << 30);
    if format_bytes < 0.1 {
        format!("{:.1} MiB", 1024.0 * format_bytes)
    } else {
        format!("{format_bytes:.1} GiB")
    }
}
