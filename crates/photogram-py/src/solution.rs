//! Results common to all solutions.

use photocore::adjustment::{Adjustment, Iteration, Seconds, Status};
use photocore::normals::Ordering;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

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
    let predictions = adjustment.effort.predictions.iter();
    let row =
        |(ordering, operations): &(Ordering, Option<f64>)| (ordering.name(), operations.unwrap_or(f64::NAN));
    predictions.map(row).into_py_dict(py)
}

/// Returns the predicted multiply-adds of each phase.
pub fn operations<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let operations = adjustment.effort.operations;
    let phases =
        [("reduction", operations.reduction), ("factor", operations.factor), ("inverse", operations.inverse)];
    phases.into_py_dict(py)
}

/// Returns the seconds spent in each phase.
pub fn seconds<'py>(py: Python<'py>, adjustment: &Adjustment) -> PyResult<Bound<'py, PyDict>> {
    let Seconds { form, factor, solve, invert, cofactors } = adjustment.effort.seconds;
    let phases =
        [("form", form), ("factor", factor), ("solve", solve), ("invert", invert), ("cofactors", cofactors)];
    phases.into_py_dict(py)
}
