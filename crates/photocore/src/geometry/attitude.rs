//! Attitude parametrizations of files and users, and their derivatives with respect to a rotation step.
//!
//! A is the matrix photo to object of a [`super::Pose`], stepped by A <- A Exp(rho). Mx, My, Mz rotate the axes about x (y towards z), y (z
//! towards x) and z (x towards y). Each parametrization provides A from its numbers, its numbers from A, and K with rho = K d(numbers).
//! Cofactors are K^-1 Q K^-T. Middle angles use `atan2`: an arcsine loses half of its digits near 90 degrees.

use std::f64::consts::PI;

use super::angle_axis::{angle_axis_rotation, right_jacobian_inverse, rotation_angle_axis};
use super::rotation::{Matrix3, Vector3};
use super::rotation::{nearest_turns, rotation, rotation_angles};

/// Direction of the rotation matrix M of omega, phi, kappa.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RotationSense {
    /// u = M d
    GroundToPhoto,
    /// u = M^T d
    PhotoToGround,
}

impl RotationSense {
    /// Returns omega, phi, kappa of A Exp(rho), if A has the given angles.
    ///
    /// Equivalent angles (full rotations; 180 degrees - phi with omega and kappa + 180 degrees) are chosen nearest to the given ones. The
    /// angles are therefore continuous if phi passes 90 degrees; they reproduce the matrix to rounding there.
    ///
    /// ```
    /// use photocore::geometry::{RotationSense, Vector3};
    ///
    /// let rho = Vector3::new(0.0, 0.02, 0.0);
    /// let [omega, phi, kappa] = RotationSense::GroundToPhoto.stepped([0.0, 1.56, 0.0], &rho);
    /// assert!((phi - 1.58).abs() < 1e-14 && omega.abs() < 1e-12 && kappa.abs() < 1e-12);
    /// ```
    pub fn stepped(self, angles: [f64; 3], rho: &Vector3) -> [f64; 3] {
        let numbers = AttitudeNumbers::OmegaPhiKappa(self);
        let found = numbers.regular_numbers(&(numbers.attitude(angles) * angle_axis_rotation(rho)));
        let other = [found[0] + PI, PI - found[1], found[2] + PI];
        let [found, other] = [found, other].map(|triple| nearest_turns(triple, angles));
        let difference = |triple: &[f64; 3]| (Vector3::from(*triple) - Vector3::from(angles)).norm_squared();
        if difference(&other) < difference(&found) { other } else { found }
    }
}

/// Returns the rotation between photo axes and vision axes (x right, y down, z forward); its own inverse.
pub fn vision_axes() -> Matrix3 {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

/// Parametrization of an attitude by three numbers; all angles in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AttitudeNumbers {
    /// omega, phi, kappa: A = (Mz My Mx)^T ground to photo, A = Mz My Mx photo to ground.
    OmegaPhiKappa(RotationSense),
    /// phi, omega, kappa (phi primary): A = (Mz(kappa) Mx(omega) My(phi))^T.
    PhiOmegaKappa,
    /// Azimuth of the viewing direction, clockwise from +Y; tilt from the nadir; swing, clockwise from the photo's +y to the nadir point. A
    /// = (Mz(swing + pi) Mx(tilt) Mz(-azimuth))^T.
    AzimuthTiltSwing,
    /// Yaw clockwise from north, pitch nose up, roll right wing down; object axes east, north, up; A = E R(yaw, pitch, roll) B^T with the
    /// boresight B.
    YawPitchRoll(Matrix3),
    /// A = Exp(r).
    RotationVector,
    /// A^T = Exp(r), used by BAL and Bundler.
    RotationVectorToPhoto,
    /// R = F A^T = Exp(r) with F = [`vision_axes`], used by OpenCV.
    RotationVectorToVision,
}

/// Returns Mx, My or Mz (axis 0, 1, 2).
fn turn(axis: usize, angle: f64) -> Matrix3 {
    let (sin, cos) = angle.sin_cos();
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = Matrix3::identity();
    (m[(j, j)], m[(j, k)]) = (cos, sin);
    (m[(k, j)], m[(k, k)]) = (-sin, cos);
    m
}

/// Returns the rotation between east, north, up and north, east, down; its own inverse.
fn level_axes() -> Matrix3 {
    Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
}

