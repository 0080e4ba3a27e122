//! Attitudes of photos from inertial units.

use nalgebra::DMatrix;

use super::{
    CommonKind, Fault, Named, ObservationModel, Precision, Quantity, Rows, Sites, Touches, nine, rotates,
};
use crate::geometry::angle_axis::{right_jacobian_inverse, rotation_angle_axis};
use crate::geometry::{Matrix3, Vector3};

/// The attitude of the body that carries a camera.
///
/// Computed is A B, body to object; the residual is v = Log((A B)^T A_obs), a rotation about the axes of the body, and with
/// Jl = Jr^-1(-v) its partials are -Jl B^T by rho and -Jl by a turn of B about the axes of the body (Sola, Deray and Atchuthan 2018).
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    /// The photo.
    pub photo: usize,
    /// A_obs, body to object: its columns are the axes of the body in those of the space or, where it is geographic, in east, north
    /// and up at the photo.
    pub attitude: Matrix3,
    /// B, body to photo: the identity where what is observed is the attitude of the photo itself.
    pub boresight: Quantity<Matrix3>,
    /// Of rotations about the axes of the body, in radians.
    pub precision: Precision,
}

impl ObservationModel for Attitude {
    const NAME: &'static str = "attitude";

    /// A_obs, then B where it is known, row by row; the boresight.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[boresight]) = (of.photos, of.commons) else { return None };
        let boresight = Quantity::new(boresight, nine(values, 9)?);
        Some(Self {
            photo,
            attitude: nine(values, 0)?,
            boresight,
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo]).and(self.boresight.common(), CommonKind::Boresight)
    }

    fn rows(&self) -> usize {
        3
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let boresight = match self.boresight {
            Quantity::Known(boresight) => boresight,
            Quantity::Common(_) => *sites.common(0).attitude(),
        };
        let computed = sites.local_attitude(0) * boresight;
        let (residual, jacobian) = misalignment(&computed, &self.attitude);
        rows.residual(0, residual.as_slice());
        rows.by_local_rotation(0, 0, &(jacobian * boresight.transpose()));
        if self.boresight.common().is_some() {
            rows.by_turn(0, 0, &jacobian);
        }
    }

    fn check(&self) -> Result<(), Fault> {
        rotates(&self.attitude)?;
        match &self.boresight {
            Quantity::Known(boresight) => rotates(boresight),
            Quantity::Common(_) => Ok(()),
        }
    }
}

/// v = Log(computed^T observed), and Jl = Jr^-1(-v): a turn of the computed by a small vector about its own axes takes Jl times it away.
pub(in super::super) fn misalignment(computed: &Matrix3, observed: &Matrix3) -> (Vector3, Matrix3) {
    let residual = rotation_angle_axis(&computed.tr_mul(observed));
    (residual, right_jacobian_inverse(&-residual))
}

#[cfg(test)]
mod tests {
    use super::super::tests::BORESIGHT;
    use super::super::tests::agrees;
    use super::{Attitude, Precision, Quantity};
    use crate::geometry::rotation;

    #[test]
    fn partials_agree_with_differences() {
        let [attitude, boresight] = [[0.3, -0.2, 0.9], [0.02, 0.5, -0.1]].map(rotation);
        let precision = Precision::Deviations(vec![1e-4; 3]);
        for boresight in [Quantity::Known(boresight), Quantity::Common(BORESIGHT)] {
            agrees(&Attitude { photo: 0, attitude, boresight, precision: precision.clone() }.into());
        }
    }
}
