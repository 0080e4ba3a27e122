//! Block triangulation; its documentation is in `_photocore.pyi`.

use numpy::PyReadonlyArrayDyn;
use photocore::adjustment::{Criterion, Options as AdjustmentOptions};
use photocore::programs::block::{Block, Image, Options, Photo, Point, UnitVariance};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::arrays::{check_lengths, indices, numbers, rows};
use crate::geometry::{RefractionRow, object_space, refraction as refraction_of, rotation_sense};
use crate::options::{named_loss, named_ordering, unknown};
use crate::solution::{BlockSolution, failure};
use crate::work::{Workers, watched};

create_exception!(
    _photocore,
    BlockError,
    PyException,
    "The block cannot be adjusted: (kind, message, photos, points)."
);

/// Adds the function and its classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("BlockError", module.py().get_type::<BlockError>())?;
    module.add_class::<BlockSolution>()?;
    module.add_function(wrap_pyfunction!(adjust_block, module)?)
}

#[pyfunction]
#[pyo3(signature = (
    photo_positions, photo_attitudes, photo_positions_observed, photo_attitudes_observed, photo_position_sd, photo_attitude_sd,
    principal_distances, point_positions, point_sd, image_photos, image_points, image_xy, image_sd, *, spheroid, photo_to_ground, refraction, criterion, limit, max_iterations,
    covariance, loss, ordering, unit_variance, threads, memory, progress
))]
fn adjust_block(
    py: Python<'_>,
    photo_positions: PyReadonlyArrayDyn<'_, f64>,
    photo_attitudes: PyReadonlyArrayDyn<'_, f64>,
    photo_positions_observed: PyReadonlyArrayDyn<'_, f64>,
    photo_attitudes_observed: PyReadonlyArrayDyn<'_, f64>,
    photo_position_sd: PyReadonlyArrayDyn<'_, f64>,
    photo_attitude_sd: PyReadonlyArrayDyn<'_, f64>,
    principal_distances: PyReadonlyArrayDyn<'_, f64>,
    point_positions: PyReadonlyArrayDyn<'_, f64>,
    point_sd: PyReadonlyArrayDyn<'_, f64>,
    image_photos: PyReadonlyArrayDyn<'_, i64>,
    image_points: PyReadonlyArrayDyn<'_, i64>,
    image_xy: PyReadonlyArrayDyn<'_, f64>,
    image_sd: PyReadonlyArrayDyn<'_, f64>,
    spheroid: Option<(f64, f64)>,
    photo_to_ground: bool,
    refraction: Option<RefractionRow>,
    criterion: &str,
    limit: f64,
    max_iterations: usize,
    covariance: bool,
    loss: Option<(&str, f64)>,
    ordering: &str,
    unit_variance: &str,
    threads: usize,
    memory: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<BlockSolution> {
    let positions = rows("photo_positions", &photo_positions)?;
    let attitudes = rows("photo_attitudes", &photo_attitudes)?;
    let positions_observed = rows("photo_positions_observed", &photo_positions_observed)?;
    let attitudes_observed = rows("photo_attitudes_observed", &photo_attitudes_observed)?;
    let position_sd = rows("photo_position_sd", &photo_position_sd)?;
    let attitude_sd = rows("photo_attitude_sd", &photo_attitude_sd)?;
    let distances = numbers("principal_distances", &principal_distances)?;
    check_lengths(
        ("photo_positions", positions.len()),
        &[
            ("photo_attitudes", attitudes.len()),
            ("photo_positions_observed", positions_observed.len()),
            ("photo_attitudes_observed", attitudes_observed.len()),
            ("photo_position_sd", position_sd.len()),
            ("photo_attitude_sd", attitude_sd.len()),
            ("principal_distances", distances.len()),
        ],
    )?;
    let coordinates = rows("point_positions", &point_positions)?;
    let sd = rows("point_sd", &point_sd)?;
    check_lengths(("point_positions", coordinates.len()), &[("point_sd", sd.len())])?;
    let photos_of = indices("image_photos", &image_photos)?;
    let points_of = indices("image_points", &image_points)?;
    let xy = rows("image_xy", &image_xy)?;
    let xy_sd = rows("image_sd", &image_sd)?;
    check_lengths(
        ("image_xy", xy.len()),
        &[("image_photos", photos_of.len()), ("image_points", points_of.len()), ("image_sd", xy_sd.len())],
    )?;
    let photo = |i: usize| Photo {
        position: positions[i],
        attitude: attitudes[i],
        observed_position: positions_observed[i],
        observed_attitude: attitudes_observed[i],
        position_sd: position_sd[i],
        attitude_sd: attitude_sd[i],
        principal_distance: distances[i],
    };
    let image = |i: usize| Image { photo: photos_of[i], point: points_of[i], xy: xy[i], sd: xy_sd[i] };
    let block = Block {
        space: object_space(spheroid)?,
        sense: rotation_sense(photo_to_ground),
        refraction: refraction.map(refraction_of).transpose()?,
        photos: (0..positions.len()).map(photo).collect(),
        points: (0..sd.len()).map(|i| Point { coordinates: coordinates[i], sd: sd[i] }).collect(),
        images: (0..xy.len()).map(image).collect(),
    };
    let criterion = match criterion {
        "fraction" => Criterion::Fraction(limit),
        "percent" => Criterion::Percent(limit),
        other => return Err(unknown("criterion", other)),
    };
    let options = Options {
        adjustment: AdjustmentOptions { criterion, max_iterations, covariance, loss: named_loss(loss)? },
        ordering: named_ordering(ordering)?,
        unit_variance: match unit_variance {
            "free" => UnitVariance::Free,
            "constrained" => UnitVariance::Constrained,
            "unity" => UnitVariance::Unity,
            other => return Err(unknown("unit_variance", other)),
        },
        memory,
    };
    run(py, &block, &options, threads, progress)
}

/// Adjusts a block and says what fails in terms of its photos and points.
fn run(
    py: Python<'_>,
    block: &Block,
    options: &Options,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<BlockSolution> {
    let workers = Workers::of(threads, block.images.len());
    let solution = watched(py, workers, progress, |pool, watch| block.adjust(options, pool, watch))?;
    solution.map(BlockSolution::new).map_err(|error| BlockError::new_err(failure(&error)))
}
