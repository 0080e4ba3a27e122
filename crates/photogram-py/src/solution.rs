//! What all solutions tell, as Python sees it.

use numpy::{PyArray1, PyArray2};
use photocore::adjustment::{Adjustment, Iteration, Observed, Status};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::table;

/// Number, weighted sum of squares, largest change in standard deviations, damping.
pub type IterationRow = (usize, f64, f64, f64);

/// One iteration as Python sees it.
pub fn iteration_row(iteration: &Iteration) -> IterationRow {
    (iteration.number, iteration.sum_of_squares, iteration.largest_change, iteration.damping)
}

/// How an adjustment ended, as Python says it.
pub fn status_name(status: Status) -> &'static str {
    match status {
        Status::Converged => "converged",
        Status::NotConverged => "not converged",
        Status::Diverged => "diverged",
    }
}

/// Predicted multiply-adds of a factorisation in each ordering that was tried.
pub fn predictions<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (ordering, operations) in &adjustment.predictions {
        dict.set_item(ordering.name(), operations)?;
    }
    Ok(dict)
}

/// Predicted multiply-adds of each phase.
pub fn operations<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let operations = adjustment.operations;
    let dict = PyDict::new(py);
    dict.set_item("reduction", operations.reduction)?;
    dict.set_item("factor", operations.factor)?;
    dict.set_item("inverse", operations.inverse)?;
    Ok(dict)
}

/// Seconds spent in each phase.
pub fn seconds<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let seconds = adjustment.seconds;
    let dict = PyDict::new(py);
    dict.set_item("form", seconds.form)?;
    dict.set_item("factor", seconds.factor)?;
    dict.set_item("solve", seconds.solve)?;
    dict.set_item("invert", seconds.invert)?;
    dict.set_item("cofactors", seconds.cofactors)?;
    Ok(dict)
}

/// Two numbers of every image as an (m, 2) array; NaN for images that were left out.
pub fn image_table<'py>(
    py: Python<'py>,
    images: &[Option<Observed<2>>],
    part: impl Fn(&Observed<2>) -> [f64; 2],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let missing = [f64::NAN; 2];
    table(py, images.iter().map(|image| image.as_ref().map_or(missing, &part)).collect())
}

/// By how much a loss has changed the weight of every image, (m,); NaN for images that were left out.
pub fn image_weights<'py>(py: Python<'py>, images: &[Option<Observed<2>>]) -> Bound<'py, PyArray1<f64>> {
    let weights = images.iter().map(|image| image.map_or(f64::NAN, |image| image.weight));
    PyArray1::from_vec(py, weights.collect())
}
