//! Relative poses of two photos.

use nalgebra::{DMatrix, SMatrix};

use super::attitude::misalignment;
use super::{Fault, Named, ObservationModel, Precision, Rows, Sites, Touches, nine, rotates, three};
use crate::geometry::{Matrix3, Pose};

/// The pose of one photo in the axes of another: odometry, a stereo rig that was calibrated.
///
/// t = Ai^T (Cj - Ci) and R = Ai^T Aj; the residuals are t_obs - t in the axes of photo i and v = Log(R^T R_obs) about those of
/// photo j. With Jl = Jr^-1(-v), the partials of t are -Ai^T, `[t]x`, Ai^T, 0 by Ci, rho_i, Cj, rho_j; those of the residual v are
/// 0, Jl R^T, 0, -Jl.
#[derive(Debug, Clone, PartialEq)]
pub struct Relative {
    /// i and j.
    pub photos: [usize; 2],
    /// Photo j in the axes of photo i: t_obs in the unit of the object space, and R_obs.
    pub pose: Pose,
    /// Of the three components of t, in units of length, and the three rotations, in radians.
    pub precision: Precision,
}

impl ObservationModel for Relative {
    const NAME: &'static str = "relative";

    /// t_obs, then R_obs row by row.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[i, j] = of.photos else { return None };
        let pose = Pose { position: three(values, 0)?.into(), attitude: nine(values, 3)? };
        Some(Self { photos: [i, j], pose, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&self.photos)
    }

    fn rows(&self) -> usize {
        6
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let (first, second) = (sites.pose(0), sites.pose(1));
        let to_first: Matrix3 = first.attitude.transpose();
        let translation = first.sight(&second.position);
        rows.residual(0, (self.pose.position - translation).as_slice());
        rows.by_centre(0, 0, &-to_first);
        rows.by_rotation(0, 0, &translation.cross_matrix());
        rows.by_centre(0, 1, &to_first);
        let rotation = to_first * second.attitude;
        let (residual, jacobian): (_, SMatrix<f64, 3, 3>) = misalignment(&rotation, &self.pose.attitude);
        rows.residual(3, residual.as_slice());
        rows.by_rotation(3, 0, &(-jacobian * rotation.transpose()));
        rows.by_rotation(3, 1, &jacobian);
    }

    fn check(&self) -> Result<(), Fault> {
        rotates(&self.pose.attitude)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{agrees, stays};
    use super::{Precision, Relative};
    use crate::geometry::{Pose, Vector3, rotation};

    fn relative() -> Relative {
        let pose = Pose { position: Vector3::new(2.0, -1.0, 0.4), attitude: rotation([0.4, -0.2, 1.1]) };
        Relative { photos: [1, 0], pose, precision: Precision::Deviations(vec![0.01; 6]) }
    }

    #[test]
    fn partials_agree_with_differences() {
        agrees(&relative().into());
    }

    #[test]
    fn moves_with_the_network() {
        assert!(stays(&relative().into()));
    }
}
