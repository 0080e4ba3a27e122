//! Central perspective without distortion.

use super::model::{CameraModel, Image, Unit};
use crate::geometry::Vector3;

/// x = c u1/u3, y = c u2/u3, relative to the principal point. With either sign of c the camera looks along its -z axis (GIANT guide,
/// sections 4 and 5 of its specification).
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perspective {
    /// c, the signed principal distance in the unit of the image: negative for the positive plane.
    pub principal_distance: f64,
}

impl Perspective {
    /// Returns the image and its partials with respect to u, evaluated at an image position chosen by `at`: x has the gradient (c/u3, 0,
    /// -x/u3).
    #[inline(always)]
    pub fn linearize_at(&self, u: &Vector3, at: impl FnOnce([f64; 2]) -> [f64; 2]) -> Image<[f64; 1]> {
        let scale = self.principal_distance / u.z;
        let xy = [scale * u.x, scale * u.y];
        let [x, y] = at(xy);
        Image {
            xy,
            by_u: [Vector3::new(scale, 0.0, -x / u.z), Vector3::new(0.0, scale, -y / u.z)],
            by_parameters: [[u.x / u.z], [u.y / u.z]],
        }
    }
}

impl CameraModel for Perspective {
    type Parameters = [f64; 1];

    const NAME: &'static str = "perspective";
    const PARAMETERS: &'static [(&'static str, Unit)] = &[("c", Unit::Image)];
    const IN_LANES: bool = true;
    const FORMULA: &'static str = "image = c (P1, P2) / P3";

    fn with_parameters([principal_distance]: [f64; 1]) -> Self {
        Self { principal_distance }
    }

    fn parameters(&self) -> [f64; 1] {
        [self.principal_distance]
    }

    fn scale(&self) -> f64 {
        self.principal_distance.abs()
    }

    #[inline]
    fn image(&self, u: &Vector3) -> [f64; 2] {
        let scale = self.principal_distance / u.z;
        [scale * u.x, scale * u.y]
    }

    #[inline(always)]
    fn linearize(&self, u: &Vector3) -> Image<[f64; 1]> {
        self.linearize_at(u, |computed| computed)
    }

    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let c = self.principal_distance;
        let length = (x * x + y * y + c * c).sqrt();
        // u is parallel to (x, y, c) and u3 is negative: the camera looks along -z.
        Some(Vector3::new(x, y, c) / (-length * c.signum()))
    }
}
