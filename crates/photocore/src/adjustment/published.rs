//! Full steps without control of the sum of squares, with the stopping rules of the programs of 1962 to 1987.

use super::options::{Iteration, Published, Status};
use super::result::AdjustError;
use super::run::{End, Iterate, Run};

impl<'a> Run<'a, '_> {
    /// Iterates with full steps, without control of the sum of squares.
    pub(super) fn full_steps(&mut self, start: Iterate<'a>, rule: Published) -> Result<End<'a>, AdjustError> {
        let mut state = start;
        let mut previous: Option<f64> = None;
        for number in 1..=self.options.max_iterations {
            let Some(step) = self.step(&state)? else {
                return Ok(End::at(Status::Diverged, state.recycle()));
            };
            let largest_change = state.linearized.change();
            let mut iteration = Iteration { number, sum_of_squares: f64::NAN, largest_change, damping: 0.0 };
            if let Published::Length { first, count, limit } = rule {
                let length = step[first..first + count].iter().map(|dx| dx * dx).sum::<f64>().sqrt();
                if length < limit || number == self.options.max_iterations {
                    let status = if length < limit { Status::Converged } else { Status::NotConverged };
                    return Ok(End::after(status, state, step, iteration));
                }
            }
            let next = self.form(self.problem.advanced(state.values(), &step), 0.0)?;
            let sum = next.linearized.sum_of_squares;
            if !sum.is_finite() {
                return Ok(End::with(Status::Diverged, state));
            }
            iteration.sum_of_squares = sum;
            self.accept(iteration, state.values(), next.values())?;
            state.recycle();
            state = next;
            if let Published::Percent(percent) = rule {
                match previous.map(|before| (sum - before) / before * 100.0) {
                    Some(change) if change.abs() < percent => return self.stay(state, Status::Converged),
                    Some(change) if change >= percent => return self.stay(state, Status::Diverged),
                    _ => previous = Some(sum),
                }
            }
        }
        self.stay(state, Status::NotConverged)
    }
}
