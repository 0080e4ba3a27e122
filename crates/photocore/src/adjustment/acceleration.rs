//! Acceleration of full steps that converge slowly, oscillate, or raise the sum of squares.
//!
//! Gauss-Newton steps p = -N^-1 (N + S) e for an error e neglect S, the second derivatives of the observations times their residuals. For
//! well-determined unknowns S is irrelevant, and convergence is quadratic. If photos share self-calibrated cameras, some combinations of
//! camera parameters, poses and heights are determined weakly. Convergence is then linear, with a factor of 30 to 50 in practice.
//!
//! * A chord N_k^-1 A^T l, with A and l formed at the new values, converges as fast as the next full step. It only needs normal matrices of
//!   the local blocks, but not a new factor (Kelley 1995, "Iterative Methods for Linear and Nonlinear Equations", chapter 5).
//! * If S is as large as N along a combination of unknowns, steps oscillate across the solution. An example is a spline lens whose distortion
//!   is nearly equivalent to attitudes. Anderson acceleration combines several steps (Anderson 1965; Walker and Ni 2011, "Anderson
//!   acceleration for fixed-point iterations"). Two successive steps, the first applied as s, have the difference d = -N^-1 (N + S) s. With
//!   coefficients c that minimise p - sum c d in the metric of N, the accelerated step is p - sum c (s + d).
//! * Chains of chords with one factor are accelerated in the same way. With N = L L^T, a chord p is computed from y = L^-1 A^T l, and
//!   y^T y' equals p^T N p', so that no pass over the observations is required.
//! * Steps of a trust region have a second-order term (Transtrum and Sethna 2012, "Improvements to the Levenberg-Marquardt algorithm for
//!   nonlinear least-squares minimization"). If a combination of unknowns is determined weakly, the sum of squares has a curved valley, and
//!   straight steps along it are short. Let r be the residuals, v the step and r_vv their second derivative along it. With
//!   (N + damping) a = A^T r_vv, v + a/2 is accurate to second order. Finite differences suffice: r_vv = 2/h ((r(x + h v) - r(x)) / h + A v).

use std::borrow::Cow;
use std::time::Instant;

use nalgebra::DMatrix;

use super::anderson::AndersonHistory;
use super::control::{BENDS, Control, ROUNDING};
use super::equations::ObservationEquations;
use super::options::{History, NEGLIGIBLE, Stop};
use super::problem::Evaluated;
use super::result::AdjustError;
use super::run::{Iterate, Run};
use super::statistics::weighted;
use crate::Iteration;
use crate::normals::{Chord, SolveOptions, dot};

/// Minimum ratio of two successive step lengths for acceleration, which continues for all later steps.
const SLOW: f64 = 0.5;
/// Maximum number of stored differences of full steps.
const MOST_DIFFERENCES: usize = 6;
/// Minimum and maximum fraction of a step that raises the sum of squares,
const LEAST: f64 = 0.05;
const LARGEST: f64 = 0.5;
/// and maximum number of tested fractions.
const PARTS: usize = 3;
/// Maximum change, in standard deviations, of a step followed by chords; farther from the solution chords raise the sum of squares.
const CLOSE: f64 = 3.0;
/// Maximum number of chords after a step, and of stored differences.
const MOST_CHORDS: usize = 40;
/// Number of chords, and the ratio that their lengths must fall below; otherwise new normal equations are more effective.
const LONG: usize = 10;
const FALL: f64 = 0.5;
/// Number of fractions of a full step along a valley, each half of its predecessor,
const VALLEY_PARTS: usize = 4;
/// damping of the steps back to the floor of the valley, which restrains only weakly determined combinations,
const HOLDING: f64 = 1e-6;
/// and maximum number of these steps per fraction.
const BACK: usize = 3;
/// Minimum ratio of actual to predicted decrease for an accepted fraction. With a poor prediction, the standard deviation of the combination
/// is not a measure of the step.
const GAIN: f64 = 0.5;
/// Fraction h of the step at which residuals are compared with their linearization.
const PART: f64 = 0.1;

