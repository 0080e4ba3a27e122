//! Parametrizations of rotation corrections: rotation vectors, or the three angles of ISIS.

use crate::geometry::angle_axis::{angle_axis_with_jacobian, right_jacobian_rate};
use crate::geometry::{Matrix3, Vector3};

/// Correction of the attitudes of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rotations {
    /// Rotation vectors r about the axes of the photo: `A = A_0 Exp(r)`.
    #[default]
    Vector,
    /// Angles, added to the angles of the table. `M = [a3]_3 [a2]_1 [a1]_3` rotates from the axes of the table to a camera that looks along
    /// its third axis, x right and y down: `A = M' F`, F = diag(1, -1, -1).
    Zxz,
}

/// Corrected attitude and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct CorrectedAttitude {
    pub attitude: Matrix3,
    /// w, about the axes of the photo.
    pub rate: Vector3,
    /// Rotation about these axes per unit of each of the three corrections, as columns.
    pub jacobian: Matrix3,
    /// Sum of table and corrections, and its rate.
    pub turn: [Vector3; 2],
}

/// Returns the columns a1, a2, a3 of K without F: `[a3]_3 [a2]_1 e3, [a3]_3 e1, e3`.
fn columns([_, a2, a3]: [f64; 3]) -> [Vector3; 3] {
    let ((s2, c2), (s3, c3)) = (a2.sin_cos(), a3.sin_cos());
    [Vector3::new(s3 * s2, c3 * s2, c2), Vector3::new(c3, -s3, 0.0), Vector3::z()]
}

/// Returns F times a vector.
fn looking_back(v: Vector3) -> Vector3 {
    Vector3::new(v.x, -v.y, -v.z)
}

/// Returns `A = M' F` of three angles.
fn attitude(a: &Vector3) -> Matrix3 {
    // The columns of M' F are e1, -e2, -e3 rotated back by the three angles.
    let ((s1, c1), (s2, c2), (s3, c3)) = (a.x.sin_cos(), a.y.sin_cos(), a.z.sin_cos());
    let first = Vector3::new(c3 * c1 - s3 * c2 * s1, c3 * s1 + s3 * c2 * c1, s3 * s2);
    let second = Vector3::new(-s3 * c1 - c3 * c2 * s1, -s3 * s1 + c3 * c2 * c1, c3 * s2);
    let third = Vector3::new(s2 * s1, -s2 * c1, c2);
    Matrix3::from_columns(&[first, -second, -third])
}

/// Returns the three angles of an attitude.
fn angles(a: &Matrix3) -> Vector3 {
    // The rows of M are the columns of A with the second and third negated.
    let (m13, m23) = (a[(2, 0)], -a[(2, 1)]);
    let (m31, m32, m33) = (-a[(0, 2)], -a[(1, 2)], -a[(2, 2)]);
    Vector3::new(m31.atan2(-m32), m31.hypot(m32).atan2(m33), m13.atan2(m23))
}

impl Rotations {
    /// Returns the corrected attitude of a table attitude and its rate, for given corrections and rates. NaN if sin a2 is zero.
    pub(super) fn corrected(
        self,
        (attitude, rate): (Matrix3, Vector3),
        turn: [Vector3; 2],
    ) -> CorrectedAttitude {
        match self {
            Self::Vector => {
                let (exp, left) = angle_axis_with_jacobian(&turn[0]);
                let jacobian = left.transpose();
                let rate = exp.tr_mul(&rate) + jacobian * turn[1];
                CorrectedAttitude { attitude: attitude * exp, rate, jacobian, turn }
            }
            Self::Zxz => {
                let table = angles(&attitude);
                let changes = Self::zxz_jacobian(&table).try_inverse().map(|inverse| inverse * rate);
                let changes = changes.unwrap_or_else(|| Vector3::repeat(f64::NAN));
                let turn = [table + turn[0], changes + turn[1]];
                let jacobian = Self::zxz_jacobian(&turn[0]);
                CorrectedAttitude {
                    attitude: self::attitude(&turn[0]),
                    rate: jacobian * turn[1],
                    jacobian,
                    turn,
                }
            }
        }
    }

    /// Returns the derivative of the Jacobian of a corrected attitude per second.
    pub(super) fn jacobian_rate(self, [turn, rate]: &[Vector3; 2]) -> Matrix3 {
        match self {
            Self::Vector => right_jacobian_rate(turn, rate),
            Self::Zxz => {
                let (s2, c2) = turn.y.sin_cos();
                let [first, second, _] = columns((*turn).into());
                // The rotation by a3 changes the first two columns by -a3', the rotation by a2 only the first by -a2'.
                let by_third = |v: &Vector3| -rate.z * Vector3::z().cross(v);
                let (s3, c3) = turn.z.sin_cos();
                let by_second = rate.y * Vector3::new(s3 * c2, c3 * c2, -s2);
                Matrix3::from_columns(&[
                    looking_back(by_third(&first) + by_second),
                    looking_back(by_third(&second)),
                    Vector3::zeros(),
                ])
            }
        }
    }

    /// Returns K with rho = K da.
    fn zxz_jacobian(a: &Vector3) -> Matrix3 {
        Matrix3::from_columns(&columns((*a).into()).map(looking_back))
    }
}
