//! Camera of Bundler and of "Bundle Adjustment in the Large" (Agarwal, Snavely, Seitz and Szeliski 2010).

use super::inverse::{RadialFactor, RadialLimit};
use super::model::{CameraModel, Image, Unit};
use crate::geometry::Vector3;

/// Radial distortion, forward: a function of ideal coordinates.
///
/// ```text
/// p = -(u1, u2) / u3,    image = f (1 + k1 |p|^2 + k2 |p|^4) p
/// ```
///
/// Image coordinates are pixels counted from the principal point, x to the right and y up.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bal {
    /// f in pixels.
    pub focal_length: f64,
    /// k1, k2.
    pub radial: [f64; 2],
}

impl Bal {
    /// Returns 1 + k1 q + k2 q^2 with q = |p|^2.
    fn radial_factor(&self, square: f64) -> f64 {
        1.0 + square * (self.radial[0] + square * self.radial[1])
    }

    fn radial_part(&self) -> RadialFactor {
        RadialFactor::polynomial(&self.radial)
    }
}

impl CameraModel for Bal {
    type Parameters = [f64; 3];

    const NAME: &'static str = "bal";
    const PARAMETERS: &'static [(&'static str, Unit)] =
        &[("f", Unit::Image), ("k1", Unit::One), ("k2", Unit::One)];
    const FORMULA: &'static str = "p = -(P1, P2) / P3, image = f (1 + k1 p^2 + k2 p^4) p";

    fn with_parameters([focal_length, k1, k2]: [f64; 3]) -> Self {
        Self { focal_length, radial: [k1, k2] }
    }

    fn parameters(&self) -> [f64; 3] {
        [self.focal_length, self.radial[0], self.radial[1]]
    }

    fn scale(&self) -> f64 {
        self.focal_length.abs()
    }

    #[inline]
    fn image(&self, u: &Vector3) -> [f64; 2] {
        let p = [u.x / -u.z, u.y / -u.z];
        let square = p[0] * p[0] + p[1] * p[1];
        p.map(|value| self.focal_length * self.radial_factor(square) * value)
    }

    #[inline(always)]
    fn linearize(&self, u: &Vector3) -> Image<[f64; 3]> {
        let depth = -u.z;
        let f = self.focal_length;
        let p = [u.x / depth, u.y / depth];
        let square = p[0] * p[0] + p[1] * p[1];
        let radial = self.radial_factor(square);
        let slope = 2.0 * (self.radial[0] + 2.0 * square * self.radial[1]);
        let row = |own: usize| {
            // With respect to p, then to u; depth decreases with increasing u3.
            let mut by_p = [f * slope * p[own] * p[0], f * slope * p[own] * p[1]];
            by_p[own] += f * radial;
            let along = by_p[0] * p[0] + by_p[1] * p[1];
            Vector3::new(by_p[0], by_p[1], along) / depth
        };
        Image {
            xy: p.map(|value| f * radial * value),
            by_u: [row(0), row(1)],
            by_parameters: p.map(|value| [radial * value, f * square * value, f * square * square * value]),
        }
    }

    fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        let distorted = xy.map(|value| value / self.focal_length);
        let radius = distorted[0].hypot(distorted[1]);
        let ideal = self.radial_part().invert(radius)?;
        let ratio = if radius > 0.0 { ideal / radius } else { 1.0 };
        Some(Vector3::new(ratio * distorted[0], ratio * distorted[1], -1.0).normalize())
    }

    fn radius(&self, u: &Vector3, _: [f64; 2]) -> f64 {
        (u.x / u.z).hypot(u.y / u.z)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.radial_part().limit()
    }
}
