//! What an adjustment ends with.

use thiserror::Error;

use super::options::NEGLIGIBLE;
use super::options::{Iteration, Status};
use super::statistics::{Counts, Observed, square, standardized};
use crate::Stopped;
use crate::normals::{Cofactors, LayoutError, Operations, Ordering, SelectedInverse, SystemError};

/// Time spent in each phase, in seconds, over all iterations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seconds {
    /// Forming, with the reduction of local blocks.
    pub form: f64,
    /// Factoring.
    pub factor: f64,
    /// Solving.
    pub solve: f64,
    /// Inverting.
    pub invert: f64,
    /// Cofactors and redundancy numbers.
    pub cofactors: f64,
}

impl Seconds {
    pub(super) fn add(&mut self, other: &Self) {
        self.form += other.form;
        self.factor += other.factor;
        self.solve += other.solve;
        self.invert += other.invert;
        self.cofactors += other.cofactors;
    }
}

/// What an adjustment has taken, and in what order it has eliminated.
#[derive(Debug, Clone)]
pub struct Effort {
    /// Predicted multiply-adds of each phase, once.
    pub operations: Operations,
    /// Formations and factorisations carried out.
    pub formations: usize,
    /// Time by phase.
    pub seconds: Seconds,
    /// The ordering in force.
    pub ordering: Ordering,
    /// The orderings that were compared, each with the predicted multiply-adds of a factorisation; None if the layout is too large for it.
    pub predictions: Vec<(Ordering, Option<f64>)>,
    /// Retained blocks in the order of their elimination.
    pub order: Vec<usize>,
}

/// The adjusted unknowns and how good they are.
#[derive(Debug)]
pub struct Adjustment {
    /// How it ended.
    pub status: Status,
    /// Weighted sum of squares (of losses, where the options ask for a loss) at the initial values.
    pub initial_sum_of_squares: f64,
    /// Every iteration.
    pub iterations: Vec<Iteration>,
    /// All unknowns that are not local, in the order of the layout: at first and after each iteration.
    pub history: Vec<Vec<f64>>,
    /// The corrections of the local unknowns in the last iteration; zero where there was none.
    pub last_local_corrections: Vec<f64>,
    /// Adjusted unknowns, in the order of the layout.
    pub unknowns: Vec<f64>,
    /// Observed minus computed, in the order of groups and rows, then of ties and rows, in the units of the observations.
    pub residuals: Vec<f64>,
    /// The factor by which a loss has changed the weight of each group of observations, then of each tie; None without a loss.
    pub weights: Option<Vec<f64>>,
    /// Cofactors (a priori unit weight, weights as the loss has changed them), when asked for; none where the last values leave
    /// unknowns undetermined.
    pub cofactors: Option<Cofactors>,
    /// The inverse that they come from, where tests of groups are to follow.
    pub(super) selected: Option<SelectedInverse>,
    /// Of every two unknowns that were to be asked together, row by row (see [`super::adjust_by_groups`]).
    pub joint: Option<Vec<f64>>,
    /// Why the last values give no cofactors although they were asked for.
    pub undetermined: Option<AdjustError>,
    /// Local blocks that the last step has led to where they harm all others (see [`super::Evaluated::collapsed`]): the iterations
    /// have stopped there, for the adjustment to be begun again without them.
    pub collapsed: Vec<usize>,
    /// The unknowns, none of them local, that a combination moves which is determined so weakly that the sum of squares stood still
    /// while no full step along it lowered it; none where the adjustment ended otherwise.
    pub weak: Vec<usize>,
    /// The unknowns held to give a datum (see [`super::Model::motions`]), none where the problem has one.
    pub datum: Vec<usize>,
    /// Where the cofactors are in the datum that the adjustment was to end in, about how large a part of the variances rounding may be.
    pub lost: Option<f64>,
    /// Redundancy number of each observation, when asked for.
    pub redundancy: Option<Vec<f64>>,
    /// Redundancy number of each unknown as an observation of itself (zero unless weighted), when asked for.
    pub prior_redundancy: Option<Vec<f64>>,
    /// Sum of all redundancy numbers minus the degrees of freedom: what rounding has made of zero. In networks that hardly hold
    /// together cofactors and redundancy numbers lose about as many digits. None without cofactors, and with a loss.
    pub redundancy_excess: Option<f64>,
    /// Counts for the degrees of freedom.
    pub counts: Counts,
    /// What it has taken.
    pub effort: Effort,
}

