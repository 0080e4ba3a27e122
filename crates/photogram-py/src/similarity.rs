//! Absolute orientation; its documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArrayDyn};
use photocore::programs::similarity::{
    AdjustedStation, Matrix7, Method, Options, Parameters, Similarity, SimilarityError as Failure, Solution,
    Start, Started, Station, Trace, gauss_crout as crout, orient_on,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{check_lengths, from_rows, row_major, rows, squares, table};
use crate::solution::{IterationRow, iteration_row, status_name};
use crate::work::{Workers, watched};

create_exception!(
    _photocore,
    SimilarityError,
    PyException,
    "The model cannot be oriented: (kind, message, stations)."
);

/// Adds the functions and their classes to the extension module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("SimilarityError", module.py().get_type::<SimilarityError>())?;
    module.add_class::<SimilaritySolution>()?;
    module.add_function(wrap_pyfunction!(orient_model, module)?)?;
    module.add_function(wrap_pyfunction!(transform_points, module)?)?;
    module.add_function(wrap_pyfunction!(similarity_partials, module)?)?;
    module.add_function(wrap_pyfunction!(gauss_crout, module)?)
}

/// Scale, rotation, shift, centre of the control, centre of the model.
type CentredRow = (f64, [[f64; 3]; 3], [f64; 3], [f64; 3], [f64; 3]);

fn centred_row(similarity: &Similarity) -> CentredRow {
    let Similarity { scale, rotation, shift, control_centre, model_centre } = *similarity;
    (scale, row_major(&rotation), shift.into(), control_centre.into(), model_centre.into())
}

fn from_row((scale, rotation, shift, control_centre, model_centre): CentredRow) -> Similarity {
    Similarity {
        rotation: from_rows(rotation),
        scale,
        shift: shift.into(),
        control_centre: control_centre.into(),
        model_centre: model_centre.into(),
    }
}

#[pyfunction]
#[pyo3(signature = (control, control_sd, model, model_sd, *, method, start, former, max_iterations, tolerance, threads, trace, scale=None))]
fn orient_model(
    py: Python<'_>,
    control: PyReadonlyArrayDyn<'_, f64>,
    control_sd: PyReadonlyArrayDyn<'_, f64>,
    model: PyReadonlyArrayDyn<'_, f64>,
    model_sd: PyReadonlyArrayDyn<'_, f64>,
    method: &str,
    start: &str,
    former: Option<(f64, [[f64; 3]; 3], [f64; 3])>,
    max_iterations: usize,
    tolerance: f64,
    threads: usize,
    trace: bool,
    scale: Option<f64>,
) -> PyResult<SimilaritySolution> {
    let control: Vec<[f64; 3]> = rows("control", &control)?;
    let (control_sd, model): (_, Vec<[f64; 3]>) = (rows("control_sd", &control_sd)?, rows("model", &model)?);
    let model_sd = rows("model_sd", &model_sd)?;
    check_lengths(
        ("control", control.len()),
        &[("control_sd", control_sd.len()), ("model", model.len()), ("model_sd", model_sd.len())],
    )?;
    let station = |i: usize| Station {
        control: control[i].into(),
        control_sd: control_sd[i],
        model: model[i].into(),
        model_sd: model_sd[i],
    };
    let stations: Vec<Station> = (0..control.len()).map(station).collect();
    let options = Options {
        method: match method {
            "rigorous" => Method::Rigorous,
            "report" => Method::Report,
            "fill-in" => Method::FillIn,
            other => return Err(PyValueError::new_err(format!("method cannot be {other:?}"))),
        },
        start: match (start, former) {
            (_, Some((scale, rotation, translation))) => Start::Given(Parameters {
                rotation: from_rows(rotation),
                scale,
                translation: translation.into(),
            }),
            ("auto", None) => Start::Auto,
            ("report", None) => Start::Report,
            ("closed-form", None) => Start::ClosedForm,
            (other, None) => return Err(PyValueError::new_err(format!("start cannot be {other:?}"))),
        },
        max_iterations,
        tolerance,
        trace,
        scale,
    };
    run(py, &stations, &options, threads)
}

fn run(
    py: Python<'_>,
    stations: &[Station],
    options: &Options,
    threads: usize,
) -> PyResult<SimilaritySolution> {
    let workers = Workers::of(threads, stations.len());
    let solution = watched(py, workers, None, |pool, watch| orient_on(stations, options, pool, watch))?;
    solution.map(|solution| SimilaritySolution { solution }).map_err(|error| failure(&error))
}

fn failure(error: &Failure) -> PyErr {
    let (kind, stations) = match error {
        Failure::Insufficient { .. } => ("insufficient", vec![]),
        Failure::Undetermined { stations, .. } => ("undetermined", stations.clone()),
        Failure::FirstStations(_) => ("first stations", vec![0, 1]),
        Failure::Scale(_) => ("scale", vec![]),
        Failure::NotFinite => ("not finite", vec![]),
        Failure::Layout(_) | Failure::Stopped(_) => ("input", vec![]),
    };
    SimilarityError::new_err((kind, error.to_string(), stations))
}

/// Rotation; stations, components and rows of the equations; normal equations; auxiliary table; results; parameters.
type TraceRow<'py> = (
    [[f64; 3]; 3],
    (Vec<(usize, usize)>, Bound<'py, PyArray2<f64>>),
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    [f64; 7],
    [f64; 7],
);

