//! Options that Python gives by name.

use photocore::adjustment::Loss;
use photocore::normals::Ordering;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The ordering of the given name.
pub fn named_ordering(name: &str) -> PyResult<Ordering> {
    Ordering::named(name).ok_or_else(|| unknown("ordering", name))
}

/// The loss of the given name and scale.
pub fn named_loss(loss: Option<(&str, f64)>) -> PyResult<Option<Loss>> {
    match loss {
        None => Ok(None),
        Some(("huber", scale)) => Ok(Some(Loss::Huber(scale))),
        Some(("cauchy", scale)) => Ok(Some(Loss::Cauchy(scale))),
        Some((other, _)) => Err(unknown("loss", other)),
    }
}

/// An option that has no such choice.
pub fn unknown(option: &str, value: &str) -> PyErr {
    PyValueError::new_err(format!("{option} cannot be {value:?}"))
}
