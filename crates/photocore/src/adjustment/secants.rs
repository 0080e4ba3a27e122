//! Steps corrected by what those before them have shown (Anderson 1965; Walker and Ni 2011, "Anderson acceleration for fixed-point
//! iterations").
//!
//! Gauss-Newton steps p = -N^-1 (N + S) e, from an error e, leave out S, the second derivatives of the observations times their residuals.
//! Where S is as large as N along a combination of unknowns, steps do not fall but swing across the solution (a lens of many knots whose
//! distortion can be turned into attitudes: what little holds it is an observation as all others). Two steps one after the other, the first
//! of which has been taken as s, show what they leave out: their difference is d = -N^-1 (N + S) s. With the c that make
//! p - sum c d shortest in the metric of N, p - sum c (s + d) is a step that has learnt it.

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::equations::ObservationEquations;
use super::method::NEGLIGIBLE;
use super::options::Iteration;
use super::run::{Run, State};
use crate::Threads;
use crate::normals::Prior;

/// Steps that fall to no less than this part of the one before are corrected, and so are all after them.
const SLOW: f64 = 0.5;
/// So many differences are remembered.
const MOST: usize = 6;
/// Parts of a step that leads higher, at the least and at the most,
const LEAST: f64 = 0.05;
const LARGEST: f64 = 0.5;
/// and how many are tried.
const PARTS: usize = 3;
/// Differences that are alike but for this part are one.
const ALIKE: f64 = 1e-6;

/// What full steps have shown.
#[derive(Debug, Default)]
pub(super) struct Secants {
    /// The last step as the equations gave it, and the values before it.
    last: Option<(Vec<f64>, Vec<f64>)>,
    /// Steps that have been taken, and by how much the step was another after each; none at all while steps fall.
    pairs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Secants {
    /// Remembers a full step that has been taken from some values.
    pub fn remember(&mut self, step: Vec<f64>, before: Vec<f64>) {
        self.last = Some((step, before));
    }

    /// Whether steps are corrected.
    pub fn correct(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// A step, the differences, and the steps that have been taken.
    fn all<'s>(&'s self, step: &'s [f64]) -> Vec<&'s [f64]> {
        let differences = self.pairs.iter().map(|(_, difference)| &difference[..]);
        let taken = self.pairs.iter().map(|(taken, _)| &taken[..]);
        std::iter::once(step).chain(differences).chain(taken).collect()
    }

    /// What the step that has learnt from those before takes of [`Secants::all`], by their products.
    fn shares(&self, products: &DMatrix<f64>) -> Option<DVector<f64>> {
        let count = self.pairs.len();
        let scale = DVector::from_fn(count, |i, _| products[(i + 1, i + 1)].sqrt().recip());
        let unit = DMatrix::from_fn(count, count, |i, j| products[(i + 1, j + 1)] * scale[i] * scale[j]);
        let right = DVector::from_fn(count, |i, _| -products[(i + 1, 0)] * scale[i]);
        let found = unit.svd(true, true).solve(&right, ALIKE).ok()?.component_mul(&scale);
        let shares = std::iter::once(1.0).chain(found.iter().chain(&found).copied());
        let shares = DVector::from_iterator(2 * count + 1, shares);
        shares.iter().all(|share| share.is_finite()).then_some(shares)
    }
}

impl<'a> Run<'a, '_> {
    /// The step in the place of a full one where steps fall slowly, or where that does not lead lower than `best`, and what it is by then as
    /// an iteration; None where it stays, and where there is none.
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

impl ObservationEquations<'_> {
    /// The products u^T N v of every two steps, N with the priors.
    fn products(&self, threads: &Threads, prior: &Prior, steps: &[&[f64]]) -> DMatrix<f64> {
        let zeros = || DMatrix::<f64>::zeros(steps.len(), steps.len());
        let add = |sum: &mut DMatrix<f64>, weight: f64, u: &[f64], v: &[f64]| {
            for (j, v) in v.iter().enumerate() {
                sum.column_mut(j).iter_mut().zip(u).for_each(|(sum, u)| *sum += weight * u * v);
            }
        };
        let of_unknown =
            |unknown: usize| steps.iter().map(|step| step[unknown]).collect::<SmallVec<[f64; 8]>>();
        let changes = |taken: &mut dyn Iterator<Item = (usize, f64)>| {
            let mut changes = SmallVec::<[f64; 8]>::from_elem(0.0, steps.len());
            taken
                .for_each(|(k, a)| changes.iter_mut().zip(steps).for_each(|(sum, step)| *sum += a * step[k]));
            changes
        };
        let observed = self.problem().for_stretches(threads, |buffers, locals| {
            let mut sum = zeros();
            for local in locals {
                self.each_row(buffers, local, |row| {
                    let own = changes(&mut row.taken());
                    add(&mut sum, 1.0, &own, &own);
                });
            }
            sum
        });
        let mut sum = observed.into_iter().fold(zeros(), |sum, part| sum + part);
        self.each_row_of_ties(|_, row| {
            let own = changes(&mut row.taken());
            add(&mut sum, 1.0, &own, &own);
        });
        for (unknown, &weight) in prior.weight.iter().enumerate().filter(|&(_, &weight)| weight != 0.0) {
            let own = of_unknown(unknown);
            add(&mut sum, weight, &own, &own);
        }
        for &(i, j, weight) in &prior.between {
            let (own, other) = (of_unknown(i), of_unknown(j));
            add(&mut sum, weight, &own, &other);
            add(&mut sum, weight, &other, &own);
        }
        sum
    }
}
