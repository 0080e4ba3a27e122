//! Precision of observations.

use nalgebra::DMatrix;

use super::fault::Fault;

/// Smallest standard deviation with a finite weight; the largest is its reciprocal.
const SMALLEST: f64 = 1e-100;
/// Tolerance of the symmetry of a covariance matrix, relative to its diagonal.
const SYMMETRIC: f64 = 1e-9;

/// Precision of the components of an observation, in their units.
#[derive(Debug, Clone, PartialEq)]
pub enum Precision {
    /// Standard deviations.
    Deviations(Vec<f64>),
    /// Covariance matrix.
    Covariance(DMatrix<f64>),
}

impl Precision {
    /// Returns L of the covariance matrix S = L L^T of `components` components: L^-1 whitens them.
    pub(in super::super) fn root(&self, components: usize) -> Result<DMatrix<f64>, Fault> {
        let deviates = |sd: f64| sd > SMALLEST && sd < SMALLEST.recip();
        let given = match self {
            Self::Deviations(sd) => sd.len(),
            Self::Covariance(matrix) if matrix.ncols() == components => matrix.nrows(),
            Self::Covariance(matrix) => matrix.ncols(),
        };
        if given != components {
            return Err(Fault::Deviations { components, given });
        }
        match self {
            Self::Deviations(sd) if sd.iter().all(|&sd| deviates(sd)) => {
                Ok(DMatrix::from_fn(components, components, |i, j| if i == j { sd[i] } else { 0.0 }))
            }
            Self::Deviations(_) => Err(Fault::Deviation),
            Self::Covariance(s) => {
                let scale = |i: usize, j: usize| (s[(i, i)] * s[(j, j)]).sqrt();
                let symmetric = |i: usize, j: usize| (s[(i, j)] - s[(j, i)]).abs() <= SYMMETRIC * scale(i, j);
                let sound = (0..components)
                    .all(|i| deviates(s[(i, i)].sqrt()) && (0..components).all(|j| symmetric(i, j)));
                sound.then(|| lower_root(s)).flatten().ok_or(Fault::Covariance)
            }
        }
    }
}

/// Returns L of a symmetric matrix L L^T (Cholesky); None if it is not positive definite.
fn lower_root(s: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let count = s.nrows();
    let mut root = DMatrix::zeros(count, count);
    for j in 0..count {
        for i in j..count {
            let left = (0..j).fold(s[(i, j)], |left, k| left - root[(i, k)] * root[(j, k)]);
            root[(i, j)] = if i > j { left / root[(j, j)] } else { left.sqrt() };
        }
        let pivot = root[(j, j)];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
    }
    Some(root)
}
