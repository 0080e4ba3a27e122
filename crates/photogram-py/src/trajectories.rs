//! Trajectories, and photos on them.

use numpy::PyReadonlyArrayDyn;
use photocore::geometry::trajectory::{
    Attitudes, Basis, Interpolation, Polynomial, Positions, Spline, Trajectory as Course,
};
use photocore::geometry::{Matrix3, Vector3};
use photocore::network::Trajectory;
use photocore::network::mounts::OnTrajectory;
use pyo3::prelude::*;

use crate::arrays::{InputError, rows};
use crate::options::unknown;

type Numbers<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Name, degree, and the numbers of a basis: reference and scale of a polynomial, knots of a spline.
type BasisRow = (String, usize, Vec<f64>);

/// Times and rotation matrices, and how they are joined.
type AttitudesRow<'py> = (Vec<f64>, Numbers<'py>, String);

/// A trajectory as Python says it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct TrajectoryRow<'py> {
    times: Vec<f64>,
    positions: Numbers<'py>,
    velocities: Option<Numbers<'py>>,
    interpolation: String,
    attitudes: AttitudesRow<'py>,
    position_basis: BasisRow,
    rotation_basis: BasisRow,
    position: Vec<usize>,
    rotation: Vec<usize>,
    body: Option<AttitudesRow<'py>>,
}

/// Indices of a photo and a trajectory, the time there, indices of its rate and offset among the unknowns.
pub type TimedRow = (usize, usize, f64, Option<usize>, Option<usize>);

/// The mount of a row.
pub fn on_trajectory((photo, trajectory, time, rate, offset): TimedRow) -> OnTrajectory {
    OnTrajectory { photo, trajectory, time, rate, offset }
}

/// The trajectory of a row.
pub fn trajectory(row: TrajectoryRow<'_>) -> PyResult<Trajectory> {
    let vectors = |name, array: &Numbers<'_>| -> PyResult<Vec<Vector3>> {
        Ok(rows::<3>(name, array)?.into_iter().map(Vector3::from).collect())
    };
    let velocities = row.velocities.as_ref().map(|own| vectors("velocities", own)).transpose()?;
    let places = vectors("positions", &row.positions)?;
    let refused =
        || InputError::new_err("times of a trajectory do not increase, or are not as many as records");
    let positions =
        Positions::new(row.times, places, velocities.unwrap_or_default(), interpolation(&row.interpolation)?);
    let course = Course {
        positions: positions.ok_or_else(refused)?,
        attitudes: attitudes(row.attitudes)?.ok_or_else(refused)?,
        position: basis(row.position_basis)?,
        rotation: basis(row.rotation_basis)?,
        body: row.body.map(|own| attitudes(own)?.ok_or_else(refused)).transpose()?,
    };
    Ok(Trajectory { course, position: row.position, rotation: row.rotation })
}

fn attitudes((times, matrices, joined): AttitudesRow<'_>) -> PyResult<Option<Attitudes>> {
    let all = rows::<9>("attitudes", &matrices)?;
    let all = all.iter().map(|row| Matrix3::from_row_slice(row)).collect();
    Ok(Attitudes::new(times, all, interpolation(&joined)?))
}

fn interpolation(name: &str) -> PyResult<Interpolation> {
    Ok(match name {
        "linear" => Interpolation::Linear,
        "hermite" => Interpolation::Hermite,
        "lagrange" => Interpolation::Lagrange,
        other => return Err(unknown("interpolation", other)),
    })
}

fn basis((kind, degree, numbers): BasisRow) -> PyResult<Basis> {
    Ok(match (kind.as_str(), &numbers[..]) {
        ("none", _) => Basis::None,
        ("polynomial", &[reference, scale]) => Basis::Polynomial(Polynomial { degree, reference, scale }),
        ("spline", _) => Basis::Spline(Spline { degree, knots: numbers }),
        (other, _) => return Err(unknown("basis", other)),
    })
}
