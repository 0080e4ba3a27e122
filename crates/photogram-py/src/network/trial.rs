//! Outlier session: a network adjusted without some of its observations.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use photocore::Threads;
use photocore::network::hypotheses::{About, Facts, Hypotheses, Hypothesis};
use photocore::network::snooping::Session;
use photocore::network::{Excluded, Network, NetworkError as Failure, Options, Outcome, Tests, Trial};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::covariances::Refused;
use super::state::BlockState;
use super::suspects::NetworkSuspects;
use crate::adjustment::status_name;
use crate::arrays::{Array, Matrix, Vector, rows, table};
use crate::work::{Workers, supervised};

/// Network that is adjusted without some of its observations.
#[pyclass(module = "photogram._photocore")]
pub struct NetworkTrial {
    trial: Trial,
    images: usize,
    /// Number of photos without trajectory records.
    photos: usize,
    threads: usize,
    refused: Refused,
}

/// Status, iterations, weighted sum of squares, degrees of freedom, points that collapsed into a station.
type OutcomeRow = (&'static str, usize, f64, i64, Vec<usize>);

fn outcome_row(outcome: Outcome) -> OutcomeRow {
    let Outcome { status, iterations, sum_of_squares, degrees_of_freedom, collapsed } = outcome;
    (status_name(status), iterations, sum_of_squares, degrees_of_freedom, collapsed)
}

/// Name and values of a column of hypotheses.
type Column<'a, T> = (&'static str, fn(&'a Hypothesis) -> T);

/// Converts hypotheses to columns; see the stub.
fn hypothesis_columns(py: Python<'_>, found: Hypotheses) -> PyResult<Bound<'_, PyDict>> {
    let Hypotheses { mut all, sets, correlations } = found;
    let columns = PyDict::new(py);
    columns.set_item("code", all.iter().map(|own| own.code).collect::<Vec<_>>())?;
    let numbers = |own: &Hypothesis| match own.about {
        About::Set(set) => [-1, set.map_or(-1, |set| set as i64), -1],
        About::Group(group, component) => {
            [group.kind as i64, i64::from(group.index), component.map_or(-1, |component| component as i64)]
        }
    };
    for (k, name) in ["group", "index", "component"].into_iter().enumerate() {
        columns.set_item(name, PyArray1::from_iter(py, all.iter().map(|own| numbers(own)[k])))?;
    }
    let scalars: [Column<'_, f64>; 7] = [
        ("observations", |own| own.observations as f64),
        ("rank", |own| own.judged.rank as f64),
        ("statistic", |own| own.judged.statistic),
        ("probability", |own| own.judged.probability),
        ("redundancy", |own| own.judged.redundancy),
        ("noncentrality", |own| own.judged.noncentrality),
        ("bias_to_noise", |own| own.judged.bias_to_noise),
    ];
    for (name, of) in scalars {
        columns.set_item(name, PyArray1::from_iter(py, all.iter().map(of)))?;
    }
    let width = all.iter().map(|own| own.judged.estimate.len()).max().unwrap_or(1);
    let vectors: [Column<'_, &[f64]>; 3] = [
        ("estimate", |own| &own.judged.estimate),
        ("plausible", |own| &own.plausible),
        ("mdb", |own| own.judged.mdb.as_deref().unwrap_or_default()),
    ];
    for (name, of) in vectors {
        let padded =
            all.iter().flat_map(|own| (0..width).map(move |k| of(own).get(k).copied().unwrap_or(f64::NAN)));
        columns.set_item(name, PyArray1::from_iter(py, padded).reshape([all.len(), width])?)?;
    }
    let effects = PyDict::new(py);
    for (row, own) in all.iter_mut().enumerate() {
        if let Some(own) = own.effect.take() {
            let effect = (own.points, own.others, own.ratio, own.at, own.change, table(py, own.checks)?);
            effects.set_item(row, effect)?;
        }
    }
    columns.set_item("effects", effects)?;
    let facts = |own: Hypothesis| -> PyResult<Bound<'_, PyDict>> {
        let row = PyDict::new(py);
        row.set_item("parameters", own.parameters)?;
        row.set_item("plausible", own.plausible)?;
        row.set_item("estimate", own.judged.estimate)?;
        row.set_item("cofactors", own.judged.cofactors)?;
        row.set_item("error", own.judged.error)?;
        row.set_item("sd_between_photos", own.sd_between_photos)?;
        row.set_item("at_checks", PyArray1::from_vec(py, own.at_checks))?;
        Ok(row)
    };
    let groups = PyDict::new(py);
    for (row, own) in all.drain(sets..).enumerate().filter(|(_, own)| !own.at_checks.is_empty()) {
        groups.set_item(sets + row, facts(own)?)?;
    }
    columns.set_item("groups", groups)?;
    columns.set_item("sets", all.into_iter().map(facts).collect::<PyResult<Vec<_>>>()?)?;
    columns.set_item("correlations", PyArray1::from_vec(py, correlations).reshape([sets, sets])?)?;
    Ok(columns)
}

impl NetworkTrial {
    /// Runs work that only reads the trial, without the GIL.
    fn query<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&Trial, &Threads) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let workers = Workers::of(self.threads, self.images);
        supervised(py, workers, None, |context| work(&self.trial, context.threads))?
            .map_err(|error| (self.refused)(&error))
    }

    /// Runs work on the trial without the GIL.
    pub(super) fn run<T: Send>(
        &mut self,
        py: Python<'_>,
        progress: Option<Py<PyAny>>,
        work: impl FnOnce(&mut Session<'_>) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        let (workers, trial) = (Workers::of(self.threads, self.images), &mut self.trial);
        let found = supervised(py, workers, progress, |context| {
            work(&mut Session { trial, context: context.reborrow() })
        })?;
        found.map_err(|error| (self.refused)(&error))
    }
}

/// First and second group of pairs, and their correlation.
type Pairs<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, Vector<'py>);

/// Prepares a network for trials without some of its observations, from its final or its initial state.
///
/// * `kept`: whether the state belongs to this network, so that its converged adjustment can be reused.
pub fn tried(
    py: Python<'_>,
    (network, options, records): (&Network, &Options, usize),
    refused: Refused,
    state: Option<PyRef<'_, BlockState>>,
    threads: usize,
    kept: bool,
) -> PyResult<NetworkTrial> {
    let (images, photos) = (network.images.len(), network.photos.len() - records);
    let converged = state.as_ref().filter(|_| kept).and_then(|state| state.take_kept());
    if let Some(converged) = converged {
        let trial = py.detach(|| converged.trial(network));
        return Ok(NetworkTrial { trial, images, photos, threads, refused });
    }
    let state = state.map(|state| state.state.clone());
    let found = supervised(py, Workers::of(threads, images), None, |context| {
        network.trial(options, state.as_ref(), context.threads)
    })?;
    found
        .map(|trial| NetworkTrial { trial, images, photos, threads, refused })
        .map_err(|error| refused(&error))
}

#[pymethods]
impl NetworkTrial {
    #[getter]
    fn suspects(&self) -> NetworkSuspects {
        NetworkSuspects(self.trial.groups().clone())
    }

    #[getter]
    fn photos(&self) -> Vec<Vec<f64>> {
        let mut all = self.trial.photos();
        all.truncate(self.photos);
        all
    }

    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        table(py, self.trial.points())
    }

    fn stand(&mut self, py: Python<'_>) -> PyResult<OutcomeRow> {
        self.run(py, None, |own| own.trial.linearize(&mut own.context)).map(outcome_row)
    }

    #[pyo3(signature = (rows, points, photos, *, tolerance, progress))]
    fn adjust(
        &mut self,
        py: Python<'_>,
        rows: PyReadonlyArray1<'_, bool>,
        points: Vec<usize>,
        photos: Vec<usize>,
        tolerance: Option<f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<OutcomeRow> {
        let out = Excluded {
            rows: rows.as_array().iter().copied().collect(),
            points: points.into_iter().collect(),
            photos: photos.into_iter().collect(),
        };
        let adjusted = self.run(py, progress, |own| own.trial.adjust(&out, tolerance, &mut own.context))?;
        Ok(outcome_row(adjusted))
    }

    fn tests<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let tests = self.query(py, |trial, pool| trial.tests(false, pool))?;
        let all = PyDict::new(py);
        all.set_item("redundancy", PyArray1::from_vec(py, self.trial.redundancy(&tests)))?;
        let Tests { groups, rows, cofactors } = tests;
        all.set_item("active", PyArray1::from_iter(py, groups.iter().map(|own| own.active)))?;
        all.set_item("rank", PyArray1::from_iter(py, groups.iter().map(|own| own.rank as i64)))?;
        all.set_item("statistic", PyArray1::from_iter(py, groups.iter().map(|own| own.statistic)))?;
        all.set_item("least", PyArray1::from_iter(py, groups.iter().map(|own| own.least)))?;
        all.set_item("residual", PyArray1::from_iter(py, rows.iter().map(|own| own.residual)))?;
        all.set_item("error", PyArray1::from_iter(py, rows.iter().map(|own| own.error)))?;
        all.set_item("error_sd", PyArray1::from_iter(py, rows.iter().map(|own| own.error_sd)))?;
        all.set_item("cofactors", PyArray1::from_vec(py, cofactors))?;
        Ok(all)
    }

    #[pyo3(signature = (*, velocities, times, position_sets, control_sets, readouts, widths, checks, centre, estimated, detection, limit, effects, observed=None, compared=0, by_component=false, photos=vec![], last=false))]
    #[allow(clippy::too_many_arguments, reason = "one for each fact")]
    fn hypotheses<'py>(
        &mut self,
        py: Python<'py>,
        velocities: Array<'_>,
        times: Vec<f64>,
        position_sets: Vec<Option<usize>>,
        control_sets: Vec<Option<usize>>,
        readouts: Vec<Vec<[f64; 3]>>,
        widths: Vec<f64>,
        checks: Vec<usize>,
        centre: Option<[f64; 3]>,
        estimated: Option<(f64, f64)>,
        detection: (f64, f64),
        limit: f64,
        effects: usize,
        observed: Option<Array<'_>>,
        compared: usize,
        by_component: bool,
        photos: Vec<usize>,
        last: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let velocities = rows("velocities", &velocities)?;
        let observed = observed.map_or_else(|| Ok(vec![]), |own| rows("observed", &own))?;
        let facts = Facts {
            velocities,
            times,
            observed,
            position_sets,
            control_sets,
            readouts,
            widths,
            photos,
            checks,
            compared,
            by_component,
            centre,
            estimated,
            detection,
            limit,
            effects,
            last,
        };
        let found = self.run(py, None, |own| own.trial.hypotheses(&facts, own.context.threads))?;
        hypothesis_columns(py, found)
    }

    fn effects<'py>(&self, py: Python<'py>, suspects: Vec<usize>) -> PyResult<Matrix<'py>> {
        table(py, self.query(py, |trial, pool| trial.effects(&suspects, pool))?)
    }

    fn responses<'py>(&self, py: Python<'py>, suspects: Vec<usize>) -> PyResult<Matrix<'py>> {
        let columns = self.query(py, |trial, pool| trial.responses(&suspects, pool))?;
        let rows = self.trial.groups().row_starts().last().copied().unwrap_or_default();
        let count = columns.len() / rows.max(1);
        PyArray1::from_vec(py, columns).reshape([count, rows])
    }

    fn inseparable<'py>(&self, py: Python<'py>, points: Vec<usize>, limit: f64) -> PyResult<Pairs<'py>> {
        let pairs = self.query(py, |trial, pool| trial.inseparable(&points, limit, pool))?;
        let groups = |of: fn(&(usize, usize, f64)) -> usize| {
            PyArray1::from_iter(py, pairs.iter().map(|pair| of(pair) as i64))
        };
        let rho = PyArray1::from_iter(py, pairs.iter().map(|pair| pair.2));
        Ok((groups(|pair| pair.0), groups(|pair| pair.1), rho))
    }
}
