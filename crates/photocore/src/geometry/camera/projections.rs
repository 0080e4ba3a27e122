//! Projections of rays to dimensionless coordinates, and their inverses: the first stage of computer-vision cameras.
//!
//! Rays have axes of computer vision: x right, y down, z forward.

use std::f64::consts::{FRAC_PI_2, PI};

use super::inverse::{Matrix2, RadialLimit};

/// Ratio of radius and depth below which series are more accurate than quotients of small numbers.
const SMALL: f64 = 1e-4;

/// Projected ray; the first index of partials is a or b.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// a, b.
    pub ab: [f64; 2],
    /// With respect to the ray.
    pub by_ray: [[f64; 3]; 2],
    /// With respect to the parameters of the projection.
    pub by_own: Matrix2,
}

/// A projection with up to two parameters.
pub trait RayProjection {
    /// Projects a ray.
    fn project(ray: [f64; 3], own: [f64; 2]) -> Seen;

    /// Returns a ray, of any length, with the given projection; None if no ray has it.
    fn ray(ab: [f64; 2], own: [f64; 2]) -> Option<[f64; 3]>;

    /// Returns whether a ray is in the field of view.
    fn faces([_, _, z]: [f64; 3], _own: [f64; 2]) -> bool {
        z >= 0.0
    }

    /// Returns the limit of the one-to-one range; the radius is X / Z.
    fn limit(_own: [f64; 2]) -> Option<RadialLimit> {
        None
    }
}

/// (X, Y) / Z.
#[derive(Debug, Clone, Copy)]
pub struct Central;

impl RayProjection for Central {
    #[inline(always)]
    fn project([x, y, z]: [f64; 3], _: [f64; 2]) -> Seen {
        let (a, b, per_depth) = (x / z, y / z, z.recip());
        let by_ray = [[per_depth, 0.0, -a * per_depth], [0.0, per_depth, -b * per_depth]];
        Seen { ab: [a, b], by_ray, by_own: [[0.0; 2]; 2] }
    }

    fn ray([a, b]: [f64; 2], _: [f64; 2]) -> Option<[f64; 3]> {
        Some([a, b, 1.0])
    }
}

/// theta (X, Y) / rho, rho = hypot(X, Y), theta = atan2(rho, Z): equidistant.
#[derive(Debug, Clone, Copy)]
pub struct Equidistant;

impl RayProjection for Equidistant {
    #[inline(always)]
    fn project([x, y, z]: [f64; 3], _: [f64; 2]) -> Seen {
        let square = x * x + y * y;
        let rho = square.sqrt();
        let distance = square + z * z;
        // theta / rho, and (Z / d - theta / rho) / rho^2.
        let (h, bend) = if rho < SMALL * z {
            let q = square / (z * z);
            ((1.0 - q / 3.0 + q * q / 5.0) / z, (0.8 * q - 2.0 / 3.0) / (z * z * z))
        } else {
            let h = rho.atan2(z) / rho;
            (h, (z / distance - h) / square)
        };
        let by_ray = [
            [h + x * x * bend, x * y * bend, -x / distance],
            [x * y * bend, h + y * y * bend, -y / distance],
        ];
        Seen { ab: [h * x, h * y], by_ray, by_own: [[0.0; 2]; 2] }
    }

    fn ray([a, b]: [f64; 2], _: [f64; 2]) -> Option<[f64; 3]> {
        let theta = a.hypot(b);
        let ratio = if theta > 0.0 { theta.sin() / theta } else { 1.0 };
        (theta <= PI).then(|| [ratio * a, ratio * b, theta.cos()])
    }

    /// All angles up to pi are visible.
    fn faces(_: [f64; 3], _: [f64; 2]) -> bool {
        true
    }
}

/// (X, Y) 2 sin(theta / 2) / rho: equisolid, preserves areas of the sphere.
#[derive(Debug, Clone, Copy)]
pub struct Equisolid;

impl RayProjection for Equisolid {
    #[inline(always)]
    fn project([x, y, z]: [f64; 3], _: [f64; 2]) -> Seen {
        let d = (x * x + y * y + z * z).sqrt();
        // 2 sin(theta / 2) / rho = (2 / (d (d + Z)))^(1/2).
        let product = d * (d + z);
        let h = (2.0 / product).sqrt();
        let slope = -0.5 * h / product;
        let (bend, along) = (slope * (2.0 + z / d), slope * (2.0 * z + d + z * z / d));
        let by_ray =
            [[h + x * x * bend, x * y * bend, x * along], [x * y * bend, h + y * y * bend, y * along]];
        Seen { ab: [h * x, h * y], by_ray, by_own: [[0.0; 2]; 2] }
    }

