//! Anderson acceleration of steps (Anderson 1965; Walker and Ni 2011, "Anderson acceleration for fixed-point iterations").
//!
//! Gauss-Newton steps p = -N^-1 (N + S) e for an error e neglect S, the second derivatives of the observations times their residuals. If S
//! is as large as N along a combination of unknowns, steps oscillate across the solution. An example is a spline lens whose distortion is
//! nearly equivalent to attitudes. Two successive steps, the first applied as s, have the difference d = -N^-1 (N + S) s. With coefficients
//! c that minimise p - sum c d in the metric of N, the accelerated step is p - sum c (s + d).

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::equations::ObservationEquations;
use crate::Threads;
use crate::normals::Prior;

/// Relative singular value below which differences are linearly dependent.
const ALIKE: f64 = 1e-6;

/// History of full steps for Anderson acceleration.
#[derive(Debug, Default)]
pub(super) struct Secants {
    /// Last step from the equations, and the values before it.
    pub last: Option<(Vec<f64>, Vec<f64>)>,
    /// Applied steps, each with the resulting change of the step; empty during fast convergence.
    pub pairs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Secants {
    /// Stores a full step and the values before it.
    pub fn remember(&mut self, step: Vec<f64>, before: Vec<f64>) {
        self.last = Some((step, before));
    }

    /// Whether steps are accelerated.
    pub fn correct(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// Stores an applied step and the resulting change of the step; at most `most` pairs are stored.
    pub fn keep(&mut self, taken: Vec<f64>, difference: Vec<f64>, most: usize) {
        self.pairs.drain(..(self.pairs.len() + 1).saturating_sub(most));
        self.pairs.push((taken, difference));
    }

    /// Returns the accelerated step: a linear combination of [`Secants::all`].
    pub fn corrected(&self, step: &[f64], shares: &DVector<f64>) -> Vec<f64> {
        let mut own = vec![0.0; step.len()];
        for (each, share) in self.all(step).into_iter().zip(shares) {
            own.iter_mut().zip(each).for_each(|(sum, value)| *sum += share * value);
        }
        own
    }

    /// Returns the step, the differences and the applied steps.
    pub fn all<'s>(&'s self, step: &'s [f64]) -> Vec<&'s [f64]> {
        let differences = self.pairs.iter().map(|(_, difference)| &difference[..]);
        let taken = self.pairs.iter().map(|(taken, _)| &taken[..]);
        std::iter::once(step).chain(differences).chain(taken).collect()
    }

    /// Returns the coefficients of the accelerated step in [`Secants::all`], from the products of these vectors.
    pub fn shares(&self, products: &DMatrix<f64>) -> Option<DVector<f64>> {
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

impl ObservationEquations<'_> {
    /// Returns the products u^T N v of all pairs of steps, with priors in N.
    pub fn products(&self, threads: &Threads, prior: &Prior, steps: &[&[f64]]) -> DMatrix<f64> {
        let zeros = || DMatrix::<f64>::zeros(steps.len(), steps.len());
        let add = |sum: &mut DMatrix<f64>, weight: f64, u: &[f64], v: &[f64]| {
            for (j, v) in v.iter().enumerate() {
                sum.column_mut(j).iter_mut().zip(u).for_each(|(sum, u)| *sum += weight * u * v);
            }
        };
        // Stored by unknown.
        let unknowns = 0..steps.first().map_or(0, |step| step.len());
        let turned: Vec<f64> = unknowns.flat_map(|k| steps.iter().map(move |step| step[k])).collect();
        let of_unknown = |unknown: usize| &turned[unknown * steps.len()..][..steps.len()];
        let changes = |taken: &mut dyn Iterator<Item = (usize, f64)>| {
            let mut changes = SmallVec::<[f64; 16]>::from_elem(0.0, steps.len());
            taken.for_each(|(k, a)| {
                changes.iter_mut().zip(of_unknown(k)).for_each(|(sum, change)| *sum += a * change);
            });
            changes
        };
        let observed = self.fold_rows(threads, zeros, |sum, row| {
            let own = changes(&mut row.taken());
            add(sum, 1.0, &own, &own);
        });
        let mut sum = observed.into_iter().fold(zeros(), |sum, part| sum + part);
        for (unknown, &weight) in prior.weight.iter().enumerate().filter(|&(_, &weight)| weight != 0.0) {
            let own = of_unknown(unknown);
            add(&mut sum, weight, own, own);
        }
        for &(i, j, weight) in &prior.between {
            let (own, other) = (of_unknown(i), of_unknown(j));
            add(&mut sum, weight, own, other);
            add(&mut sum, weight, other, own);
        }
        sum
    }
}
