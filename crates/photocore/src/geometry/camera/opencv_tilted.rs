//! OpenCV camera with a tilted sensor (Scheimpflug).

use super::inverse::{Matrix2, RadialLimit};
use super::model::{CameraModel, Image, Unit, parameters};
use super::vision::OpencvPinhole;
use crate::geometry::{Matrix3, Vector3};

/// [`OpencvPinhole`] with a sensor rotated by `tau_x`, `tau_y` against the lens plane, as in the OpenCV documentation:
///
/// ```text
/// R = Ry(tau_y) Rx(tau_x),    h = [R33 0 -R13; 0 R33 -R23; 0 0 1] R (A, B, 1),    image = (fx h1/h3 + cx, fy h2/h3 + cy)
/// ```
///
/// with A, B of [`OpencvPinhole`], `Rx = [1 0 0; 0 c s; 0 -s c]` and `Ry = [c 0 -s; 0 1 0; s 0 c]`.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpencvTilted {
    /// fx, fy, cx, cy and the lens terms.
    pub lens: OpencvPinhole,
    /// `tau_x`, `tau_y` in radians.
    pub tilt: [f64; 2],
}

/// Number of parameters of [`OpencvPinhole`].
const LENS: usize = 16;

/// Projective map of the tilt: mapped position, and its partials with respect to the position and the angles.
struct Tilted {
    xy: [f64; 2],
    by_place: Matrix2,
    by_tilt: Matrix2,
}

impl OpencvTilted {
    /// Returns the lens with focal length 1.
    fn normalised(&self) -> OpencvPinhole {
        let mut parameters = self.lens.parameters;
        parameters[..4].copy_from_slice(&[1.0, 1.0, 0.0, 0.0]);
        OpencvPinhole { parameters }
    }

    /// Returns Rx, Ry and their derivatives with respect to their angles.
    fn rotations(&self) -> [[Matrix3; 2]; 2] {
        let [(sx, cx), (sy, cy)] = self.tilt.map(f64::sin_cos);
        let about_x = |o: f64, s: f64, c: f64| Matrix3::new(o, 0.0, 0.0, 0.0, c, s, 0.0, -s, c);
        let about_y = |o: f64, s: f64, c: f64| Matrix3::new(c, 0.0, -s, 0.0, o, 0.0, s, 0.0, c);
        [[about_x(1.0, sx, cx), about_x(0.0, cx, -sx)], [about_y(1.0, sy, cy), about_y(0.0, cy, -sy)]]
    }

    /// Returns the matrix of the projective map.
    fn matrix(&self) -> Matrix3 {
        let [[x, _], [y, _]] = self.rotations();
        let r = y * x;
        sensor(&r, 1.0) * r
    }

    fn tilted(&self, [a, b]: [f64; 2]) -> Tilted {
        let [[x, by_x], [y, by_y]] = self.rotations();
        let (r, place) = (y * x, Vector3::new(a, b, 1.0));
        let map = sensor(&r, 1.0) * r;
        let h = map * place;
        let xy = [h.x / h.z, h.y / h.z];
        let moved = |d: Vector3| [(d.x - xy[0] * d.z) / h.z, (d.y - xy[1] * d.z) / h.z];
        let by_angle = |d: Matrix3| moved((sensor(&d, 0.0) * r + sensor(&r, 1.0) * d) * place);
        let (columns, angles) =
            ([0, 1].map(|k| moved(map.column(k).into())), [by_angle(y * by_x), by_angle(by_y * x)]);
        let rows = |columns: [[f64; 2]; 2]| [0, 1].map(|row| columns.map(|column| column[row]));
        Tilted { xy, by_place: rows(columns), by_tilt: rows(angles) }
    }
}

/// Returns the matrix that projects rotated positions back to the sensor; its derivative with the derivative of R and 0 for `one`.
fn sensor(r: &Matrix3, one: f64) -> Matrix3 {
    Matrix3::new(r[(2, 2)], 0.0, -r[(0, 2)], 0.0, r[(2, 2)], -r[(1, 2)], 0.0, 0.0, one)
}