    fn ray([a, b]: [f64; 2], _: [f64; 2]) -> Option<[f64; 3]> {
        let quarter = 0.25 * (a * a + b * b);
        let cosine = (1.0 - quarter).sqrt();
        (quarter <= 1.0).then_some([cosine * a, cosine * b, 1.0 - 2.0 * quarter])
    }

    /// All angles up to pi are visible.
    fn faces(_: [f64; 3], _: [f64; 2]) -> bool {
        true
    }
}

/// (X, Y) 2 tan(theta / 2) / rho: stereographic, preserves circles of the sphere.
#[derive(Debug, Clone, Copy)]
pub struct Stereographic;

/// alpha and beta of [`ExtendedUnified`] for the stereographic projection: 2 tan(theta / 2) / rho = 1 / (d / 2 + Z / 2).
const STEREOGRAPHIC: [f64; 2] = [0.5, 1.0];

impl RayProjection for Stereographic {
    #[inline(always)]
    fn project(ray: [f64; 3], _: [f64; 2]) -> Seen {
        ExtendedUnified::project(ray, STEREOGRAPHIC)
    }

    fn ray(ab: [f64; 2], _: [f64; 2]) -> Option<[f64; 3]> {
        ExtendedUnified::ray(ab, STEREOGRAPHIC)
    }

    /// All angles below pi are visible.
    fn faces(_: [f64; 3], _: [f64; 2]) -> bool {
        true
    }
}

/// (X, Y) / Z times atan(2 r tan(omega / 2)) / (r omega) with r = |(X, Y) / Z| (Devernay and Faugeras 2001).
#[derive(Debug, Clone, Copy)]
pub struct FieldOfView;

impl RayProjection for FieldOfView {
    #[inline(always)]
    fn project(ray: [f64; 3], [omega, _]: [f64; 2]) -> Seen {
        let Seen { ab: [a, b], by_ray: ideal, .. } = Central::project(ray, [0.0; 2]);
        let square = a * a + b * b;
        let r = square.sqrt();
        let t = 2.0 * (0.5 * omega).tan();
        let by_omega = 1.0 + 0.25 * t * t;
        let s = r * t;
        // h = g / r with g = atan(r t) / omega, (dg/dr - h) / r^2, and dh/domega.
        let (h, bend, turn) = if omega.abs() * (1.0 + r) < SMALL {
            let square_of_omega = omega * omega;
            let rest = 1.0 / 12.0 - square / 3.0;
            (1.0 + square_of_omega * rest, -2.0 / 3.0 * square_of_omega, 2.0 * omega * rest)
        } else if s.abs() < SMALL {
            let s = s * s;
            (
                t / omega * (1.0 - s / 3.0),
                t * t * t / omega * (0.8 * s - 2.0 / 3.0),
                (by_omega * (1.0 - s) - t / omega * (1.0 - s / 3.0)) / omega,
            )
        } else {
            let h = s.atan() / (r * omega);
            let slope = t / (1.0 + s * s) / omega;
            (h, (slope - h) / square, (by_omega / (1.0 + s * s) - h) / omega)
        };
        let by_place = [[h + a * a * bend, a * b * bend], [a * b * bend, h + b * b * bend]];
        let by_ray = by_place.map(|[by_a, by_b]| [0, 1, 2].map(|k| by_a * ideal[0][k] + by_b * ideal[1][k]));
        Seen { ab: [h * a, h * b], by_ray, by_own: [[a * turn, 0.0], [b * turn, 0.0]] }
    }

    fn ray([a, b]: [f64; 2], [omega, _]: [f64; 2]) -> Option<[f64; 3]> {
        let r = a.hypot(b);
        let ratio = if omega.abs() * (1.0 + r) < SMALL {
            1.0 - omega * omega * (1.0 / 12.0 - r * r / 3.0)
        } else if r > 0.0 {
            (r * omega).tan() / (2.0 * r * (0.5 * omega).tan())
        } else {
            omega / (2.0 * (0.5 * omega).tan())
        };
        ((r * omega).abs() < FRAC_PI_2).then_some([ratio * a, ratio * b, 1.0])
    }

