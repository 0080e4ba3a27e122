//! Calibration of a comparator; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use photocore::adjustment::{Method, Options, Status, Stop};
use photogram_programs::comparator::{
    Basis, Calibration, CalibrationError, Case, Comparator, GridPoint, Measurement, Placement, Solution,
};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::arrays::{Array, Indices, blocks, check_lengths, indices, rows, table};
use crate::work::{Workers, supervised};

create_exception!(
    _photocore,
    ComparatorError,
    PyException,
    "The calibration cannot be adjusted: (message, cases, points)."
);

#[pyfunction]
#[pyo3(signature = (
    grid_xy, grid_sd, case_placements, case_left_handed, measured_cases, measured_points, measured_xy, measured_sd,
    coefficients, coefficient_sd, *, degree, centre, half_range, limit, max_iterations
))]
pub fn adjust_comparator(
    py: Python<'_>,
    grid_xy: Array<'_>,
    grid_sd: Array<'_>,
    case_placements: Array<'_>,
    case_left_handed: Vec<bool>,
    measured_cases: Indices<'_>,
    measured_points: Indices<'_>,
    measured_xy: Array<'_>,
    measured_sd: Array<'_>,
    coefficients: [Vec<f64>; 2],
    coefficient_sd: [Vec<f64>; 2],
    degree: u32,
    centre: [f64; 2],
    half_range: [f64; 2],
    limit: f64,
    max_iterations: usize,
) -> PyResult<ComparatorSolution> {
    let (points, point_sd) = (rows("grid_xy", &grid_xy)?, rows("grid_sd", &grid_sd)?);
    check_lengths(("grid_xy", points.len()), &[("grid_sd", point_sd.len())])?;
    let placements = rows::<3>("case_placements", &case_placements)?;
    check_lengths(("case_placements", placements.len()), &[("case_left_handed", case_left_handed.len())])?;
    let (xy, sd) = (rows("measured_xy", &measured_xy)?, rows("measured_sd", &measured_sd)?);
    let case_of = indices("measured_cases", &measured_cases)?;
    let point_of = indices("measured_points", &measured_points)?;
    check_lengths(
        ("measured_xy", xy.len()),
        &[("measured_sd", sd.len()), ("measured_cases", case_of.len()), ("measured_points", point_of.len())],
    )?;
    let case = |(&placement, &left_handed)| Case { placement: Placement::from(placement), left_handed };
    let calibration = Calibration {
        comparator: Comparator {
            scale: [1.0; 2],
            nonorthogonality: 0.0,
            basis: Basis { degree, centre, half_range },
            coefficients,
        },
        coefficient_sd,
        cases: placements.iter().zip(&case_left_handed).map(case).collect(),
        points: points.iter().zip(point_sd).map(|(&xy, sd)| GridPoint { xy, sd }).collect(),
        measurements: (0..xy.len())
            .map(|i| Measurement { case: case_of[i], point: point_of[i], xy: xy[i], sd: sd[i] })
            .collect(),
    };
    let options =
        Options { method: Method::Damped(Stop::Fraction(limit)), max_iterations, ..Options::default() };
    let workers = Workers::of(0, calibration.measurements.len());
    let solution = supervised(py, workers, None, |context| calibration.adjust_on(&options, context))?;
    columns(py, solution.map_err(|error| failure(&error))?)
}

fn failure(error: &CalibrationError) -> PyErr {
    let (cases, points) = match error {
        CalibrationError::UndeterminedPoints(points) => (vec![], points.clone()),
        CalibrationError::Undetermined(combinations) => {
            (combinations.iter().flat_map(|(cases, _)| cases.clone()).collect(), vec![])
        }
        _ => (vec![], vec![]),
    };
    ComparatorError::new_err((error.to_string(), cases, points))
}

/// Adjusted calibration.
#[pyclass(frozen, get_all, module = "photogram._photocore")]
pub struct ComparatorSolution {
    converged: bool,
    iterations: usize,
    comparator: Vec<f64>,
    comparator_cofactors: Py<PyArray2<f64>>,
    case_placements: Py<PyArray2<f64>>,
    case_cofactors: Py<PyArray3<f64>>,
    grid_xy: Py<PyArray2<f64>>,
    grid_cofactors: Py<PyArray3<f64>>,
    grid_redundancy: Py<PyArray2<f64>>,
    residuals: Py<PyArray2<f64>>,
    redundancy: Py<PyArray2<f64>>,
    sum_of_squares: f64,
    degrees_of_freedom: i64,
}

fn columns(py: Python<'_>, found: Solution) -> PyResult<ComparatorSolution> {
    let unknowns = found.comparator.len();
    let row = |case: &Placement| [case.rotation, case.translation[0], case.translation[1]];
    Ok(ComparatorSolution {
        converged: found.adjustment.status == Status::Converged,
        iterations: found.adjustment.iterations.len(),
        comparator: found.comparator,
        comparator_cofactors: PyArray1::from_vec(py, found.comparator_cofactors)
            .reshape([unknowns, unknowns])?
            .unbind(),
        case_placements: table(py, found.cases.iter().map(row).collect())?.unbind(),
        case_cofactors: blocks(py, found.case_cofactors)?.unbind(),
        grid_xy: table(py, found.points)?.unbind(),
        grid_cofactors: blocks(py, found.point_cofactors)?.unbind(),
        grid_redundancy: table(py, found.point_redundancy)?.unbind(),
        residuals: table(py, found.residuals)?.unbind(),
        redundancy: table(py, found.redundancy)?.unbind(),
        sum_of_squares: found.sum_of_squares,
        degrees_of_freedom: found.degrees_of_freedom,
    })
}