impl CameraModel for OpencvTilted {
    type Parameters = [f64; 18];

    const NAME: &'static str = "opencv_tilted";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "fx" "fy" "cx" "cy";
        Unit::One => "k1" "k2" "p1" "p2" "k3" "k4" "k5" "k6" "s1" "s2" "s3" "s4" "tau_x" "tau_y";
    };
    const DOWN: bool = true;
    const FORMULA: &'static str = "(A, B) of opencv_pinhole, R = Ry(tau_y) Rx(tau_x), h = [R33 0 -R13; 0 R33 -R23; 0 0 1] R (A, B, 1), \
         image = (fx h1/h3 + cx, fy h2/h3 + cy)";

    fn with_parameters(parameters: [f64; 18]) -> Self {
        let lens = OpencvPinhole { parameters: std::array::from_fn(|k| parameters[k]) };
        Self { lens, tilt: [parameters[LENS], parameters[LENS + 1]] }
    }

    fn parameters(&self) -> [f64; 18] {
        std::array::from_fn(|k| if k < LENS { self.lens.parameters[k] } else { self.tilt[k - LENS] })
    }

    fn scale(&self) -> f64 {
        self.lens.scale()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        let [fx, fy, cx, cy] = std::array::from_fn(|k| self.lens.parameters[k]);
        let [x, y] = self.tilted(self.normalised().image(u)).xy;
        [fx * x + cx, fy * y + cy]
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; 18]> {
        let [fx, fy, cx, cy] = std::array::from_fn(|k| self.lens.parameters[k]);
        let bent = self.normalised().linearize(u);
        let Tilted { xy: [x, y], by_place, by_tilt } = self.tilted(bent.xy);
        let row = |k: usize| {
            let (focal, to) = ([fx, fy][k], by_place[k]);
            let mut own = [0.0; 18];
            own[k] = [x, y][k];
            own[2 + k] = 1.0;
            for term in 4..LENS {
                own[term] =
                    focal * (to[0] * bent.by_parameters[0][term] + to[1] * bent.by_parameters[1][term]);
            }
            (0..2).for_each(|angle| own[LENS + angle] = focal * by_tilt[k][angle]);
            (own, (bent.by_u[0] * to[0] + bent.by_u[1] * to[1]) * focal)
        };
        let ((by_x, x_by_u), (by_y, y_by_u)) = (row(0), row(1));
        Image { xy: [fx * x + cx, fy * y + cy], by_u: [x_by_u, y_by_u], by_parameters: [by_x, by_y] }
    }

    /// Also None if the sensor is tilted beyond the ray.
    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let [fx, fy, cx, cy] = std::array::from_fn(|k| self.lens.parameters[k]);
        let h = self.matrix().try_inverse()? * Vector3::new((x - cx) / fx, (y - cy) / fy, 1.0);
        if h.z > 0.0 { self.normalised().direction([h.x / h.z, h.y / h.z]) } else { None }
    }

    fn radius(&self, u: &Vector3, measured: [f64; 2]) -> f64 {
        self.lens.radius(u, measured)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.lens.radial_limit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilt_about_one_axis_is_a_keystone() {
        // Computed by hand, with tau_y = 0 and therefore R = Rx.
        let tau: f64 = 0.1;
        let (s, c) = tau.sin_cos();
        let mut camera = OpencvTilted::with_parameters([0.0; 18]);
        camera.tilt = [tau, 0.0];
        let [a, b] = [0.3, -0.2];
        let depth = c - s * b;
        let found = camera.tilted([a, b]).xy;
        assert!((found[0] - c * a / depth).abs() < 1e-15);
        assert!((found[1] - (c * (c * b + s) - s * depth) / depth).abs() < 1e-15);
    }
}
