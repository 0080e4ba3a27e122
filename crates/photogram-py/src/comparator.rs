//! Joint calibration of a comparator; its documentation is in `_photocore.pyi`.

use numpy::{PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn};
use photocore::adjustment::{Method, Options, Status, Stop};
use photocore::programs::comparator::{
    Basis, Calibration, CalibrationError, Case, Comparator, GridPoint, Measurement, Placement, Solution,
};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

use crate::arrays::{check_lengths, indices, rows, squares, table};
use crate::work::{Workers, watched};

create_exception!(
    _photocore,
    ComparatorError,
    PyException,
    "The calibration cannot be adjusted: (message, cases, points)."
);

/// Adds the function and its classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("ComparatorError", module.py().get_type::<ComparatorError>())?;
    module.add_class::<ComparatorSolution>()?;
    module.add_function(wrap_pyfunction!(adjust_comparator, module)?)
}

#[pyfunction]
#[pyo3(signature = (
    grid_xy, grid_sd, case_placements, case_left_handed, measured_cases, measured_points, measured_xy, measured_sd,
    coefficients, coefficient_sd, *, degree, centre, half_range, limit, max_iterations
))]
fn adjust_comparator(
    py: Python<'_>,
    grid_xy: PyReadonlyArrayDyn<'_, f64>,
    grid_sd: PyReadonlyArrayDyn<'_, f64>,
    case_placements: PyReadonlyArrayDyn<'_, f64>,
    case_left_handed: Vec<bool>,
    measured_cases: PyReadonlyArrayDyn<'_, i64>,
    measured_points: PyReadonlyArrayDyn<'_, i64>,
    measured_xy: PyReadonlyArrayDyn<'_, f64>,
    measured_sd: PyReadonlyArrayDyn<'_, f64>,
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
    let options = Options {
        method: Method::Damped(Stop::Fraction(limit)),
        max_iterations,
        covariance: true,
        loss: None,
        threads: 0,
    };
    let workers = Workers::of(0, calibration.measurements.len());
    let solution = watched(py, workers, None, |pool, watch| calibration.adjust_on(&options, pool, watch))?;
    solution.map(|solution| ComparatorSolution { solution }).map_err(|error| failure(&error))
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

/// An adjusted calibration.
#[pyclass(frozen, module = "photogram._photocore")]
struct ComparatorSolution {
    solution: Solution,
}

#[pymethods]
impl ComparatorSolution {
    #[getter]
    fn converged(&self) -> bool {
        self.solution.adjustment.status == Status::Converged
    }

    #[getter]
    fn iterations(&self) -> usize {
        self.solution.adjustment.iterations.len()
    }

    #[getter]
    fn comparator(&self) -> Vec<f64> {
        self.solution.comparator.clone()
    }

    #[getter]
    fn comparator_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let unknowns = self.solution.comparator.len();
        numpy::PyArray1::from_slice(py, &self.solution.comparator_cofactors).reshape([unknowns, unknowns])
    }

    #[getter]
    fn case_placements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let row = |case: &Placement| [case.rotation, case.translation[0], case.translation[1]];
        table(py, self.solution.cases.iter().map(row).collect())
    }

    #[getter]
    fn case_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        squares(py, self.solution.case_cofactors.clone())
    }

    #[getter]
    fn grid_xy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.points.clone())
    }

    #[getter]
    fn grid_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        squares(py, self.solution.point_cofactors.clone())
    }

    #[getter]
    fn grid_redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.point_redundancy.clone())
    }

    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.residuals.clone())
    }

    #[getter]
    fn redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.redundancy.clone())
    }

    #[getter]
    fn sum_of_squares(&self) -> f64 {
        self.solution.sum_of_squares
    }

    #[getter]
    fn degrees_of_freedom(&self) -> i64 {
        self.solution.degrees_of_freedom
    }
}
