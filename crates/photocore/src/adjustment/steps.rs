//! Levenberg-Marquardt iterations: full Gauss-Newton steps (damping 0) that are damped after failures, or damped steps from the start
//! (Nielsen 1999; Madsen, Nielsen and Tingleff 2004, section 3.2).
//!
//! For the step dx and the normal matrix N, dx_i^2 <= q_ii dx^T N dx (Cauchy-Schwarz). The predicted decrease of the sum of squares by a
//! full step is dx^T N dx. Its root bounds every correction in standard deviations, without an inverse.
//!
//! A full step seldom fails, so that the normal equations are formed at its end, and their sum of squares decides. If every step is damped,
//! it is judged by the residuals at its end. Full steps that fail repeatedly do not converge: the neglected term, residuals times second
//! derivatives, dominates a combination of unknowns. From then on every step is damped, and a full step at the end confirms convergence.

use std::ops::ControlFlow;

use super::control::{BENDS, Control, Damping, FAR, MOST_DAMPING, ROUNDING, SHORT, STILL};
use super::options::{NEGLIGIBLE, Status, Stop};
use super::problem::Evaluated;
use super::result::AdjustError;
use super::run::{End, Iterate, Next, Run};
use crate::Iteration;

/// Reciprocal of the fraction of groups that may leave the layout before convergence.
const FEW: usize = 20;
/// Maximum change, in standard deviations, after which groups must not leave the layout: missing columns are detected before the last
/// steps.
const SETTLED: f64 = 0.1;
/// Maximum change, in standard deviations, of a failed full step in a valley: its combination is determined so weakly that the other
/// unknowns change nonlinearly along it.
const VALLEY: f64 = 30.0;
/// Maximum number of steps along a valley in an adjustment; afterwards their unknowns are reported.
const MOST_ALONG: usize = 8;
/// Maximum number of failed full steps; after more failures every step is damped.
const MOST_FAILURES: usize = 4;
/// Minimum ratio of actual to predicted decrease for an accepted damped step.
const LEAST_GAIN: f64 = 1e-3;
/// Minimum size of the second-order term for acceleration, relative to the step in the metric of the normal equations.
const STRAIGHT: f64 = 0.1;
/// Number of damped steps for the test of stagnation, and minimum ratio of the last decrease to the first. Stagnation: their total decrease
/// is less than required of one step. Such steps follow an undetermined combination at any damping.
const CREEPING: usize = 50;
const FALLING: f64 = 0.1;
/// Number of steps for networks, and the insignificant total decrease as a multiple of the variance of unit weight: about a fifth of a
/// standard deviation.
const CREEPING_IN_NETWORKS: usize = 12;
const LITTLE: f64 = 0.05;
/// Minimum number of local blocks of a network, whose damped steps may be accelerated and stopped at stagnation. Valleys of small problems
/// may be long (Eckerle4 of NIST's problems, from its first start), but those in networks are short.
const NETWORK: usize = 16;

/// Values after a step.
enum Reached<'a> {
    /// With normal equations.
    Formed(Box<Iterate<'a>>),
    /// With the sum of squares only.
    Evaluated(Vec<f64>, Box<dyn Evaluated + 'a>, f64),
}

impl Reached<'_> {
    /// Returns the values before a transformation to the datum.
    fn values(&self) -> &[f64] {
        match self {
            Self::Formed(state) => state.reached(),
            Self::Evaluated(values, ..) => values,
        }
    }

    fn at(&self) -> &dyn Evaluated {
        match self {
            Self::Formed(state) => state.equations.at(),
            Self::Evaluated(_, at, _) => &**at,
        }
    }

    fn sum_of_squares(&self) -> f64 {
        match self {
            Self::Formed(state) => state.linearized.sum_of_squares,
            Self::Evaluated(.., sum_of_squares) => *sum_of_squares,
        }
    }

    /// Whether the step lowers the sum of squares enough. A NaN sum of squares or a newly deficient local block is also a failure.
    fn succeeds(&self, step: &Iteration, gain: f64, best: f64) -> bool {
        match self {
            Self::Formed(state) => {
                let negligible = step.damping == 0.0 && step.largest_change <= NEGLIGIBLE;
                let highest = if negligible { f64::MAX } else { best * (1.0 + ROUNDING) };
                self.sum_of_squares() <= highest && state.linearized.factor.deficient_locals.is_empty()
            }
            Self::Evaluated(..) => gain > LEAST_GAIN && self.sum_of_squares() <= best,
        }
    }
}