/// Step after acceleration.
pub(super) struct Accelerated<'s, 'a> {
    /// The step, accelerated or shortened if useful, with its record.
    pub step: Cow<'s, [f64]>,
    pub iteration: Iteration,
    /// Values after the step and its chords or second-order term,
    pub values: Vec<f64>,
    /// and the model there with its objective, if evaluated.
    pub evaluated: Option<(Box<dyn Evaluated + 'a>, f64)>,
    /// Whether the step makes too many groups leave the layout.
    pub pattern_violations: bool,
    /// Ratio of the second-order term to the step, if computed.
    pub bend: Option<f64>,
}

impl<'a> Run<'a, '_> {
    /// Accelerates a step. A full step is followed by chords that lower the sum of squares; a damped one receives its second-order term.
    pub(super) fn accelerated<'s>(
        &mut self,
        state: &Iterate<'a>,
        step: &'s [f64],
        iteration: Iteration,
        predicted: f64,
        control: &Control,
    ) -> Result<Accelerated<'s, 'a>, AdjustError> {
        if control.bends {
            return self.bent(state, step, iteration, predicted);
        }
        let followed = self.is_followed(state, &iteration);
        let corrected = self.corrected(state, step, &iteration, followed);
        let (step, iteration) = match corrected {
            Some((own, iteration)) => (Cow::Owned(own), iteration),
            None => (Cow::Borrowed(step), iteration),
        };
        let ahead = self.problem.advanced(state.values(), &step);
        let pattern_violations = self.leaves_pattern(&iteration, followed, &ahead);
        let values = if followed && !pattern_violations {
            let found = self.followed(state, ahead.clone(), (control.best, control.stop))?;
            self.chord = found.as_ref().map(|&(_, length)| length);
            found.map_or(ahead, |(values, _)| values)
        } else {
            self.stepped(state, ahead, &iteration)?
        };
        Ok(Accelerated { step, iteration, values, evaluated: None, pattern_violations, bend: None })
    }

    /// Adds the second-order term to a damped step in a curved valley; returns the plain step if that gains more.
    fn bent<'s>(
        &mut self,
        state: &Iterate<'a>,
        step: &'s [f64],
        iteration: Iteration,
        predicted: f64,
    ) -> Result<Accelerated<'s, 'a>, AdjustError> {
        let (term, square) = self.second_order(state, step)?;
        let along: Vec<f64> = step.iter().zip(&term).map(|(v, a)| v + 0.5 * a).collect();
        let (mut values, mut evaluated) = self.tried(state, &along);
        let gain = (iteration.sum_of_squares - evaluated.1) / predicted;
        if gain.is_nan() || gain < BENDS {
            let plain = self.tried(state, step);
            if evaluated.1.is_nan() || plain.1.1 <= evaluated.1 {
                (values, evaluated) = plain;
            }
        }
        let bend = Some(square.max(0.0).sqrt() / iteration.largest_change);
        let (step, evaluated) = (Cow::Borrowed(step), Some(evaluated));
        Ok(Accelerated { step, iteration, values, evaluated, pattern_violations: false, bend })
    }

    /// Follows a failed full step along a valley: a fraction of the step, then steps back to the floor with a damping that preserves the
    /// combination. Returns the values and the sum of squares there; None if all fractions fail.
    ///
    /// Example: principal distance and flying height of a flat block. Their change leaves the residuals unchanged if points and attitudes
    /// follow it along a curve. Steps with arbitrary damping would cross the valley repeatedly and creep.
    pub(super) fn along_valley(
        &mut self,
        unknowns: &[f64],
        step: &[f64],
        &Iteration { largest_change: change, sum_of_squares: best, .. }: &Iteration,
    ) -> Result<Option<(Vec<f64>, f64)>, AdjustError> {
        let mut part = 1.0;
        for _ in 0..VALLEY_PARTS {
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

    /// Returns the values after a step, with the model there and its objective.
    fn tried(&self, state: &Iterate<'a>, step: &[f64]) -> (Vec<f64>, (Box<dyn Evaluated + 'a>, f64)) {
        let values = self.problem.advanced(state.values(), step);
        let evaluated = self.evaluated(&values);
        (values, evaluated)
    }

    /// Returns the second-order term a of a step, and a^T (N + damping) a. The few terms are regarded as linear.
    fn second_order(&mut self, state: &Iterate<'a>, step: &[f64]) -> Result<(Vec<f64>, f64), AdjustError> {
        let part: Vec<f64> = step.iter().map(|value| PART * value).collect();
        let ahead =
            self.problem.residuals(self.context.threads, &self.problem.advanced(state.values(), &part));
        let (equations, layout) = (&state.equations, self.problem.layout());
        let of_groups = layout.groups() * layout.rows();
        let right = equations.transposed(self.context.threads, 1, |row, bend| {
            let difference = || weighted(ahead[row.number], equations.deviation(row.number)) - row.constant;
            bend[0] = match row.number < of_groups {
                true => 2.0 / PART * (difference() / PART + row.change(step)),
                false => 0.0,
            };
        });
        let term = self.solved(state, SolveOptions { rights: Some(&right), ..SolveOptions::default() })?;
        let square = right.iter().zip(&term).map(|(right, value)| right * value).sum();
        Ok((term, square))
    }

    /// Returns an accelerated or shortened step with its iteration record, if the full step converges slowly or raises the sum of squares.
    /// None if the step is unchanged or damped. Steps followed by chords are not accelerated.
    fn corrected(
        &mut self,
        state: &Iterate<'a>,
        step: &[f64],
        iteration: &Iteration,
        followed: bool,
    ) -> Option<(Vec<f64>, Iteration)> {
        let last = self.anderson.last.take();
        if iteration.damping > 0.0 || self.options.loss.is_some() || !self.problem.model.may_oscillate() {
            self.anderson.pairs.clear();
            return None;
        }
        if let Some((given, before)) = last
            && !followed
            && (self.anderson.correct() || self.is_slow(iteration))
        {
            let entries = self.problem.model.step_between(&before, state.reached());
            let difference = step.iter().zip(&given).map(|(now, before)| now - before).collect();
            self.anderson.keep(entries, difference, MOST_DIFFERENCES);
        } else {
            self.anderson.pairs.clear();
        }
        let anderson_step =
            if self.anderson.correct() { self.anderson_step(state, step, iteration) } else { None };
        if iteration.largest_change <= NEGLIGIBLE {
            return anderson_step;
        }
        let (best, plain) = (iteration.sum_of_squares, self.reached(state, step));
        let lowest = best.min(plain);
        match anderson_step.filter(|(own, _)| self.reached(state, own) <= lowest) {
            None if plain.is_nan() || plain > best => self.shortened(state, step, iteration, plain),
            found => found,
        }
    }

    /// Whether a step is hardly shorter than its predecessor.
    fn is_slow(&self, step: &Iteration) -> bool {
        self.iterations.last().is_some_and(|former| step.largest_change >= SLOW * former.largest_change)
    }

    /// Returns the sum of squares after a step.
    fn reached(&self, state: &Iterate<'a>, step: &[f64]) -> f64 {
        self.objective(&self.problem.advanced(state.values(), step))
    }

    /// Returns the step after Anderson acceleration.
    fn anderson_step(
        &self,
        state: &Iterate<'a>,
        step: &[f64],
        iteration: &Iteration,
    ) -> Option<(Vec<f64>, Iteration)> {
        let all = self.anderson.all(step);
        let products = state.equations.products(self.context.threads, &all);
        let shares = self.anderson.shares(&products)?;
        let own = self.anderson.corrected(step, &shares);
        let largest_change = (&products * &shares).dot(&shares).max(0.0).sqrt();
        Some((own, Iteration { largest_change, ..*iteration }))
    }

    /// Returns the fraction of a step with the lowest sum of squares on a fitted parabola, if that is an improvement. Damping would
    /// suppress the weakly determined combinations that the step must change.
    fn shortened(
        &self,
        state: &Iterate<'a>,
        step: &[f64],
        iteration: &Iteration,
        mut reached: f64,
    ) -> Option<(Vec<f64>, Iteration)> {
        let (best, square) = (iteration.sum_of_squares, iteration.largest_change.powi(2));
        let mut part = 1.0;
        for _ in 0..PARTS {
            let bend = (reached - best + 2.0 * part * square) / part.powi(2);
            let lowest = if bend.is_finite() { square / bend } else { 0.0 };
            part = lowest.clamp(LEAST * part, LARGEST * part);
            let own: Vec<f64> = step.iter().map(|value| part * value).collect();
            reached = self.reached(state, &own);
            if reached < best {
                return Some((
                    own,
                    Iteration { largest_change: part * iteration.largest_change, ..*iteration },
                ));
            }
        }
        None
    }

    /// Returns the values after a step, including a chord if that is useful.
    fn stepped(
        &mut self,
        state: &Iterate<'a>,
        values: Vec<f64>,
        iteration: &Iteration,
    ) -> Result<Vec<f64>, AdjustError> {
        self.chord = None;
        if !(state.linearized.factor.has_cached() && self.is_for_chord(iteration)) {
            return Ok(values);
        }
        let start = Instant::now();
        let (_, chord) = self.chord_at(state, &values)?;
        self.seconds.solve += start.elapsed().as_secs_f64();
        let change = chord.decrease.sqrt();
        if !History::is_chord(change, iteration.largest_change) {
            return Ok(values);
        }
        self.chord = Some(change);
        Ok(self.problem.advanced(&values, &chord.step))
    }

    fn is_for_chord(&self, step: &Iteration) -> bool {
        step.damping == 0.0
            && self.options.loss.is_none()
            && self.problem.model.converges_linearly()
            && self.history().is_for_chord(step.largest_change)
    }

    /// Returns the history of the steps so far.
    pub(super) fn history(&self) -> History<'_> {
        let unknowns = self.problem.layout().unknowns();
        History { iterations: &self.iterations, chord: self.chord, unknowns }
    }

    /// Whether a full step is followed by chords until convergence.
    fn is_followed(&self, state: &Iterate<'a>, step: &Iteration) -> bool {
        step.damping == 0.0
            && step.largest_change < CLOSE
            && self.options.loss.is_none()
            && self.problem.model.may_oscillate()
            && state.linearized.factor.has_cached()
    }

    /// Returns the best values of a chain of chords and the length of the chord there. None if the sum of squares at the given values is
    /// above `best`.
    fn followed(
        &mut self,
        state: &Iterate<'a>,
        values: Vec<f64>,
        (best, stop): (f64, Stop),
    ) -> Result<Option<(Vec<f64>, f64)>, AdjustError> {
        let start = Instant::now();
        let (mut anderson, mut differences) = (AndersonHistory::default(), Vec::<Vec<f64>>::new());
        let mut here = self.link(state, values)?;
        if here.is_higher_than(best) {
            return Ok(None);
        }
        let (mut end, mut lowest) = ((here.values.clone(), here.change()), here.sum_of_squares);
        let mut lengths = vec![here.change()];
        while lengths.len() < MOST_CHORDS && falls(&lengths) && !is_enough(stop, &here) {
            let entries = here.corrected(&anderson, &differences);
            let next = self.link(state, self.problem.advanced(&here.values, &entries))?;
            // An accelerated chord may temporarily raise the sum of squares, by no more than the last predicted decrease.
            if next.is_higher_than(lowest + here.chord.decrease) {
                break;
            }
            if !next.is_higher_than(lowest) {
                (end, lowest) = ((next.values.clone(), next.change()), lowest.min(next.sum_of_squares));
            }
            anderson.keep(entries, minus(&next.chord.step, &here.chord.step), MOST_CHORDS);
            differences.push(minus(&next.chord.reduced, &here.chord.reduced));
            lengths.push(next.change());
            here = next;
        }
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(Some(end))
    }

    /// Computes the chord and the sum of squares at given values.
    fn link(&mut self, state: &Iterate<'a>, values: Vec<f64>) -> Result<Link, AdjustError> {
        let (equations, chord) = self.chord_at(state, &values)?;
        let sum_of_squares = self.objective_at(&values, equations.at());
        Ok(Link { values, sum_of_squares, chord })
    }

    /// Forms the equations at given values and computes their chord.
    pub(super) fn chord_at(
        &mut self,
        state: &Iterate<'a>,
        values: &[f64],
    ) -> Result<(ObservationEquations<'a>, Chord), AdjustError> {
        let equations =
            ObservationEquations::new(self.problem, None, values, &self.datum, self.context.threads);
        let chord = state.linearized.factor.chord(&equations, &mut self.context);
        Ok((equations, chord?))
    }
}

