//! Trajectories, and photos on them.

use photocore::geometry::trajectory::{
    Attitudes, Axes, Basis, Flight, Interpolation, Positions, Rotations, Trajectory as Course,
};
use photocore::geometry::{Matrix3, Vector3};
use photocore::network::Trajectory;
use photocore::network::mounts::OnTrajectory;
use pyo3::prelude::*;

use crate::adjustment::unknown;
use crate::arrays::{Array, InputError, Matrix, rows, table};

/// Name, degree, and the numbers of a basis: reference and scale of a polynomial, knots of a spline.
type BasisRow = (String, usize, Vec<f64>);

/// Times and rotation matrices, and the interpolation.
type AttitudesRow<'py> = (Vec<f64>, Array<'py>, String);

/// Trajectory as Python attributes.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct TrajectoryRow<'py> {
    times: Vec<f64>,
    positions: Array<'py>,
    velocities: Option<Array<'py>>,
    interpolation: String,
    attitudes: AttitudesRow<'py>,
    position_basis: BasisRow,
    rotation_basis: BasisRow,
    position: Vec<usize>,
    rotation: Vec<usize>,
    body: Option<AttitudesRow<'py>>,
    axes: String,
    rotations: String,
}

/// Indices of a photo and a trajectory, the time, and indices of the rate and offset among the shared parameters.
pub type TimedRow = (usize, usize, f64, Option<usize>, Option<usize>);

/// Converts a row to a pose link.
pub fn on_trajectory((photo, trajectory, time, rate, offset): TimedRow) -> OnTrajectory {
    OnTrajectory { photo, trajectory, time, rate, offset }
}

/// Converts a row to a trajectory.
pub fn trajectory(row: TrajectoryRow<'_>) -> PyResult<Trajectory> {
    let vectors = |name, array: &Array<'_>| -> PyResult<Vec<Vector3>> {
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
        axes: match row.axes.as_str() {
            "table" => Axes::Table,
            "orbit" => Axes::Orbit(Vector3::zeros()),
            "flight" => Axes::Flight,
            other => return Err(unknown("position_axes", other)),
        },
        rotations: match row.rotations.as_str() {
            "vector" => Rotations::Vector,
            "zxz" => Rotations::Zxz,
            other => return Err(unknown("angles", other)),
        },
    };
    Ok(Trajectory { course, position: row.position, rotation: row.rotation })
}

/// Nonzero basis functions per time: index of the first, and their values.
type ActiveRow = Vec<(usize, Vec<f64>)>;

/// Positions, attitudes row by row, axes of coefficients row by row, right Jacobians row by row; functions of positions, of rotations.
type FlownRow<'py> = (Matrix<'py>, Matrix<'py>, Matrix<'py>, Matrix<'py>, ActiveRow, ActiveRow);

#[pyfunction]
pub fn trajectory_span(trajectory: TrajectoryRow<'_>) -> PyResult<(f64, f64)> {
    Ok(self::trajectory(trajectory)?.course.span())
}

#[pyfunction]
pub fn flown<'py>(
    py: Python<'py>,
    trajectory: TrajectoryRow<'py>,
    position: Array<'py>,
    rotation: Array<'py>,
    times: Vec<f64>,
) -> PyResult<FlownRow<'py>> {
    let course = self::trajectory(trajectory)?.course;
    let c = rows::<3>("position", &position)?;
    let r = rows::<3>("rotation", &rotation)?;
    if (c.len(), r.len()) != (course.position.count(), course.rotation.count()) {
        return Err(InputError::new_err("a trajectory has not as many coefficients as functions"));
    }
    let own = |all: &[[f64; 3]], k: usize| all.get(k).map_or_else(Vector3::zeros, |&own| own.into());
    let flights: Vec<_> =
        times.iter().map(|&time| course.at(time, &|k| own(&c, k), &|k| own(&r, k))).collect();
    let matrix = |of: &dyn Fn(&Flight) -> Matrix3| -> Vec<[f64; 9]> {
        flights.iter().map(|own| std::array::from_fn(|k| of(own)[(k / 3, k % 3)])).collect()
    };
    let active = |basis: &Basis| -> ActiveRow {
        let of = |&time: &f64| {
            let found = basis.at(time);
            (found.first, found.values.to_vec())
        };
        times.iter().map(of).collect()
    };
    Ok((
        table(py, flights.iter().map(|own| <[f64; 3]>::from(own.motion.pose.position)).collect())?,
        table(py, matrix(&|own| own.motion.pose.attitude))?,
        table(py, matrix(&|own| own.axes))?,
        table(py, matrix(&|own| own.jacobian))?,
        active(&course.position),
        active(&course.rotation),
    ))
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
    Basis::from_numbers(&kind, degree, &numbers).ok_or_else(|| unknown("basis", &kind))
}
