//! Result of a network adjustment as arrays.

use std::mem::take;
use std::sync::{Arc, Mutex};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use photocore::network::{AdjustedCamera, AdjustedPhoto, Reason, Solution};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::state::BlockState;
use super::tables::SolutionColumns;
use super::{FailureRow, failure};
use crate::adjustment::{IterationRow, iteration_row, operations, predictions, seconds, status_name};
use crate::arrays::{Blocks, Matrix, blocks, table};
use crate::commons::{AdjustedRow as UnknownRow, adjusted_row as unknown_row};
use crate::observations::{Adjusted, adjusted};

/// Returns the cofactors of the unknowns of each photo, (n, N, N); zero for fixed unknowns.
fn photo_cofactors<'py>(py: Python<'py>, photos: &[AdjustedPhoto], unknowns: usize) -> PyResult<Blocks<'py>> {
    let mut all = vec![0.0; photos.len() * unknowns * unknowns];
    for (photo, matrix) in photos.iter().zip(all.chunks_exact_mut(unknowns * unknowns)) {
        let own = photo.redundancy.len();
        // In a block the camera unknowns are separate.
        let shown = own.min(unknowns);
        for (row, values) in photo.cofactors.as_slice().chunks_exact(own).take(shown).enumerate() {
            matrix[row * unknowns..][..shown].copy_from_slice(&values[..shown]);
        }
        if photo.cofactors[0].is_nan() {
            matrix.fill(f64::NAN);
        }
    }
    PyArray1::from_vec(py, all).reshape([photos.len(), unknowns, unknowns])
}

/// Returns the redundancy numbers of the unknowns of each photo, (n, N); zero for fixed unknowns.
fn photo_redundancy<'py>(
    py: Python<'py>,
    photos: &[AdjustedPhoto],
    unknowns: usize,
) -> PyResult<Matrix<'py>> {
    let mut all = vec![0.0; photos.len() * unknowns];
    for (photo, row) in photos.iter().zip(all.chunks_exact_mut(unknowns)) {
        let shown = photo.redundancy.len().min(unknowns);
        row[..shown].copy_from_slice(&photo.redundancy[..shown]);
        if photo.redundancy[0].is_nan() {
            row.fill(f64::NAN);
        }
    }
    PyArray1::from_vec(py, all).reshape([photos.len(), unknowns])
}

/// Returns the six corrections of each photo in each iteration, (iterations, n, 6).
fn photo_corrections<'py>(
    py: Python<'py>,
    iterations: &[Vec<f64>],
    photos: &[AdjustedPhoto],
) -> PyResult<Blocks<'py>> {
    let mut values = Vec::with_capacity(6 * iterations.len() * photos.len());
    for corrections in iterations {
        let mut rest = corrections.as_slice();
        for photo in photos {
            let (own, others) = rest.split_at(photo.redundancy.len());
            values.extend_from_slice(&own[..6]);
            rest = others;
        }
    }
    PyArray1::from_vec(py, values).reshape([iterations.len(), photos.len(), 6])
}

/// Returns the points that were excluded for a reason.
fn left_out(solution: &Solution, reason: Reason) -> Vec<usize> {
    let own = solution.dropped.iter().filter(|dropped| dropped.reason == reason);
    own.map(|dropped| dropped.point).collect()
}

/// Parameters, cofactors row by row, redundancy numbers, diagonal of the normal equations, numbers of photos and observations of a camera.
type CameraRow = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, usize, usize);

fn camera_row(camera: AdjustedCamera) -> CameraRow {
    let AdjustedCamera { parameters, cofactors, redundancy, information, photos, images } = camera;
    (parameters, cofactors.data.into(), redundancy, information, photos, images)
}

