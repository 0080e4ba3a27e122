//! Star-plate camera (NOAA TR NOS 55, equations 38 to 41) for block adjustment.

use super::inverse::{RadialFactor, RadialLimit, from_radial};
use super::model::{CameraModel, Image, Unit, parameters};
use crate::geometry::plate_lens::{Decentering, Form, Kind, PlateLens, Plated};
use crate::geometry::{Displacement, Vector3};

/// Lens with its own centre of distortion, in ideal coordinates, before or after the scales of two axes, which may be oblique.
///
/// ```text
/// (X, Y, Z) = (u1, -u2, -u3)
/// c0 = 0:  (p, q) = (c X/Z, c_y Y/Z),  (mx, my) = (1, 1)        else  (p, q) = c0 (X/Z, Y/Z),  (mx, my) = (c, c_y)/c0
/// (d, e) = (p - dx, q - dy),  r^2 = d^2 + e^2,  R = K1 r^2 + K2 r^4 + K3 r^6,  T = K4 + K5 r^2
/// p' = p + d R + T ((r^2 + 2 d^2) cos(phi_T) + 2 d e sin(phi_T))
/// q' = q + e R + T ((r^2 + 2 e^2) sin(phi_T) + 2 d e cos(phi_T))
/// y = yp + my q',    x = xp + mx p' - epsilon y
/// ```
///
/// x, y and the viewing axis are right-handed. If `c_y` is zero, it equals c. c0, the principal distance of the form with distortion before
/// scale, is always fixed.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    /// Lens, with decentering in polar form.
    pub lens: PlateLens,
}

/// Index of each lens parameter among the camera parameters, which begin with c.
const PLACES: [usize; 13] = [12, 2, 3, 0, 1, 10, 11, 4, 5, 6, 7, 8, 9];
const COUNT: usize = 14;

impl Plate {
    fn tangents(u: &Vector3) -> [f64; 2] {
        [-u.x / u.z, u.y / u.z]
    }

    /// Returns the offset from the centre of distortion, before the lens.
    fn offset(&self, w: [f64; 2]) -> [f64; 2] {
        let (c, _) = self.lens.scales();
        let [_, _, _, _, _, dx, dy, ..] = *self.lens.interior();
        [c[0] * w[0] - dx, c[1] * w[1] - dy]
    }

    fn radial(&self) -> RadialFactor {
        RadialFactor::polynomial(&self.lens.distortion().radial)
    }
}

impl CameraModel for Plate {
    type Parameters = [f64; COUNT];

    const NAME: &'static str = "plate";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "c_y" "xp" "yp"; Unit::PerImage(2) => "K1"; Unit::PerImage(4) => "K2";
        Unit::PerImage(6) => "K3"; Unit::PerImage(1) => "K4"; Unit::PerImage(3) => "K5"; Unit::One => "phi_T";
        Unit::Image => "dx" "dy"; Unit::One => "epsilon"; Unit::Image => "c0";
    };
    const CONSTANTS: usize = 1;
    const DOWN: bool = true;
    const FORMULA: &'static str = "(p, q) = (c P1, -c_y P2) / -P3, or c0 (P1, -P2) / -P3 with scales (c, c_y) / c0 behind the lens, c_y = c where it \
         is 0, (d, e) = (p - dx, q - dy), r^2 = d^2 + e^2, R = K1 r^2 + K2 r^4 + K3 r^6, T = K4 + K5 r^2, p' = p + d R + T ((r^2 + 2 d^2) \
         cos(phi_T) + 2 d e sin(phi_T)), q' = q + e R + T ((r^2 + 2 e^2) sin(phi_T) + 2 d e cos(phi_T)), image = (xp + p' - epsilon y, \
         y), y = yp + q'";

    fn with_parameters(values: [f64; COUNT]) -> Self {
        let reference = values[COUNT - 1];
        let form = if reference == 0.0 { Form::ScaleFirst } else { Form::DistortionFirst(reference) };
        let kind = Kind { form, decentering: Decentering::Polar, common_scale: values[1] == 0.0 };
        Self { lens: PlateLens::new(kind, PLACES.map(|place| values[place])) }
    }

    fn parameters(&self) -> [f64; COUNT] {
        let Kind { form, common_scale, .. } = self.lens.kind();
        let mut values = [0.0; COUNT];
        PLACES.into_iter().zip(self.lens.interior()).for_each(|(place, value)| values[place] = *value);
        if common_scale {
            values[1] = 0.0;
        }
        if let Form::DistortionFirst(reference) = form {
            values[COUNT - 1] = reference;
        }
        values
    }

    fn scale(&self) -> f64 {
        self.lens.interior()[3].abs()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        self.lens.place(Self::tangents(u)).xy
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; COUNT]> {
        let w = Self::tangents(u);
        let Plated { xy, tangents, interior } = self.lens.place(w);
        let by_u = tangents.map(|[by_a, by_b]| Vector3::new(-by_a, by_b, -by_a * w[0] - by_b * w[1]) / u.z);
        let by_parameters = interior.map(|row| {
            let mut own = [0.0; COUNT];
            PLACES.into_iter().zip(row).for_each(|(place, partial)| own[place] = partial);
            own
        });
        Image { xy, by_u, by_parameters }
    }

    fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        let distorted = self.lens.upright(xy);
        let [x, y] = from_radial(&self.radial(), [3, 0], distorted, |offset| {
            let Displacement { shift, offset: by, .. } = self.lens.distortion().linearize(offset);
            let by_offset = [[1.0 + by[0][0], by[0][1]], [by[1][0], 1.0 + by[1][1]]];
            ([offset[0] + shift[0], offset[1] + shift[1]], by_offset)
        })?;
        let ([c, c_y], _) = self.lens.scales();
        let [_, _, _, _, _, dx, dy, ..] = *self.lens.interior();
        Some(Vector3::new((x + dx) / c, -(y + dy) / c_y, -1.0).normalize())
    }

    fn radius(&self, u: &Vector3, _: [f64; 2]) -> f64 {
        let [x, y] = self.offset(Self::tangents(u));
        x.hypot(y)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.radial().limit()
    }
}
