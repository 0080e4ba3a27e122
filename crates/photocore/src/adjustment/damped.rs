//! Full steps: with step control and damping after failures, or uncontrolled as in published programs.

use std::ops::ControlFlow;

use super::options::{self, Iteration, NEGLIGIBLE, Published, Status, Stop};
use super::result::AdjustError;
use super::run::{End, Iterate, NEAR, Run};

/// Relative increase of the sum of squares that is accepted as rounding error.
pub(super) const ROUNDING: f64 = 1e-12;
/// Maximum decrease of the sum of squares by three damped steps that counts as stagnation, as a multiple of the variance of unit weight. It
/// corresponds to 0.01 standard deviations of a combination of unknowns.
const STILL: f64 = 1e-4;
/// Minimum mean change, in standard deviations, for a recomputation of local unknowns instead of their linearization.
const FAR: f64 = 30.0;
/// Damping after the first failure; it is divided by ten after a success, and set to zero below [`LEAST_DAMPING`].
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-5;
/// Maximum damping: the step is parallel to the gradient and must lower the sum of squares if any step does.
const MOST_DAMPING: f64 = 1e9;
/// Reciprocal of the fraction of groups that may leave the layout before convergence.
const FEW: usize = 20;
/// Maximum change, in standard deviations, after which groups must not leave the layout: missing columns are detected before the last
/// steps.
const SETTLED: f64 = 0.1;

/// Maximum change, in standard deviations, of a failed full step that is followed along a valley. Its combination is determined so weakly
/// that the other unknowns change nonlinearly along it (see [`Run::along_valley`]).
const VALLEY: f64 = 30.0;
/// Number of fractions of such a step, each half of its predecessor.
const PARTS: usize = 4;
/// Maximum number of valley steps in an adjustment; afterwards the unknowns of the valley are reported.
const MOST_ALONG: usize = 8;
/// Damping of the steps back to the floor of a valley: it restrains only weakly determined combinations.
const HOLDING: f64 = 1e-6;
/// Maximum number of these steps per fraction.
const BACK: usize = 3;
/// Minimum ratio of actual to predicted decrease for an accepted fraction of a step. With a poor prediction, the standard deviation of the
/// combination is not a measure of the step.
const GAIN: f64 = 0.5;

/// Maximum number of failed full steps; after more failures, a trust region controls the steps. Full steps then do not converge: the
/// neglected term, residuals times second derivatives, dominates a combination of unknowns. Repeated damping only makes them creep.
const MOST_FAILURES: usize = 4;
/// Maximum change, in standard deviations, of a full step that confirms convergence of a trust region.
const SHORT: f64 = 1e-2;

/// Returns the constants of the step control by name, for partitioned problems (see [`super::Linearized::of_part`]).
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

/// State of the step control between steps.
struct StepControl {
    stop: Stop,
    /// Lowest sum of squares.
    best: f64,
    /// Sum of squares at the last failure of a full step, and the unknowns that the step moved most.
    refused: Option<(f64, Vec<usize>)>,
    /// Whether the failed step followed a valley.
    in_valley: bool,
    /// Number of valley steps.
    along: usize,
    /// Number of failed full steps.
    failures: usize,
}

/// Returns the damping after a failed step.
fn harder(damping: f64) -> f64 {
    (10.0 * damping).max(FIRST_DAMPING)
}

/// Returns the damping after a successful step.
fn relaxed(damping: f64) -> f64 {
    if damping / 10.0 < LEAST_DAMPING { 0.0 } else { damping / 10.0 }
}

/// Next linearization, or the end of the iterations.
type Next<'a> = Result<ControlFlow<End<'a>, Iterate<'a>>, AdjustError>;

