//! Node of the elimination tree of a partitioned block adjustment; the documentation is in `_photocore.pyi`.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use photocore::Context;
use photocore::network::{BlockId, Interface, Network, NetworkError as Failure, Options};
use photocore::normals::Contribution;
use photogram_parts::{DatumOfPart, FormedNode as Formed, Node as Core};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use super::covariances::refused;
use super::solution::BlockSolution;
use super::tables::SolutionColumns;
use super::{FailureRow, failure};
use crate::adjustment::unknown;
use crate::arrays::{Array, InputError, Vector, numbers};
use crate::work::{Workers, supervised};

/// Matrix, right-hand side and diagonal of the Schur complement of a node.
type ContributionRow<'py> = (Array<'py>, Array<'py>, Array<'py>);

/// T, W and B^T W, the last step, the condition of B^T G, and fixed unknowns: see `FormedNode.invert`.
type TransformationRow<'py> = (Array<'py>, Array<'py>, Array<'py>, Array<'py>, f64, Vec<usize>);

/// Type and index of the owner of a parameter block.
pub type BlockRow = (String, usize);

fn block_of((kind, index): BlockRow) -> PyResult<BlockId> {
    Ok(match kind.as_str() {
        "photo" => BlockId::Photo(index),
        "camera" => BlockId::Camera(index),
        "unknown" => BlockId::Common(index),
        "point" => BlockId::Point(index),
        other => return Err(unknown("kind of block", other)),
    })
}

/// Converts an error of a node to an exception: invalid arguments, or an error of the block.
fn failed(error: &Failure) -> PyErr {
    match error {
        Failure::NoBlock(_) | Failure::Node(_) | Failure::State | Failure::Layout(_) => {
            InputError::new_err(error.to_string())
        }
        error => refused(error),
    }
}

fn indices<'py>(py: Python<'py>, places: &[usize]) -> Bound<'py, PyArray1<i64>> {
    PyArray1::from_iter(py, places.iter().map(|&place| place as i64))
}

/// Returns the contiguous data of an array; large arrays are not copied.
fn slice<'a>(name: &str, array: &'a Array<'_>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(|_| InputError::new_err(format!("{name} must be contiguous")))
}

/// Node with ordered blocks.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct Node {
    node: Arc<Core>,
    /// Number of photos that are trajectory records: the last photos.
    records: usize,
}

#[pymethods]
impl Node {
    #[getter]
    fn size(&self) -> usize {
        self.node.size()
    }

