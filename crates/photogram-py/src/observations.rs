//! Observations beside images: rows of one kind from Python, and what has become of them.

use nalgebra::DMatrix;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use photocore::geometry::{Matrix3, Pose, Vector3};
use photocore::network::observations::{
    Attitude, Control, Difference, Distance, EqualHeight, Position, Relative,
};
use photocore::network::{AdjustedObservation, Observation, Precision};
use pyo3::prelude::*;

use crate::arrays::InputError;

/// Observations of one kind: its name, indices of points or photos (n, k), values (n, v), covariance matrices (n, r, r).
pub type Group<'py> =
    (String, PyReadonlyArrayDyn<'py, i64>, PyReadonlyArrayDyn<'py, f64>, PyReadonlyArrayDyn<'py, f64>);

/// The observations of all groups, one group after the other.
pub fn observations(groups: &[Group<'_>]) -> PyResult<Vec<Observation>> {
    let mut all = Vec::new();
    for (kind, indices, values, covariances) in groups {
        let refused = || InputError::new_err(format!("observations of the kind {kind} have other arrays"));
        let (&[n, touched], &[m, given]) = (indices.shape(), values.shape()) else { return Err(refused()) };
        let &[o, rows, columns] = covariances.shape() else { return Err(refused()) };
        if [m, o] != [n, n] || rows != columns || touched * given * rows == 0 {
            return Err(refused());
        }
        let indices: Result<Vec<usize>, _> = indices.as_array().iter().map(|&i| usize::try_from(i)).collect();
        let indices = indices.map_err(|_| refused())?;
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        let covariances: Vec<f64> = covariances.as_array().iter().copied().collect();
        let each = indices.chunks_exact(touched).zip(values.chunks_exact(given));
        for ((indices, values), covariance) in each.zip(covariances.chunks_exact(rows * rows)) {
            let covariance = DMatrix::from_row_slice(rows, rows, covariance);
            all.push(observation(kind, indices, values, covariance).ok_or_else(refused)?);
        }
    }
    Ok(all)
}

/// An observation of a kind; None where there is no such kind, or it has other numbers of indices and values.
fn observation(kind: &str, of: &[usize], values: &[f64], covariance: DMatrix<f64>) -> Option<Observation> {
    let first = |at: usize| -> Option<[f64; 3]> { values.get(at..at + 3)?.try_into().ok() };
    let sd = covariance[(0, 0)].sqrt();
    Some(match (kind, of, values.len()) {
        ("distance", &[p, q], 1) => Distance { points: [p, q], length: values[0], sd }.into(),
        ("equal height", &[p, q], 1) => EqualHeight { points: [p, q], difference: values[0], sd }.into(),
        ("difference", &[p, q], 3) => {
            let components = first(0)?.map(|value| (!value.is_nan()).then_some(value));
            let seen: Vec<usize> = (0..3).filter(|&k| components[k].is_some()).collect();
            let covariance = covariance.select_rows(&seen).select_columns(&seen);
            Difference { points: [p, q], components, precision: Precision::Covariance(covariance) }.into()
        }
        ("control", &[point], 3) => {
            Control { point, coordinates: first(0)?, precision: Precision::Covariance(covariance) }.into()
        }
        ("position", &[photo], 6) => {
            let (coordinates, lever_arm) = (first(0)?, first(3)?.into());
            Position { photo, coordinates, lever_arm, precision: Precision::Covariance(covariance) }.into()
        }
        ("attitude", &[photo], 18) => {
            let (attitude, boresight) =
                (Matrix3::from_row_slice(&values[..9]), Matrix3::from_row_slice(&values[9..]));
            Attitude { photo, attitude, boresight, precision: Precision::Covariance(covariance) }.into()
        }
        ("relative", &[i, j], 12) => {
            let position = Vector3::from(first(0)?);
            let pose = Pose { position, attitude: Matrix3::from_row_slice(&values[3..]) };
            Relative { photos: [i, j], pose, precision: Precision::Covariance(covariance) }.into()
        }
        _ => return None,
    })
}

/// Residuals, redundancy numbers, standardized residuals, weighted square and weight.
pub type AdjustedRow = (Vec<f64>, Vec<f64>, Vec<f64>, f64, f64);

/// What has become of an observation, for Python.
pub fn adjusted_row(observation: &AdjustedObservation) -> AdjustedRow {
    let AdjustedObservation { residual, redundancy, standardized, square, weight } = observation.clone();
    (residual, redundancy, standardized, square, weight)
}
