//! The iterations of published programs: full steps.

use super::method::Published;
use super::options::{Iteration, Status};
use super::problem::Model;
use super::result::AdjustError;
use super::run::{End, Run, State};

impl<'a, M: Model> Run<'a, '_, M> {
    /// Full steps, whatever becomes of the sum of squares.
    pub(super) fn full_steps(
        &mut self,
        start: State<'a, M>,
        rule: Published,
    ) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        let mut previous: Option<f64> = None;
        for number in 1..=self.options.max_iterations {
            let unknowns = state.unknowns.clone();
            let Some(solved) = self.solve_unless_lost(state)? else {
                return Ok(End::lost(unknowns, None));
            };
            let mut iteration =
                Iteration { number, sum_of_squares: f64::NAN, largest_change: solved.change, damping: 0.0 };
            if let Published::Length { first, count, limit } = rule {
                let length = solved.step[first..first + count].iter().map(|dx| dx * dx).sum::<f64>().sqrt();
                if length < limit || number == self.options.max_iterations {
                    let status = if length < limit { Status::Converged } else { Status::NotConverged };
                    return Ok(End::after(status, unknowns, solved, iteration));
                }
            }
            let values = self.problem.advanced(&unknowns, &solved.step);
            state = self.form(values, 0.0)?;
            let sum = state.sum_of_squares;
            if !sum.is_finite() {
                return Ok(End::at(Status::Diverged, unknowns, Some(solved.basis)));
            }
            iteration.sum_of_squares = sum;
            self.accept(iteration, &unknowns, &state.unknowns)?;
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
