//! The iterations of published programs: full steps.

use std::ops::Range;

use super::options::{Iteration, Status};
use super::problem::Model;
use super::result::AdjustError;
use super::run::{End, Run, Solved, State};

impl<'a, M: Model> Run<'a, '_, M> {
    /// The iteration of the 1987 program: full steps until the sum of squares changes by less than `percent`.
    pub(super) fn as_published(
        &mut self,
        start: State<'a, M>,
        percent: f64,
    ) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        let mut previous: Option<f64> = None;
        for number in 1..=self.options.max_iterations {
            let unknowns = state.unknowns.clone();
            let Some(solved) = self.solve_unless_lost(state)? else {
                return Ok(End::lost(unknowns, None));
            };
            let values = self.problem.advanced(&unknowns, &solved.step);
            state = self.form(values, 0.0)?;
            let sum_of_squares = state.sum_of_squares;
            if !sum_of_squares.is_finite() {
                return Ok(End {
                    status: Status::Diverged,
                    unknowns,
                    basis: Some(solved.basis),
                    undetermined: None,
                    last: None,
                });
            }
            let iteration = Iteration { number, sum_of_squares, largest_change: solved.change, damping: 0.0 };
            self.accept(iteration, &unknowns, &state.unknowns)?;
            match previous.map(|before| (sum_of_squares - before) / before * 100.0) {
                Some(change) if change.abs() < percent => return self.stay(state, Status::Converged),
                Some(change) if change >= percent => return self.stay(state, Status::Diverged),
                _ => previous = Some(sum_of_squares),
            }
        }
        self.stay(state, Status::NotConverged)
    }

    /// The iteration of program W5344: full steps until the corrections of the unknowns in `tested` are short.
    pub(super) fn until_short(
        &mut self,
        start: State<'a, M>,
        tested: Range<usize>,
        limit: f64,
    ) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        loop {
            let unknowns = state.unknowns.clone();
            let Some(Solved { basis, step, change }) = self.solve_unless_lost(state)? else {
                return Ok(End::lost(unknowns, None));
            };
            let number = self.iterations.len() + 1;
            let length = step[tested.clone()].iter().map(|dx| dx * dx).sum::<f64>().sqrt();
            let values = self.problem.advanced(&unknowns, &step);
            let mut iteration =
                Iteration { number, sum_of_squares: f64::NAN, largest_change: change, damping: 0.0 };
            if length < limit || number >= self.options.max_iterations {
                let status = if length < limit { Status::Converged } else { Status::NotConverged };
                return Ok(End {
                    status,
                    unknowns,
                    basis: Some(basis),
                    undetermined: None,
                    last: Some((iteration, step)),
                });
            }
            state = self.form(values, 0.0)?;
            iteration.sum_of_squares = state.sum_of_squares;
            if !iteration.sum_of_squares.is_finite() {
                return Ok(End {
                    status: Status::Diverged,
                    unknowns,
                    basis: Some(basis),
                    undetermined: None,
                    last: None,
                });
            }
            self.accept(iteration, &unknowns, &state.unknowns)?;
        }
    }
}
