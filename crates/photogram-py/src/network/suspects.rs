//! Test groups of the observations of a network.

use std::sync::Arc;

use crate::arrays::Vector;
use numpy::PyArray1;
use photocore::network::{Subject, Suspects};
use pyo3::prelude::*;

/// Groups of observations that are tested together.
#[pyclass(module = "photogram._photocore", frozen)]
pub struct NetworkSuspects(pub(super) Arc<Suspects>);

/// Returns the number of the type, and the index.
pub(super) fn subject(subject: Subject) -> (u8, i64) {
    (subject.kind() as u8, subject.index() as i64)
}

#[pymethods]
impl NetworkSuspects {
    #[getter]
    fn subjects<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<i64>>) {
        let (kinds, indices): (Vec<u8>, Vec<i64>) = self.0.subjects().map(subject).unzip();
        (PyArray1::from_vec(py, kinds), PyArray1::from_vec(py, indices))
    }

    #[getter]
    fn row_starts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let starts = self.0.row_starts().iter().map(|&start| start as i64);
        PyArray1::from_vec(py, starts.collect())
    }

    #[getter]
    fn components<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.0.components().map(|component| component as i64).collect())
    }

    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> Vector<'py> {
        PyArray1::from_slice(py, self.0.deviations())
    }
}
