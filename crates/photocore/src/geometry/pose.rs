//! Pose of a photo (position and attitude), and the step of a pose.

use nalgebra::{Matrix6, Matrix6xX, Vector6};
use smallvec::SmallVec;

use super::angle_axis::angle_axis_rotation;
use super::rotation::{Matrix3, Vector3};

/// Number of unknowns of a pose: three of the position, three of the attitude.
pub const POSE: usize = 6;

/// Pose in cartesian object space: u = A^T (P - C) are the coordinates of a point in the photo's axes, x right, y up, z backward. The
/// camera looks along -z: visible points have u3 < 0.
///
/// ```
/// use photocore::geometry::{Pose, Vector3, rotation};
///
/// // From 1000 m straight down, the top of the picture to the north.
/// let pose = Pose { position: Vector3::new(0.0, 0.0, 1000.0), attitude: rotation([0.0; 3]).transpose() };
/// assert_eq!(pose.to_camera_frame(&Vector3::new(10.0, 20.0, 0.0)), Vector3::new(10.0, 20.0, -1000.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// C, the projection centre.
    pub position: Vector3,
    /// A, photo to object: its columns are the photo's axes.
    pub attitude: Matrix3,
}

/// Derivatives of a pose step (dC, then rho; see [`Pose::step`]), one column per unknown; up to six are stored inline.
#[derive(Debug, Clone, Default)]
pub struct Steps(SmallVec<[Vector6<f64>; POSE]>);

impl Steps {
    /// Replaces all columns; each item is dC and rho of one unknown.
    pub fn put(&mut self, each: impl IntoIterator<Item = (Vector3, Vector3)>) {
        self.0.clear();
        self.0.extend(each.into_iter().map(|(shift, rho)| column(&shift, &rho)));
    }

    /// Returns the columns (dC, rho) of the unknowns.
    pub fn columns(&self) -> &[Vector6<f64>] {
        &self.0
    }

    /// Returns the columns as one matrix.
    pub fn matrix(&self) -> Matrix6xX<f64> {
        Matrix6xX::from_columns(&self.0)
    }

    /// Applies a function to each step.
    pub fn map(&mut self, step: impl Fn(Vector3, Vector3) -> (Vector3, Vector3)) {
        for own in &mut self.0 {
            let (shift, rho) = step(own.fixed_rows::<3>(0).into(), own.fixed_rows::<3>(3).into());
            *own = column(&shift, &rho);
        }
    }

    /// Multiplies each step by a matrix of derivatives (chain rule).
    pub fn lead_by(&mut self, unknowns: &Matrix6<f64>) {
        self.0.iter_mut().for_each(|own| *own = unknowns * *own);
    }
}

/// Returns a step as a column.
pub(super) fn column(shift: &Vector3, rho: &Vector3) -> Vector6<f64> {
    Vector6::new(shift.x, shift.y, shift.z, rho.x, rho.y, rho.z)
}

impl Pose {
    /// Returns u, a point in the photo's axes.
    #[inline(always)]
    pub fn to_camera_frame(&self, point: &Vector3) -> Vector3 {
        // A^T d axis by axis: nalgebra's generic transposed product is not inlined in this hot loop.
        let d = point - self.position;
        Vector3::from_fn(|k, _| self.attitude.column(k).dot(&d))
    }

    /// Returns the partials of one image coordinate with respect to a step (dC and rho) and to the position of the point. g is the gradient
    /// of the coordinate with respect to u.
    #[inline(always)]
    pub fn chain(&self, u: &Vector3, g: &Vector3) -> ([f64; POSE], [f64; 3]) {
        // A g row by row, for the same reason.
        let row = |i: usize| {
            self.attitude[(i, 0)] * g.x + self.attitude[(i, 1)] * g.y + self.attitude[(i, 2)] * g.z
        };
        let ([x, y, z], moment) = ([row(0), row(1), row(2)], u.cross(g));
        ([-x, -y, -z, -moment.x, -moment.y, -moment.z], [x, y, z])
    }

    /// Returns the distance of a point from the projection centre along the optical axis: negative behind the camera.
    #[inline]
    pub fn depth(&self, point: &Vector3) -> f64 {
        -self.attitude.column(2).dot(&(point - self.position))
    }

    /// Returns the pose after a step: C + dC, and A Exp(rho) with rho about the photo's own axes, orthonormalized to rounding.
    ///
    /// Every attitude is regular. To first order du = -A^T dC + u x rho.
    #[inline]
    pub fn step(&self, shift: &Vector3, rho: &Vector3) -> Self {
        let turned = self.attitude * angle_axis_rotation(rho);
        // One Newton step for the nearest orthonormal matrix.
        let attitude = turned * (3.0 * Matrix3::identity() - turned.tr_mul(&turned)) / 2.0;
        Self { position: self.position + shift, attitude }
    }

    /// Transforms a pose from the axes of this one to object space: C + A c and A a.
    #[inline]
    pub fn of_inner(&self, inner: &Self) -> Self {
        Self {
            position: self.position + self.attitude * inner.position,
            attitude: self.attitude * inner.attitude,
        }
    }

    /// Returns the step of the transformed inner pose for a step of this pose: dC - `A [c]x rho` and `a^T rho`.
    pub fn carried(&self, inner: &Self) -> impl Fn(Vector3, Vector3) -> (Vector3, Vector3) {
        let (moves, turned) = (-self.attitude * inner.position.cross_matrix(), inner.attitude);
        move |shift, rho| (shift + moves * rho, turned.tr_mul(&rho))
    }
}
