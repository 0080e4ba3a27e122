//! Covariances of an adjusted network.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use photocore::adjustment::{GroupSquares, Probing};
use photocore::network::{Covariances, Groups, Network, NetworkError as Failure, Of, Options};
use pyo3::prelude::*;

use super::state::BlockState;
use super::suspects::NetworkSuspects;
use super::{BlockError, failure};
use crate::adjustment::unknown;
use crate::arrays::{Array, Blocks, Indices, Matrix, Vector, group_rows, matrix};
use crate::work::{Workers, supervised};

/// Covariances of an adjusted block, from one factor.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockCovariances {
    pub(super) covariances: Covariances,
    images: usize,
    refused: Refused,
}

/// Conversion of an error to an exception for a block or a collection.
pub(super) type Refused = fn(&Failure) -> PyErr;

/// Type and index of an object with cofactors.
pub(super) type OfRow = (String, usize);

pub(super) fn of_rows(rows: Vec<OfRow>) -> PyResult<Vec<Of>> {
    let of = |(kind, index): OfRow| match kind.as_str() {
        "photo" => Ok(Of::Photo(index)),
        "step" => Ok(Of::PhotoStep(index)),
        "point" => Ok(Of::Point(index)),
        "camera" => Ok(Of::Camera(index)),
        "unknown" => Ok(Of::Common(index)),
        other => Err(unknown("kind", other)),
    };
    rows.into_iter().map(of).collect()
}

/// Factors the normal equations of a network at the end of its adjustment.
pub fn factored(
    py: Python<'_>,
    (network, options): (&Network, &Options),
    refused: Refused,
    state: &BlockState,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<BlockCovariances> {
    let images = network.images.len();
    let found = supervised(py, Workers::of(threads, images), progress, |context| {
        network.covariances(options, &state.state, None, context)
    })?;
    found
        .map(|covariances| BlockCovariances { covariances, images, refused })
        .map_err(|error| refused(&error))
}

/// Converts an error of a block to an exception.
pub fn refused(error: &Failure) -> PyErr {
    BlockError::new_err(failure(error, "block"))
}

#[pymethods]
impl BlockCovariances {
    fn suspects(&self, py: Python<'_>) -> NetworkSuspects {
        py.detach(|| NetworkSuspects(self.covariances.groups().clone()))
    }

    fn influences<'py>(
        &self,
        py: Python<'py>,
        partials: PyReadonlyArray2<'_, f64>,
        of: Vec<OfRow>,
    ) -> PyResult<Matrix<'py>> {
        let count = partials.as_array().nrows();
        let partials: Vec<f64> = partials.as_array().iter().copied().collect();
        let of = of_rows(of)?;
        let found = supervised(py, Workers::of(0, self.images), None, |context| {
            self.covariances.influences(&partials, &of, context.threads)
        })?;
        let influences = found.map_err(|error| (self.refused)(&error))?;
        let rows = influences.len() / count.max(1);
        PyArray1::from_vec(py, influences).reshape([count, rows])
    }

    #[pyo3(signature = (rows, columns, *, threads, progress))]
    fn cofactors<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<OfRow>,
        columns: Option<Vec<OfRow>>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Matrix<'py>> {
        let (rows, columns) = (of_rows(rows)?, columns.map(of_rows).transpose()?);
        let found = supervised(py, Workers::of(threads, self.images), progress, |context| {
            self.covariances.cofactors(&rows, columns.as_deref(), context)
        })?;
        matrix(py, found.map_err(|error| (self.refused)(&error))?, columns.is_none())
    }

    #[pyo3(signature = (partials, of, *, threads, progress))]
    fn propagate<'py>(
        &self,
        py: Python<'py>,
        partials: Array<'_>,
        of: Vec<OfRow>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Matrix<'py>> {
        let of = of_rows(of)?;
        let partials: Vec<f64> = partials.as_array().iter().copied().collect();
        let found = supervised(py, Workers::of(threads, self.images), progress, |context| {
            self.covariances.propagate(&partials, &of, context)
        })?;
        matrix(py, found.map_err(|error| (self.refused)(&error))?, true)
    }

    #[pyo3(signature = (groups, *, classes, exact, vectors, seed, threads, progress))]
    fn group_squares<'py>(
        &self,
        py: Python<'py>,
        groups: GroupsRow<'py>,
        classes: Option<usize>,
        exact: usize,
        vectors: usize,
        seed: u64,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<SquaresRow<'py>> {
        let groups = groups_of(groups)?;
        let probing = Probing { exact, vectors, seed };
        let workers = Workers::of(threads, self.images);
        let found = supervised(py, workers, progress, |context| match classes {
            None => self.covariances.group_squares(&groups, &probing, context),
            Some(classes) => {
                let squares = self.covariances.own_squares(&groups, classes, &probing, context)?;
                Ok(GroupSquares { equations: vec![], squares, exact: vec![] })
            }
        })?;
        let GroupSquares { equations, squares, exact } = found.map_err(|error| (self.refused)(&error))?;
        Ok((equations, PyArray1::from_vec(py, squares), exact))
    }

    #[pyo3(signature = (columns, *, threads, progress))]
    fn project_images<'py>(
        &self,
        py: Python<'py>,
        columns: Array<'_>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Blocks<'py>> {
        let count = columns.as_array().shape().first().copied().unwrap_or(0);
        let columns: Vec<f64> = columns.as_array().iter().copied().collect();
        let found = supervised(py, Workers::of(threads, self.images), progress, |context| {
            self.covariances.project_images(&columns, context)
        })?;
        let found = found.map_err(|error| (self.refused)(&error))?;
        PyArray1::from_vec(py, found).reshape([count, self.images, 2])
    }
}

/// Number of groups, and the group of each image coordinate, point component, pose unknown, camera, shared parameter and other observation;
/// -1 for none.
type GroupsRow<'py> = (usize, Indices<'py>, Indices<'py>, Indices<'py>, Vec<i64>, Vec<i64>, Vec<i64>);

/// Number of equations of each group, sums of squares, and whether each column is exact.
type SquaresRow<'py> = (Vec<usize>, Vector<'py>, Vec<bool>);

fn groups_of(
    (count, images, points, photos, cameras, commons, observations): GroupsRow<'_>,
) -> PyResult<Groups> {
    let number = |group: i64| usize::try_from(group).unwrap_or(usize::MAX);
    let all = |groups: Vec<i64>| groups.into_iter().map(number).collect();
    Ok(Groups {
        count,
        images: group_rows("images", &images)?,
        points: group_rows("points", &points)?,
        photos: group_rows("photos", &photos)?,
        cameras: all(cameras),
        commons: all(commons),
        observations: all(observations),
    })
}