/// Returns K of omega, phi, kappa if M = Mz My Mx = A^T.
fn omega_phi_kappa([_, phi, kappa]: [f64; 3]) -> Matrix3 {
    let ((sp, cp), (sk, ck)) = (phi.sin_cos(), kappa.sin_cos());
    Matrix3::new(cp * ck, sk, 0.0, -cp * sk, ck, 0.0, sp, 0.0, 1.0)
}

impl AttitudeNumbers {
    /// Returns the boresight, photo from body, of a nadir camera whose image top points forward, rotated `quarters` times 90 degrees to the
    /// right (1: image top towards the right wing).
    pub fn nadir_boresight(quarters: u8) -> Matrix3 {
        (level_axes() * turn(2, 0.5 * PI * f64::from(quarters))).transpose()
    }

    /// Returns A of the numbers.
    pub fn attitude(&self, numbers: [f64; 3]) -> Matrix3 {
        let [p, q, r] = numbers;
        match self {
            Self::OmegaPhiKappa(RotationSense::GroundToPhoto) => rotation(numbers).transpose(),
            Self::OmegaPhiKappa(RotationSense::PhotoToGround) => rotation(numbers),
            Self::PhiOmegaKappa => (turn(2, r) * turn(0, q) * turn(1, p)).transpose(),
            Self::AzimuthTiltSwing => (turn(2, r + PI) * turn(0, q) * turn(2, -p)).transpose(),
            Self::YawPitchRoll(boresight) => {
                let body = (turn(0, r) * turn(1, q) * turn(2, p)).transpose();
                level_axes() * body * boresight.transpose()
            }
            Self::RotationVector => angle_axis_rotation(&numbers.into()),
            Self::RotationVectorToPhoto => angle_axis_rotation(&numbers.into()).transpose(),
            Self::RotationVectorToVision => angle_axis_rotation(&numbers.into()).transpose() * vision_axes(),
        }
    }

    /// Returns the numbers of A. At a singular attitude (see [`AttitudeNumbers::is_singular`]) the last angle is zero; of a vertical photo
    /// the azimuth is zero.
    pub fn numbers(&self, attitude: &Matrix3) -> [f64; 3] {
        let found = self.regular_numbers(attitude);
        if !self.is_singular(found) {
            return found;
        }
        let m = attitude.transpose();
        match self {
            Self::OmegaPhiKappa(sense) => {
                let m = if *sense == RotationSense::GroundToPhoto { m } else { *attitude };
                [(found[1].signum() * m[(0, 1)]).atan2(m[(1, 1)]), found[1], 0.0]
            }
            // With kappa = 0 the first row of M is cos phi, 0, -sin phi.
            Self::PhiOmegaKappa => [(-m[(0, 2)]).atan2(m[(0, 0)]), found[1], 0.0],
            // With azimuth = 0 the first row of M is cos, sin cos t, sin sin t of swing + pi.
            Self::AzimuthTiltSwing => [0.0, found[1], (-m[(1, 0)]).atan2(m[(0, 0)]) - PI].map(wrapped),
            Self::YawPitchRoll(boresight) => {
                let body = level_axes() * attitude * boresight;
                // With roll = 0 the second column is -sin yaw, cos yaw, 0.
                [(-body[(0, 1)]).atan2(body[(1, 1)]), found[1], 0.0]
            }
            Self::RotationVector | Self::RotationVectorToPhoto | Self::RotationVectorToVision => found,
        }
    }

    fn regular_numbers(&self, a: &Matrix3) -> [f64; 3] {
        // M = A^T: m_ij = a_ji.
        let m = |i: usize, j: usize| a[(j - 1, i - 1)];
        match self {
            Self::OmegaPhiKappa(RotationSense::GroundToPhoto) => rotation_angles(&a.transpose()),
            Self::OmegaPhiKappa(RotationSense::PhotoToGround) => rotation_angles(a),
            Self::PhiOmegaKappa => {
                [m(3, 1).atan2(m(3, 3)), (-m(3, 2)).atan2(m(1, 2).hypot(m(2, 2))), m(1, 2).atan2(m(2, 2))]
            }
            Self::AzimuthTiltSwing => [
                (-m(3, 1)).atan2(-m(3, 2)),
                m(3, 1).hypot(m(3, 2)).atan2(m(3, 3)),
                (-m(1, 3)).atan2(-m(2, 3)),
            ],
            Self::YawPitchRoll(boresight) => {
                let body = level_axes() * a * boresight;
                let r = |i: usize, j: usize| body[(i - 1, j - 1)];
                [r(2, 1).atan2(r(1, 1)), (-r(3, 1)).atan2(r(1, 1).hypot(r(2, 1))), r(3, 2).atan2(r(3, 3))]
            }
            Self::RotationVector => rotation_angle_axis(a).into(),
            Self::RotationVectorToPhoto => rotation_angle_axis(&a.transpose()).into(),
            Self::RotationVectorToVision => rotation_angle_axis(&(vision_axes() * a.transpose())).into(),
        }
    }