/// Common part of the solutions of blocks and collections.
#[pyclass(frozen, subclass, get_all, module = "photogram._photocore")]
pub struct NetworkSolution {
    status: &'static str,
    initial_sum_of_squares: f64,
    iterations: Vec<IterationRow>,
    photo_cofactors: Py<PyArray3<f64>>,
    photo_redundancy: Py<PyArray2<f64>>,
    point_positions: Py<PyArray2<f64>>,
    point_cofactors: Py<PyArray3<f64>>,
    point_redundancy: Py<PyArray2<f64>>,
    point_rays: Py<PyArray1<i64>>,
    residuals: Py<PyArray2<f64>>,
    redundancy: Py<PyArray2<f64>>,
    standardized: Py<PyArray2<f64>>,
    image_weights: Py<PyArray1<f64>>,
    redundancy_excess: Option<f64>,
    undetermined: Option<FailureRow>,
    degrees_of_freedom: i64,
    variance_of_unit_weight: Option<f64>,
    counts: (usize, usize, usize),
    ordering: &'static str,
    predictions: Py<PyDict>,
    operations: Py<PyDict>,
    formations: usize,
    seconds: Py<PyDict>,
    state: Py<BlockState>,
    datum: Vec<(usize, usize)>,
    weak: Vec<(usize, usize)>,
    weak_points: Vec<(usize, f64, f64)>,
}

impl NetworkSolution {
    /// Creates the solution of a block or a collection; `unknowns` per photo are the pose and, in collections, the camera.
    fn new(py: Python<'_>, columns: &mut SolutionColumns, unknowns: usize, what: &str) -> PyResult<Self> {
        let kept = Arc::new(Mutex::new(columns.solution.converged.take()));
        let Solution { adjustment, state, joint, weak, .. } = &columns.solution;
        let effort = &adjustment.effort;
        let weak_points = weak.points.iter().map(|weak| (weak.point, weak.ratio, weak.distance));
        Ok(Self {
            status: status_name(adjustment.status),
            initial_sum_of_squares: adjustment.initial_sum_of_squares,
            iterations: adjustment.iterations.iter().map(iteration_row).collect(),
            photo_cofactors: photo_cofactors(py, &columns.solution.photos, unknowns)?.unbind(),
            photo_redundancy: photo_redundancy(py, &columns.solution.photos, unknowns)?.unbind(),
            point_positions: table(py, take(&mut columns.point_positions))?.unbind(),
            point_cofactors: blocks(py, take(&mut columns.point_cofactors))?.unbind(),
            point_redundancy: table(py, take(&mut columns.point_redundancy))?.unbind(),
            point_rays: PyArray1::from_vec(py, take(&mut columns.point_rays)).unbind(),
            residuals: table(py, take(&mut columns.residuals))?.unbind(),
            redundancy: table(py, take(&mut columns.redundancy))?.unbind(),
            standardized: table(py, take(&mut columns.standardized))?.unbind(),
            image_weights: PyArray1::from_vec(py, take(&mut columns.image_weights)).unbind(),
            redundancy_excess: adjustment.redundancy_excess,
            undetermined: columns.solution.undetermined.as_ref().map(|error| failure(error, what)),
            degrees_of_freedom: columns.solution.degrees_of_freedom,
            variance_of_unit_weight: columns.solution.variance_of_unit_weight,
            counts: (adjustment.counts.observations, adjustment.counts.weighted, adjustment.counts.unknowns),
            ordering: effort.ordering.name(),
            predictions: predictions(py, adjustment)?.unbind(),
            operations: operations(py, adjustment)?.unbind(),
            formations: effort.formations,
            seconds: seconds(py, adjustment)?.unbind(),
            state: Py::new(py, BlockState { state: state.clone(), kept, joint: joint.clone() })?,
            datum: columns.solution.datum.held.clone(),
            weak: weak.photos.clone(),
            weak_points: weak_points.collect(),
        })
    }
}

