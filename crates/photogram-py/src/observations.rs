//! Additional observations: input rows by type, and their results.

use nalgebra::DMatrix;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use photocore::network::observations::Named;
use photocore::network::{AdjustedObservation, Observation};
use pyo3::prelude::*;

use crate::arrays::{Array, Indices, InputError};

/// Observations of one type: name, indices of points (n, p), photos (n, q) and shared parameters (n, c; -1 for none), values (n, v),
/// covariance matrices (n, r, r).
pub type Group<'py> = (String, Indices<'py>, Indices<'py>, Indices<'py>, Array<'py>, Array<'py>);

/// Returns the observations of all groups in sequence.
pub fn observations(groups: &[Group<'_>]) -> PyResult<Vec<Observation>> {
    let mut all = Vec::new();
    for (kind, points, photos, commons, values, covariances) in groups {
        let refused = || InputError::new_err(format!("observations of the kind {kind} have other arrays"));
        let &[n, rows, columns] = covariances.shape() else { return Err(refused()) };
        let lengths = [points.shape(), photos.shape(), commons.shape(), values.shape()];
        if lengths.iter().any(|shape| shape.len() != 2 || shape[0] != n) || rows != columns || rows == 0 {
            return Err(refused());
        }
        let listed = |array: &Indices<'_>| array.as_array().iter().copied().collect::<Vec<i64>>();
        let index = |&i: &i64| usize::try_from(i).ok();
        let whole = |array: &Indices<'_>| listed(array).iter().map(index).collect::<Option<Vec<usize>>>();
        let (of_points, of_photos) = (whole(points).ok_or_else(refused)?, whole(photos).ok_or_else(refused)?);
        let of_commons: Vec<Option<usize>> = listed(commons).iter().map(index).collect();
        let values_of: Vec<f64> = values.as_array().iter().copied().collect();
        let covariances: Vec<f64> = covariances.as_array().iter().copied().collect();
        for row in 0..n {
            let named = Named {
                points: own(&of_points, points.shape(), row),
                photos: own(&of_photos, photos.shape(), row),
                commons: own(&of_commons, commons.shape(), row),
            };
            let covariance =
                DMatrix::from_row_slice(rows, rows, &covariances[row * rows * rows..][..rows * rows]);
            let values = own(&values_of, values.shape(), row);
            all.push(Observation::from_numbers(kind, &named, values, covariance).ok_or_else(refused)?);
        }
    }
    Ok(all)
}

/// Returns one row of a matrix.
fn own<'a, T>(all: &'a [T], shape: &[usize], row: usize) -> &'a [T] {
    &all[row * shape[1]..][..shape[1]]
}

/// Number of components of each observation, zero for excluded ones; residuals, redundancy numbers and standardized residuals of all
/// components (3, rows); weighted squares and weights (2, observations).
pub type Adjusted = (Py<PyArray1<i64>>, Py<PyArray2<f64>>, Py<PyArray2<f64>>);

/// Converts adjusted observations to arrays.
pub fn adjusted(py: Python<'_>, all: &[Option<AdjustedObservation>]) -> PyResult<Adjusted> {
    let count = |own: &Option<AdjustedObservation>| own.as_ref().map_or(0, |own| own.residual.len());
    let counts: Vec<usize> = all.iter().map(count).collect();
    let rows = counts.iter().sum();
    let column = |of: fn(&AdjustedObservation) -> &[f64]| all.iter().flatten().flat_map(of).copied();
    let values = column(|own| &own.residual);
    let values = values.chain(column(|own| &own.redundancy)).chain(column(|own| &own.standardized));
    let single =
        |of: fn(&AdjustedObservation) -> f64| all.iter().map(move |own| own.as_ref().map_or(f64::NAN, of));
    let sums = single(|own| own.square).chain(single(|own| own.weight));
    Ok((
        PyArray1::from_iter(py, counts.iter().map(|&own| own as i64)).unbind(),
        PyArray1::from_vec(py, values.collect()).reshape([3, rows])?.unbind(),
        PyArray1::from_vec(py, sums.collect()).reshape([2, all.len()])?.unbind(),
    ))
}
