//! JPL camera CAHVOR with a separate optical axis of the lens (Gennery 2006, "Generalized camera calibration including fish-eye lenses").

use super::inverse::{RadialFactor, RadialLimit};
use super::model::{CameraModel, Image, Unit, parameters};
use crate::geometry::{Matrix3, Vector3};

/// Rays are bent about the unit vector o. The angles a and b (radians) rotate o off the axis of the image, to the right and down:
///
/// ```text
/// o = (cos b sin a, sin b, cos b cos a),    w = v . o,    t = |v|^2 / w^2 - 1,    mu = r0 + r1 t + r2 t^2
/// V = (1 + mu) v - mu w o,                  image = (fx V1/V3 + cx, fy V2/V3 + cy)
/// ```
///
/// with v = (u1, -u2, -u3). The component along o is unchanged, the component across o is scaled by 1 + mu; t is its squared tangent.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cahvor {
    /// fx, fy, cx, cy, a, b, r0, r1, r2.
    pub parameters: [f64; 9],
}

/// A ray before and after the lens.
struct Bent {
    /// v and V.
    ray: Vector3,
    bent: Vector3,
    /// w, t, mu and dmu/dt.
    along: f64,
    square: f64,
    factor: f64,
    slope: f64,
}

/// Converts a vector between photo axes and vision axes.
fn turned(u: &Vector3) -> Vector3 {
    Vector3::new(u.x, -u.y, -u.z)
}

impl Cahvor {
    /// Returns o and its derivatives with respect to the angles.
    fn axis(&self) -> [Vector3; 3] {
        let [(sa, ca), (sb, cb)] = [4, 5].map(|k: usize| self.parameters[k].sin_cos());
        [
            Vector3::new(cb * sa, sb, cb * ca),
            Vector3::new(cb * ca, 0.0, -cb * sa),
            Vector3::new(-sb * sa, cb, -sb * ca),
        ]
    }

    fn radial(&self) -> RadialFactor {
        let mut radial = RadialFactor::polynomial(&self.parameters[7..]);
        radial.numerator[0] += self.parameters[6];
        radial
    }

    fn bent(&self, u: &Vector3, axis: &Vector3) -> Bent {
        let [.., r0, r1, r2] = self.parameters;
        let ray = turned(u);
        let along = ray.dot(axis);
        let square = ray.norm_squared() / (along * along) - 1.0;
        let factor = r0 + square * (r1 + square * r2);
        let bent = ray * (1.0 + factor) - axis * (factor * along);
        Bent { ray, bent, along, square, factor, slope: r1 + 2.0 * square * r2 }
    }

    /// Returns the image of V and its gradients with respect to V.
    fn seen(&self, bent: &Vector3) -> ([f64; 2], [Vector3; 2]) {
        let [fx, fy, cx, cy, ..] = self.parameters;
        let (x, y) = (bent.x / bent.z, bent.y / bent.z);
        let by_x = Vector3::new(1.0, 0.0, -x) * (fx / bent.z);
        let by_y = Vector3::new(0.0, 1.0, -y) * (fy / bent.z);
        ([fx * x + cx, fy * y + cy], [by_x, by_y])
    }
}

impl CameraModel for Cahvor {
    type Parameters = [f64; 9];