    #[getter]
    fn outer<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        indices(py, self.node.outer())
    }

    #[getter]
    fn children<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<i64>>> {
        self.node.below().iter().map(|places| indices(py, places)).collect()
    }

    #[getter]
    fn unknown_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let names = self.node.names();
        let flat = names.iter().flatten().map(|&number| number as i64);
        PyArray1::from_iter(py, flat).reshape([names.len(), 3])
    }

    #[getter]
    fn counts(&self) -> (usize, usize, usize) {
        let counts = self.node.counts();
        (counts.observations, counts.weighted, counts.unknowns)
    }

    #[getter]
    fn converges_linearly(&self) -> bool {
        self.node.converges_linearly()
    }

    #[getter]
    fn dropped(&self) -> Vec<(usize, &'static str)> {
        self.node.dropped().iter().map(|dropped| (dropped.point, dropped.reason.code())).collect()
    }

    #[getter]
    fn initial<'py>(&self, py: Python<'py>) -> Vector<'py> {
        PyArray1::from_slice(py, self.node.initial())
    }

    fn prediction<'py>(&self, py: Python<'py>, threads: usize) -> PyResult<Bound<'py, PyDict>> {
        self.node.prediction(self.workers(threads).count()).into_py_dict(py)
    }

    fn advance<'py>(&self, py: Python<'py>, state: Array<'py>, step: Array<'py>) -> PyResult<Vector<'py>> {
        let (state, step) = (numbers("state", &state)?, numbers("step", &step)?);
        let reached = py.detach(|| self.node.advance(&state, &step));
        reached.map(|reached| PyArray1::from_vec(py, reached)).map_err(|error| failed(&error))
    }

    #[pyo3(signature = (state, *, threads))]
    fn relocate<'py>(&self, py: Python<'py>, state: Array<'py>, threads: usize) -> PyResult<Vector<'py>> {
        let state = numbers("state", &state)?;
        let moved = supervised(py, self.workers(threads), None, |context| {
            self.node.relocate(&state, context.threads)
        })?;
        moved.map(|moved| PyArray1::from_vec(py, moved)).map_err(|error| failed(&error))
    }

    #[pyo3(signature = (state, *, threads))]
    fn objective(
        &self,
        py: Python<'_>,
        state: Array<'_>,
        threads: usize,
    ) -> PyResult<(f64, f64, f64, f64, f64)> {
        let state = numbers("state", &state)?;
        let found = supervised(py, self.workers(threads), None, |context| {
            self.node.objective(&state, context.threads)
        })?;
        let (sums, minimised) = found.map_err(|error| failed(&error))?;
        Ok((sums.camera, sums.ground, sums.plates, sums.observations, minimised))
    }

    #[pyo3(signature = (state, contributions, *, damping, curved, threads))]
    fn form(
        &self,
        py: Python<'_>,
        state: Array<'_>,
        contributions: Vec<ContributionRow<'_>>,
        damping: f64,
        curved: bool,
        threads: usize,
    ) -> PyResult<FormedNode> {
        let state = numbers("state", &state)?;
        let mut given = Vec::with_capacity(contributions.len());
        for (matrix, right, diagonal) in &contributions {
            given.push(Contribution {
                matrix: Cow::Borrowed(slice("the matrix of a contribution", matrix)?),
                right: Cow::Borrowed(slice("the right-hand side of a contribution", right)?),
                diagonal: Cow::Borrowed(slice("the diagonal of a contribution", diagonal)?),
            });
        }
        let formed = supervised(py, self.workers(threads), None, |context| {
            let mut formed = self.node.form(&state, &given, (damping, curved), context)?;
            let contribution = formed.take_contribution();
            Ok((formed, contribution))
        })?;
        let (formed, contribution) = formed.map_err(|error: Failure| failed(&error))?;
        Ok(FormedNode {
            node: Arc::clone(&self.node),
            records: self.records,
            sum_of_squares: formed.sum_of_squares(),
            decrease: formed.decrease(),
            undetermined: self.node.undetermined(&formed).map(|error| failure(&error, "block")),
            contribution: Mutex::new(Some(contribution)),
            formed: Mutex::new(Some(formed)),
        })
    }

    #[pyo3(signature = (state, before, *, threads))]
    fn solution(
        &self,
        py: Python<'_>,
        state: Array<'_>,
        before: Array<'_>,
        threads: usize,
    ) -> PyResult<Py<BlockSolution>> {
        let (state, before) = (numbers("state", &state)?, numbers("before", &before)?);
        let columns = supervised(py, self.workers(threads), None, |context| {
            let solution = self.node.solution(&state, &before, context.threads)?;
            Ok(SolutionColumns::without_records(solution, self.records, context.threads))
        })?;
        BlockSolution::new(py, columns.map_err(|error: Failure| failed(&error))?)
    }
}

impl Node {
    /// Creates the node of a block in a larger network; its blocks are named for the nodes above and below.
    pub fn new(
        py: Python<'_>,
        (network, options, records): (&Network, &Options, usize),
        (outer, children): (Vec<BlockRow>, Vec<Vec<BlockRow>>),
        middle: Option<[f64; 3]>,
        held: Vec<(usize, usize)>,
        threads: usize,
    ) -> PyResult<Self> {
        let blocks = |rows: Vec<BlockRow>| rows.into_iter().map(block_of).collect::<PyResult<Vec<BlockId>>>();
        let below = children.into_iter().map(blocks).collect::<PyResult<_>>()?;
        let interface = Interface { outer: blocks(outer)?, below, middle, held };
        let workers = Workers::of(threads, network.images.len());
        let node =
            supervised(py, workers, None, |context| Core::new(network, options, interface, context.threads))?;
        node.map(|node| Self { node: Arc::new(node), records }).map_err(|error| failed(&error))
    }

    fn workers(&self, threads: usize) -> Workers {
        Workers::of(threads, self.node.images())
    }
}

/// Node at a state, with eliminated points and blocks.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct FormedNode {
    node: Arc<Core>,
    records: usize,
    sum_of_squares: f64,
    decrease: f64,
    undetermined: Option<FailureRow>,
    contribution: Mutex<Option<Contribution<'static>>>,
    /// None after the inversion.
    formed: Mutex<Option<Formed>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn used_up(what: &str) -> PyErr {
    PyValueError::new_err(format!("{what} of this node was taken before"))
}

