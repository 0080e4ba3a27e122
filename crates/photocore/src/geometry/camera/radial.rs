//! RADIAL of COLMAP: radial distortion about a principal point, in pixels.

use super::bal::Bal;
use super::inverse::RadialLimit;
use super::model::{CameraModel, Image, Unit};
use crate::geometry::Vector3;

/// Radial distortion, forward, in axes of computer vision: x right, y down, z forward.
///
/// ```text
/// p = (u1, -u2) / -u3,    image = (cx, cy) + f (1 + k1 |p|^2 + k2 |p|^4) p
/// ```
///
/// Image coordinates are pixels from the upper-left corner, column and row. The lens is [`Bal`] with the y axis reversed. SIMPLE_RADIAL is
/// this camera with k2 fixed at zero.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radial {
    /// f, k1, k2.
    pub lens: Bal,
    /// cx, cy in pixels.
    pub principal_point: [f64; 2],
}

impl CameraModel for Radial {
    type Parameters = [f64; 5];

    const NAME: &'static str = "radial";
    const PARAMETERS: &'static [(&'static str, Unit)] =
        &[("f", Unit::Image), ("cx", Unit::Image), ("cy", Unit::Image), ("k1", Unit::One), ("k2", Unit::One)];
    const DOWN: bool = true;
    const FORMULA: &'static str = "p = (P1, -P2) / -P3, image = (cx, cy) + f (1 + k1 p^2 + k2 p^4) p";

    fn with_parameters([f, cx, cy, k1, k2]: [f64; 5]) -> Self {
        Self { lens: Bal::with_parameters([f, k1, k2]), principal_point: [cx, cy] }
    }

    fn parameters(&self) -> [f64; 5] {
        let ([f, k1, k2], [cx, cy]) = (self.lens.parameters(), self.principal_point);
        [f, cx, cy, k1, k2]
    }

    fn scale(&self) -> f64 {
        self.lens.scale()
    }

    #[inline]
    fn image(&self, u: &Vector3) -> [f64; 2] {
        let ([x, y], [cx, cy]) = (self.lens.image(u), self.principal_point);
        [cx + x, cy - y]
    }

    #[inline(always)]
    fn linearize(&self, u: &Vector3) -> Image<[f64; 5]> {
        let Image { xy: [x, y], by_u, by_parameters: [by_x, by_y] } = self.lens.linearize(u);
        let [cx, cy] = self.principal_point;
        Image {
            xy: [cx + x, cy - y],
            by_u: [by_u[0], -by_u[1]],
            by_parameters: [[by_x[0], 1.0, 0.0, by_x[1], by_x[2]], [-by_y[0], 0.0, 1.0, -by_y[1], -by_y[2]]],
        }
    }

    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let [cx, cy] = self.principal_point;
        self.lens.direction([x - cx, cy - y])
    }

    fn radius(&self, u: &Vector3, measured: [f64; 2]) -> f64 {
        self.lens.radius(u, measured)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.lens.radial_limit()
    }
}
