//! Absolute orientation; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3};
use photogram_programs::similarity::{
    AdjustedStation, Matrix7, Method, Options, Parameters, Similarity, SimilarityError as Failure, Solution,
    Start, Started, Station, Trace, gauss_crout as crout, orient_on,
};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::adjustment::{IterationRow, iteration_row, status_name};
use crate::arrays::{
    Array, Blocks, Matrix, Vector, blocks, check_lengths, from_rows, row_major, rows, table,
};
use crate::work::{Workers, supervised};

create_exception!(
    _photocore,
    SimilarityError,
    PyException,
    "The model cannot be oriented: (kind, message, stations)."
);

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
pub fn orient_model(
    py: Python<'_>,
    control: Array<'_>,
    control_sd: Array<'_>,
    model: Array<'_>,
    model_sd: Array<'_>,
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
    let solution = supervised(py, workers, None, |context| orient_on(stations, options, context))?;
    columns(py, solution.map_err(|error| failure(&error))?)
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
fn trace_row(py: Python<'_>, trace: &Trace) -> PyResult<Py<PyTuple>> {
    let equations = trace.equations.iter();
    let places: Vec<_> = equations.clone().map(|&(station, component, _)| (station, component)).collect();
    let rows = table(py, equations.map(|(_, _, row)| *row).collect())?;
    let [normal, auxiliary] = [trace.normal, trace.auxiliary].map(|matrix| table(py, matrix.to_vec()));
    let rotation = row_major(&trace.rotation);
    let row = (rotation, (places, rows), normal?, auxiliary?, trace.results, trace.parameters);
    Ok(row.into_pyobject(py)?.unbind())
}

/// Oriented model.
#[pyclass(frozen, get_all, module = "photogram._photocore")]
pub struct SimilaritySolution {
    status: &'static str,
    started: &'static str,
    similarity: CentredRow,
    initial: CentredRow,
    alternatives: Vec<CentredRow>,
    iterations: Vec<IterationRow>,
    cycles: Option<Vec<f64>>,
    traces: Vec<Py<PyTuple>>,
    tangent_cofactors: Py<PyArray2<f64>>,
    condition: f64,
    weakness: Option<(&'static str, Vec<usize>)>,
    sum_of_squares: f64,
    misclosures: Py<PyArray2<f64>>,
    model_residuals: Py<PyArray2<f64>>,
    adjusted_control: Py<PyArray2<f64>>,
    control_cofactors: Py<PyArray3<f64>>,
    redundancy: Py<PyArray2<f64>>,
    standardized: Py<PyArray2<f64>>,
}

fn columns(py: Python<'_>, found: Solution) -> PyResult<SimilaritySolution> {
    let parameter_unknowns = |part: fn(&AdjustedStation) -> [f64; 3]| {
        table(py, found.stations.iter().map(part).collect()).map(Bound::unbind)
    };
    let cofactors = found.stations.iter().map(|station| row_major(&station.cofactors));
    Ok(SimilaritySolution {
        status: status_name(found.status),
        started: match found.started {
            Started::Restart => "restart",
            Started::Report => "report",
            Started::ClosedForm => "closed-form",
        },
        similarity: centred_row(&found.similarity),
        initial: centred_row(&found.initial),
        alternatives: found.alternatives.iter().map(centred_row).collect(),
        iterations: found.iterations.iter().map(iteration_row).collect(),
        traces: found.traces.iter().map(|trace| trace_row(py, trace)).collect::<PyResult<_>>()?,
        tangent_cofactors: table(py, found.tangent_cofactors.to_vec())?.unbind(),
        condition: found.condition,
        sum_of_squares: found.sum_of_squares,
        misclosures: parameter_unknowns(|station| station.misclosure.into())?,
        model_residuals: parameter_unknowns(|station| station.model_residual.into())?,
        adjusted_control: parameter_unknowns(|station| station.control.into())?,
        control_cofactors: blocks(py, cofactors.collect())?.unbind(),
        redundancy: parameter_unknowns(|station| station.redundancy)?,
        standardized: parameter_unknowns(|station| station.standardized)?,
        weakness: found.weakness.map(|(cause, stations)| (cause.name(), stations)),
        cycles: found.cycles,
    })
}

/// Positions and covariances.
type PointsRow<'py> = (Matrix<'py>, Blocks<'py>);

#[pyfunction]
pub fn transform_points<'py>(
    py: Python<'py>,
    similarity: CentredRow,
    tangent_covariance: Array<'py>,
    points: Array<'py>,
    points_sd: Array<'py>,
) -> PyResult<PointsRow<'py>> {
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
    Ok((table(py, positions)?, blocks(py, covariances)?))
}

#[pyfunction]
pub fn similarity_partials(py: Python<'_>, similarity: CentredRow) -> PyResult<Matrix<'_>> {
    table(py, from_row(similarity).parameter_partials().to_vec())
}

/// The auxiliary matrix D and the solution E.
type CroutTables<'py> = (Matrix<'py>, Vector<'py>);

#[pyfunction]
pub fn gauss_crout<'py>(py: Python<'py>, normal: Array<'py>) -> PyResult<Option<CroutTables<'py>>> {
    let rows: Vec<[f64; 8]> = rows("normal", &normal)?;
    let normal = rows.try_into().map_err(|_| PyValueError::new_err("normal has seven rows"))?;
    match crout(&normal) {
        Some((d, e)) => Ok(Some((table(py, d.to_vec())?, PyArray1::from_slice(py, &e)))),
        None => Ok(None),
    }
}

fn square7(name: &str, array: &Array<'_>) -> PyResult<Matrix7> {
    let rows: Vec<[f64; 7]> = rows(name, array)?;
    rows.try_into().map_err(|_| PyValueError::new_err(format!("{name} has seven rows")))
}
