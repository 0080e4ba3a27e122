//! Shared parameters of observations, and rigs.

use photocore::geometry::Matrix3;
use photocore::network::commons::Measure;
use photocore::network::mounts::OnFrame;
use photocore::network::{AdjustedCommon, Common, CommonKind, Mount};
use pyo3::prelude::*;

use crate::adjustment::unknown;

/// Returns the types of shared parameters, each with the names and physical quantities of its components.
pub fn kinds() -> Vec<(&'static str, Vec<(&'static str, &'static str)>)> {
    let facts = |kind: &CommonKind| {
        let unknowns = kind.unknowns().iter().map(|&(name, _, measure)| (name, measured(measure)));
        (kind.name(), unknowns.collect())
    };
    CommonKind::ALL.iter().map(facts).collect()
}

fn measured(measure: Measure) -> &'static str {
    match measure {
        Measure::Length => "length",
        Measure::Speed => "speed",
        Measure::Angle => "angle",
        Measure::Rate => "rate",
        Measure::Time => "time",
        Measure::Ratio => "ratio",
        Measure::InImage => "in image",
        Measure::PerImage => "per image",
    }
}

/// Type, position, rotation matrix row by row, standard deviations.
pub type CommonRow = (String, [f64; 3], [f64; 9], Vec<f64>);

/// Converts a row to a shared parameter.
pub fn common((kind, position, attitude, sd): CommonRow) -> PyResult<Common> {
    let kind = CommonKind::named(&kind).ok_or_else(|| unknown("kind of unknown", &kind))?;
    Ok(Common { kind, position, attitude: Matrix3::from_row_slice(&attitude), sd })
}

/// Index of a photo, index of the photo of its frame, and index of its sensor among the shared parameters.
pub type MountRow = (usize, usize, usize);

/// Converts a row to a pose link.
pub fn mount((photo, frame, sensor): MountRow) -> Mount {
    OnFrame { photo, frame, sensor }.into()
}

/// Change, position, rotation matrix row by row, cofactors row by row, cofactors with the previous parameter, redundancy numbers, number of
/// observations.
pub type AdjustedRow = (Vec<f64>, [f64; 3], Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, usize);

/// Converts an adjusted shared parameter to a row.
pub fn adjusted_row(common: AdjustedCommon) -> AdjustedRow {
    let AdjustedCommon { change, position, attitude, cofactors, with_former, redundancy, observations } =
        common;
    (
        change,
        position,
        attitude.transpose().as_slice().to_vec(),
        cofactors.data.into(),
        with_former.transpose().as_slice().to_vec(),
        redundancy,
        observations,
    )
}
