//! Stellar camera: partials against complex steps, distortion and refraction forward and inverse.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use num_complex::Complex64;
use photocore::geometry::Distortion;
use photogram_programs::sky::{ARCSEC, Air, REFRACTION, Station, pointing, pointing_angles};
use photogram_programs::stellar::{
    Attitude, COMMON, Calibration, Camera, Decentering, Form, Image, Kind, Star, Weights,
};
use proptest::prelude::*;

type C = Complex64;

const LATITUDE: f64 = 0.6;
const ABERRATION: f64 = 0.32 * ARCSEC;
const TEMPERATURE: f64 = 290.0;
const PRESSURE: f64 = 750.0;

/// Returns the arctangent to first order in the imaginary part; the library function loses small imaginary parts.
fn atan(z: C) -> C {
    C::new(z.re.atan(), z.im / (1.0 + z.re * z.re))
}

/// Independent implementation of the model for complex arguments: direction (2), attitude (3), shared parameters (17).
fn image(kind: &Kind, time: f64, unknowns: &[C]) -> [C; 2] {
    let (ra, dec) = (unknowns[0], unknowns[1]);
    let (sp, cp) = LATITUDE.sin_cos();
    let hour = C::from(time) - ra;
    let k = ABERRATION * cp;
    let (h, d) = (hour - k * hour.cos() / dec.cos(), dec + k * hour.sin() * dec.sin());
    let north = cp * d.sin() - sp * d.cos() * h.cos();
    let east = -d.cos() * h.sin();
    let up = sp * d.sin() + cp * d.cos() * h.cos();
    let s = (north * north + east * east).sqrt();
    let zenith = atan(s / up);
    let (t, p) = (TEMPERATURE / 273.15, PRESSURE / 760.0);
    let tau = &unknowns[18..22];
    let mut observed = zenith;
    for _ in 0..60 {
        let u = (0.5 * atan(observed.tan() * t.sqrt() / 8.7137)).tan();
        let sum = tau[0] * u + tau[1] * u.powi(3) + tau[2] * u.powi(5) + tau[3] * u.powi(7);
        observed = zenith - sum * p * t.powf(-1.5) * ARCSEC;
    }
    let (xi, eta) = (north * observed.tan() / s, east * observed.tan() / s);
    let (alpha, omega, kappa) = (unknowns[2], unknowns[3], unknowns[4]);
    // Rotate by alpha about east, by omega about the rotated north, by kappa about the axis; reflect x.
    let (n1, z1) = (xi * alpha.cos() - alpha.sin(), xi * alpha.sin() + alpha.cos());
    let (e2, z2) = (eta * omega.cos() - z1 * omega.sin(), eta * omega.sin() + z1 * omega.cos());
    let (u, v) = (-n1, e2);
    let (m, n) = (u * kappa.cos() - v * kappa.sin(), u * kappa.sin() + v * kappa.cos());
    let [m, n] = [m / z2, n / z2];
    plate(kind, [m, n], &unknowns[5..])
}

fn plate(kind: &Kind, [m, n]: [C; 2], p: &[C]) -> [C; 2] {
    let (cx, cy) = (p[3], if kind.common_scale { p[3] } else { p[4] });
    let (bx, by, sx, sy) = match kind.form {
        Form::ScaleFirst => (cx, cy, C::from(1.0), C::from(1.0)),
        Form::DistortionFirst(c) => (C::from(c), C::from(c), cx / c, cy / c),
    };
    let (bx, by) = (bx * m, by * n);
    let (dx, dy) = (bx - p[5], by - p[6]);
    let r = dx * dx + dy * dy;
    let radial = r * (p[7] + r * (p[8] + r * p[9]));
    let (c, s) = match kind.decentering {
        Decentering::Polar => ((p[10] + p[11] * r) * p[12].cos(), (p[10] + p[11] * r) * p[12].sin()),
        Decentering::Cartesian => (p[10] * (p[12] * r + 1.0), p[11] * (p[12] * r + 1.0)),
    };
    let x = bx + dx * radial + (3.0 * dx * dx + dy * dy) * c + 2.0 * dx * dy * s;
    let y = by + dy * radial + (dx * dx + 3.0 * dy * dy) * s + 2.0 * dx * dy * c;
    let y = p[2] + sy * y;
    [p[1] + sx * x - p[0] * y, y]
}

fn values(decentering: Decentering) -> [f64; 22] {
    let [k4, k5, phi] = match decentering {
        Decentering::Polar => [0.05, -0.8, 0.7],
        Decentering::Cartesian => [0.03, -0.02, 1.5],
    };
    let [t1, t2, t3, t4] = REFRACTION;
    [
        1.1, 0.75, 0.19, -0.14, 0.6, 2e-3, 1.2e-4, -9e-5, 0.3002, 0.2989, 4e-4, -3e-4, -0.3, 12.0, -250.0,
        k4, k5, phi, t1, t2, t3, t4,
    ]
}

