//! Attitudes in every representation; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use photocore::geometry::angle_axis::{quaternion, quaternion_rotation};
use photocore::geometry::attitude::{quaternion_by_step, vision_axes, vision_quaternion_by_step};
use photocore::geometry::{AttitudeNumbers, Matrix3, RotationSense, Vector3};
use pyo3::prelude::*;

use crate::arrays::{Array, InputError, Matrix, blocks, from_rows, matrices, row_major, rows, table};

/// Two arrays with one row or matrix per attitude.
type RotationRow<'py, A, B> = PyResult<(Bound<'py, A>, Bound<'py, B>)>;

/// Representation of an attitude by numbers.
enum Representation {
    Three(AttitudeNumbers),
    /// Quaternion of A.
    Quaternion,
    /// Quaternion of R = F A^T.
    VisionQuaternion,
}

impl Representation {
    fn named(name: &str, boresight: [[f64; 3]; 3]) -> PyResult<Self> {
        let sequential = |sense| Self::Three(AttitudeNumbers::OmegaPhiKappa(sense));
        Ok(match name {
            "omega_phi_kappa" => sequential(RotationSense::GroundToPhoto),
            "omega_phi_kappa_photo_to_ground" => sequential(RotationSense::PhotoToGround),
            "phi_omega_kappa" => Self::Three(AttitudeNumbers::PhiOmegaKappa),
            "azimuth_tilt_swing" => Self::Three(AttitudeNumbers::AzimuthTiltSwing),
            "yaw_pitch_roll" => Self::Three(AttitudeNumbers::YawPitchRoll(from_rows(boresight))),
            "rotation_vector" => Self::Three(AttitudeNumbers::RotationVector),
            "rotation_vector_to_photo" => Self::Three(AttitudeNumbers::RotationVectorToPhoto),
            "rotation_vector_to_vision" => Self::Three(AttitudeNumbers::RotationVectorToVision),
            "quaternion" => Self::Quaternion,
            "quaternion_to_vision" => Self::VisionQuaternion,
            other => return Err(InputError::new_err(format!("no numbers of attitudes are called {other}"))),
        })
    }

    /// Returns the partials of the numbers with respect to the rotation step, row by row; NaN at a singular attitude.
    fn by_step(&self, numbers: &[f64]) -> Vec<Vector3> {
        match (self, numbers) {
            (Self::Three(kind), &[p, q, r]) => {
                let numbers = [p, q, r];
                let partials = kind.by_step(numbers).unwrap_or_else(|| Matrix3::repeat(f64::NAN));
                partials.row_iter().map(|row| row.transpose()).collect()
            }
            (Self::Quaternion, &[w, x, y, z]) => quaternion_by_step([w, x, y, z]).to_vec(),
            (_, &[w, x, y, z]) => vision_quaternion_by_step([w, x, y, z]).to_vec(),
            _ => vec![],
        }
    }
}

#[pyfunction]
pub fn attitudes_from_numbers<'py>(
    py: Python<'py>,
    representation: &str,
    numbers: Array<'py>,
    boresight: [[f64; 3]; 3],
) -> RotationRow<'py, PyArray3<f64>, PyArray3<f64>> {
    let representation = Representation::named(representation, boresight)?;
    let (mut attitudes, mut rates) = (vec![], vec![]);
    match &representation {
        Representation::Three(kind) => {
            for numbers in rows::<3>("values", &numbers)? {
                attitudes.push(row_major(&kind.attitude(numbers)));
                rates.extend(row_major(&kind.rates(numbers)).as_flattened());
            }
        }
        Representation::Quaternion | Representation::VisionQuaternion => {
            for q in rows::<4>("values", &numbers)? {
                let length = q.iter().map(|value| value * value).sum::<f64>().sqrt();
                let q = q.map(|value| value / length);
                let rotation = quaternion_rotation(q);
                let vision = matches!(representation, Representation::VisionQuaternion);
                let attitude = if vision { rotation.transpose() * vision_axes() } else { rotation };
                attitudes.push(row_major(&attitude));
                // dq = W rho / 2 with orthonormal columns of W: rho = 2 W^T dq for a normalised quaternion.
                let by_step = representation.by_step(&q);
                rates.extend((0..3).flat_map(|k| by_step.iter().map(move |row| 4.0 * row[k] / length)));
            }
        }
    }
    let shape = [attitudes.len(), 3, numbers.shape()[1]];
    Ok((blocks(py, attitudes)?, PyArray1::from_vec(py, rates).reshape(shape)?))
}

#[pyfunction]
pub fn numbers_of_attitudes<'py>(
    py: Python<'py>,
    representation: &str,
    attitudes: Array<'py>,
    boresight: [[f64; 3]; 3],
) -> RotationRow<'py, PyArray2<f64>, PyArray3<f64>> {
    let representation = Representation::named(representation, boresight)?;
    let attitudes = matrices::<3>("matrices", &attitudes)?;
    let count = attitudes.len();
    let (mut numbers, mut partials) = (vec![], vec![]);
    for attitude in attitudes {
        let attitude = from_rows(attitude);
        let found = match &representation {
            Representation::Three(kind) => kind.numbers(&attitude).to_vec(),
            Representation::Quaternion => quaternion(&attitude).to_vec(),
            Representation::VisionQuaternion => quaternion(&(vision_axes() * attitude.transpose())).to_vec(),
        };
        partials.extend(representation.by_step(&found).into_iter().flat_map(|row| row.data.0[0]));
        numbers.extend(found);
    }
    let width = if let Representation::Three(_) = representation { 3 } else { 4 };
    let partials = PyArray1::from_vec(py, partials).reshape([count, width, 3])?;
    Ok((PyArray1::from_vec(py, numbers).reshape([count, width])?, partials))
}

#[pyfunction]
pub fn nadir_boresight(py: Python<'_>, quarters: u8) -> PyResult<Matrix<'_>> {
    table(py, row_major(&AttitudeNumbers::nadir_boresight(quarters)).to_vec())
}