impl Adjustment {
    /// Whether cofactors, which were formed before the last step, hold after it: the step was the last one, and short.
    pub fn holds_after_last_step(&self) -> bool {
        let last = self.iterations.last().map_or(0.0, |iteration| iteration.largest_change);
        let plain = self.weights.is_none() && self.lost.is_none();
        self.status == Status::Converged && last <= NEGLIGIBLE && plain
    }

    /// For every iteration, the corrections of all unknowns that are not local, in the order of the layout.
    pub fn corrections(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.history.windows(2).map(|pair| pair[0].iter().zip(&pair[1]).map(|(from, to)| to - from).collect())
    }

    /// Counts what an adjustment of the same observations has done before that this one has begun from.
    pub(crate) fn go_on_from(&mut self, before: Option<Self>) {
        let Some(before) = before else { return };
        let done = before.iterations.len();
        self.iterations.iter_mut().for_each(|iteration| iteration.number += done);
        self.iterations.splice(0..0, before.iterations);
        self.history.splice(0..1, before.history);
        self.initial_sum_of_squares = before.initial_sum_of_squares;
        self.effort.formations += before.effort.formations;
        self.effort.seconds.add(&before.effort.seconds);
    }

    /// Residuals and test values of a group of observations with the given standard deviations a priori.
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

    /// Forgets what [`Adjustment::observed`] has handed out: in large problems it is large.
    pub(crate) fn release_observations(&mut self) {
        self.residuals = vec![];
        self.redundancy = None;
        self.weights = None;
    }

    /// Weighted sum of squares of the first residuals, those of observations of the given standard deviations in groups of so many rows,
    /// weights as the loss has changed them.
    pub fn reweighted_sum_of_squares(&self, sd: &[f64], rows: usize) -> f64 {
        let squares = self.residuals.iter().zip(sd).map(square);
        match &self.weights {
            None => squares.sum(),
            Some(weights) => squares.enumerate().map(|(i, square)| weights[i / rows] * square).sum(),
        }
    }

    /// Redundancy numbers of unknowns, from the given one on, as observations of themselves; NaN where there are no cofactors.
    pub fn prior_redundancy<const N: usize>(&self, first: usize) -> [f64; N] {
        std::array::from_fn(|k| self.prior_redundancy.as_ref().map_or(f64::NAN, |all| all[first + k]))
    }
}

/// Why there is no adjustment.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AdjustError {
    /// Local blocks that their observations do not determine.
    #[error("{} local blocks are not determined by their observations", .0.len())]
    UndeterminedLocals(Vec<usize>),
    /// Combinations of retained unknowns that the observations do not determine: for each the retained blocks it moves.
    #[error("{} combinations of unknowns are not determined by the observations", .0.len())]
    Undetermined(Vec<Vec<usize>>),
    /// The initial values give observations that are not finite.
    #[error("the initial values give computed observations that are not finite")]
    NotFinite,
    /// The problem contradicts its layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The work was stopped: by whoever watched it, or for want of memory or threads.
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

/// A number of bytes for a message.
pub(crate) fn gib(bytes: usize) -> String {
    let gib = bytes as f64 / f64::from(1 << 30);
    if gib < 0.1 { format!("{:.1} MiB", 1024.0 * gib) } else { format!("{gib:.1} GiB") }
}