    /// Returns K with rho = K d(numbers).
    pub fn rates(&self, numbers: [f64; 3]) -> Matrix3 {
        let [_, q, r] = numbers;
        let inverse = |rates: Matrix3| rates.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
        match self {
            Self::OmegaPhiKappa(RotationSense::GroundToPhoto) => omega_phi_kappa(numbers),
            Self::OmegaPhiKappa(RotationSense::PhotoToGround) => {
                -rotation(numbers).tr_mul(&omega_phi_kappa(numbers))
            }
            Self::PhiOmegaKappa => {
                let turned = turn(2, r);
                Matrix3::from_columns(&[
                    turned * turn(0, q) * Vector3::y(),
                    turned.column(0).into(),
                    Vector3::z(),
                ])
            }
            Self::AzimuthTiltSwing => {
                let turned = turn(2, r + PI);
                Matrix3::from_columns(&[
                    -(turned * turn(0, q) * Vector3::z()),
                    turned.column(0).into(),
                    Vector3::z(),
                ])
            }
            Self::YawPitchRoll(boresight) => {
                let ((sq, cq), (sr, cr)) = (q.sin_cos(), r.sin_cos());
                boresight * Matrix3::new(-sq, 0.0, 1.0, sr * cq, cr, 0.0, cr * cq, -sr, 0.0)
            }
            Self::RotationVector => inverse(right_jacobian_inverse(&numbers.into())),
            Self::RotationVectorToPhoto => -inverse(right_jacobian_inverse(&-Vector3::from(numbers))),
            Self::RotationVectorToVision => {
                -(vision_axes() * inverse(right_jacobian_inverse(&-Vector3::from(numbers))))
            }
        }
    }

    /// Returns whether two of the angles are not separable: the middle angle is within 1e-8 of the gimbal lock.
    pub fn is_singular(&self, numbers: [f64; 3]) -> bool {
        const NEAR: f64 = 1e-8;
        match self {
            Self::OmegaPhiKappa(_) | Self::PhiOmegaKappa | Self::YawPitchRoll(_) => {
                numbers[1].cos().abs() < NEAR
            }
            Self::AzimuthTiltSwing => numbers[1].sin().abs() < NEAR,
            Self::RotationVector | Self::RotationVectorToPhoto | Self::RotationVectorToVision => false,
        }
    }

    /// Returns K^-1 with d(numbers) = K^-1 rho; None at a singular attitude.
    pub fn by_step(&self, numbers: [f64; 3]) -> Option<Matrix3> {
        self.rates(numbers).try_inverse().filter(|_| !self.is_singular(numbers))
    }

    /// Returns the cofactors K^-1 Q K^-T of the numbers from the cofactors Q of the rotation step; None at a singular attitude.
    pub fn cofactors(&self, numbers: [f64; 3], of_step: &Matrix3) -> Option<Matrix3> {
        let inverse = self.by_step(numbers)?;
        Some(inverse * of_step * inverse.transpose())
    }
}

/// Reduces an angle to [-pi, pi].
fn wrapped(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

/// Returns the partials of the unit quaternion w, x, y, z of A with respect to rho, one row per component: dq = 1/2 q (0, rho).
pub fn quaternion_by_step([w, x, y, z]: [f64; 4]) -> [Vector3; 4] {
    [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]].map(|row| 0.5 * Vector3::from(row))
}

/// Returns the same partials for R = F A^T, vision from object (COLMAP): dq = 1/2 (0, -F rho) q with F = [`vision_axes`].
pub fn vision_quaternion_by_step([w, x, y, z]: [f64; 4]) -> [Vector3; 4] {
    [[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]].map(|[a, b, c]| 0.5 * Vector3::new(-a, b, c))
}
