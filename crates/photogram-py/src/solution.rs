//! Results common to all solutions.

use photocore::adjustment::{Adjustment, Iteration, Status};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Number, weighted sum of squares, largest change in standard deviations, damping.
pub type IterationRow = (usize, f64, f64, f64);

/// Converts an iteration to a row.
pub fn iteration_row(iteration: &Iteration) -> IterationRow {
    (iteration.number, iteration.sum_of_squares, iteration.largest_change, iteration.damping)
}

/// Returns the name of a status.
pub fn status_name(status: Status) -> &'static str {
    match status {
        Status::Converged => "converged",
        Status::NotConverged => "not converged",
        Status::Diverged => "diverged",
    }
}

/// Returns the predicted multiply-adds of a factorization for each tried ordering; NaN if the network is too large for the ordering.
pub fn predictions<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (ordering, operations) in &adjustment.effort.predictions {
        dict.set_item(ordering.name(), operations.unwrap_or(f64::NAN))?;
    }
    Ok(dict)
}

/// Returns the predicted multiply-adds of each phase.
pub fn operations<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let operations = adjustment.effort.operations;
    let dict = PyDict::new(py);
    dict.set_item("reduction", operations.reduction)?;
    dict.set_item("factor", operations.factor)?;
    dict.set_item("inverse", operations.inverse)?;
    Ok(dict)
}

/// Returns the seconds spent in each phase.
pub fn seconds<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let seconds = adjustment.effort.seconds;
    let dict = PyDict::new(py);
    dict.set_item("form", seconds.form)?;
    dict.set_item("factor", seconds.factor)?;
    dict.set_item("solve", seconds.solve)?;
    dict.set_item("invert", seconds.invert)?;
    dict.set_item("cofactors", seconds.cofactors)?;
    Ok(dict)
}
