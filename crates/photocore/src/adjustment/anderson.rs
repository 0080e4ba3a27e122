//! History of full steps for Anderson acceleration.

use nalgebra::{DMatrix, DVector};

/// Relative singular value below which differences are linearly dependent.
const ALIKE: f64 = 1e-6;

/// History of full steps for Anderson acceleration.
#[derive(Debug, Default)]
pub(super) struct AndersonHistory {
    /// Last step from the equations, and the values before it.
    pub last: Option<(Vec<f64>, Vec<f64>)>,
    /// Applied steps, each with the resulting change of the step; empty during fast convergence.
    pub pairs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl AndersonHistory {
    /// Stores a full step and the values before it.
    pub fn remember(&mut self, step: Vec<f64>, before: Vec<f64>) {
        self.last = Some((step, before));
    }

    /// Whether steps are accelerated.
    pub fn correct(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// Stores an applied step and the resulting change of the step; at most `most` pairs are stored.
    pub fn keep(&mut self, entries: Vec<f64>, difference: Vec<f64>, most: usize) {
        self.pairs.drain(..(self.pairs.len() + 1).saturating_sub(most));
        self.pairs.push((entries, difference));
    }

    /// Returns the accelerated step: a linear combination of [`AndersonHistory::all`].
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
        let entries = self.pairs.iter().map(|(entries, _)| &entries[..]);
        std::iter::once(step).chain(differences).chain(entries).collect()
    }

    /// Returns the coefficients of the accelerated step in [`AndersonHistory::all`], from the products of these vectors.
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
