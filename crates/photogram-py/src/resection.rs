//! Resection of one photo; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3};
use photocore::adjustment::{Method, Options, Published, Stop};
use photogram_programs::resection::{
    AdjustedControl, AdjustedImage, ControlPoint, Degeneracy, Known, Partials, Pose, Resection,
    ResectionError as Failure, Solution,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;

use crate::adjustment::{IterationRow, iteration_row, status_name};
use crate::arrays::{Array, blocks, check_lengths, numbers, rows, table};
use crate::geometry::{object_space, rotation_sense};
use crate::work::{Workers, supervised};

create_exception!(_photocore, ResectionError, PyException, "The photo cannot be resected: (kind, message).");

#[pyfunction]
#[pyo3(signature = (
    points, point_sd, image_xy, image_sd, principal_distance, *, known, known_sd, start, spheroid, photo_to_ground,
    at_measured, criterion, limit, max_iterations, covariance
))]
pub fn resect(
    py: Python<'_>,
    points: Array<'_>,
    point_sd: Array<'_>,
    image_xy: Array<'_>,
    image_sd: Array<'_>,
    principal_distance: f64,
    known: Array<'_>,
    known_sd: Array<'_>,
    start: Option<Array<'_>>,
    spheroid: Option<(f64, f64)>,
    photo_to_ground: bool,
    at_measured: bool,
    criterion: &str,
    limit: f64,
    max_iterations: usize,
    covariance: bool,
) -> PyResult<ResectionSolution> {
    let coordinates = rows("points", &points)?;
    let sd = rows("point_sd", &point_sd)?;
    let xy = rows("image_xy", &image_xy)?;
    let xy_sd = rows("image_sd", &image_sd)?;
    check_lengths(
        ("points", coordinates.len()),
        &[("point_sd", sd.len()), ("image_xy", xy.len()), ("image_sd", xy_sd.len())],
    )?;
    let [position, attitude] = pose("known", &known)?;
    let [position_sd, attitude_sd] = pose("known_sd", &known_sd)?;
    let start = start.map(|start| pose("start", &start)).transpose()?;
    let point =
        |i: usize| ControlPoint { coordinates: coordinates[i], sd: sd[i], xy: xy[i], xy_sd: xy_sd[i] };
    let resection = Resection {
        space: object_space(spheroid)?,
        sense: rotation_sense(photo_to_ground),
        principal_distance,
        points: (0..xy.len()).map(point).collect(),
        position: Known { value: position, sd: position_sd },
        attitude: Known { value: attitude, sd: attitude_sd },
        start: start.map(|[position, attitude]| Pose { position, attitude }),
        partials: if at_measured { Partials::AtMeasured } else { Partials::AtComputed },
    };
    let position_unknowns = 3 * resection.points.len();
    let method = match criterion {
        "fraction" => Method::Damped(Stop::Fraction(limit)),
        "position" => Method::Full(Published::Length { first: position_unknowns, count: 3, limit }),
        other => return Err(PyValueError::new_err(format!("criterion cannot be {other:?}"))),
    };
    run(py, &resection, &Options { method, max_iterations, covariance, loss: None, threads: 0 })
}

/// Adjusts on the calling thread: the work for one photo is too small for another thread.
fn run(py: Python<'_>, resection: &Resection, options: &Options) -> PyResult<ResectionSolution> {
    let solution = supervised(py, Workers::CALLER, None, |context| resection.adjust_on(options, context))?;
    columns(py, &solution.map_err(|error| ResectionError::new_err((kind(error), error.to_string())))?)
}

fn pose(name: &str, array: &Array<'_>) -> PyResult<[[f64; 3]; 2]> {
    match numbers(name, array)?[..] {
        [a, b, c, d, e, f] => Ok([[a, b, c], [d, e, f]]),
        ref other => Err(PyValueError::new_err(format!("{name} has {} values, not 6", other.len()))),
    }
}

