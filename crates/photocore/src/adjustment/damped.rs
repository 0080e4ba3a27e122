//! Full steps: with step control, damped where they fail, or whatever becomes of the sum of squares, as published programs took them.

use std::ops::ControlFlow;

use super::options::{self, Iteration, NEGLIGIBLE, Published, Status, Stop};
use super::result::AdjustError;
use super::run::{End, NEAR, Run, State};

/// A step is accepted when the sum of squares does not rise by more than its own rounding error.
pub(super) const ROUNDING: f64 = 1e-12;
/// The sum of squares stands still where three damped steps lower it by less than this multiple of the variance of unit weight: a
/// hundredth of a standard deviation of the combination of unknowns that they follow.
const STILL: f64 = 1e-4;
/// A step that changes the unknowns by more than this multiple of their standard deviations, in the mean, is so long that local
/// unknowns are better computed afresh than linearized.
const FAR: f64 = 30.0;
/// First damping after a step that failed; it falls by ten after a success, and below [`LEAST_DAMPING`] to zero.
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-5;
/// With this damping a step follows the gradient; if that does not lower the sum of squares, nothing will.
const MOST_DAMPING: f64 = 1e9;
/// One group of so many may touch blocks that the layout does not have on the way.
const FEW: usize = 20;
/// None may any more after a step that changes no unknown by more than this multiple of its standard deviation: what is left out is found before
/// the last steps, not after them.
const SETTLED: f64 = 0.1;

/// A full step that changes no unknown by more than this multiple of its standard deviation, and fails, follows a combination that is
/// so weakly determined that the others bend off the straight line on the way: it is followed along the curve (see
/// [`Run::along_valley`]).
const VALLEY: f64 = 30.0;
/// Parts of such a step that are taken in turn, each half of the one before,
const PARTS: usize = 4;
/// and how many steps are taken so in one adjustment at the most: a valley that goes on and on is for the names of its unknowns.
const MOST_ALONG: usize = 8;
/// Damping of the steps that lead back to the floor of a valley: it holds what is weak, and lets all else go.
const HOLDING: f64 = 1e-6;
/// How many of these steps there are at the most, at each part.
const BACK: usize = 3;
/// A part of a step is good when it lowers the sum of squares by this fraction of what the linearized equations predict: where they predict
/// badly, the combination is determined so weakly that its standard deviation is no measure of a step.
const GAIN: f64 = 0.5;

/// So many full steps may fail; after more the steps are controlled by how well they are predicted, as in a trust region: full steps do not
/// lead there, since what the linearized equations leave out, residuals times second derivatives, is larger than what they have of a
/// combination of unknowns, and damping that is taken away each time makes them creep.
const MOST_FAILURES: usize = 4;
/// A full step from where a trust region has ended that changes no unknown by more than this multiple of its standard deviation.
const SHORT: f64 = 1e-2;