/// Adjusted block.
#[pyclass(frozen, get_all, extends = NetworkSolution, module = "photogram._photocore")]
pub struct BlockSolution {
    datum_unknowns: Vec<(usize, usize)>,
    relative_error: f64,
    minimal_control: bool,
    photo_corrections: Py<PyArray3<f64>>,
    photo_positions: Py<PyArray2<f64>>,
    photo_attitudes: Py<PyArray2<f64>>,
    point_last_corrections: Py<PyArray2<f64>>,
    images_behind: Py<PyArray1<i64>>,
    images_folded: Py<PyArray1<i64>>,
    loose_photos: Vec<usize>,
    weak_unknowns: Vec<(usize, usize)>,
    adjusted_unknowns: Vec<UnknownRow>,
    weak_cameras: Vec<(usize, usize)>,
    cameras: Vec<CameraRow>,
    dropped: Vec<(usize, &'static str)>,
    sums_of_squares: (f64, f64, f64, f64),
    redundancies: Option<(f64, f64, f64, f64)>,
    adjusted_observations: Adjusted,
    photo_order: Py<PyArray1<i64>>,
}

impl BlockSolution {
    pub fn new(py: Python<'_>, mut columns: SolutionColumns) -> PyResult<Py<Self>> {
        let base = NetworkSolution::new(py, &mut columns, 6, "block")?;
        let SolutionColumns { solution: found, point_last_corrections, .. } = columns;
        let three = |first: usize| {
            let part = |photo: &AdjustedPhoto| std::array::from_fn::<_, 3, _>(|k| photo.pose[first + k]);
            table(py, found.photos.iter().map(part).collect()).map(Bound::unbind)
        };
        let numbers = |all: &[usize]| PyArray1::from_iter(py, all.iter().map(|&own| own as i64)).unbind();
        let sums = found.sums_of_squares;
        // Cameras, points and pose links in the order are not photos.
        let order = found.adjustment.effort.order.iter().filter(|&&block| block < found.photos.len());
        let own = Self {
            datum_unknowns: found.datum.held_commons.clone(),
            relative_error: found.datum.relative_error,
            minimal_control: found.datum.minimal_control,
            photo_corrections: photo_corrections(py, &found.photo_corrections, &found.photos)?.unbind(),
            photo_positions: three(0)?,
            photo_attitudes: three(3)?,
            point_last_corrections: table(py, point_last_corrections)?.unbind(),
            images_behind: numbers(&found.unseen.behind),
            images_folded: numbers(&found.unseen.folded),
            photo_order: numbers(&order.copied().collect::<Vec<_>>()),
            loose_photos: found.state.undetermined_photos,
            weak_unknowns: found.weak.commons,
            adjusted_unknowns: found.commons.into_iter().map(unknown_row).collect(),
            weak_cameras: found.weak.cameras,
            cameras: found.cameras.into_iter().map(camera_row).collect(),
            dropped: found.dropped.iter().map(|dropped| (dropped.point, dropped.reason.code())).collect(),
            sums_of_squares: (sums.camera, sums.ground, sums.plates, sums.observations),
            redundancies: found
                .redundancies
                .map(|own| (own.camera, own.ground, own.plates, own.observations)),
            adjusted_observations: adjusted(py, &found.observations)?,
        };
        Py::new(py, PyClassInitializer::from(base).add_subclass(own))
    }
}

/// Adjusted collection.
#[pyclass(frozen, get_all, extends = NetworkSolution, module = "photogram._photocore")]
pub struct CollectionSolution {
    photo_parameters: Py<PyArray2<f64>>,
    photo_images: Py<PyArray1<i64>>,
    point_rays_behind: Py<PyArray1<i64>>,
    collapsed: Vec<usize>,
    beside_stations: Vec<usize>,
    not_determined: Vec<usize>,
    sum_of_squares: f64,
}

impl CollectionSolution {
    /// Creates the solution of a collection with `unknowns` per photo.
    pub fn new(py: Python<'_>, mut columns: SolutionColumns, unknowns: usize) -> PyResult<Py<Self>> {
        let base = NetworkSolution::new(py, &mut columns, unknowns, "collection")?;
        let SolutionColumns { solution: found, point_rays_behind, .. } = columns;
        let parameters =
            found.photos.iter().flat_map(|photo| [&photo.pose, photo.camera.as_slice()].concat());
        let own = Self {
            photo_parameters: PyArray1::from_vec(py, parameters.collect())
                .reshape([found.photos.len(), unknowns])?
                .unbind(),
            photo_images: PyArray1::from_iter(py, found.photos.iter().map(|photo| photo.images as i64))
                .unbind(),
            point_rays_behind: PyArray1::from_vec(py, point_rays_behind).unbind(),
            collapsed: [Reason::RanIntoStation, Reason::AtStation].map(|why| left_out(&found, why)).concat(),
            beside_stations: left_out(&found, Reason::NearStation),
            not_determined: [Reason::NotDetermined, Reason::RanOff].map(|why| left_out(&found, why)).concat(),
            sum_of_squares: found.sums_of_squares.total(),
        };
        Py::new(py, PyClassInitializer::from(base).add_subclass(own))
    }
}
