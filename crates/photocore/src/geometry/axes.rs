//! Vectors and matrices in cartesian axes, and what `nalgebra` finds of small matrices: compiled for one size, not for each.

use crate::sorting::order;
use nalgebra::{DMatrix, SMatrix};

/// Three components in cartesian axes.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A matrix in cartesian axes.
pub type Matrix3 = nalgebra::Matrix3<f64>;

/// Sweeps of an eigenvalue decomposition at the most.
const SWEEPS: usize = 1000;

/// Eigenvalues of a symmetric matrix, the largest first, and its unit eigenvectors as columns; None where it is not finite.
pub(crate) fn principal_axes(matrix: &Matrix3) -> Option<(Vector3, Matrix3)> {
    if !matrix.iter().all(|element| element.is_finite()) {
        return None;
    }
    let eigen = dense(matrix).try_symmetric_eigen(f64::EPSILON, SWEEPS)?;
    let values = eigen.eigenvalues;
    let falling = order(3, &|a, b| values[b].total_cmp(&values[a]));
    let axes = Matrix3::from_fn(|row, column| eigen.eigenvectors[(row, falling[column])]);
    Some((Vector3::from_fn(|k, _| values[falling[k]]), axes))
}

/// The inverse of a small square matrix; None where there is none.
pub(crate) fn inverse<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    dense(matrix).try_inverse().map(|inverse| SMatrix::from_column_slice(inverse.as_slice()))
}

/// The same matrix, of a size that is no type.
fn dense<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> DMatrix<f64> {
    DMatrix::from_column_slice(R, C, matrix.as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_fall() {
        let matrix = Matrix3::new(2.0, -1.0, 0.5, -1.0, 7.0, 0.3, 0.5, 0.3, -4.0);
        let (values, axes) = principal_axes(&matrix).unwrap();
        assert!(values[0] > values[1] && values[1] > values[2]);
        assert!((matrix * axes - axes * Matrix3::from_diagonal(&values)).norm() < 1e-13);
        assert!(principal_axes(&Matrix3::repeat(f64::NAN)).is_none());
    }
}
