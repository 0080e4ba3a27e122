//! Camera with the whole sphere in one image.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::model::{CameraModel, Image, Unit};
use crate::geometry::Vector3;

/// EQUIRECTANGULAR of COLMAP: longitude and latitude in an image of w by h pixels, which are always fixed.
///
/// ```text
/// (X, Y, Z) = (u1, -u2, -u3)
/// image = (w (1/2 + atan2(X, Z) / 2 pi), h (1/2 + atan2(Y, hypot(X, Z)) / pi))
/// ```
///
/// The first column continues the last: residuals of columns are at most w/2.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equirectangular {
    /// w, h in pixels.
    pub size: [f64; 2],
}

impl CameraModel for Equirectangular {
    type Parameters = [f64; 2];

    const NAME: &'static str = "equirectangular";
    const PARAMETERS: &'static [(&'static str, Unit)] = &[("w", Unit::Image), ("h", Unit::Image)];
    const CONSTANTS: usize = 2;
    const DOWN: bool = true;
    const FORMULA: &'static str =
        "image = (w (1/2 + atan2(P1, -P3) / 2 pi), h (1/2 + atan2(-P2, hypot(P1, P3)) / pi))";

    fn with_parameters(size: [f64; 2]) -> Self {
        Self { size }
    }

    fn parameters(&self) -> [f64; 2] {
        self.size
    }

    fn scale(&self) -> f64 {
        self.size[0].abs() / TAU
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        let [w, h] = self.size;
        [w * (0.5 + u.x.atan2(-u.z) / TAU), h * (0.5 + (-u.y).atan2(u.x.hypot(u.z)) / PI)]
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; 2]> {
        let [w, h] = self.size;
        let xy = self.image(u);
        let level = u.x.hypot(u.z);
        let square = level * level;
        let per_distance = h / PI / u.norm_squared();
        let by_column = Vector3::new(-u.z, 0.0, u.x) * (w / TAU / square);
        let tilt = u.y / level;
        let by_row = Vector3::new(tilt * u.x, -level, tilt * u.z) * per_distance;
        Image { xy, by_u: [by_column, by_row], by_parameters: [[xy[0] / w, 0.0], [0.0, xy[1] / h]] }
    }

    fn compare(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<[f64; 2]>) {
        let (image, w) = (self.linearize(u), self.size[0]);
        let column = measured[0] - image.xy[0];
        ([column - w * (column / w).round(), measured[1] - image.xy[1]], image)
    }

    fn faces(&self, _: &Vector3) -> bool {
        true
    }

    /// None above or below the image.
    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let [w, h] = self.size;
        let (longitude, latitude) = ((x / w - 0.5) * TAU, (y / h - 0.5) * PI);
        let level = latitude.cos();
        let direction = || Vector3::new(longitude.sin() * level, -latitude.sin(), -longitude.cos() * level);
        (latitude.abs() <= FRAC_PI_2 && longitude.is_finite()).then(direction)
    }
}