fn kind(error: Failure) -> &'static str {
    match error {
        Failure::TooFewPoints(_) => degeneracy(Degeneracy::TooFewPoints),
        Failure::Collinear => degeneracy(Degeneracy::Collinear),
        Failure::Undetermined(why) => degeneracy(why),
        Failure::NoPlacement => "no placement",
        Failure::NotFinite => "not finite",
        Failure::Stopped(_) | Failure::TooManyPoints => "input",
    }
}

fn degeneracy(why: Degeneracy) -> &'static str {
    match why {
        Degeneracy::TooFewPoints => "too few points",
        Degeneracy::Collinear => "collinear",
        Degeneracy::DangerCylinder => "danger cylinder",
        Degeneracy::Unnamed => "undetermined",
    }
}

/// Resected photo.
#[pyclass(frozen, get_all, module = "photogram._photocore")]
pub struct ResectionSolution {
    status: &'static str,
    iterations: Vec<IterationRow>,
    history: Py<PyArray2<f64>>,
    start: Py<PyArray1<f64>>,
    pose: Py<PyArray1<f64>>,
    cofactors: Py<PyArray2<f64>>,
    pose_redundancy: Py<PyArray1<f64>>,
    point_positions: Py<PyArray2<f64>>,
    point_cofactors: Py<PyArray3<f64>>,
    point_redundancy: Py<PyArray2<f64>>,
    residuals: Py<PyArray2<f64>>,
    redundancy: Py<PyArray2<f64>>,
    standardized: Py<PyArray2<f64>>,
    partials: Py<PyArray3<f64>>,
    points_behind: Py<PyArray1<i64>>,
    sum_of_squares: f64,
    degrees_of_freedom: i64,
    alternatives: Vec<([f64; 6], f64)>,
    undetermined: Option<&'static str>,
    outside_danger_cylinder: Option<f64>,
}

fn columns(py: Python<'_>, found: &Solution) -> PyResult<ResectionSolution> {
    let of_images = |part: fn(&AdjustedImage) -> [f64; 2]| {
        table(py, found.images.iter().map(part).collect()).map(Bound::unbind)
    };
    let of_points = |part: fn(&AdjustedControl) -> [f64; 3]| {
        table(py, found.points.iter().map(part).collect()).map(Bound::unbind)
    };
    let behind = found.behind.iter().map(|&point| point as i64);
    let alternatives = found.alternatives.iter();
    Ok(ResectionSolution {
        status: status_name(found.adjustment.status),
        iterations: found.adjustment.iterations.iter().map(iteration_row).collect(),
        history: table(py, found.history.iter().map(joined).collect())?.unbind(),
        start: PyArray1::from_slice(py, &joined(&found.start)).unbind(),
        pose: PyArray1::from_slice(py, &joined(&found.pose)).unbind(),
        cofactors: table(py, found.cofactors.to_vec())?.unbind(),
        pose_redundancy: PyArray1::from_slice(py, &found.redundancy).unbind(),
        point_positions: of_points(|point| point.coordinates)?,
        point_cofactors: blocks(py, found.points.iter().map(|point| point.cofactors).collect())?.unbind(),
        point_redundancy: of_points(|point| point.redundancy)?,
        residuals: of_images(|image| image.residual)?,
        redundancy: of_images(|image| image.redundancy)?,
        standardized: of_images(|image| image.standardized)?,
        partials: blocks(py, found.images.iter().map(|image| image.partials).collect())?.unbind(),
        points_behind: PyArray1::from_vec(py, behind.collect()).unbind(),
        sum_of_squares: found.sum_of_squares,
        degrees_of_freedom: found.degrees_of_freedom,
        alternatives: alternatives.map(|other| (joined(&other.pose), other.sum_of_squares)).collect(),
        undetermined: found.undetermined.map(degeneracy),
        outside_danger_cylinder: found.outside_danger_cylinder,
    })
}

fn joined(pose: &Pose) -> [f64; 6] {
    let ([x, y, z], [omega, phi, kappa]) = (pose.position, pose.attitude);
    [x, y, z, omega, phi, kappa]
}
