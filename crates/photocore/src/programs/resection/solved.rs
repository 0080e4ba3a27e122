//! What an adjustment from one start has led to.

use super::Pose;
use super::model::SinglePhoto;
use crate::adjustment::{Adjustment, Problem, Status};

/// An adjustment, and the problem it solved.
pub(super) struct Solved {
    pub problem: Problem<SinglePhoto>,
    pub adjustment: Adjustment,
    pub start: Pose,
    pub origin: [f64; 3],
}

impl Solved {
    pub fn pose(&self) -> Pose {
        absolute(&self.adjustment.unknowns[self.problem.layout().all_retained()], self.origin)
    }

    /// Weighted sum of squares at the end.
    pub fn sum_of_squares(&self) -> f64 {
        let last = self.adjustment.iterations.last();
        last.map_or(self.adjustment.initial_sum_of_squares, |iteration| iteration.sum_of_squares)
    }

    pub fn behind(&self) -> Vec<usize> {
        self.problem.model.behind(&self.adjustment.unknowns)
    }

    pub fn converged(&self) -> bool {
        self.adjustment.status == Status::Converged
    }
}

/// A pose counted from the origin of the object space again.
pub(super) fn absolute(values: &[f64], origin: [f64; 3]) -> Pose {
    let local = Pose::from_unknowns(values);
    local.counted_from(origin.map(|value| -value))
}
