//! Full steps where they fall slowly, or lead higher: corrected by those before them, or shortened.
//!
//! A second step with the same factor: the chord method (Kelley 1995, "Iterative Methods for Linear and Nonlinear Equations", chapter 5).
//!
//! Gauss-Newton steps leave out the second derivatives of the observations times their residuals. Where unknowns are determined well this is
//! nothing, and steps fall quadratically; where photos share cameras that are calibrated, combinations of these with attitudes, positions and
//! heights are determined weakly, and steps fall at last by a constant factor, 30 to 50 in practice. A chord step from the values reached,
//! N_k^-1 A^T l with A and l formed there, falls by as much as the next full step would: it needs no normal matrix but those of the local
//! blocks, and no new factor.

use std::time::Instant;

use super::options::{History, Iteration, NEGLIGIBLE};
use super::result::AdjustError;
use super::run::{Run, State};

/// Steps that fall to no less than this part of the one before are corrected, and so are all after them.
const SLOW: f64 = 0.5;
/// So many differences are remembered.
const MOST: usize = 6;
/// Parts of a step that leads higher, at the least and at the most,
const LEAST: f64 = 0.05;
const LARGEST: f64 = 0.5;
/// and how many are tried.
const PARTS: usize = 3;

impl<'a> Run<'a, '_> {
    /// The step in the place of a full one where steps fall slowly, or where that leads higher, and what it is by then as an iteration; None
    /// where the step stays, and of damped ones. Where chords follow it, they are corrected instead.
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

    /// Whether a step is hardly shorter than the one before.
    pub(super) fn is_slow(&self, step: &Iteration) -> bool {
        self.iterations.last().is_some_and(|former| step.largest_change >= SLOW * former.largest_change)
    }

    /// The sum of squares that a step leads to.
    fn reached(&self, state: &State<'a>, step: &[f64]) -> f64 {
        self.objective(&self.problem.advanced(state.values(), step))
    }

    /// The step that has learnt from those before.
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

    /// The part of a step that leads lowest on the parabola through what is known of the sum of squares along it, if that is lower. A damping
    /// instead would hold what the step is to move: what is determined weakly.
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
    /// The values after a step, and after a chord from there where that pays.
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

    /// What the steps so far say of the next.
    pub(super) fn history(&self) -> History<'_> {
        let unknowns = self.problem.layout().unknowns();
        History { iterations: &self.iterations, chord: self.chord, unknowns }
    }
}