impl<'a> Run<'a, '_> {
    /// Iterates until the stopping rule is satisfied, or steps no longer lower the sum of squares.
    pub(super) fn controlled_steps(
        &mut self,
        start: Iterate<'a>,
        stop: Stop,
        damping: &'static Damping,
    ) -> Result<End<'a>, AdjustError> {
        let mut control = Control::new(stop, damping, start.linearized.sum_of_squares);
        let mut state = start;
        while self.iterations.len() < self.options.max_iterations
            && state.linearized.factor.damping <= MOST_DAMPING
        {
            let next = match self.step(&state)? {
                Some(step) => self.take(state, step, &mut control)?,
                None => {
                    let damping = state.linearized.factor.damping;
                    self.refuse(state.recycle(), damping, vec![], &mut control)?
                }
            };
            match next {
                ControlFlow::Continue(next) => state = next,
                ControlFlow::Break(end) => return Ok(end),
            }
        }
        self.exhausted(state, control)
    }

    /// Applies a step unless it fails, or ends with it.
    fn take(&mut self, state: Iterate<'a>, step: Vec<f64>, control: &mut Control) -> Next<'a> {
        let (damping, change) = (state.linearized.factor.damping, state.linearized.change());
        let (number, full) = (self.iterations.len() + 1, damping == 0.0);
        let iteration = Iteration { number, sum_of_squares: control.best, largest_change: change, damping };
        if full && self.is_end(&state, &step, control) {
            return self.end_after(state, step, iteration).map(ControlFlow::Break);
        }
        let predicted = match control.always() {
            false => change * change,
            true => state.equations.decrease(self.context.threads, &step),
        };
        let accelerated = self.accelerated(&state, &step, iteration, predicted, control)?;
        let iteration = accelerated.iteration;
        let moved = if full { state.moved(&accelerated.step) } else { vec![] };
        let before = state.recycle();
        let values = self.relocated(accelerated.values, iteration.largest_change, control);
        if accelerated.pattern_violations {
            let sum_of_squares = self.objective(&values);
            if sum_of_squares <= control.best * (1.0 + ROUNDING) {
                self.accept(Iteration { sum_of_squares, ..iteration }, &before, &values)?;
                return Ok(ControlFlow::Break(End::at(Status::NotConverged, values)));
            }
        }
        let evaluated = match accelerated.evaluated {
            None if control.always() => Some(self.evaluated(&values)),
            found => found,
        };
        let reached = match evaluated {
            Some((at, sum_of_squares)) => Reached::Evaluated(values, at, sum_of_squares),
            None => {
                self.predict_last(&iteration);
                Reached::Formed(Box::new(self.form(values, control.eased(damping, f64::NAN))?))
            }
        };
        let gain = (control.best - reached.sum_of_squares()) / predicted;
        control.bends &= accelerated.bend.is_none_or(|bend| bend > STRAIGHT);
        control.bends |= control.always() && self.may_bend() && (gain.is_nan() || gain < BENDS);
        let last = control.always() && control.is_last_damped(&iteration, predicted);
        if reached.succeeds(&iteration, gain, control.best) {
            let next = self.follow(reached, iteration, &before, (gain, last), control);
            if full && self.problem.model.may_oscillate() {
                self.anderson.remember(step, before);
            }
            return next;
        }
        if let Reached::Formed(state) = reached {
            state.recycle();
        }
        if full {
            control.in_valley = iteration.largest_change <= VALLEY;
            if self.may_follow_valley(control)
                && let Some((values, sum_of_squares)) =
                    self.along_valley(&before, &accelerated.step, &iteration)?
            {
                control.along += 1;
                control.refused = Some((control.best, moved.clone()));
                (control.best, self.weak) = (sum_of_squares, moved);
                self.accept(Iteration { sum_of_squares, ..iteration }, &before, &values)?;
                return self.form(values, 0.0).map(ControlFlow::Continue);
            }
        } else if last {
            return self.end_at_best(before, control);
        }
        self.refuse(before, damping, moved, control)
    }

    /// Continues after a successful step, or ends there.
    fn follow(
        &mut self,
        reached: Reached<'a>,
        iteration: Iteration,
        before: &[f64],
        (gain, last): (f64, bool),
        control: &mut Control,
    ) -> Next<'a> {
        let sum_of_squares = reached.sum_of_squares();
        let decrease = std::mem::replace(&mut control.best, sum_of_squares) - sum_of_squares;
        self.accept(Iteration { sum_of_squares, ..iteration }, before, reached.values())?;
        let enough =
            control.is_whole(iteration.damping) && control.stop.at_decrease(decrease, sum_of_squares);
        let short = control.always() && iteration.largest_change < SHORT;
        if iteration.damping > 0.0 {
            self.collapsed = self.context.threads.install(|| match reached.at().collapsed(before) {
                none if none.is_empty() && short => reached.at().diverging(before),
                found => found,
            });
        }
        let (values, at) = match reached {
            Reached::Formed(next) if !self.collapsed.is_empty() => {
                return Ok(ControlFlow::Break(End::at(Status::NotConverged, next.recycle())));
            }
            Reached::Formed(next) if enough => {
                return self.stay(*next, Status::Converged).map(ControlFlow::Break);
            }
            Reached::Formed(next) => return Ok(ControlFlow::Continue(*next)),
            Reached::Evaluated(values, ..) if !self.collapsed.is_empty() => {
                return Ok(ControlFlow::Break(End::at(Status::NotConverged, values)));
            }
            Reached::Evaluated(values, at, _) => (values, at),
        };
        control.falls.push(decrease);
        if enough || last {
            return self.rest(values, Status::Converged, false, control).map(ControlFlow::Break);
        }
        if self.creeps(control) {
            return self.rest(values, Status::Converged, true, control).map(ControlFlow::Break);
        }
        let damping = control.eased(iteration.damping, gain);
        self.formed(values, at, damping).map(ControlFlow::Continue)
    }

    /// Continues from the same values with more damping. Ends there if the sum of squares has stagnated although full steps, which move the
    /// unknowns `moved` most, have failed.
    fn refuse(
        &mut self,
        before: Vec<f64>,
        damping: f64,
        moved: Vec<usize>,
        control: &mut Control,
    ) -> Next<'a> {
        if damping == 0.0 {
            let refused = control.refused.replace((control.best, moved));
            if self.is_still(&refused, control.best) {
                return self.end_at_best(before, control);
            }
            control.failures += 1;
            if control.failures > MOST_FAILURES {
                control.damp_always();
            }
        }
        self.form(before, control.raised(damping)).map(ControlFlow::Continue)
    }

    /// Whether a full step makes too many groups leave the layout: more than a fraction, or any after a short step. Missing columns would
    /// disturb chords and last steps.
    pub(super) fn leaves_pattern(&self, step: &Iteration, followed: bool, values: &[f64]) -> bool {
        let short = followed || step.largest_change <= SETTLED;
        let most = if short { 0 } else { self.problem.layout().groups() / FEW };
        step.damping == 0.0
            && self.problem.model.may_oscillate()
            && self.context.threads.install(|| self.problem.model.pattern_violations(values)) > most
    }

    /// Recomputes the local unknowns after a long step if that lowers the sum of squares.
    fn relocated(&self, unknowns: Vec<f64>, change: f64, control: &Control) -> Vec<f64> {
        if control.always() || change <= FAR * (unknowns.len() as f64).sqrt() {
            return unknowns;
        }
        let mut other = unknowns.clone();
        let relocated = self.context.threads.install(|| self.problem.model.relocate(&mut other));
        let lower = relocated && self.objective(&other) < self.objective(&unknowns);
        if lower { other } else { unknowns }
    }

    /// Whether a full step is the last one: by its length, by the predicted lengths of further steps, or because steps remain negligible
    /// without decreasing. In this case their unknowns are stored.
    fn is_end(&mut self, state: &Iterate<'a>, step: &[f64], control: &Control) -> bool {
        let change = state.linearized.change();
        let last = control.stop.at_change(change)
            || matches!(control.stop, Stop::Fraction(fraction) if self.leaves_less_than(fraction, change))
            || self.is_foreseen(control, state, step);
        let rests = !last && self.history().falls_no_more(change);
        if rests {
            self.weak = state.moved(step);
        }
        last || rests
    }

    /// Whether the sum of all further steps is within a limit; unknown for accelerated steps.
    fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let learns = self.anderson.correct() || self.problem.model.may_oscillate() && self.chord.is_some();
        !learns && self.history().leaves_less_than(limit, change)
    }

    /// Whether the step after a full step would be negligible, judged by the sum of squares after the full step.
    fn is_foreseen(&self, control: &Control, state: &Iterate<'a>, step: &[f64]) -> bool {
        let Stop::Foreseen(limit) = control.stop else { return false };
        let foreseen = control.best - state.linearized.change().powi(2);
        // A smaller difference is a rounding error.
        if limit.powi(2) <= ROUNDING * control.best {
            return false;
        }
        let reached = self.objective(&self.problem.advanced(state.values(), step));
        (reached - foreseen).abs() <= limit.powi(2)
    }

    /// Whether the sum of squares has hardly decreased since the last failed full step. Further damped steps would not change any unknown
    /// significantly.
    fn is_still(&self, refused: &Option<(f64, Vec<usize>)>, sum: f64) -> bool {
        let least = STILL * self.variance(sum);
        refused.as_ref().is_some_and(|(before, _)| before - sum <= least)
    }

    /// Returns the variance of unit weight for a sum of squares, at least 1.
    fn variance(&self, sum: f64) -> f64 {
        (sum / self.problem.counts(&[]).degrees_of_freedom().max(1) as f64).max(1.0)
    }

    /// Whether a failed full step may be followed along a valley: if previous full steps succeeded, and the sum of squares still decreases.
    fn may_follow_valley(&self, control: &Control) -> bool {
        control.in_valley
            && control.along < MOST_ALONG
            && self.options.loss.is_none()
            && self.iterations.iter().any(|iteration| iteration.damping == 0.0)
            && !self.is_still(&control.refused, control.best)
    }

    /// Whether damped steps may be accelerated in a curved valley. Kinks of a loss also make steps fail.
    fn may_bend(&self) -> bool {
        self.options.loss.is_none() && self.is_network()
    }

    fn is_network(&self) -> bool {
        self.problem.layout().locals() >= NETWORK
    }

    /// Whether the objective stagnates: small decreases that do not converge.
    fn creeps(&self, control: &Control) -> bool {
        let least = control.stop.least_decrease(control.best).unwrap_or(0.0);
        let (steps, little) = match self.is_network() {
            true => (CREEPING_IN_NETWORKS, least.max(LITTLE * self.variance(control.best))),
            false => (CREEPING, least),
        };
        let Some(first) = control.falls.len().checked_sub(steps) else { return false };
        let last = &control.falls[first..];
        last.iter().sum::<f64>() <= little && last[steps - 1] >= FALLING * last[0]
    }
}
