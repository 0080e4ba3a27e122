//! Full steps where they fall slowly, or lead higher: corrected by those before them, or shortened.

use super::method::NEGLIGIBLE;
use super::options::Iteration;
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
    /// where the step stays, and of damped ones.
    pub(super) fn corrected(
        &mut self,
        state: &State<'a>,
        step: &[f64],
        iteration: &Iteration,
    ) -> Option<(Vec<f64>, Iteration)> {
        let last = self.secants.last.take();
        if iteration.damping > 0.0 || self.options.loss.is_some() || !self.problem.model.steps_swing() {
            self.secants.pairs.clear();
            return None;
        }
        if let (Some((given, before)), Some(former)) = (last, self.iterations.last())
            && (self.secants.correct() || iteration.largest_change >= SLOW * former.largest_change)
        {
            let taken = self.problem.model.step_between(&before, state.reached());
            let difference = step.iter().zip(&given).map(|(now, before)| now - before).collect();
            let pairs = &mut self.secants.pairs;
            pairs.drain(..(pairs.len() + 1).saturating_sub(MOST));
            pairs.push((taken, difference));
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
        let mut own = vec![0.0; step.len()];
        for (each, share) in all.iter().zip(&shares) {
            own.iter_mut().zip(*each).for_each(|(sum, value)| *sum += share * value);
        }
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