fn trace_row<'py>(py: Python<'py>, trace: &Trace) -> PyResult<TraceRow<'py>> {
    let places = trace.equations.iter().map(|&(station, component, _)| (station, component)).collect();
    let rows = table(py, trace.equations.iter().map(|(_, _, row)| *row).collect())?;
    let [normal, auxiliary] = [trace.normal, trace.auxiliary].map(|matrix| table(py, matrix.to_vec()));
    Ok((row_major(&trace.rotation), (places, rows), normal?, auxiliary?, trace.results, trace.parameters))
}

/// An oriented model.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct SimilaritySolution {
    solution: Solution,
}

impl SimilaritySolution {
    fn stations<'py>(
        &self,
        py: Python<'py>,
        part: impl Fn(&AdjustedStation) -> [f64; 3],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.stations.iter().map(part).collect())
    }
}

#[pymethods]
impl SimilaritySolution {
    #[getter]
    fn status(&self) -> &'static str {
        status_name(self.solution.status)
    }

    #[getter]
    fn started(&self) -> &'static str {
        match self.solution.started {
            Started::Restart => "restart",
            Started::Report => "report",
            Started::ClosedForm => "closed-form",
        }
    }

    #[getter]
    fn similarity(&self) -> CentredRow {
        centred_row(&self.solution.similarity)
    }

    #[getter]
    fn initial(&self) -> CentredRow {
        centred_row(&self.solution.initial)
    }

    #[getter]
    fn alternatives(&self) -> Vec<CentredRow> {
        self.solution.alternatives.iter().map(centred_row).collect()
    }

    #[getter]
    fn iterations(&self) -> Vec<IterationRow> {
        self.solution.iterations.iter().map(iteration_row).collect()
    }

    #[getter]
    fn cycles(&self) -> Option<Vec<f64>> {
        self.solution.cycles.clone()
    }

    #[getter]
    fn traces<'py>(&self, py: Python<'py>) -> PyResult<Vec<TraceRow<'py>>> {
        self.solution.traces.iter().map(|trace| trace_row(py, trace)).collect()
    }

    #[getter]
    fn tangent_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.solution.tangent_cofactors.to_vec())
    }

    #[getter]
    fn condition(&self) -> f64 {
        self.solution.condition
    }

    #[getter]
    fn weakness(&self) -> Option<(&'static str, Vec<usize>)> {
        self.solution.weakness.as_ref().map(|(cause, stations)| (cause.name(), stations.clone()))
    }

    #[getter]
    fn sum_of_squares(&self) -> f64 {
        self.solution.sum_of_squares
    }

    #[getter]
    fn misclosures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.stations(py, |station| station.misclosure.into())
    }

    #[getter]
    fn model_residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.stations(py, |station| station.model_residual.into())
    }

    #[getter]
    fn adjusted_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.stations(py, |station| station.control.into())
    }

    #[getter]
    fn control_cofactors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        squares(py, self.solution.stations.iter().map(|station| row_major(&station.cofactors)).collect())
    }

    #[getter]
    fn redundancy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.stations(py, |station| station.redundancy)
    }

    #[getter]
    fn standardized<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.stations(py, |station| station.standardized)
    }
}

/// Positions and covariances.
type Points<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>);

#[pyfunction]
fn transform_points<'py>(
    py: Python<'py>,
    similarity: CentredRow,
    tangent_covariance: PyReadonlyArrayDyn<'py, f64>,
    points: PyReadonlyArrayDyn<'py, f64>,
    points_sd: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Points<'py>> {
    let similarity = from_row(similarity);
    let points: Vec<[f64; 3]> = rows("points", &points)?;
    let points_sd: Vec<[f64; 3]> = rows("points_sd", &points_sd)?;
    check_lengths(("points", points.len()), &[("points_sd", points_sd.len())])?;
    let covariance = square7("tangent_covariance", &tangent_covariance)?;
    let (positions, covariances): (Vec<_>, Vec<_>) = py.detach(|| {
        let transform = |(&point, sd): (&[f64; 3], &[f64; 3])| {
            let (position, covariance) = similarity.transform(&point.into(), sd, &covariance);
            (<[f64; 3]>::from(position), row_major(&covariance))
        };
        points.iter().zip(&points_sd).map(transform).unzip()
    });
    Ok((table(py, positions)?, squares(py, covariances)?))
}

#[pyfunction]
fn similarity_partials(py: Python<'_>, similarity: CentredRow) -> PyResult<Bound<'_, PyArray2<f64>>> {
    table(py, from_row(similarity).parameter_partials().to_vec())
}

/// The auxiliary matrix D and the solution E.
type CroutTables<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

#[pyfunction]
fn gauss_crout<'py>(
    py: Python<'py>,
    normal: PyReadonlyArrayDyn<'py, f64>,
) -> PyResult<Option<CroutTables<'py>>> {
    let rows: Vec<[f64; 8]> = rows("normal", &normal)?;
    let normal = rows.try_into().map_err(|_| PyValueError::new_err("normal has seven rows"))?;
    match crout(&normal) {
        Some((d, e)) => Ok(Some((table(py, d.to_vec())?, PyArray1::from_slice(py, &e)))),
        None => Ok(None),
    }
}

fn square7(name: &str, array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Matrix7> {
    let rows: Vec<[f64; 7]> = rows(name, array)?;
    rows.try_into().map_err(|_| PyValueError::new_err(format!("{name} has seven rows")))
}
