//! Resection of one photo; its documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn};
use photocore::adjustment::{Method, Options, Published, Stop};
use photocore::programs::resection::{
    AdjustedImage, ControlPoint, Degeneracy, Known, Partials, Pose, Resection, ResectionError as Failure,
    Solution,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{check_lengths, numbers, rows, squares, table};
use crate::geometry::{object_space, rotation_sense};
use crate::solution::{IterationRow, iteration_row, status_name};
use crate::work::{Workers, watched};

create_exception!(_photocore, ResectionError, PyException, "The photo cannot be resected: (kind, message).");

/// Adds the function and its classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("ResectionError", module.py().get_type::<ResectionError>())?;
    module.add_class::<ResectionSolution>()?;
    module.add_function(wrap_pyfunction!(resect, module)?)
}

#[pyfunction]
#[pyo3(signature = (
    points, point_sd, image_xy, image_sd, principal_distance, *, known, known_sd, start, spheroid, photo_to_ground,
    at_measured, criterion, limit, max_iterations, covariance
))]
fn resect(
    py: Python<'_>,
    points: PyReadonlyArrayDyn<'_, f64>,
    point_sd: PyReadonlyArrayDyn<'_, f64>,
    image_xy: PyReadonlyArrayDyn<'_, f64>,
    image_sd: PyReadonlyArrayDyn<'_, f64>,
    principal_distance: f64,
    known: PyReadonlyArrayDyn<'_, f64>,
    known_sd: PyReadonlyArrayDyn<'_, f64>,
    start: Option<PyReadonlyArrayDyn<'_, f64>>,
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

/// Adjusts on the calling thread: one photo is too little work for another one.
fn run(py: Python<'_>, resection: &Resection, options: &Options) -> PyResult<ResectionSolution> {
    let solution =
        watched(py, Workers::CALLER, None, |pool, watch| resection.adjust_on(options, pool, watch))?;
    solution
        .map(|solution| ResectionSolution { solution })
        .map_err(|error| ResectionError::new_err((kind(error), error.to_string())))
}

fn pose(name: &str, array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<[[f64; 3]; 2]> {
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

/// A resected photo.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct ResectionSolution {
    solution: Solution,
}

impl ResectionSolution {
    fn images<'py>(
        &self,
        py: Python<'py>,
        part: impl Fn(&AdjustedImage) -> [f64; 2],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.images.iter().map(part).collect())
    }
}

fn joined(pose: &Pose) -> [f64; 6] {
    let ([x, y, z], [omega, phi, kappa]) = (pose.position, pose.attitude);
    [x, y, z, omega, phi, kappa]
}

#[pymethods]
impl ResectionSolution {
    #[getter]
    fn status(&self) -> &'static str {
        status_name(self.solution.adjustment.status)
    }

    #[getter]
    fn iterations(&self) -> Vec<IterationRow> {
        self.solution.adjustment.iterations.iter().map(iteration_row).collect()
    }

    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.history.iter().map(joined).collect())
    }

    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &joined(&self.solution.start))
    }

    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &joined(&self.solution.pose))
    }

    #[getter]
    fn cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.cofactors.to_vec())
    }

    #[getter]
    fn pose_redundancy<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.solution.redundancy)
    }

    #[getter]
    fn point_positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.points.iter().map(|point| point.coordinates).collect())
    }

    #[getter]
    fn point_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        squares(py, self.solution.points.iter().map(|point| point.cofactors).collect())
    }

    #[getter]
    fn point_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.points.iter().map(|point| point.redundancy).collect())
    }

    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.images(py, |image| image.residual)
    }

    #[getter]
    fn redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.images(py, |image| image.redundancy)
    }

    #[getter]
    fn standardized<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.images(py, |image| image.standardized)
    }

    #[getter]
    fn partials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let count = self.solution.images.len();
        let values: Vec<[[f64; 6]; 2]> = self.solution.images.iter().map(|image| image.partials).collect();
        PyArray1::from_vec(py, values.into_flattened().into_flattened()).reshape([count, 2, 6])
    }

    #[getter]
    fn points_behind<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        PyArray1::from_vec(py, self.solution.behind.iter().map(|&point| point as i64).collect())
    }

    #[getter]
    fn sum_of_squares(&self) -> f64 {
        self.solution.sum_of_squares
    }

    #[getter]
    fn degrees_of_freedom(&self) -> i64 {
        self.solution.degrees_of_freedom
    }

    #[getter]
    fn alternatives(&self) -> Vec<([f64; 6], f64)> {
        let alternatives = &self.solution.alternatives;
        alternatives.iter().map(|other| (joined(&other.pose), other.sum_of_squares)).collect()
    }

    #[getter]
    fn undetermined(&self) -> Option<&'static str> {
        self.solution.undetermined.map(degeneracy)
    }

    #[getter]
    fn outside_danger_cylinder(&self) -> Option<f64> {
        self.solution.outside_danger_cylinder
    }
}
