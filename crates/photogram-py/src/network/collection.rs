//! Input of a collection adjustment: every photo with its own camera, poses in vectors.

use photocore::adjustment::{Method, Options as AdjustmentOptions, Stop};
use photocore::geometry::camera::ModelFacts;
use photocore::geometry::{self, ObjectSpace, Orientation, Point as GroundPoint, PoseNumbers};
use photocore::network::{Camera, Network, NetworkError as Failure, Options, Photo, Start};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::covariances::{BlockCovariances, factored};
use super::solution::CollectionSolution;
use super::state::BlockState;
use super::tables::SolutionColumns;
use super::trial::{NetworkTrial, tried};
use super::{CollectionError, failure, images, points, said};
use crate::adjustment::{named_loss, named_ordering, unknown};
use crate::arrays::{Array, Indices, Matrix, check_lengths, rows, slices, table};
use crate::memory::LOADED;
use crate::work::{Workers, supervised};

/// Collection with the options of its adjustment.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct CollectionNetwork {
    network: Network,
    options: Options,
    /// Number of unknowns of a photo: its pose and its camera.
    unknowns: usize,
}

#[pymethods]
impl CollectionNetwork {
    #[pyo3(signature = (*, threads, progress, start = None))]
    fn adjust(
        &self,
        py: Python<'_>,
        threads: usize,
        progress: Option<Py<PyAny>>,
        start: Option<PyRef<'_, BlockState>>,
    ) -> PyResult<Py<CollectionSolution>> {
        let workers = Workers::of(threads, self.network.images.len());
        let start = start.map(|start| start.state.clone());
        let columns = supervised(py, workers, progress, |context| {
            let adjustment = self.network.adjustment(&self.options);
            let adjustment = match &start {
                None => adjustment,
                Some(start) => adjustment.from_state(start),
            };
            adjustment.run_in(context).map(|solution| SolutionColumns::new(solution, context.threads))
        })?;
        CollectionSolution::new(py, columns.map_err(|error| refused(&error))?, self.unknowns)
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

    #[pyo3(signature = (state, *, threads))]
    fn trial(
        &self,
        py: Python<'_>,
        state: Option<PyRef<'_, BlockState>>,
        threads: usize,
    ) -> PyResult<NetworkTrial> {
        tried(py, (&self.network, &self.options, 0), refused, state, threads, false)
    }
}

fn refused(error: &Failure) -> PyErr {
    match error {
        Failure::Index(_) => PyValueError::new_err(said(error, "collection")),
        error => CollectionError::new_err(failure(error, "collection")),
    }
}

/// Number of parameters of a pose in vectors.
const POSE: usize = 6;

/// Returns the description of a camera model.
fn model(camera: &str) -> PyResult<ModelFacts> {
    geometry::Camera::model(camera).ok_or_else(|| unknown("camera", camera))
}

/// Returns photos from an (n, 6 + k) array of poses and cameras, in one pass: the number of rows may be large.
fn photos(
    camera: &str,
    name: &str,
    array: &Array<'_>,
) -> PyResult<impl ExactSizeIterator<Item = PyResult<([f64; POSE], geometry::Camera)>>> {
    let split = move |row: Vec<f64>| {
        let (pose, own) = row.split_first_chunk().ok_or_else(|| unknown("camera", camera))?;
        Ok((*pose, geometry::Camera::named(camera, own).ok_or_else(|| unknown("camera", camera))?))
    };
    Ok(slices(name, array, POSE + model(camera)?.parameters.len())?.into_iter().map(split))
}

#[pyfunction]
pub fn collection_images<'py>(
    py: Python<'py>,
    camera: &str,
    photo_parameters: Array<'py>,
    points: Array<'py>,
) -> PyResult<Matrix<'py>> {
    let photos = photos(camera, "photo_parameters", &photo_parameters)?;
    let points = rows("points", &points)?;
    check_lengths(("points", points.len()), &[("photo_parameters", photos.len())])?;
    let image = |(photo, point): (PyResult<([f64; POSE], geometry::Camera)>, [f64; 3])| {
        let ([a, b, c, x, y, z], camera) = photo?;
        let orientation = Orientation::from_vectors([a, b, c].into(), [x, y, z].into());
        Ok(camera.image(&orientation.to_camera_frame(&GroundPoint::new(ObjectSpace::Rectangular, point))))
    };
    let images: PyResult<Vec<[f64; 2]>> = py.detach(|| photos.zip(points).map(image).collect());
    table(py, images?)
}

#[pyfunction]
#[pyo3(signature = (
    camera, photo_parameters, photo_sd, point_positions, point_sd, image_photos, image_points, image_xy, image_sd, *, decrease,
    max_iterations, covariance, loss, ordering, memory
))]
pub fn collection_network(
    camera: &str,
    photo_parameters: Array<'_>,
    photo_sd: Array<'_>,
    point_positions: Array<'_>,
    point_sd: Array<'_>,
    image_photos: Indices<'_>,
    image_points: Indices<'_>,
    image_xy: Array<'_>,
    image_sd: Array<'_>,
    decrease: f64,
    max_iterations: usize,
    covariance: bool,
    loss: Option<(&str, f64)>,
    ordering: &str,
    memory: Option<usize>,
) -> PyResult<CollectionNetwork> {
    let given = photos(camera, "photo_parameters", &photo_parameters)?.collect::<PyResult<Vec<_>>>()?;
    let unknowns = POSE + model(camera)?.parameters.len();
    let sd = slices("photo_sd", &photo_sd, unknowns)?;
    check_lengths(("photo_parameters", given.len()), &[("photo_sd", sd.len())])?;
    let photo = |(camera, ((pose, _), sd)): (usize, (&([f64; POSE], _), &Vec<f64>))| Photo {
        pose: *pose,
        observed: *pose,
        sd: std::array::from_fn(|k| sd[k]),
        camera,
    };
    let own = |((_, camera), sd): (&(_, geometry::Camera), &Vec<f64>)| {
        Camera::new(camera.clone(), sd[POSE..].to_vec())
    };
    let network = Network {
        poses: PoseNumbers::Vectors,
        cameras: given.iter().zip(&sd).map(own).collect(),
        photos: given.iter().zip(&sd).enumerate().map(photo).collect(),
        points: points(&point_positions, &point_sd)?,
        images: images(&image_photos, &image_points, &image_xy, &image_sd)?,
        ..Network::new()
    };
    let options = Options {
        adjustment: AdjustmentOptions {
            method: Method::TrustRegion(Stop::Decrease(decrease)),
            max_iterations,
            covariance,
            loss: named_loss(loss)?,
            threads: 0,
        },
        ordering: named_ordering(ordering)?,
        start: Start::Given,
        hold_unused: true,
        memory,
        reserved: LOADED,
        ..Options::default()
    };
    Ok(CollectionNetwork { network, options, unknowns })
}