    const NAME: &'static str = "cahvor";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "fx" "fy" "cx" "cy"; Unit::One => "axis_x" "axis_y" "r0" "r1" "r2";
    };
    const DOWN: bool = true;
    const FORMULA: &'static str = "v = (P1, -P2, -P3), o = (cos(axis_y) sin(axis_x), sin(axis_y), cos(axis_y) cos(axis_x)), w = v . o, \
         t = |v|^2 / w^2 - 1, mu = r0 + r1 t + r2 t^2, V = (1 + mu) v - mu w o, image = (fx V1/V3 + cx, fy V2/V3 + cy)";

    fn with_parameters(parameters: [f64; 9]) -> Self {
        Self { parameters }
    }

    fn parameters(&self) -> [f64; 9] {
        self.parameters
    }

    fn scale(&self) -> f64 {
        self.parameters[0].abs()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        self.seen(&self.bent(u, &self.axis()[0]).bent).0
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; 9]> {
        let [axis, by_a, by_b] = self.axis();
        let Bent { ray, bent, along, square, factor, slope } = self.bent(u, &axis);
        let across = ray - axis * along;
        // dt = (2 v . dv) / w^2 - 2 (t + 1) dw / w, with dw = o . dv + v . do.
        let by_along = -2.0 * (square + 1.0) / along;
        let square_by_ray = ray * (2.0 / (along * along)) + axis * by_along;
        let by_ray = Matrix3::identity() * (1.0 + factor) + across * (square_by_ray * slope).transpose()
            - axis * axis.transpose() * factor;
        let by_axis = |turn: &Vector3| {
            let moved = ray.dot(turn);
            across * (slope * by_along * moved) - (axis * moved + turn * along) * factor
        };
        let columns = [by_axis(&by_a), by_axis(&by_b), across, across * square, across * (square * square)];
        let (xy, by_bent) = self.seen(&bent);
        let [fx, fy, cx, cy, ..] = self.parameters;
        let plain = [(xy[0] - cx) / fx, (xy[1] - cy) / fy];
        let row = |k: usize| {
            let mut own = [0.0; 9];
            own[k] = plain[k];
            own[2 + k] = 1.0;
            own[4..].iter_mut().zip(&columns).for_each(|(value, column)| *value = by_bent[k].dot(column));
            own
        };
        let by_u = by_bent.map(|by| turned(&(by_ray.transpose() * by)));
        Image { xy, by_u, by_parameters: [row(0), row(1)] }
    }

    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let [fx, fy, cx, cy, ..] = self.parameters;
        let [axis, ..] = self.axis();
        let seen = Vector3::new((x - cx) / fx, (y - cy) / fy, 1.0);
        let along = seen.dot(&axis);
        if along <= 0.0 {
            return None;
        }
        let across = seen / along - axis;
        let bent = across.norm();
        let part = if bent > 0.0 { self.radial().invert(bent)? / bent } else { 0.0 };
        let ray = axis + across * part;
        (ray.z > 0.0).then(|| turned(&ray.normalize()))
    }

    /// In front of the image plane and of the plane across o: t is independent of the sign of w.
    fn faces(&self, u: &Vector3) -> bool {
        let found = self.bent(u, &self.axis()[0]);
        u.z <= 0.0 && found.along > 0.0 && found.bent.z > 0.0
    }

    fn radius(&self, u: &Vector3, _: [f64; 2]) -> f64 {
        self.bent(u, &self.axis()[0]).square.max(0.0).sqrt()
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.radial().limit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_on_the_axis_of_the_lens_is_not_bent() {
        let camera = Cahvor::with_parameters([1000.0, 1100.0, 500.0, 400.0, 0.1, -0.05, 0.01, -0.2, 0.05]);
        let [axis, ..] = camera.axis();
        let [x, y] = camera.image(&turned(&(axis * 3.0)));
        assert!((x - (1000.0 * axis.x / axis.z + 500.0)).abs() < 1e-10);
        assert!((y - (1100.0 * axis.y / axis.z + 400.0)).abs() < 1e-10);
    }

    #[test]
    fn what_is_behind_the_plane_across_that_axis_is_not_faced() {
        let camera = Cahvor::with_parameters([1000.0, 1000.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0]);
        let side = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            turned(&Vector3::new(sine, 0.0, cosine))
        };
        assert!([-84.0, 0.0, 89.0].map(side).iter().all(|u| camera.faces(u)));
        assert!([-84.5, 91.0].map(side).iter().all(|u| !camera.faces(u)));
    }
}
