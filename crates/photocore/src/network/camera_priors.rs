//! Prior information of cameras with a full covariance matrix from a separate calibration.

use nalgebra::{DMatrix, DVector};

use super::input::Camera;
use crate::adjustment::PriorTerms;

/// Observation of the weighted parameters of a camera.
#[derive(Debug, Clone)]
pub struct CameraPrior {
    /// Index of its first parameter.
    first: usize,
    /// Inverse Cholesky factor of the covariance matrix; rows and columns of other parameters are zero.
    root: DMatrix<f64>,
}

impl CameraPrior {
    /// Returns the prior of a camera with a given first parameter; None without a covariance matrix.
    pub fn of(camera: &Camera, first: usize) -> Option<Self> {
        let (whitening, weighted, count) = (camera.whitening()?, camera.weighted(), camera.sd.len());
        let mut root = DMatrix::zeros(count, count);
        for (i, &row) in weighted.iter().enumerate() {
            weighted.iter().enumerate().for_each(|(j, &column)| root[(row, column)] = whitening[(i, j)]);
        }
        Some(Self { first, root })
    }

    /// Adds its equations at given values: L^-1 (p0 - p), S = L L^T.
    pub fn add_to(&self, prior_terms: &mut PriorTerms, values: &[f64], prior: &[f64]) {
        let count = self.root.nrows();
        // Values without prior information may be arbitrary: their column is zero.
        let weighted = |k: usize| self.root.column(k).iter().any(|&value| value != 0.0);
        let difference = DVector::from_fn(count, |k, _| {
            if weighted(k) { prior[self.first + k] - values[self.first + k] } else { 0.0 }
        });
        prior_terms.push(self.first, (&self.root * difference).as_slice(), self.root.transpose().as_slice());
    }
}

impl Camera {
    pub(super) fn weighted(&self) -> Vec<usize> {
        (0..self.sd.len()).filter(|&k| self.sd[k] > 0.0 && self.sd[k].is_finite()).collect()
    }

    /// Returns the inverse Cholesky factor of the covariance matrix; None if it is missing or not positive definite.
    fn whitening(&self) -> Option<DMatrix<f64>> {
        let covariance = self.covariance.as_ref()?;
        let scale = DMatrix::from_diagonal(&covariance.diagonal().map(|variance| variance.sqrt().recip()));
        let correlations = &scale * covariance * &scale;
        Some(correlations.cholesky()?.l().try_inverse()? * scale)
    }

    /// Returns true if the covariance matrix is missing or valid. It must be symmetric and positive definite, with the variances of the
    /// weighted parameters on its diagonal.
    pub(super) fn has_sound_covariance(&self) -> bool {
        let Some(covariance) = &self.covariance else { return true };
        let weighted = self.weighted();
        let of_sd = |(i, &k): (usize, &usize)| (covariance[(i, i)] / self.sd[k].powi(2) - 1.0).abs() < 1e-6;
        covariance.shape() == (weighted.len(), weighted.len())
            && covariance == &covariance.transpose()
            && weighted.iter().enumerate().all(of_sd)
            && self.whitening().is_some()
    }

    /// Returns the redundancy numbers of the parameters as one observation, the diagonal of I - Q S^-1; None without a matrix.
    pub(super) fn redundancy(&self, cofactors: &DMatrix<f64>) -> Option<Vec<f64>> {
        let (root, weighted, count) = (self.whitening()?, self.weighted(), self.sd.len());
        let q = cofactors.select_rows(&weighted).select_columns(&weighted);
        let shares = q * root.transpose() * root;
        let mut redundancy = vec![0.0; count];
        weighted.iter().enumerate().for_each(|(i, &k)| redundancy[k] = 1.0 - shares[(i, i)]);
        Some(redundancy)
    }
}
