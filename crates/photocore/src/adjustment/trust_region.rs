//! Levenberg-Marquardt method with damping by the gain ratio of actual to predicted decrease (Nielsen 1999; Madsen, Nielsen and Tingleff
//! 2004, section 3.2).

use super::options::{FIRST_DAMPING, Iteration, Status, Stop};
use super::problem::Evaluated;
use super::result::AdjustError;
use super::run::{End, Iterate, Run};

/// Minimum damping; with less, the seven null pivots of a network without datum would be rounding errors.
const LEAST_DAMPING: f64 = 1e-10;
/// Maximum damping: the step is parallel to the gradient and must lower the sum of squares if any step does.
const MOST_DAMPING: f64 = 1e16;
/// Minimum ratio of actual to predicted decrease for an accepted step.
const LEAST_GAIN: f64 = 1e-3;
/// Relative predicted decrease of the sum of squares that counts as rounding error.
const ROUNDING: f64 = 1e-14;
/// Change, in standard deviations, that may also be a rounding error.
const NEGLIGIBLE: f64 = 1e-6;

/// Number of steps for the test of stagnation, and minimum ratio of the last decrease to the first. Stagnation: their total decrease is
/// less than required of one step. Such steps follow an undetermined combination at any damping.
const CREEPING: usize = 50;
const FALLING: f64 = 0.1;
/// Number of steps for networks, and the insignificant total decrease as a multiple of the variance of unit weight: about a fifth of a
/// standard deviation.
const CREEPING_IN_NETWORKS: usize = 12;
const LITTLE: f64 = 0.05;
/// Minimum change of an unknown in a weak combination: multiple of the overall change, scaled by the unknown's own equations.
const WEAK: f64 = 10.0;
/// Maximum change of a short step, in standard deviations.
const SHORT: f64 = 1.0;

/// Gain ratio below which steps are accelerated,
const BENDS: f64 = 0.75;
/// and size of the second-order term, relative to the step in the metric of the normal equations, below which they are not.
const STRAIGHT: f64 = 0.1;
/// Minimum number of local blocks of a network, whose steps may be accelerated and stopped at stagnation. Valleys of small problems may be
/// long (Eckerle4 of NIST's problems, from its first start), but those in networks are short.
const NETWORK: usize = 16;

/// Damping, and its factor at the next failure.
struct Damping {
    value: f64,
    rise: f64,
    /// Whether steps follow a curved valley.
    bends: bool,
}

/// Candidate step.
struct TrialStep<'a> {
    unknowns: Vec<f64>,
    at: Box<dyn Evaluated + 'a>,
    sum_of_squares: f64,
    /// Predicted decrease of the sum of squares.
    predicted: f64,
    /// Upper bound of the changes of all unknowns, in standard deviations.
    change: f64,
    /// Ratio of the second-order term to the step, if computed.
    bend: Option<f64>,
}

impl TrialStep<'_> {
    /// Gain ratio: actual to predicted decrease of the sum of squares.
    fn gain(&self, lowest: f64) -> f64 {
        (lowest - self.sum_of_squares) / self.predicted
    }
}

