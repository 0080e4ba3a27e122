//! The camera of Bundler and of "Bundle Adjustment in the Large" (Agarwal, Snavely, Seitz and Szeliski 2010): every photo with
//! interior unknowns of its own.
//!
//! ```text
//! P = R X + t,    p = -(P_x, P_y) / P_z,    image = f (1 + k1 |p|^2 + k2 |p|^4) p
//! ```
//!
//! R turns by the angle-axis vector; the camera looks along its -z axis, x to the right and y up; image coordinates are pixels
//! counted from the principal point.

use super::angle_axis::angle_axis_with_jacobian;
use super::vector::{Matrix3, Vector3, apply, apply_transposed, cross, dot};

/// The nine parameters of a photo: angle-axis vector (3), translation t (3), f, k1, k2.
pub type BundlerParameters = [f64; 9];

/// A photo with what all its image points share.
#[derive(Debug, Clone, Copy)]
pub struct BundlerPhoto {
    rotation: Matrix3,
    jacobian: Matrix3,
    parameters: BundlerParameters,
}

/// An image position and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct BundlerImage {
    /// x, y in pixels.
    pub xy: [f64; 2],
    /// With respect to the nine parameters of the photo.
    pub photo: [BundlerParameters; 2],
    /// With respect to the coordinates of the point.
    pub point: [Vector3; 2],
}

impl BundlerPhoto {
    /// The photo with the given parameters.
    pub fn new(parameters: BundlerParameters) -> Self {
        let (rotation, jacobian) = angle_axis_with_jacobian([parameters[0], parameters[1], parameters[2]]);
        Self { rotation, jacobian, parameters }
    }

    /// R: object space to photo.
    pub fn rotation(&self) -> &Matrix3 {
        &self.rotation
    }

    /// The projection centre -R^T t.
    pub fn centre(&self) -> Vector3 {
        apply_transposed(&self.rotation, &self.translation()).map(|value| -value)
    }

    /// Distance of a point from the projection centre along the optical axis: negative behind the camera.
    pub fn depth(&self, point: &Vector3) -> f64 {
        -(dot(&self.rotation[2], point) + self.parameters[5])
    }

    fn translation(&self) -> Vector3 {
        [self.parameters[3], self.parameters[4], self.parameters[5]]
    }

    /// The image of a point with all partials; not finite in the plane of the projection centre. A point behind the camera has the
    /// image that the formula gives.
    #[inline(always)]
    pub fn linearize(&self, point: &Vector3) -> BundlerImage {
        let turned = apply(&self.rotation, point);
        let [_, _, _, tx, ty, tz, f, k1, k2] = self.parameters;
        let depth = -(turned[2] + tz);
        let p = [(turned[0] + tx) / depth, (turned[1] + ty) / depth];
        let square = p[0] * p[0] + p[1] * p[1];
        let radial = 1.0 + square * (k1 + square * k2);
        let slope = 2.0 * (k1 + 2.0 * square * k2);
        let mut image = BundlerImage {
            xy: p.map(|value| f * radial * value),
            photo: [[0.0; 9]; 2],
            point: [[0.0; 3]; 2],
        };
        for row in 0..2 {
            // With respect to p, then to P; depth falls as P_z rises.
            let mut by_p = [f * slope * p[row] * p[0], f * slope * p[row] * p[1]];
            by_p[row] += f * radial;
            let along = by_p[0] * p[0] + by_p[1] * p[1];
            let by_position = [by_p[0] / depth, by_p[1] / depth, along / depth];
            // g . (J dw x RX) = J^T (RX x g) . dw
            let turn = apply_transposed(&self.jacobian, &cross(&turned, &by_position));
            let photo = &mut image.photo[row];
            photo[..3].copy_from_slice(&turn);
            photo[3..6].copy_from_slice(&by_position);
            photo[6] = radial * p[row];
            photo[7] = f * square * p[row];
            photo[8] = f * square * square * p[row];
            image.point[row] = apply_transposed(&self.rotation, &by_position);
        }
        image
    }
}
