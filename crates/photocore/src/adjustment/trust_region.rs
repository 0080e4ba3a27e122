//! Levenberg-Marquardt: steps damped by how well the linearized equations predict what they do (Nielsen 1999; Madsen, Nielsen and
//! Tingleff 2004, section 3.2).

use super::options::{FIRST_DAMPING, Iteration, Status};
use super::problem::Model;
use super::result::AdjustError;
use super::run::{End, Run, State};

/// Less would leave the seven pivots of a network without datum among rounding errors.
const LEAST_DAMPING: f64 = 1e-10;
/// With this damping a step follows the gradient; if that does not lower the sum of squares, nothing will.
const MOST_DAMPING: f64 = 1e16;
/// A step is accepted when it lowers the sum of squares by this fraction of what the linearized equations predict.
const LEAST_GAIN: f64 = 1e-3;
/// A predicted decrease below this fraction of the sum of squares is rounding error,
const ROUNDING: f64 = 1e-14;
/// and so may be one by which no unknown changes by more than this multiple of its standard deviation.
const NEGLIGIBLE: f64 = 1e-6;

/// The damping, and by how much the next failure raises it.
struct Damping {
    value: f64,
    rise: f64,
}

impl Damping {
    /// After a step of the given gain ratio: from a third where the prediction was good to twice where it was poor.
    fn fall(&mut self, gain: f64) {
        let factor = (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
        self.value = (self.value * factor).max(LEAST_DAMPING);
        self.rise = 2.0;
    }

    /// After a step that failed.
    fn rise(&mut self) {
        self.value *= self.rise;
        self.rise *= 2.0;
    }
}

impl<'a, M: Model> Run<'a, '_, M> {
    /// Damped steps until one lowers the sum of squares by less than `fraction` of it.
    ///
    /// A step counts for this when it is not much shortened, the damping being no larger than at first; where the predicted
    /// decrease drowns in rounding errors, any does.
    pub(super) fn by_trust_region(
        &mut self,
        start: State<'a, M>,
        fraction: f64,
    ) -> Result<End<'a, M>, AdjustError> {
        let mut state = start;
        let mut lowest = state.sum_of_squares;
        let mut damping = Damping { value: state.damping, rise: 2.0 };
        while self.iterations.len() < self.options.max_iterations {
            if damping.value > MOST_DAMPING {
                return self.rest(state.unknowns, Status::Diverged);
            }
            let (unknowns, used) = (state.unknowns.clone(), state.damping);
            let Some(solved) = self.solve_unless_lost(state)? else {
                damping.rise();
                state = self.form(unknowns, damping.value)?;
                continue;
            };
            let predicted = solved.basis.equations.decrease(self.pool, &solved.basis.prior, &solved.step);
            solved.basis.factor.recycle(&self.problem.system);
            let whole = used <= FIRST_DAMPING && predicted <= fraction * lowest;
            let trial = self.problem.advanced(&unknowns, &solved.step);
            let sum_of_squares = self.objective(&trial);
            let gain = (lowest - sum_of_squares) / predicted;
            // Written so that a gain that is not a number is a failure.
            if gain > LEAST_GAIN && sum_of_squares <= lowest {
                let decrease = lowest - sum_of_squares;
                let number = self.iterations.len() + 1;
                let iteration =
                    Iteration { number, sum_of_squares, largest_change: solved.change, damping: used };
                self.accept(iteration, &unknowns, &trial)?;
                self.collapsed = self.problem.model.collapsed(&unknowns, &trial);
                if !self.collapsed.is_empty() {
                    let status = Status::NotConverged;
                    return Ok(End { status, unknowns: trial, basis: None, undetermined: None, last: None });
                }
                lowest = sum_of_squares;
                damping.fall(gain);
                if whole || used <= FIRST_DAMPING && decrease <= fraction * lowest {
                    return self.rest(trial, Status::Converged);
                }
                state = self.form(trial, damping.value)?;
            } else if whole || predicted <= (ROUNDING * lowest).max(NEGLIGIBLE * NEGLIGIBLE) {
                return self.rest(unknowns, Status::Converged);
            } else {
                damping.rise();
                state = self.form(unknowns, damping.value)?;
            }
        }
        self.rest(state.unknowns, Status::NotConverged)
    }

    /// Ends at the values reached, in the datum that the model chooses.
    fn rest(&mut self, unknowns: Vec<f64>, status: Status) -> Result<End<'a, M>, AdjustError> {
        self.datum = self.problem.model.datum(&unknowns);
        if !self.options.covariance {
            return Ok(End { status, unknowns, basis: None, undetermined: None, last: None });
        }
        self.curved = false;
        let state = self.form(unknowns, 0.0)?;
        let end = self.stay(state, status)?;
        Ok(End { status, ..end })
    }
}