impl<'a> Run<'a, '_> {
    /// Iterates with damped Gauss-Newton steps.
    ///
    /// For the step dx and normal matrix N, dx_i^2 <= q_ii dx^T N dx (Cauchy-Schwarz). The predicted decrease of the sum of squares is dx^T
    /// N dx. Its root bounds every correction in standard deviations, without an inverse.
    pub(super) fn damped_steps(&mut self, start: Iterate<'a>, stop: Stop) -> Result<End<'a>, AdjustError> {
        let mut state = start;
        let mut control = StepControl {
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

    /// Whether a full step makes too many groups leave the layout: more than a fraction, or any after a short step. Missing columns would
    /// disturb chords and last steps.
    pub(super) fn is_outgrown(&self, step: &Iteration, followed: bool, values: &[f64]) -> bool {
        let short = followed || step.largest_change <= SETTLED;
        let most = if short { 0 } else { self.problem.layout().groups() / FEW };
        step.damping == 0.0
            && self.problem.model.steps_swing()
            && self.threads.install(|| self.problem.model.outgrown(values)) > most
    }

    /// Applies a step that leaves the layout if it does not raise the sum of squares; returns whether it was applied.
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

    /// Solves, and applies the step or ends with it.
    fn step_from(&mut self, state: Iterate<'a>, control: &mut StepControl) -> Next<'a> {
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

    /// Applies a step unless it fails.
    fn take(
        &mut self,
        iteration: Iteration,
        state: Iterate<'a>,
        step: &[f64],
        control: &mut StepControl,
    ) -> Next<'a> {
        let given = step;
        let accelerated = self.accelerated(&state, given, iteration, (control.best, control.stop))?;
        let (step, iteration, outgrown) = (&*accelerated.step, accelerated.iteration, accelerated.outgrown);
        let (trial, Iteration { damping, largest_change: change, .. }) = (accelerated.values, iteration);
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
        // A NaN sum of squares or a newly deficient local block is also a failure.
        let sum = next.linearized.sum_of_squares;
        if !(sum <= highest && next.linearized.factor.deficient_locals.is_empty()) {
            next.recycle();
            return self.failed(iteration, unknowns, (step, moved), control);
        }
        let decrease = std::mem::replace(&mut control.best, sum) - sum;
        self.accept(Iteration { sum_of_squares: sum, ..iteration }, &unknowns, next.reached())?;
        if damping > 0.0 {
            // Ill-conditioned local blocks make full steps fail.
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

    /// Continues after a failed step: along a valley if previous full steps succeeded, otherwise with more damping. Valley steps are not
    /// used with a loss, whose kinks also make steps fail. `moved` contains the unknowns that the step moves most.
    fn failed(
        &mut self,
        iteration: Iteration,
        unknowns: Vec<f64>,
        (step, moved): (&[f64], Vec<usize>),
        control: &mut StepControl,
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

    /// Continues from the same values with more damping. Ends there if the sum of squares has stagnated although full steps, which move the
    /// unknowns `moved` most, have failed.
    fn refuse(
        &mut self,
        unknowns: Vec<f64>,
        damping: f64,
        control: &mut StepControl,
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

    /// Continues in a trust region to its end. It has converged if a full step from there is short, or if the sum of squares stagnates
    /// along a reported combination.
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

    /// Whether a full step is the last one, by its length or by the predicted lengths of further steps.
    fn is_last(&self, stop: Stop, change: f64) -> bool {
        stop.at_change(change)
            || matches!(stop, Stop::Fraction(fraction) if self.leaves_less_than(fraction, change))
    }

    /// Whether the step after a full step would be negligible, judged by the sum of squares after the full step.
    fn is_foreseen(&self, control: &StepControl, state: &Iterate<'a>, step: &[f64]) -> bool {
        let Stop::Foreseen(limit) = control.stop else { return false };
        let foreseen = control.best - state.linearized.change().powi(2);
        // A smaller difference is a rounding error.
        if limit.powi(2) <= ROUNDING * control.best {
            return false;
        }
        let reached = self.objective(&self.problem.advanced(state.values(), step));
        (reached - foreseen).abs() <= limit.powi(2)
    }

    /// Whether the sum of squares stagnated between two failed full steps, `refused` at the first and `sum` at the second. Further damped
    /// steps would not change any unknown significantly.
    fn stands_still(&self, refused: &mut Option<(f64, Vec<usize>)>, sum: f64, moved: Vec<usize>) -> bool {
        let still = self.is_still(refused, sum);
        *refused = Some((sum, moved));
        still
    }

    /// Whether the sum of squares has hardly decreased since the last failed full step.
    fn is_still(&self, refused: &Option<(f64, Vec<usize>)>, sum: f64) -> bool {
        let freedom = self.problem.counts(&[]).degrees_of_freedom().max(1) as f64;
        let least = STILL * (sum / freedom).max(1.0);
        refused.as_ref().is_some_and(|(before, _)| before - sum <= least)
    }

    /// Follows a failed full step along a valley: a fraction of the step, then steps back to the floor with a damping that preserves the
    /// combination. Returns the values and the sum of squares there; None if all fractions fail.
    ///
    /// Example: principal distance and flying height of a flat block. Their change leaves the residuals unchanged if points and attitudes
    /// follow it along a curve. Steps with arbitrary damping would cross the valley repeatedly and creep.
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

    /// Whether the sum of all further steps is within a limit; unknown for accelerated steps.
    fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let learns = self.secants.correct() || self.problem.model.steps_swing() && self.chord.is_some();
        !learns && self.history().leaves_less_than(limit, change)
    }

    /// Recomputes the local unknowns if that lowers the sum of squares.
    fn relocated(&self, unknowns: Vec<f64>) -> Vec<f64> {
        let mut other = unknowns.clone();
        let relocated = self.threads.install(|| self.problem.model.relocate(&mut other));
        let lower = relocated && self.objective(&other) < self.objective(&unknowns);
        if lower { other } else { unknowns }
    }

    /// Applies the last step and ends there.
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
