//! Data snooping of a network.

use std::collections::BTreeSet;

use numpy::PyArray1;
use photocore::network::NetworkError as Failure;
use photocore::network::TestKind;
use photocore::network::snooping::{
    Consensus, Consequence, ControlParts, Kept, Log, Predicted, Remark, Removal, Round, Settings, Snooping,
    Standing,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::trial::NetworkTrial;
use crate::adjustment::{status_name, unknown};

/// Data snooping of a network; see the stub.
#[pyclass(module = "photogram._photocore")]
pub struct NetworkSnooping {
    snooping: Option<Snooping>,
}

/// Status, weighted sum of squares, degrees of freedom.
type StandingRow = (&'static str, f64, i64);

/// Groups of images, and photos, that a consensus excludes.
type ConsensusRow = (Vec<usize>, BTreeSet<usize>);

/// Code, and the groups, photos or values of it.
type CodeRow = (&'static str, Vec<f64>);

/// Number of a type, and factor of its standard deviations.
type FactorRow = (u8, f64);

fn standing_row(standing: Standing) -> StandingRow {
    (status_name(standing.status), standing.sum_of_squares, standing.degrees_of_freedom)
}

fn factor_rows(factors: Vec<(TestKind, f64)>) -> Vec<FactorRow> {
    factors.into_iter().map(|(kind, factor)| (kind as u8, factor)).collect()
}

fn consensus_of((images, photos): ConsensusRow) -> Consensus {
    Consensus { images, photos }
}

fn consequence_row(consequence: Consequence) -> CodeRow {
    match consequence {
        Consequence::PointUndetermined => ("point-undetermined", vec![]),
        Consequence::SingleRay(group) => ("single-ray", vec![group as f64]),
        Consequence::DivergentRays => ("rays-part", vec![]),
        Consequence::Median(median, usual) => ("median", vec![median, usual]),
        Consequence::Singly(removed, images) => ("singly", vec![removed as f64, images as f64]),
        Consequence::Contradicted(photo) => ("contradicted", vec![photo as f64]),
    }
}

fn remark_row(remark: Remark) -> (&'static str, Vec<f64>, Vec<FactorRow>) {
    match remark {
        Remark::Factors { overall, by_type } => ("factors", vec![overall], factor_rows(by_type)),
        Remark::Aside(points) => ("aside", vec![points as f64], vec![]),
        Remark::NotEnded => ("not-ended", vec![], vec![]),
        Remark::Consensus { is_adjusted, images, agreeing } => {
            let code = if is_adjusted { "bent" } else { "undetermined" };
            (code, vec![images as f64, agreeing as f64], vec![])
        }
    }
}

fn kept_code(kept: Kept) -> &'static str {
    match kept {
        Kept::Needed => "needed",
        Kept::PhotoUndetermined => "photo-undetermined",
        Kept::Disputed => "disputed",
    }
}

fn removal_row(py: Python<'_>, own: Removal) -> PyResult<Bound<'_, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("round", own.round)?;
    row.set_item("group", own.group)?;
    row.set_item("photo", own.photo)?;
    row.set_item("rows", own.rows)?;
    row.set_item("dimension", own.dimension)?;
    row.set_item("first_statistic", own.first_statistic)?;
    row.set_item("statistic", own.statistic)?;
    row.set_item("fisher", own.fisher)?;
    row.set_item("log_probability", own.log_probability)?;
    row.set_item("limit", own.limit)?;
    row.set_item("error", own.error)?;
    row.set_item("error_sd", own.error_sd)?;
    row.set_item("redundancy", own.redundancy)?;
    let rivals = own.rivals.into_iter().map(|own| (own.group, own.statistic, own.dimension, own.odds));
    row.set_item("rivals", rivals.collect::<Vec<_>>())?;
    row.set_item("consequences", own.consequences.into_iter().map(consequence_row).collect::<Vec<_>>())?;
    let prediction = own
        .prediction
        .map(|Predicted { statistic, log_probability, error }| (statistic, log_probability, error));
    row.set_item("prediction", prediction)?;
    row.set_item("returned", own.returned)?;
    row.set_item("kept", own.kept.map(kept_code))?;
    Ok(row)
}

fn log_row(py: Python<'_>, log: Log) -> PyResult<Bound<'_, PyDict>> {
    let row = PyDict::new(py);
    let removals = log.removals.into_iter().map(|own| removal_row(py, own)).collect::<PyResult<Vec<_>>>()?;
    row.set_item("removals", removals)?;
    let rounds = log.rounds.into_iter().map(|own| {
        let Round { number, standing, limit, removed, returned } = own;
        (number, standing_row(standing), limit, removed, returned)
    });
    row.set_item("rounds", rounds.collect::<Vec<_>>())?;
    row.set_item("remarks", log.remarks.into_iter().map(remark_row).collect::<Vec<_>>())?;
    row.set_item("rows", PyArray1::from_vec(py, log.out.rows))?;
    row.set_item("points", log.out.points)?;
    row.set_item("photos", log.out.photos)?;
    row.set_item("tests", log.tests)?;
    row.set_item("before", standing_row(log.before))?;
    row.set_item("after", standing_row(log.after))?;
    row.set_item("factors", factor_rows(log.factors))?;
    row.set_item("active", PyArray1::from_vec(py, log.active))?;
    Ok(row)
}

impl NetworkSnooping {
    fn state(&self) -> PyResult<&Snooping> {
        self.snooping.as_ref().ok_or_else(ended)
    }

    fn state_mut(&mut self) -> PyResult<&mut Snooping> {
        self.snooping.as_mut().ok_or_else(ended)
    }
}

fn ended() -> PyErr {
    super::covariances::refused(&Failure::State)
}

#[pymethods]
impl NetworkSnooping {
    #[new]
    #[pyo3(signature = (trial, consensus, *, level, is_rate, known, robust, max_rounds, control, rough, exact, max_rows, is_supported))]
    #[allow(clippy::too_many_arguments, reason = "one for each setting")]
    fn new(
        py: Python<'_>,
        mut trial: PyRefMut<'_, NetworkTrial>,
        consensus: Option<ConsensusRow>,
        level: f64,
        is_rate: bool,
        known: bool,
        robust: Option<bool>,
        max_rounds: usize,
        control: &str,
        rough: f64,
        exact: f64,
        max_rows: usize,
        is_supported: Vec<bool>,
    ) -> PyResult<Self> {
        let control = match control {
            "whole" => ControlParts::Whole,
            "plan and height" => ControlParts::PlanAndHeight,
            "components" => ControlParts::Components,
            other => return Err(unknown("control", other)),
        };
        let mut settings = Settings::default();
        (settings.level, settings.is_rate, settings.known, settings.robust) = (level, is_rate, known, robust);
        (settings.max_rounds, settings.control, settings.is_supported) = (max_rounds, control, is_supported);
        (settings.rough, settings.exact, settings.max_rows) = (rough, exact, max_rows);
        let consensus = consensus.map(consensus_of);
        let snooping = trial.run(py, None, |network| Snooping::new(network, settings, consensus.as_ref()))?;
        Ok(Self { snooping: Some(snooping) })
    }

    #[getter]
    fn needs_consensus(&self) -> PyResult<bool> {
        Ok(self.state()?.needs_consensus())
    }

    fn may_have_common_errors(
        &self,
        py: Python<'_>,
        mut trial: PyRefMut<'_, NetworkTrial>,
    ) -> PyResult<bool> {
        let snooping = self.state()?;
        trial.run(py, None, |network| snooping.may_have_common_errors(network))
    }

    fn restart(
        &mut self,
        py: Python<'_>,
        mut trial: PyRefMut<'_, NetworkTrial>,
        consensus: ConsensusRow,
    ) -> PyResult<()> {
        let (snooping, consensus) = (self.state_mut()?, consensus_of(consensus));
        trial.run(py, None, |network| snooping.restart(network, &consensus))
    }

    fn adjust_exactly(
        &mut self,
        py: Python<'_>,
        mut trial: PyRefMut<'_, NetworkTrial>,
    ) -> PyResult<StandingRow> {
        let snooping = self.state_mut()?;
        trial.run(py, None, |network| snooping.adjust_exactly(network)).map(standing_row)
    }

    fn run(&mut self, py: Python<'_>, mut trial: PyRefMut<'_, NetworkTrial>) -> PyResult<()> {
        let snooping = self.state_mut()?;
        trial.run(py, None, |network| snooping.run(network))
    }

    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let log = self.snooping.take().ok_or_else(ended)?.finish();
        log_row(py, log)
    }
}
