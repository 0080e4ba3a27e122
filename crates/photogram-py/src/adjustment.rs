//! Options, steps and results common to all adjustments; the documentation is in `_photocore.pyi`.

use std::collections::BTreeMap;

use photocore::Iteration;
use photocore::adjustment::{Adjustment, History, Loss, PhaseTimes, Status};
use photocore::normals::Ordering;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

/// Returns the ordering of a name.
pub fn named_ordering(name: &str) -> PyResult<Ordering> {
    Ordering::named(name).ok_or_else(|| unknown("ordering", name))
}

/// Returns the loss of a name and scale.
pub fn named_loss(loss: Option<(&str, f64)>) -> PyResult<Option<Loss>> {
    match loss {
        None => Ok(None),
        Some(("huber", scale)) => Ok(Some(Loss::Huber(scale))),
        Some(("cauchy", scale)) => Ok(Some(Loss::Cauchy(scale))),
        Some((other, _)) => Err(unknown("loss", other)),
    }
}

/// Returns the error for an unknown choice of an option.
pub fn unknown(option: &str, value: &str) -> PyErr {
    PyValueError::new_err(format!("{option} cannot be {value:?}"))
}

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
    let PhaseTimes { form, factor, solve, invert, cofactors } = adjustment.effort.seconds;
    let phases =
        [("form", form), ("factor", factor), ("solve", solve), ("invert", invert), ("cofactors", cofactors)];
    phases.into_py_dict(py)
}

/// Step rules for partitioned adjustments.
#[pyfunction]
pub fn step_rules() -> BTreeMap<&'static str, f64> {
    let mut rules = BTreeMap::from(photocore::adjustment::step_rules());
    rules.insert("least_redundancy", photocore::network::LEAST_REDUNDANCY);
    rules
}

/// Classifies a full step by its length and by the damping and lengths of previous steps.
#[pyfunction]
#[pyo3(signature = (taken, change, *, chord, unknowns, tolerance))]
pub fn judge_full_step(
    taken: Vec<(f64, f64)>,
    change: f64,
    chord: Option<f64>,
    unknowns: usize,
    tolerance: f64,
) -> &'static str {
    let row = |(number, (damping, largest_change))| Iteration {
        number,
        sum_of_squares: f64::NAN,
        largest_change,
        damping,
    };
    let iterations: Vec<Iteration> = taken.into_iter().enumerate().map(row).collect();
    let history = History { iterations: &iterations, chord, unknowns };
    if change <= tolerance || history.leaves_less_than(tolerance, change) {
        "last"
    } else if history.falls_no_more(change) {
        "rests"
    } else if history.is_for_chord(change) {
        "before a chord"
    } else {
        "one of many"
    }
}

#[pyfunction]
pub fn is_chord(chord: f64, change: f64) -> bool {
    History::is_chord(chord, change)
}
