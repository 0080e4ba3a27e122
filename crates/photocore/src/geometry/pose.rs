//! Where a photo stands and how it is turned: its pose, and the step of a pose.

use super::angle_axis::angle_axis_rotation;
use super::{Matrix3, Vector3};

/// A photo in cartesian object space: u = A^T (P - C) are the coordinates of a point in the photo's axes, x right, y up, z back
/// towards the viewer. The camera looks along -z: what it sees has u3 < 0.
///
/// ```
/// use photocore::geometry::{Pose, Vector3, rotation};
///
/// // From 1000 m straight down, the top of the picture to the north.
/// let pose = Pose { position: Vector3::new(0.0, 0.0, 1000.0), attitude: rotation([0.0; 3]).transpose() };
/// assert_eq!(pose.sight(&Vector3::new(10.0, 20.0, 0.0)), Vector3::new(10.0, 20.0, -1000.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// C, the projection centre.
    pub position: Vector3,
    /// A, photo to object: its columns are the photo's axes.
    pub attitude: Matrix3,
}

impl Pose {
    /// u, a point in the photo's axes.
    #[inline(always)]
    pub fn sight(&self, point: &Vector3) -> Vector3 {
        // A^T d axis by axis: nalgebra's product with a transpose is too general to be inlined here, of all places.
        let d = point - self.position;
        Vector3::from_fn(|k, _| self.attitude.column(k).dot(&d))
    }

    /// Partials of one image coordinate with respect to a step, dC and rho, and to the position of the point, given its gradient g with
    /// respect to u.
    #[inline(always)]
    pub fn chain(&self, u: &Vector3, g: &Vector3) -> ([f64; 6], [f64; 3]) {
        // A g row by row, for the reason given above.
        let row = |i: usize| {
            self.attitude[(i, 0)] * g.x + self.attitude[(i, 1)] * g.y + self.attitude[(i, 2)] * g.z
        };
        let ([x, y, z], moment) = ([row(0), row(1), row(2)], u.cross(g));
        ([-x, -y, -z, -moment.x, -moment.y, -moment.z], [x, y, z])
    }

    /// Distance of a point from the projection centre along the optical axis: negative behind the camera.
    pub fn depth(&self, point: &Vector3) -> f64 {
        -self.attitude.column(2).dot(&(point - self.position))
    }

    /// The pose after a step: C + dC, and A Exp(rho) with rho about the photo's own axes, orthonormal to rounding again.
    ///
    /// No attitude is singular. To first order du = -A^T dC + u x rho.
    pub fn step(&self, shift: &Vector3, rho: &Vector3) -> Self {
        let turned = self.attitude * angle_axis_rotation(rho);
        // One step of Newton's method for the nearest orthonormal matrix.
        let attitude = turned * (3.0 * Matrix3::identity() - turned.tr_mul(&turned)) / 2.0;
        Self { position: self.position + shift, attitude }
    }
}
