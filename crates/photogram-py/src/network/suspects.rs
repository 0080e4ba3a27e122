//! Test groups of the observations of a network.

use std::sync::Arc;

use crate::arrays::Vector;
use numpy::PyArray1;
use photocore::network::TestGroups;
use pyo3::prelude::*;

/// Groups of observations that are tested together.
#[pyclass(module = "photogram._photocore", frozen)]
pub struct NetworkSuspects(pub(super) Arc<TestGroups>);

#[pymethods]
impl NetworkSuspects {
    #[getter]
    fn subjects<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<i64>>) {
        let ids = self.0.ids().iter();
        let kinds = ids.clone().map(|id| id.kind as u8);
        (PyArray1::from_iter(py, kinds), PyArray1::from_iter(py, ids.map(|id| i64::from(id.index))))
    }

    #[getter]
    fn row_starts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let starts = self.0.row_starts().iter().map(|&start| start as i64);
        PyArray1::from_vec(py, starts.collect())
    }

    #[getter]
    fn components<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_iter(py, self.0.components().iter().map(|&component| i64::from(component)))
    }

    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> Vector<'py> {
        PyArray1::from_slice(py, self.0.deviations())
    }
}
