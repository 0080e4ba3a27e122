//! Acceleration or shortening of full steps that converge slowly or raise the sum of squares.
//!
//! Chord method: a second step with the same factor (Kelley 1995, "Iterative Methods for Linear and Nonlinear Equations", chapter 5).
//!
//! Gauss-Newton steps neglect second derivatives times residuals. For well-determined unknowns this term is irrelevant, and convergence is
//! quadratic. If photos share self-calibrated cameras, some combinations of camera parameters, poses and heights are determined weakly.
//! Convergence is then linear, with a factor of 30 to 50 in practice. A chord N_k^-1 A^T l, with A and l formed at the new values,
//! converges as fast as the next full step. It only needs normal matrices of the local blocks, but not a new factor.

use std::time::Instant;

use super::options::{History, Iteration, NEGLIGIBLE};
use super::result::AdjustError;
use super::run::{Run, State};

/// Minimum ratio of two successive step lengths for acceleration, which continues for all later steps.
const SLOW: f64 = 0.5;
/// Maximum number of stored differences.
const MOST: usize = 6;
/// Minimum and maximum fraction of a step that raises the sum of squares,
const LEAST: f64 = 0.05;
const LARGEST: f64 = 0.5;
/// and maximum number of tested fractions.
const PARTS: usize = 3;

impl<'a> Run<'a, '_> {
    /// Returns an accelerated or shortened step with its iteration record, if the full step converges slowly or raises the sum of squares.
    /// None if the step is unchanged or damped. Steps followed by chords are not accelerated.
    pub(super) fn corrected(
        &mut self,
        state: &State<'a>,
        step: &[f64],
        iteration: &Iteration,
        followed: bool,
    ) -> Option<(Vec<f64>, Iteration)> {
        let last = self.secants.last.take();
        if iteration.damping > 0.0 || self.options.loss.is_some() || !self.problem.model.steps_swing() {
            self.secants.pairs.clear();
            return None;
        }
        if let Some((given, before)) = last
            && !followed
            && (self.secants.correct() || self.is_slow(iteration))
        {
            let taken = self.problem.model.step_between(&before, state.reached());
            let difference = step.iter().zip(&given).map(|(now, before)| now - before).collect();
            self.secants.keep(taken, difference, MOST);
        } else {
            self.secants.pairs.clear();
        }
        let learnt = if self.secants.correct() { self.learnt(state, step, iteration) } else { None };
        if iteration.largest_change <= NEGLIGIBLE {
            return learnt;
        }
        let (best, plain) = (iteration.sum_of_squares, self.reached(state, step));
        let lowest = best.min(plain);
        match learnt.filter(|(own, _)| self.reached(state, own) <= lowest) {
            None if plain.is_nan() || plain > best => self.shortened(state, step, iteration, plain),
            found => found,
        }
    }

    /// Whether a step is hardly shorter than its predecessor.
    pub(super) fn is_slow(&self, step: &Iteration) -> bool {
        self.iterations.last().is_some_and(|former| step.largest_change >= SLOW * former.largest_change)
    }

    /// Returns the sum of squares after a step.
    fn reached(&self, state: &State<'a>, step: &[f64]) -> f64 {
        self.objective(&self.problem.advanced(state.values(), step))
    }

    /// Returns the step after Anderson acceleration.
    fn learnt(
        &self,
        state: &State<'a>,
        step: &[f64],
        iteration: &Iteration,
    ) -> Option<(Vec<f64>, Iteration)> {
        let all = self.secants.all(step);
        let products = state.equations.products(self.threads, &state.linearized.prior, &all);
        let shares = self.secants.shares(&products)?;
        let own = self.secants.corrected(step, &shares);
        let largest_change = (&products * &shares).dot(&shares).max(0.0).sqrt();
        Some((own, Iteration { largest_change, ..*iteration }))
    }

    /// Returns the fraction of a step with the lowest sum of squares on a fitted parabola, if that is an improvement. Damping would
    /// suppress the weakly determined combinations that the step must change.
    fn shortened(
        &self,
        state: &State<'a>,
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
}

impl<'a> Run<'a, '_> {
    /// Returns the values after a step, including a chord if that is useful.
    pub(super) fn stepped(
        &mut self,
        state: &State<'a>,
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
            && self.problem.model.ends_slowly()
            && self.history().is_for_chord(step.largest_change)
    }

    /// Returns the history of the steps so far.
    pub(super) fn history(&self) -> History<'_> {
        let unknowns = self.problem.layout().unknowns();
        History { iterations: &self.iterations, chord: self.chord, unknowns }
    }
}
