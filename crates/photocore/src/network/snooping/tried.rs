//! Operations of a network that data snooping requires.

use super::super::group_tests::Tests;
use super::super::predictions::ResidualBlock;
use super::super::trial::{Excluded, Trial};
use super::super::{Combination, NetworkError, Outcome};
use super::log::Standing;
use crate::Context;
use crate::adjustment::Loss;

/// Scales of Huber's and Cauchy's loss, in standard deviations of an image point.
const HUBER: f64 = 1.50;
const CAUCHY: f64 = 2.55;
/// Maximum number of iterations with each loss.
const ROBUST_ITERATIONS: usize = 20;
/// Smallest weight factor.
const LEAST_WEIGHT: f64 = 1e-12;

/// A network that can be adjusted without some observations; see the methods of [`Trial`].
pub trait Tried {
    /// Adjusts without some observations.
    fn adjust(&mut self, out: &Excluded, tolerance: f64) -> Result<Standing, NetworkError>;

    /// Returns the tests of all groups.
    fn tests(&mut self) -> Result<Tests, NetworkError>;

    /// Returns tests of excluded rows against their prediction.
    fn predictions(&mut self, groups: &[usize]) -> Result<Tests, NetworkError>;

    /// Returns R of points, on request of excluded ones as if they were active.
    fn on_points(&mut self, points: &[usize], gone: bool) -> Result<Vec<ResidualBlock>, NetworkError>;

    /// Returns R of all rows.
    fn responses(&mut self) -> Result<Vec<f64>, NetworkError>;

    /// Adjusts robustly: errors beyond `scale` standard deviations lose weight. Returns the length of the residuals of unit weight of each
    /// group, zero for groups without loss. None if it diverges; then the state is unchanged.
    fn robust_residuals(&mut self, scale: f64) -> Result<Option<Vec<f64>>, NetworkError>;
}

/// A trial with its threads and progress.
pub struct Session<'a> {
    /// The trial.
    pub trial: &'a mut Trial,
    /// Threads and progress of its adjustments and tests.
    pub context: Context<'a>,
}

impl Tried for Session<'_> {
    fn adjust(&mut self, out: &Excluded, tolerance: f64) -> Result<Standing, NetworkError> {
        let Outcome { status, sum_of_squares, degrees_of_freedom, collapsed, .. } =
            self.trial.adjust(out, Some(tolerance), &mut self.context)?;
        if collapsed.is_empty() {
            return Ok(Standing { status, sum_of_squares, degrees_of_freedom });
        }
        Err(NetworkError::UndeterminedPoints(collapsed))
    }

    fn tests(&mut self) -> Result<Tests, NetworkError> {
        self.trial.tests(true, self.context.threads)
    }

    fn predictions(&mut self, groups: &[usize]) -> Result<Tests, NetworkError> {
        self.trial.predictions(groups, self.context.threads)
    }

    fn on_points(&mut self, points: &[usize], gone: bool) -> Result<Vec<ResidualBlock>, NetworkError> {
        self.trial.on_points(points, (0.0, gone), self.context.threads)
    }

    fn responses(&mut self) -> Result<Vec<f64>, NetworkError> {
        let all: Vec<usize> = (0..self.trial.groups.len()).collect();
        self.trial.responses(&all, self.context.threads)
    }

    fn robust_residuals(&mut self, scale: f64) -> Result<Option<Vec<f64>>, NetworkError> {
        let huber = Loss::Huber(HUBER * scale);
        if self.trial.robust_weights(huber, ROBUST_ITERATIONS, &mut self.context)?.is_none() {
            return Ok(None);
        }
        let limit = CAUCHY * scale;
        let weights = self.trial.robust_weights(Loss::Cauchy(limit), ROBUST_ITERATIONS, &mut self.context)?;
        // The weight of Cauchy's loss is 1 / (1 + (size / limit)^2).
        let size = |weight: f64| limit * (weight.max(LEAST_WEIGHT).recip() - 1.0).max(0.0).sqrt();
        Ok(weights.map(|weights| weights.into_iter().map(size).collect()))
    }
}

/// Objects without support: the reason why an adjustment without some observations fails.
pub(super) struct Lost {
    pub points: Vec<usize>,
    pub photos: Vec<usize>,
}

impl From<Lost> for NetworkError {
    fn from(Lost { points, photos }: Lost) -> Self {
        match points.is_empty() {
            false => Self::UndeterminedPoints(points),
            true => Self::Undetermined(vec![Combination { photos, ..Combination::default() }]),
        }
    }
}

/// Separates a loss of support from other errors.
pub(super) fn unless_lost<T>(result: Result<T, NetworkError>) -> Result<Result<T, Lost>, NetworkError> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(NetworkError::UndeterminedPoints(points)) => Ok(Err(Lost { points, photos: vec![] })),
        Err(NetworkError::NotFinite) => Ok(Err(Lost { points: vec![], photos: vec![] })),
        Err(NetworkError::Undetermined(combinations)) => {
            let photos = combinations.into_iter().flat_map(|own| own.photos).collect();
            Ok(Err(Lost { points: vec![], photos }))
        }
        Err(error) => Err(error),
    }
}
