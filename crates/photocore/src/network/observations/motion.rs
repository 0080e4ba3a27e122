//! Motion of photos on trajectories: velocities from GNSS, rotation rates from gyroscopes, smoothness.

use nalgebra::DMatrix;

use super::{
    CommonKind, Fault, Named, ObservationInputs, ObservationModel, Precision, Quantity, Rows, Touches, nine,
    rotates, three,
};
use crate::geometry::{Matrix3, Vector3};

/// Velocity of the antenna of a photo or record on a trajectory, in the Cartesian axes of the object space.
///
/// `C' + A [w]x l`, with the partials `I` by C', `-A [l]x` by w, `-A [w x l]x` by rho and `A [w]x` by l.
#[derive(Debug, Clone, PartialEq)]
pub struct Velocity {
    /// Photo on a trajectory.
    pub photo: usize,
    /// Velocity in units of the object space per second.
    pub velocity: [f64; 3],
    /// Lever arm l from the projection centre to the antenna, in the axes of the photo.
    pub lever_arm: Quantity<Vector3>,
    /// Precision of X, Y, Z.
    pub precision: Precision,
}

impl ObservationModel for Velocity {
    const ROWS: usize = 3;

    /// Values: velocity, l if fixed; shared parameter: lever arm.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[lever_arm]) = (of.photos, of.commons) else { return None };
        let lever_arm = Quantity::new(lever_arm, three(values, 3)?.into());
        let precision = Precision::Covariance(covariance);
        Some(Self { photo, velocity: three(values, 0)?, lever_arm, precision })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo]).and(self.lever_arm.common(), CommonKind::LeverArm)
    }

    fn moves(&self) -> bool {
        true
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let Some(moving) = inputs.moving(0) else { return };
        let attitude = inputs.pose(0).attitude;
        let lever_arm = self.lever_arm.value(|_| inputs.common(0).vector());
        let around = moving.rate.cross(&lever_arm);
        let computed = moving.velocity + attitude * around;
        rows.residual(0, (Vector3::from(self.velocity) - computed).as_slice());
        rows.by_velocity(0, 0, &Matrix3::identity());
        rows.by_rate(0, 0, &(-attitude * lever_arm.cross_matrix()));
        rows.by_rotation(0, 0, &(-attitude * around.cross_matrix()));
        if self.lever_arm.common().is_some() {
            rows.by_offset(0, 0, &(attitude * moving.rate.cross_matrix()));
        }
    }
}

/// Rotation rate of the body of a camera, about its own axes, at a photo or record on a trajectory.
///
/// `B^T w + b`, with the partials `B^T` by w, `[B^T w]x` by a rotation of B about the axes of the body, and `I` by the bias b.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// Photo on a trajectory.
    pub photo: usize,
    /// Radians per second.
    pub rate: [f64; 3],
    /// Rotation B from body to photo.
    pub boresight: Quantity<Matrix3>,
    /// Shared parameter of the bias b, if any.
    pub bias: Option<usize>,
    /// Precision about the three axes of the body.
    pub precision: Precision,
}

impl ObservationModel for Rate {
    const ROWS: usize = 3;

    /// Values: rate, then B if fixed, row by row; shared parameters: boresight, bias.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[boresight, bias]) = (of.photos, of.commons) else { return None };
        let boresight = Quantity::new(boresight, nine(values, 3)?);
        let precision = Precision::Covariance(covariance);
        Some(Self { photo, rate: three(values, 0)?, boresight, bias, precision })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo])
            .and(self.boresight.common(), CommonKind::Boresight)
            .and(self.bias, CommonKind::GyroBias)
    }

    fn moves(&self) -> bool {
        true
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let Some(moving) = inputs.moving(0) else { return };
        let boresight = self.boresight.value(|_| *inputs.common(0).attitude());
        let bias = usize::from(self.boresight.common().is_some());
        let mut computed = boresight.tr_mul(&moving.rate);
        rows.by_rate(0, 0, &boresight.transpose());
        if self.boresight.common().is_some() {
            rows.by_turn(0, 0, &computed.cross_matrix());
        }
        if self.bias.is_some() {
            computed += inputs.common(bias).vector();
            rows.by_offset(0, bias, &Matrix3::identity());
        }
        rows.residual(0, (Vector3::from(self.rate) - computed).as_slice());
    }

    fn check(&self) -> Result<(), Fault> {
        self.boresight.known().map_or(Ok(()), rotates)
    }
}

/// Weighted sum of trajectory coefficients: differences of neighbours (Eilers and Marx 1996), or one step of a Gauss-Markov process.
///
/// `sum f_k c_k`, with the partials `f_k I`.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothness {
    /// Coefficients: shared parameters of three components.
    pub coefficients: Vec<usize>,
    /// Factor of each coefficient.
    pub factors: Vec<f64>,
    /// Observed sum, usually zero.
    pub observed: [f64; 3],
    /// Precision of x, y, z.
    pub precision: Precision,
}

impl ObservationModel for Smoothness {
    const ROWS: usize = 3;

    /// Values: observed sum, then the factors.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let coefficients: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let factors = values.get(3..)?.to_vec();
        let precision = Precision::Covariance(covariance);
        let sound = factors.len() == coefficients.len();
        sound.then_some(Self { coefficients, factors, observed: three(values, 0)?, precision })
    }

    fn touches(&self) -> Touches {
        Touches { commons: self.coefficients.iter().map(|&own| (own, None)).collect(), ..Touches::default() }
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let mut missing = Vector3::from(self.observed);
        for (k, &factor) in self.factors.iter().enumerate() {
            missing -= factor * inputs.common(k).vector();
            rows.by_offset(0, k, &Matrix3::from_diagonal_element(factor));
        }
        rows.residual(0, missing.as_slice());
    }

    fn check(&self) -> Result<(), Fault> {
        let numbers = self.factors.iter().chain(&self.observed);
        if numbers.into_iter().all(|value| value.is_finite()) { Ok(()) } else { Err(Fault::NotFinite) }
    }
}