impl FormedNode {
    /// Runs a query on the factor, which an inversion consumes.
    fn asked<T: Send>(
        &self,
        py: Python<'_>,
        threads: usize,
        ask: impl FnOnce(&mut Formed, &mut Context<'_>) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let workers = Workers::of(threads, self.node.images());
        let found = supervised(py, workers, None, |context| match &mut *lock(&self.formed) {
            Some(formed) => ask(formed, context).map(Some),
            None => Ok(None),
        })?;
        found.map_err(|error| failed(&error))?.ok_or_else(|| used_up("the factor"))
    }
}

#[pymethods]
impl FormedNode {
    #[getter]
    fn contribution<'py>(&self, py: Python<'py>) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>)> {
        let taken = lock(&self.contribution).take().ok_or_else(|| used_up("the contribution"))?;
        let [matrix, right, diagonal] = [taken.matrix, taken.right, taken.diagonal]
            .map(|values| PyArray1::from_vec(py, values.into_owned()));
        Ok((matrix, right, diagonal))
    }

    #[getter]
    fn sum_of_squares(&self) -> f64 {
        self.sum_of_squares
    }

    #[getter]
    fn decrease(&self) -> f64 {
        self.decrease
    }

    #[getter]
    fn undetermined(&self) -> Option<FailureRow> {
        self.undetermined.clone()
    }

    #[pyo3(signature = (outer, *, threads))]
    fn solve<'py>(&self, py: Python<'py>, outer: Array<'py>, threads: usize) -> PyResult<Vector<'py>> {
        let outer = numbers("outer", &outer)?;
        let step = self.asked(py, threads, |formed, context| self.node.solve(formed, &outer, context))?;
        Ok(PyArray1::from_vec(py, step))
    }

    #[getter]
    fn has_chord(&self) -> bool {
        lock(&self.formed).as_ref().is_some_and(Formed::has_chord)
    }

    #[pyo3(signature = (state, left, *, threads))]
    fn reduce_chord<'py>(
        &self,
        py: Python<'py>,
        state: Array<'py>,
        left: Vec<Array<'py>>,
        threads: usize,
    ) -> PyResult<Option<(Vector<'py>, f64)>> {
        let state = numbers("state", &state)?;
        let left =
            left.iter().map(|left| slice("what a child has left", left)).collect::<PyResult<Vec<_>>>()?;
        let found = self
            .asked(py, threads, |formed, context| self.node.reduce_chord(formed, &state, &left, context))?;
        Ok(found.map(|(left, decrease)| (PyArray1::from_vec(py, left), decrease)))
    }

    #[pyo3(signature = (rights, *, threads))]
    fn reduce<'py>(
        &self,
        py: Python<'py>,
        rights: Array<'py>,
        threads: usize,
    ) -> PyResult<(Vector<'py>, Vector<'py>)> {
        let rights = slice("rights", &rights)?.to_vec();
        let (left, products) =
            self.asked(py, threads, |formed, context| self.node.reduce_rights(formed, rights, context))?;
        Ok((PyArray1::from_vec(py, left), PyArray1::from_vec(py, products)))
    }

    #[pyo3(signature = (outer, *, threads))]
    fn complete<'py>(&self, py: Python<'py>, outer: Array<'py>, threads: usize) -> PyResult<Vector<'py>> {
        let outer = slice("outer", &outer)?;
        let found =
            self.asked(py, threads, |formed, context| self.node.solve_reduced(formed, outer, context))?;
        Ok(PyArray1::from_vec(py, found))
    }

    #[pyo3(signature = (outer, state, *, threads, datum = None))]
    fn invert<'py>(
        &self,
        py: Python<'py>,
        outer: Array<'py>,
        state: Array<'py>,
        threads: usize,
        datum: Option<TransformationRow<'py>>,
    ) -> PyResult<(Py<BlockSolution>, Vec<Vector<'py>>)> {
        let (given, state) = (slice("outer", &outer)?, numbers("state", &state)?);
        let datum = match &datum {
            Some((t, w, common, last, condition, staying)) => Some(DatumOfPart {
                t: slice("T", t)?,
                w: slice("W", w)?,
                common: slice("B^T W", common)?,
                last: slice("the last step", last)?,
                condition: *condition,
                staying,
            }),
            None => None,
        };
        let formed = lock(&self.formed).take().ok_or_else(|| used_up("the factor"))?;
        let workers = Workers::of(threads, self.node.images());
        let found = supervised(py, workers, None, |context| {
            let found = self.node.invert(formed, given, &state, datum, context);
            found.map(|(solution, below)| {
                (SolutionColumns::without_records(solution, self.records, context.threads), below)
            })
        })?;
        let (columns, below) = found.map_err(|error| failed(&error))?;
        let below = below.into_iter().map(|triangle| PyArray1::from_vec(py, triangle)).collect();
        Ok((BlockSolution::new(py, columns)?, below))
    }
}