    fn limit([omega, _]: [f64; 2]) -> Option<RadialLimit> {
        (omega != 0.0).then(|| RadialLimit { radius: f64::INFINITY, distorted: FRAC_PI_2 / omega.abs() })
    }
}

/// (X, Y) 2 / (Z + sqrt(Z^2 - 4 k rho^2)): ideal = distorted / (1 + k r^2) with the distorted radius r (Fitzgibbon 2001).
#[derive(Debug, Clone, Copy)]
pub struct DivisionByRadius;

impl RayProjection for DivisionByRadius {
    /// Not finite outside of the field of view.
    #[inline(always)]
    fn project([x, y, z]: [f64; 3], [k, _]: [f64; 2]) -> Seen {
        let square = x * x + y * y;
        let root = (z * z - 4.0 * k * square).sqrt();
        let sum = z + root;
        let ratio = 2.0 / sum;
        let bend = 8.0 * k / (sum * sum * root);
        let (along, turn) = (-2.0 / (sum * root), 4.0 * square / (sum * sum * root));
        let by_ray = [
            [ratio + x * x * bend, x * y * bend, x * along],
            [x * y * bend, ratio + y * y * bend, y * along],
        ];
        Seen { ab: [ratio * x, ratio * y], by_ray, by_own: [[x * turn, 0.0], [y * turn, 0.0]] }
    }

    fn ray([a, b]: [f64; 2], [k, _]: [f64; 2]) -> Option<[f64; 3]> {
        let square = a * a + b * b;
        (k * square < 1.0).then_some([a, b, 1.0 + k * square])
    }

    /// With k < 0 the field of view exceeds a hemisphere.
    fn faces([x, y, z]: [f64; 3], [k, _]: [f64; 2]) -> bool {
        z + (z * z - 4.0 * k * (x * x + y * y)).sqrt() > 0.0
    }

    fn limit([k, _]: [f64; 2]) -> Option<RadialLimit> {
        let root = k.abs().sqrt();
        match k {
            k if k > 0.0 => Some(RadialLimit { radius: 0.5 / root, distorted: root.recip() }),
            k if k < 0.0 => Some(RadialLimit { radius: f64::INFINITY, distorted: root.recip() }),
            _ => None,
        }
    }
}

/// (X, Y) / (alpha d + (1 - alpha) Z), d = sqrt(beta rho^2 + Z^2) (Khomutenko, Garcia and Martinet 2016).
#[derive(Debug, Clone, Copy)]
pub struct ExtendedUnified;

impl RayProjection for ExtendedUnified {
    #[inline(always)]
    fn project([x, y, z]: [f64; 3], [alpha, beta]: [f64; 2]) -> Seen {
        let square = x * x + y * y;
        let d = (beta * square + z * z).sqrt();
        let depth = alpha * d + (1.0 - alpha) * z;
        let (ratio, per_square) = (depth.recip(), -(depth * depth).recip());
        let bend = per_square * alpha * beta / d;
        let along = per_square * (alpha * z / d + 1.0 - alpha);
        let by_ray = [
            [ratio + x * x * bend, x * y * bend, x * along],
            [x * y * bend, ratio + y * y * bend, y * along],
        ];
        let by_own = [per_square * (d - z), per_square * alpha * square / (2.0 * d)];
        Seen {
            ab: [ratio * x, ratio * y],
            by_ray,
            by_own: [by_own.map(|value| x * value), by_own.map(|value| y * value)],
        }
    }

    fn ray([a, b]: [f64; 2], [alpha, beta]: [f64; 2]) -> Option<[f64; 3]> {
        let square = beta * (a * a + b * b);
        let inside = 1.0 - (2.0 * alpha - 1.0) * square;
        let depth = (1.0 - alpha * alpha * square) / (alpha * inside.sqrt() + 1.0 - alpha);
        (inside >= 0.0 && depth.is_finite()).then_some([a, b, depth])
    }

    /// Beyond the limit behind the camera two rays have the same image.
    fn faces([x, y, z]: [f64; 3], [alpha, beta]: [f64; 2]) -> bool {
        let d = (beta * (x * x + y * y) + z * z).sqrt();
        alpha * d + (1.0 - alpha) * z > 0.0 && (alpha <= 0.5 || alpha * z > -(1.0 - alpha) * d)
    }

    fn limit([alpha, beta]: [f64; 2]) -> Option<RadialLimit> {
        let distorted = (alpha * beta.sqrt()).recip();
        distorted.is_finite().then_some(RadialLimit { radius: f64::INFINITY, distorted })
    }
}
