//! Block of the core: adjustment, transformation to other datums, covariances.

use numpy::PyArray1;
use photocore::Threads;
use photocore::adjustment::DatumError;
use photocore::network::{Network, NetworkDatum, NetworkError as Failure, Options, Solution};
use photogram_parts::{AdjustedInParts, DatumColumns, UnknownName};
use pyo3::prelude::*;

use super::covariances::{BlockCovariances, factored, refused};
use super::node::{BlockRow, Node};
use super::solution::BlockSolution;
use super::state::{BlockState, DatumRow, datum_of};
use super::tables::SolutionColumns;
use super::trial::{NetworkTrial, tried};
use crate::adjustment::unknown;
use crate::arrays::{Array, Indices, Vector, indices, numbers};
use crate::work::{Workers, supervised};

/// Block with the options of its adjustment.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockNetwork {
    pub network: Network,
    pub options: Options,
    /// Number of photos that are trajectory records: the last photos, with the last camera.
    pub records: usize,
}

impl BlockNetwork {
    /// Converts a solution to columns without trajectory records.
    fn columns(&self, solution: Solution, pool: &Threads) -> SolutionColumns {
        SolutionColumns::without_records(solution, self.records, pool)
    }
}

#[pymethods]
impl BlockNetwork {
    #[pyo3(signature = (*, datum, threads, progress, start = None, keep = None))]
    fn adjust(
        &self,
        py: Python<'_>,
        datum: Option<DatumRow>,
        threads: usize,
        progress: Option<Py<PyAny>>,
        start: Option<PyRef<'_, BlockState>>,
        keep: Option<Vec<usize>>,
    ) -> PyResult<Py<BlockSolution>> {
        let workers = Workers::of(threads, self.network.images.len());
        let inner = datum.map(datum_of).transpose()?;
        let start = start.map(|start| start.state.clone());
        let columns = supervised(py, workers, progress, |context| {
            let adjustment = self.network.adjustment(&self.options);
            let adjustment = match (&inner, &start, &keep) {
                (Some(NetworkDatum::Inner(inner)), ..) => adjustment.in_datum(inner),
                (_, Some(start), _) => adjustment.from_state(start),
                (_, _, Some(points)) => adjustment.kept(points),
                _ => adjustment,
            };
            adjustment.run_in(context).map(|solution| self.columns(solution, context.threads))
        })?;
        BlockSolution::new(py, columns.map_err(|error| refused(&error))?)
    }

    #[pyo3(signature = (state, datum, *, threads, progress))]
    fn in_datum(
        &self,
        py: Python<'_>,
        state: &BlockState,
        datum: DatumRow,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Py<BlockSolution>> {
        let workers = Workers::of(threads, self.network.images.len());
        let datum = datum_of(datum)?;
        let columns = supervised(py, workers, progress, |context| {
            let solution = self.network.in_datum(&self.options, &state.state, &datum, context);
            solution.map(|solution| self.columns(solution, context.threads))
        })?;
        BlockSolution::new(py, columns.map_err(|error| refused(&error))?)
    }

    #[pyo3(signature = (state, *, threads, progress))]
    fn covariances(
        &self,
        py: Python<'_>,
        state: &BlockState,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<BlockCovariances> {
        factored(py, (&self.network, &self.options), refused, state, threads, progress)
    }

    #[pyo3(signature = (state, *, threads, kept = false))]
    fn trial(
        &self,
        py: Python<'_>,
        state: Option<PyRef<'_, BlockState>>,
        threads: usize,
        kept: bool,
    ) -> PyResult<NetworkTrial> {
        tried(py, (&self.network, &self.options, self.records), refused, state, threads, kept)
    }

    #[pyo3(signature = (state, *, threads))]
    fn resistance(
        &self,
        py: Python<'_>,
        state: &BlockState,
        threads: usize,
    ) -> PyResult<Vec<(&'static str, f64)>> {
        let workers = Workers::of(threads, self.network.images.len());
        let found = supervised(py, workers, None, |context| {
            self.network.resistance(&self.options, &state.state, context.threads)
        })?;
        found.map_err(|error| refused(&error))
    }

    #[pyo3(signature = (*, threads))]
    fn held_for_datum(&self, py: Python<'_>, threads: usize) -> PyResult<Vec<(usize, usize)>> {
        let workers = Workers::of(threads, self.network.images.len());
        let held = supervised(py, workers, None, |context| {
            photogram_parts::held_for_datum(&self.network, &self.options, context.threads)
        })?;
        held.map_err(|error| refused(&error))
    }

    #[pyo3(signature = (datum, held, *, middle, names, values, threads))]
    fn parts_in_datum<'py>(
        &self,
        py: Python<'py>,
        datum: DatumRow,
        held: Vec<(usize, usize)>,
        middle: Option<[f64; 3]>,
        names: Indices<'py>,
        values: Array<'py>,
        threads: usize,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>, f64, bool)> {
        let NetworkDatum::Inner(inner) = datum_of(datum)? else { return Err(unknown("datum", "relative")) };
        let names: Vec<UnknownName> = indices("names", &names)?.as_chunks().0.to_vec();
        let values = numbers("values", &values)?;
        let workers = Workers::of(threads, self.network.images.len());
        let found = supervised(py, workers, None, |context| {
            let adjusted = AdjustedInParts { middle, held: &held, names: &names, values: &values };
            photogram_parts::parts_in_datum(&self.network, &self.options, &inner, adjusted, context.threads)
        })?;
        let (moved, DatumColumns { b, t, condition, exact }) = found.map_err(|error| refused(&error))?;
        let [moved, b, t] = [moved, b, t].map(|column| PyArray1::from_vec(py, column));
        Ok((moved, b, t, condition, exact))
    }

    #[pyo3(signature = (outer, children, *, middle, threads, held = vec![]))]
    fn node(
        &self,
        py: Python<'_>,
        outer: Vec<BlockRow>,
        children: Vec<Vec<BlockRow>>,
        middle: Option<[f64; 3]>,
        threads: usize,
        held: Vec<(usize, usize)>,
    ) -> PyResult<Node> {
        let own = (&self.network, &self.options, self.records);
        Node::new(py, own, (outer, children), middle, held, threads)
    }
}

/// Returns whether an error reports that the network has a datum already.
pub fn has_datum(error: &Failure) -> bool {
    matches!(error, Failure::Datum(DatumError::NotFree))
}
