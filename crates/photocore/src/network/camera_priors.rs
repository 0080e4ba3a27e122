//! Cameras whose parameters were observed with their full covariance: by a calibration of their own.

use nalgebra::{DMatrix, DVector};
use smallvec::SmallVec;

use super::Camera;
use crate::adjustment::Term;

/// The observation of the weighted parameters of a camera.
#[derive(Debug, Clone)]
pub struct CameraPrior {
    /// The unknown that its first parameter is.
    first: usize,
    /// The inverse of the Cholesky factor of the covariance matrix, rows and columns of parameters that are not weighted zero.
    root: DMatrix<f64>,
}

impl CameraPrior {
    /// What was observed of a camera whose first parameter is the given unknown; None without a covariance matrix.
    pub fn of(camera: &Camera, first: usize) -> Option<Self> {
        let (whitening, weighted, count) = (camera.whitening()?, camera.weighted(), camera.sd.len());
        let mut root = DMatrix::zeros(count, count);
        for (i, &row) in weighted.iter().enumerate() {
            weighted.iter().enumerate().for_each(|(j, &column)| root[(row, column)] = whitening[(i, j)]);
        }
        Some(Self { first, root })
    }

    /// Its equations at given values of the unknowns: L^-1 (p0 - p), S = L L^T.
    pub fn equations(&self, values: &[f64], prior: &[f64]) -> Term {
        let count = self.root.nrows();
        // Where nothing is observed the column is zero, and what stands there any number.
        let weighted = |k: usize| self.root.column(k).iter().any(|&value| value != 0.0);
        let apart = DVector::from_fn(count, |k, _| {
            if weighted(k) { prior[self.first + k] - values[self.first + k] } else { 0.0 }
        });
        Term {
            first: self.first,
            constant: SmallVec::from_slice((&self.root * apart).as_slice()),
            coefficients: SmallVec::from_slice(self.root.transpose().as_slice()),
        }
    }
}

impl Camera {
    /// The parameters that are weighted.
    pub(super) fn weighted(&self) -> Vec<usize> {
        (0..self.sd.len()).filter(|&k| self.sd[k] > 0.0 && self.sd[k].is_finite()).collect()
    }

    /// The inverse of the Cholesky factor of the covariance matrix of these; None where there is no such matrix, or it is none.
    fn whitening(&self) -> Option<DMatrix<f64>> {
        let covariance = self.covariance.as_ref()?;
        let scale = DMatrix::from_diagonal(&covariance.diagonal().map(|variance| variance.sqrt().recip()));
        let correlations = &scale * covariance * &scale;
        Some(correlations.cholesky()?.l().try_inverse()? * scale)
    }

    /// Whether the covariance matrix, where there is one, is that of the weighted parameters: symmetric and positive definite, with the
    /// squares of their standard deviations in its diagonal.
    pub(super) fn has_sound_covariance(&self) -> bool {
        let Some(covariance) = &self.covariance else { return true };
        let weighted = self.weighted();
        let of_sd = |(i, &k): (usize, &usize)| (covariance[(i, i)] / self.sd[k].powi(2) - 1.0).abs() < 1e-6;
        covariance.shape() == (weighted.len(), weighted.len())
            && covariance == &covariance.transpose()
            && weighted.iter().enumerate().all(of_sd)
            && self.whitening().is_some()
    }

    /// Redundancy numbers of the parameters as one observation, the diagonal of Qvv S^-1 = I - Q S^-1; None unless it is one.
    pub(super) fn redundancy(&self, cofactors: &DMatrix<f64>) -> Option<Vec<f64>> {
        let (root, weighted, count) = (self.whitening()?, self.weighted(), self.sd.len());
        let q = cofactors.select_rows(&weighted).select_columns(&weighted);
        let shares = q * root.transpose() * root;
        let mut redundancy = vec![0.0; count];
        weighted.iter().enumerate().for_each(|(i, &k)| redundancy[k] = 1.0 - shares[(i, i)]);
        Some(redundancy)
    }
}
