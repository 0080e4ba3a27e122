//! Options that are selected by name.

use photocore::adjustment::Loss;
use photocore::normals::Ordering;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

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
