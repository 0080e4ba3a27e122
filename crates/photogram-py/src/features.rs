//! Features through points; the documentation is in `_photocore.pyi`.

use nalgebra::DMatrix;
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use photocore::geometry::Vector3;
use photogram_programs::features::{Form, Measured, distance, measure};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, InputError, Matrix, Vector, rows, table};

/// Names and whether they are lengths, values, covariance, deviations, test.
type FeatureRow<'py> =
    (Vec<(&'static str, bool)>, Vector<'py>, Matrix<'py>, Matrix<'py>, Option<(f64, usize)>);

#[pyfunction]
pub fn measured_feature<'py>(
    py: Python<'py>,
    kind: &str,
    points: Array<'py>,
    covariance: Array<'py>,
) -> PyResult<FeatureRow<'py>> {
    let points: Vec<Vector3> = rows("points", &points)?.into_iter().map(<Vector3>::from).collect();
    let covariance = match covariance.shape() {
        // The matrix is symmetric, so that row and column order are equivalent.
        &[n, m] => DMatrix::from_iterator(n, m, covariance.as_array().iter().copied()),
        _ => return Err(PyValueError::new_err("the covariance is no matrix")),
    };
    let found = py.detach(|| match (kind, points.as_slice()) {
        ("distance", &[from, to]) => Some(distance(&[from, to], &covariance)),
        _ => Form::named(kind).map(|form| measure(form, &points, &covariance)),
    });
    match found {
        None => Err(PyValueError::new_err(format!("there is no {kind} of {} points", points.len()))),
        Some(found) => row(py, found.map_err(|error| InputError::new_err(error.to_string()))?),
    }
}

fn row(py: Python<'_>, found: Measured) -> PyResult<FeatureRow<'_>> {
    let Measured { quantities, covariance, deviations, test } = found;
    let names = quantities.iter().map(|each| (each.name, each.is_length)).collect();
    let values = PyArray1::from_vec(py, quantities.iter().map(|each| each.value).collect());
    let (n, m) = covariance.shape();
    let covariance = PyArray1::from_slice(py, covariance.as_slice()).reshape([n, m])?;
    let deviations = deviations.iter().map(|each| [each.value, each.sd, each.axial, each.axial_sd]).collect();
    Ok((names, values, covariance, table(py, deviations)?, test.map(|test| (test.statistic, test.freedom))))
}
