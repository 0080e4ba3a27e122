//! Independent implementation of the collinearity equations for complex arguments, as a chain of single rotations.

use num_complex::Complex64 as C;
use photocore::geometry::{Ellipsoid, ObjectSpace};

/// Returns geographic space on a spheroid with these semi-axes, or rectangular space without a spheroid.
pub fn object_space(spheroid: Option<(f64, f64)>) -> ObjectSpace {
    spheroid.map_or(ObjectSpace::Rectangular, |(a, b)| ObjectSpace::Geographic(Ellipsoid::new(a, b).unwrap()))
}

fn about_axis(axis: usize, angle: C, v: [C; 3]) -> [C; 3] {
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut out = v;
    out[j] = angle.cos() * v[j] + angle.sin() * v[k];
    out[k] = -angle.sin() * v[j] + angle.cos() * v[k];
    out
}

fn geocentric(a: f64, b: f64, [longitude, latitude, height]: [C; 3]) -> [C; 3] {
    let (n, d) = (a * a, (a * a * latitude.cos().powi(2) + b * b * latitude.sin().powi(2)).sqrt());
    let out = (n / d + height) * latitude.cos();
    [out * longitude.cos(), out * longitude.sin(), (b * b / d + height) * latitude.sin()]
}

/// Returns east, north and up of `to` relative to `from`; differences of X, Y, Z without a spheroid.
pub fn local(spheroid: Option<(f64, f64)>, from: [C; 3], to: [C; 3]) -> [C; 3] {
    let (start, end) = match spheroid {
        None => (from, to),
        Some((a, b)) => (geocentric(a, b, from), geocentric(a, b, to)),
    };
    let d: [C; 3] = std::array::from_fn(|i| end[i] - start[i]);
    if spheroid.is_none() {
        return d;
    }
    // Rotate the x axis east, then tilt the z axis to the zenith.
    let quarter = C::new(std::f64::consts::FRAC_PI_2, 0.0);
    about_axis(0, quarter - from[1], about_axis(2, quarter + from[0], d))
}

/// Returns x, y of a vector in the local frame at the camera.
pub fn image(to_ground: bool, c: f64, [omega, phi, kappa]: [C; 3], local: [C; 3]) -> [C; 2] {
    let mut d = local;
    if to_ground {
        for (axis, angle) in [(2, -kappa), (1, -phi), (0, -omega)] {
            d = about_axis(axis, angle, d);
        }
    } else {
        for (axis, angle) in [(0, omega), (1, phi), (2, kappa)] {
            d = about_axis(axis, angle, d);
        }
    }
    [c * d[0] / d[2], c * d[1] / d[2]]
}

/// Computes the partials of x, y by complex steps and returns the largest difference from given ones. The nine unknowns are position,
/// omega, phi, kappa of the photo, then the point. Each group of three is relative to its norm; longitude and latitude are in units of
/// length, so that the columns of a group have equal weight.
pub fn disagreement(
    unknowns: [f64; 9],
    radius: f64,
    analytic: [[[f64; 3]; 3]; 2],
    project: impl Fn([C; 9]) -> [C; 2],
) -> f64 {
    const STEP: f64 = 1e-100;
    let derivatives: [[f64; 2]; 9] = std::array::from_fn(|k| {
        let mut stepped = unknowns.map(|value| C::new(value, 0.0));
        stepped[k].im = STEP;
        project(stepped).map(|value| value.im / STEP)
    });
    let mut worst = 0.0f64;
    for (i, groups) in analytic.iter().enumerate() {
        for (group, analytic) in groups.iter().enumerate() {
            let unit = if group == 1 { [1.0; 3] } else { [radius, radius, 1.0] };
            let numeric: [f64; 3] = std::array::from_fn(|k| derivatives[3 * group + k][i] / unit[k]);
            let norm = numeric.iter().map(|value| value * value).sum::<f64>().sqrt();
            for k in 0..3 {
                let difference = (analytic[k] / unit[k] - numeric[k]).abs() / norm;
                // NaN must count as disagreement.
                worst = if difference <= worst { worst } else { difference };
            }
        }
    }
    worst
}