/// Values with the chord from them.
struct Link {
    values: Vec<f64>,
    sum_of_squares: f64,
    chord: Chord,
}

impl Link {
    /// Length of the chord in standard deviations.
    fn change(&self) -> f64 {
        self.chord.decrease.sqrt()
    }

    /// Returns the chord after Anderson acceleration with the stored steps and differences of y.
    fn corrected(&self, anderson: &AndersonHistory, differences: &[Vec<f64>]) -> Vec<f64> {
        if !anderson.correct() {
            return self.chord.step.clone();
        }
        let row = |k: usize| if k == 0 { &self.chord.reduced } else { &differences[k - 1] };
        let count = differences.len() + 1;
        let shares = anderson.shares(&DMatrix::from_fn(count, count, |i, j| dot(row(i), row(j))));
        shares.map_or_else(|| self.chord.step.clone(), |shares| anderson.corrected(&self.chord.step, &shares))
    }

    /// Whether the sum of squares exceeds a limit, apart from rounding errors and negligible chords, or is not finite.
    fn is_higher_than(&self, sum_of_squares: f64) -> bool {
        let highest = sum_of_squares * (1.0 + ROUNDING);
        !(self.sum_of_squares <= highest || self.change() <= NEGLIGIBLE && self.sum_of_squares.is_finite())
            || !self.change().is_finite()
    }
}

/// Whether the chord satisfies the stopping rule of full steps.
fn is_enough(stop: Stop, link: &Link) -> bool {
    stop.at_change(link.change()) || stop.at_decrease(link.chord.decrease, link.sum_of_squares)
}

/// Whether the chord lengths are still decreasing.
fn falls(lengths: &[f64]) -> bool {
    let before = lengths.len().checked_sub(LONG + 1).map(|first| lengths[first]);
    before.is_none_or(|before| lengths[lengths.len() - 1] < FALL * before)
}

/// Returns the elementwise difference.
fn minus(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}