/// The constants of these rules by name, for whoever controls the steps of a problem in parts (see [`super::Linearized::of_part`]).
pub fn step_rules() -> [(&'static str, f64); 8] {
    [
        ("rounding", ROUNDING),
        ("negligible", NEGLIGIBLE),
        ("far", FAR),
        ("still", STILL),
        ("first_damping", FIRST_DAMPING),
        ("least_damping", LEAST_DAMPING),
        ("most_damping", MOST_DAMPING),
        ("near", NEAR),
    ]
}

/// What the control of the steps remembers from one to the next.
struct Control {
    stop: Stop,
    /// The lowest sum of squares.
    best: f64,
    /// What it was when a full step failed last, and the unknowns that this has moved most.
    refused: Option<(f64, Vec<usize>)>,
    /// Whether that was a step along a valley.
    in_valley: bool,
    /// How many have been taken along one.
    along: usize,
    /// How many full steps have failed.
    failures: usize,
}

/// The damping after a step that failed.
fn harder(damping: f64) -> f64 {
    (10.0 * damping).max(FIRST_DAMPING)
}

/// The damping after a step that did not.
fn relaxed(damping: f64) -> f64 {
    if damping / 10.0 < LEAST_DAMPING { 0.0 } else { damping / 10.0 }
}

/// The next values, or the end.
type Next<'a> = Result<ControlFlow<End<'a>, State<'a>>, AdjustError>;

impl<'a> Run<'a, '_> {
    /// Gauss-Newton with step control.
    ///
    /// With dx the step and N the normal matrix, dx_i^2 <= q_ii dx^T N dx (Cauchy-Schwarz), and dx^T N dx is the predicted
    /// decrease of the sum of squares: its root bounds every correction in standard deviations, without an inverse.
    pub(super) fn damped_steps(&mut self, start: State<'a>, stop: Stop) -> Result<End<'a>, AdjustError> {
        let mut state = start;
        let mut control = Control {
            stop,
            best: state.linearized.sum_of_squares,
            refused: None,
            in_valley: false,
            along: 0,
            failures: 0,
        };
        while self.iterations.len() < self.options.max_iterations
            && state.linearized.damping() <= MOST_DAMPING
        {
            match self.step_from(state, &mut control)? {
                ControlFlow::Continue(next) => state = next,
                ControlFlow::Break(end) => return Ok(end),
            }
        }
        let too_much = state.linearized.damping() > MOST_DAMPING;
        let status = if too_much { Status::Diverged } else { Status::NotConverged };
        let creeps = control.in_valley && status == Status::NotConverged;
        if let Some((_, moved)) = control.refused.filter(|_| creeps) {
            self.weak = moved;
        }
        self.stay(state, status)
    }

    /// Whether a full step leads to where groups touch other blocks than the layout has: more than a few groups, or any once steps are short. What
    /// is left out of their equations would lead chords, and the last steps, elsewhere.
    fn is_outgrown(&self, step: &Iteration, followed: bool, values: &[f64]) -> bool {
        let short = followed || step.largest_change <= SETTLED;
        let most = if short { 0 } else { self.problem.layout().groups() / FEW };
        step.damping == 0.0
            && self.problem.model.steps_swing()
            && self.threads.install(|| self.problem.model.outgrown(values)) > most
    }

    /// Takes a step to where groups touch other blocks than the layout has, unless it leads higher: whether it was taken.
    fn leaves_layout(
        &mut self,
        iteration: Iteration,
        before: &[f64],
        after: &[f64],
        best: f64,
    ) -> Result<bool, AdjustError> {
        let sum_of_squares = self.objective(after);
        let lower = sum_of_squares <= best * (1.0 + ROUNDING);
        if lower {
            self.accept(Iteration { sum_of_squares, ..iteration }, before, after)?;
        }
        Ok(lower)
    }

    /// Solves, and takes the step or ends with it.
    fn step_from(&mut self, state: State<'a>, control: &mut Control) -> Next<'a> {
        let damping = state.linearized.damping();
        let Some(step) = self.step(&state)? else {
            return self.refuse(state.recycle(), damping, control, vec![]);
        };
        let (number, largest_change) = (self.iterations.len() + 1, state.linearized.change());
        let iteration = Iteration { number, sum_of_squares: control.best, largest_change, damping };
        let is_last = damping == 0.0
            && (self.is_last(control.stop, largest_change) || self.is_foreseen(control, &state, &step));
        let rests = damping == 0.0 && !is_last && self.history().falls_no_more(largest_change);
        if rests {
            self.weak = state.moved(&step);
        }
        if is_last || rests {
            let end = if state.linearized.is_curved() {
                self.stay_after(iteration, &state.recycle(), &step)?
            } else {
                End::after(Status::Converged, state, step, iteration)
            };
            return Ok(ControlFlow::Break(end));
        }
        self.take(iteration, state, &step, control)
    }

    /// Takes a step, unless it fails.
    fn take(
        &mut self,
        iteration: Iteration,
        state: State<'a>,
        step: &[f64],
        control: &mut Control,
    ) -> Next<'a> {
        let followed = self.is_followed(&state, &iteration);
        let corrected = self.corrected(&state, step, &iteration, followed);
        let (given, (step, iteration)) = match &corrected {
            Some((own, iteration)) => (step, (&own[..], *iteration)),
            None => (step, (step, iteration)),
        };
        let Iteration { damping, largest_change: change, .. } = iteration;
        let ahead = self.problem.advanced(state.values(), step);
        let outgrown = self.is_outgrown(&iteration, followed, &ahead);
        let trial = match followed && !outgrown {
            true => self.chords(&state, ahead, (control.best, control.stop))?,
            false => self.stepped(&state, ahead, &iteration)?,
        };
        let moved = if damping == 0.0 { state.moved(step) } else { vec![] };
        let unknowns = state.recycle();
        let far = change > FAR * (unknowns.len() as f64).sqrt();
        let trial = if far { self.relocated(trial) } else { trial };
        if outgrown && self.leaves_layout(iteration, &unknowns, &trial, control.best)? {
            return Ok(ControlFlow::Break(End::at(Status::NotConverged, trial)));
        }
        self.look_ahead(&iteration);
        let next = self.form(trial, relaxed(damping))?;
        let negligible = damping == 0.0 && change <= NEGLIGIBLE;
        let highest = if negligible { f64::MAX } else { control.best * (1.0 + ROUNDING) };
        // A sum of squares that is not a number is a failure too, and so is a step that loses a local block.
        let sum = next.linearized.sum_of_squares;
        if !(sum <= highest && next.linearized.factor.deficient_locals.is_empty()) {
            next.recycle();
            return self.failed(iteration, unknowns, (step, moved), control);
        }
        let decrease = std::mem::replace(&mut control.best, sum) - sum;
        self.accept(Iteration { sum_of_squares: sum, ..iteration }, &unknowns, next.reached())?;
        if damping > 0.0 {
            // What harms all others makes full steps fail.
            return Ok(match self.has_collapsed(&unknowns, next.equations.at()) {
                true => ControlFlow::Break(End::at(Status::NotConverged, next.recycle())),
                false => ControlFlow::Continue(next),
            });
        }
        if control.stop.at_decrease(decrease, sum) {
            return self.stay(next, Status::Converged).map(ControlFlow::Break);
        }
        if self.problem.model.steps_swing() {
            self.secants.remember(given.to_vec(), unknowns);
        }
        Ok(ControlFlow::Continue(next))
    }

    /// Goes on after a step that has failed, and the unknowns that it moves most: along a valley where full steps have led here, which says that the
    /// linearized equations are worth following; with more damping otherwise. A step that the bends of a loss make fail follows no valley.
    fn failed(
        &mut self,
        iteration: Iteration,
        unknowns: Vec<f64>,
        (step, moved): (&[f64], Vec<usize>),
        control: &mut Control,
    ) -> Next<'a> {
        let Iteration { damping, largest_change: change, .. } = iteration;
        if damping == 0.0 {
            control.in_valley = change <= VALLEY;
        }
        let led = self.iterations.iter().any(|iteration| iteration.damping == 0.0);
        if damping == 0.0
            && led
            && self.options.loss.is_none()
            && control.in_valley
            && control.along < MOST_ALONG
            && !self.is_still(&control.refused, control.best)
            && let Some((values, sum)) = self.along_valley(&unknowns, step, change, control.best)?
        {
            let before = std::mem::replace(&mut control.best, sum);
            control.along += 1;
            self.weak = moved;
            control.refused = Some((before, self.weak.clone()));
            self.accept(Iteration { sum_of_squares: sum, ..iteration }, &unknowns, &values)?;
            return self.form(values, 0.0).map(ControlFlow::Continue);
        }
        self.refuse(unknowns, damping, control, moved)
    }

    /// Goes on from the same values with more damping; or ends there, where the sum of squares has stood still although full steps,
    /// which move the unknowns `moved` most, have failed.
    fn refuse(
        &mut self,
        unknowns: Vec<f64>,
        damping: f64,
        control: &mut Control,
        moved: Vec<usize>,
    ) -> Next<'a> {
        if damping == 0.0 && self.stands_still(&mut control.refused, control.best, moved) {
            self.weak = control.refused.take().map(|(_, moved)| moved).unwrap_or_default();
            let state = self.form(unknowns, 0.0)?;
            return self.stay(state, Status::Converged).map(ControlFlow::Break);
        }
        control.failures += usize::from(damping == 0.0);
        if control.failures > MOST_FAILURES {
            return self.handed_over(unknowns, control.stop).map(ControlFlow::Break);
        }
        self.form(unknowns, harder(damping)).map(ControlFlow::Continue)
    }

    /// Goes on in a trust region, to its end. It has converged where a full step from there is short, which damping may hide, or where the
    /// sum of squares has crept to rest along a combination that is named.
    fn handed_over(&mut self, unknowns: Vec<f64>, stop: Stop) -> Result<End<'a>, AdjustError> {
        let state = self.form(unknowns, options::FIRST_DAMPING)?;
        let end = self.in_trust_region(state, stop)?;
        if end.status != Status::Converged || !self.weak.is_empty() {
            return Ok(end);
        }
        let state = self.form(end.unknowns.clone(), 0.0)?;
        let Some(step) = self.step(&state)? else {
            return Ok(End { status: Status::NotConverged, ..end });
        };
        let rests = state.linearized.change() <= SHORT;
        if !rests {
            self.weak = state.moved(&step);
        }
        state.recycle();
        Ok(if rests { end } else { End { status: Status::NotConverged, ..end } })
    }

    /// Whether a full step is the last one, by its length or by those that would follow.
    fn is_last(&self, stop: Stop, change: f64) -> bool {
        stop.at_change(change)
            || matches!(stop, Stop::Fraction(fraction) if self.leaves_less_than(fraction, change))
    }

    /// Whether the next step after a full one would be negligible, by the sum of squares that this one leads to.
    fn is_foreseen(&self, control: &Control, state: &State<'a>, step: &[f64]) -> bool {
        let Stop::Foreseen(limit) = control.stop else { return false };
        let foreseen = control.best - state.linearized.change().powi(2);
        // A smaller difference than this one is rounding.
        if limit.powi(2) <= ROUNDING * control.best {
            return false;
        }
        let reached = self.objective(&self.problem.advanced(state.values(), step));
        (reached - foreseen).abs() <= limit.powi(2)
    }

    /// Whether the sum of squares has stood still between two full steps that failed, `refused` at the first and `sum` at the second:
    /// what it still falls by, damped, no unknown is determined well enough to show.
    fn stands_still(&self, refused: &mut Option<(f64, Vec<usize>)>, sum: f64, moved: Vec<usize>) -> bool {
        let still = self.is_still(refused, sum);
        *refused = Some((sum, moved));
        still
    }

    /// Whether the sum of squares has fallen by next to nothing since a full step failed.
    fn is_still(&self, refused: &Option<(f64, Vec<usize>)>, sum: f64) -> bool {
        let freedom = self.problem.counts(&[]).degrees_of_freedom().max(1) as f64;
        let least = STILL * (sum / freedom).max(1.0);
        refused.as_ref().is_some_and(|(before, _)| before - sum <= least)
    }

    /// Follows a full step that has failed along the valley of the combination that it moves: a part of it, then back to the floor by
    /// steps so damped that they hold the combination. The values reached and the sum of squares there; None where no part is good.
    ///
    /// Principal distance and flying height of a flat block make such a valley: a change that no image shows, as long as points and
    /// attitudes follow it, and they follow a curve. A step back damped at random crosses the valley to and fro, and creeps.
    fn along_valley(
        &mut self,
        unknowns: &[f64],
        step: &[f64],
        change: f64,
        best: f64,
    ) -> Result<Option<(Vec<f64>, f64)>, AdjustError> {
        let mut part = 1.0;
        for _ in 0..PARTS {
            let own: Vec<f64> = step.iter().map(|value| part * value).collect();
            let mut values = self.problem.advanced(unknowns, &own);
            let predicted = part * (2.0 - part) * change * change;
            for _ in 0..BACK {
                let state = self.form(values, HOLDING)?;
                let sum = state.linearized.sum_of_squares;
                if !(sum.is_finite() && state.linearized.factor.deficient_locals.is_empty()) {
                    break;
                }
                let Some(step) = self.step(&state)? else { break };
                values = self.problem.advanced(&state.recycle(), &step);
                let sum = self.objective(&values);
                if best - sum >= GAIN * predicted {
                    return Ok(Some((values, sum)));
                }
            }
            part /= 2.0;
        }
        Ok(None)
    }

    /// Whether all further steps together would not exceed a limit; secants say nothing of a rate.
    fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let learns = self.secants.correct() || self.problem.model.steps_swing() && self.chord.is_some();
        !learns && self.history().leaves_less_than(limit, change)
    }

    /// The same unknowns, with the local ones computed afresh where that lowers the sum of squares.
    fn relocated(&self, unknowns: Vec<f64>) -> Vec<f64> {
        let mut other = unknowns.clone();
        let relocated = self.threads.install(|| self.problem.model.relocate(&mut other));
        let lower = relocated && self.objective(&other) < self.objective(&unknowns);
        if lower { other } else { unknowns }
    }

    /// Takes the last step and ends there.
    fn stay_after(
        &mut self,
        last: Iteration,
        unknowns: &[f64],
        step: &[f64],
    ) -> Result<End<'a>, AdjustError> {
        let values = self.problem.advanced(unknowns, step);
        let sum_of_squares = self.objective(&values);
        self.accept(Iteration { sum_of_squares, ..last }, unknowns, &values)?;
        self.curved = false;
        let state = self.form(values, 0.0)?;
        self.stay(state, Status::Converged)
    }
}

impl<'a> Run<'a, '_> {
    /// Full steps, whatever becomes of the sum of squares.
    pub(super) fn full_steps(&mut self, start: State<'a>, rule: Published) -> Result<End<'a>, AdjustError> {
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