fn calibration(kind: &Kind, values: &[f64; 22], time: f64) -> Calibration {
    let common: [f64; COMMON] = std::array::from_fn(|k| values[5 + k]);
    Calibration {
        station: Station::new(LATITUDE, ABERRATION, Air::new(TEMPERATURE, PRESSURE)),
        kind: kind.clone(),
        pointings: vec![[values[2], values[3], values[4]]],
        common,
        fixed: vec![false; 3 + COMMON],
        weights: Weights { parameters: vec![], values: vec![], root: vec![] },
        stars: vec![Star {
            place: [values[0], values[1]],
            catalogue: [values[0], values[1]],
            weight: None,
            fixed: false,
        }],
        images: vec![Image {
            star: 0,
            pointing: 0,
            xy: [0.0; 2],
            weight: [[1.0, 0.0], [0.0, 1.0]],
            sidereal_time: time,
            shift: [0.0; 2],
        }],
        axis: None,
    }
}

/// Compares every partial with a complex step, for all types of cameras, relative to the size of the column.
#[test]
fn partials_are_exact() {
    for form in [Form::ScaleFirst, Form::DistortionFirst(0.31)] {
        for decentering in [Decentering::Polar, Decentering::Cartesian] {
            for common_scale in [false, true] {
                let kind = Kind { lens: None, form, decentering, common_scale };
                for time in [1.0, 1.35, 1.7] {
                    check_partials(&kind, &values(decentering), time);
                }
            }
        }
    }
}

fn check_partials(kind: &Kind, values: &[f64; 22], time: f64) {
    let rows = calibration(kind, values, time).equations().unwrap()[0];
    let exact = image(kind, time, &values.map(C::from));
    for i in 0..2 {
        assert!((rows.constant[i] + exact[i].re).abs() < 1e-15, "{kind:?}");
    }
    for k in 0..22 {
        let mut moved = values.map(C::from);
        moved[k].im = 1e-30;
        let step = image(kind, time, &moved).map(|value| value.im * 1e30);
        let column: [f64; 2] = std::array::from_fn(|i| match k {
            0..2 => rows.star[i][k],
            2..5 => rows.pointing[i][k - 2],
            _ => rows.common[i][k - 5],
        });
        let size = step[0].hypot(step[1]);
        for i in 0..2 {
            let off = (column[i] - step[i]).abs();
            assert!(off <= 1e-10 * size, "{kind:?}: partial {k} is {column:?}, not {step:?}");
        }
    }
}

/// Directions computed from images reproduce the images.
#[test]
fn a_direction_comes_back() {
    let kind =
        Kind { lens: None, form: Form::ScaleFirst, decentering: Decentering::Polar, common_scale: false };
    let mut calibration = calibration(&kind, &values(kind.decentering), 1.2);
    calibration.images[0].xy = [-0.07, 0.05];
    calibration.stars[0].place = calibration.directions().unwrap()[0];
    let rows = calibration.equations().unwrap()[0];
    assert!(rows.constant.iter().all(|off| off.abs() < 1e-15), "{:?}", rows.constant);
}

#[test]
fn a_distortion_too_large_does_not_settle() {
    let distortion = Distortion { radial: [-400.0, 0.0, 0.0], profile: [0.0; 2], direction: [1.0, 0.0] };
    assert!(!distortion.undistort([0.08, 0.05], 1e-9, 6).converged);
}

proptest! {
    #[test]
    fn distortion_is_inverted(x in -0.1..0.1, y in -0.1..0.1, k1 in -1.0..1.0, k4 in -0.05..0.05, phi in 0.0..6.3) {
        let distortion = Distortion { radial: [k1, 5.0, -100.0], profile: [k4, 0.1], direction: [f64::cos(phi), f64::sin(phi)] };
        let shift = distortion.displacement([x, y]);
        let found = distortion.undistort([x + shift[0], y + shift[1]], 1e-15, 60);
        prop_assert!(found.converged);
        prop_assert!((found.offset[0] - x).abs() < 1e-14 && (found.offset[1] - y).abs() < 1e-14);
    }

    #[test]
    fn a_pointing_comes_back(alpha in -3.1..3.1, omega in -1.5..1.5, kappa in -3.1..3.1) {
        let matrix = pointing([alpha, omega, kappa]);
        for (found, given) in pointing_angles(&matrix).iter().zip([alpha, omega, kappa]) {
            prop_assert!((found - given).abs() < 1e-12);
        }
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| matrix[(i, k)] * matrix[(j, k)]).sum();
                prop_assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_place_comes_back(hour in -1.2..1.2, dec in 0.0..1.4) {
        let station = Station::new(LATITUDE, ABERRATION, Air::new(TEMPERATURE, PRESSURE));
        let place = [2.0 - hour, dec];
        let seen = station.standard(place, 2.0, &REFRACTION);
        prop_assume!(seen.coordinates[0].hypot(seen.coordinates[1]) < 6.0);
        let again = station.place(seen.coordinates, 2.0, &REFRACTION);
        prop_assert!((again[0] - place[0]).abs() * dec.cos() < 1e-13 && (again[1] - dec).abs() < 1e-13);
    }
}

#[test]
fn the_camera_sees_nothing_behind_it() {
    let kind =
        Kind { lens: None, form: Form::ScaleFirst, decentering: Decentering::Polar, common_scale: false };
    let mut interior = [0.0; 13];
    interior[3] = 0.3;
    interior[4] = 0.3;
    let attitude = Attitude::new([2.0, 0.0, 0.0]);
    assert!(Camera::new(&kind, interior).linearize(&attitude, [0.0, 0.0]).xy[0].is_nan());
}