impl Damping {
    /// Reduces the damping after a step: factor from 1/3 (good prediction) to 2 (poor prediction).
    fn fall(&mut self, gain: f64) {
        let factor = (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
        self.value = (self.value * factor).max(LEAST_DAMPING);
        self.rise = 2.0;
    }

    /// Raises the damping after a failed step.
    fn rise(&mut self) {
        self.value *= self.rise;
        self.rise *= 2.0;
    }
}

impl<'a> Run<'a, '_> {
    /// Iterates with trust-region steps.
    ///
    /// The stopping rule is applied to steps with at most the initial damping, which are not much shortened. It is applied to any step if
    /// the predicted decrease is a rounding error.
    pub(super) fn in_trust_region(&mut self, start: Iterate<'a>, stop: Stop) -> Result<End<'a>, AdjustError> {
        let mut state = start;
        let mut lowest = state.linearized.sum_of_squares;
        let mut damping = Damping { value: state.linearized.damping(), rise: 2.0, bends: false };
        let mut falls: Vec<f64> = vec![];
        while self.iterations.len() < self.options.max_iterations {
            if damping.value > MOST_DAMPING {
                return self.rest(state.recycle(), Status::Diverged);
            }
            let used = state.linearized.damping();
            let Some(step) = self.step(&state)? else {
                damping.rise();
                state = self.form(state.recycle(), damping.value)?;
                continue;
            };
            let (unknowns, trial) = self.trial(state, &step, lowest, damping.bends)?;
            let whole = used <= FIRST_DAMPING;
            let rounding = trial.predicted <= (ROUNDING * lowest).max(NEGLIGIBLE * NEGLIGIBLE);
            let last = whole
                && (stop.at_change(trial.change) || stop.at_decrease(trial.predicted, lowest) || rounding);
            let gain = trial.gain(lowest);
            damping.bends &= trial.bend.is_none_or(|bend| bend > STRAIGHT);
            damping.bends |=
                (gain.is_nan() || gain < BENDS) && self.options.loss.is_none() && self.is_network();
            if gain > LEAST_GAIN && trial.sum_of_squares <= lowest {
                let decrease = lowest - trial.sum_of_squares;
                if let Some(end) = self.keep(&unknowns, &trial, used)? {
                    return Ok(end);
                }
                lowest = trial.sum_of_squares;
                damping.fall(gain);
                falls.push(decrease);
                if last || whole && stop.at_decrease(decrease, lowest) {
                    return self.rest(trial.unknowns, Status::Converged);
                }
                if self.creeps(&falls, lowest, stop) {
                    return self.rest_in_valley(trial.unknowns, Status::Converged);
                }
                state = self.formed(trial.unknowns, trial.at, damping.value)?;
            } else if last || rounding {
                return self.rest(unknowns, Status::Converged);
            } else {
                damping.rise();
                state = self.form(unknowns, damping.value)?;
            }
        }
        self.rest_in_valley(state.recycle(), Status::NotConverged)
    }

    /// Evaluates a step; returns the values before it, and the trial with its predicted decrease.
    ///
    /// In a curved valley the step is accelerated, and compared with the plain step if it gains little.
    fn trial(
        &mut self,
        state: Iterate<'a>,
        step: &[f64],
        lowest: f64,
        bends: bool,
    ) -> Result<(Vec<f64>, TrialStep<'a>), AdjustError> {
        let change = state.linearized.change();
        let predicted = state.equations.decrease(self.threads, &state.linearized.prior, step);
        let term = if bends { Some(self.second_order(&state, step)?) } else { None };
        let before = state.recycle();
        let trial = |step: &[f64], bend: Option<f64>| {
            let unknowns = self.problem.advanced(&before, step);
            let at = self.threads.install(|| self.problem.model.at(&unknowns));
            let sum_of_squares = self.objective_at(&unknowns, &*at);
            TrialStep { unknowns, at, sum_of_squares, predicted, change, bend }
        };
        let found = match term {
            None => trial(step, None),
            Some((term, square)) => {
                let bend = Some(square.max(0.0).sqrt() / change);
                let along: Vec<f64> = step.iter().zip(&term).map(|(v, a)| v + 0.5 * a).collect();
                let accelerated = trial(&along, bend);
                let good = accelerated.gain(lowest) >= BENDS;
                let plain = (!good).then(|| trial(step, bend));
                let lower = |plain: &TrialStep<'_>| accelerated.sum_of_squares < plain.sum_of_squares;
                plain.filter(|plain| !lower(plain)).unwrap_or(accelerated)
            }
        };
        Ok((before, found))
    }

    fn is_network(&self) -> bool {
        self.problem.layout().locals() >= NETWORK
    }

    /// Whether the objective stagnates: small decreases that do not converge.
    fn creeps(&self, falls: &[f64], lowest: f64, stop: Stop) -> bool {
        let least = stop.least_decrease(lowest).unwrap_or(0.0);
        let freedom = self.problem.counts(&[]).degrees_of_freedom().max(1) as f64;
        let (steps, little) = match self.is_network() {
            true => (CREEPING_IN_NETWORKS, least.max(LITTLE * (lowest / freedom).max(1.0))),
            false => (CREEPING, least),
        };
        let Some(first) = falls.len().checked_sub(steps) else { return false };
        let last = &falls[first..];
        last.iter().sum::<f64>() <= little && last[steps - 1] >= FALLING * last[0]
    }

    /// Stores a step; returns the end if it made local blocks ill-conditioned or divergent.
    fn keep(
        &mut self,
        before: &[f64],
        trial: &TrialStep<'a>,
        damping: f64,
    ) -> Result<Option<End<'a>>, AdjustError> {
        let number = self.iterations.len() + 1;
        let &TrialStep { sum_of_squares, change: largest_change, .. } = trial;
        let iteration = Iteration { number, sum_of_squares, largest_change, damping };
        self.accept(iteration, before, &trial.unknowns)?;
        let ends = self.has_collapsed(before, &*trial.at)
            || largest_change < SHORT && self.has_run_off(before, &*trial.at);
        Ok(ends.then(|| End::at(Status::NotConverged, trial.unknowns.clone())))
    }

    /// Ends at the current values although steps still change them. Stores the retained unknowns that a full step with a datum moves much
    /// more than the observations justify; empty if only local ones move so.
    fn rest_in_valley(&mut self, unknowns: Vec<f64>, status: Status) -> Result<End<'a>, AdjustError> {
        if self.iterations.last().is_none_or(|last| last.largest_change > SHORT) {
            return self.rest(unknowns, status);
        }
        self.curved = false;
        self.hold(&unknowns);
        let state = self.form(unknowns, 0.0)?;
        let Some(step) = self.step(&state)? else {
            return self.rest(state.recycle(), status);
        };
        let linearized = &state.linearized;
        if linearized.factor.largest_share(&self.problem.system, &step) > WEAK * linearized.change() {
            self.weak = state.moved(&step);
        }
        Ok(match self.options.covariance {
            true => End::with(status, state),
            false => End::at(status, state.recycle()),
        })
    }

    /// Constrains a datum, unless there is one already.
    fn hold(&mut self, unknowns: &[f64]) {
        if self.datum.is_empty() {
            self.datum = self.problem.to_hold(unknowns, self.threads);
        }
    }

    /// Ends at the current values, with a datum.
    fn rest(&mut self, unknowns: Vec<f64>, status: Status) -> Result<End<'a>, AdjustError> {
        self.hold(&unknowns);
        if !self.options.covariance {
            return Ok(End::at(status, unknowns));
        }
        self.curved = false;
        let state = self.form(unknowns, 0.0)?;
        let end = self.stay(state, status)?;
        Ok(End { status, ..end })
    }
}
