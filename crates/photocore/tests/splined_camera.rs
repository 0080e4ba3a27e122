//! The splined camera: against golden data computed by mrcal, complex steps, and its inverse.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::sync::Arc;

use num_complex::Complex64 as C;
use photocore::geometry::camera::Patch;
use photocore::geometry::{Camera, Vector3};
use proptest::prelude::*;
use serde_json::Value;

use crate::golden::{golden_of, golden_text, list, rows};

const NAME: &str = "splined_stereographic";

fn pairs(values: &[f64]) -> Arc<[[f64; 2]]> {
    values.as_chunks().0.into()
}

/// Returns the number after a key in an mrcal model name: `LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=20_fov_x_deg=170`.
fn constant(model: &str, key: &str) -> f64 {
    let (_, rest) = model.split_once(&format!("_{key}=")).unwrap();
    rest.split('_').next().unwrap().parse().unwrap()
}

fn golden_camera(entry: &Value) -> Camera {
    let model = entry["model"].as_str().unwrap();
    let mut parameters = list(&entry["core"]);
    parameters.extend(["order", "Nx", "Ny", "fov_x_deg"].map(|key| constant(model, key)));
    let knots = match entry["knots"].as_str() {
        Some(file) => intrinsics(&golden_text("targets", file).unwrap())[4..].to_vec(),
        None => list(&entry["knots"]),
    };
    Camera::named(NAME, &parameters).unwrap().with_knots(pairs(&knots)).unwrap()
}

/// Returns the numbers of the key `intrinsics` in a `.cameramodel`.
fn intrinsics(text: &str) -> Vec<f64> {
    let (_, rest) = text.split_once("'intrinsics': [").unwrap();
    let (numbers, _) = rest.split_once(']').unwrap();
    numbers.split(',').filter_map(|number| number.trim().parse().ok()).collect()
}

/// Returns the partials of a column or row with respect to all parameters of mrcal: fx, fy, cx, cy, then knots.
fn by_all(camera: &Camera, u: &Vector3, row: usize) -> Vec<f64> {
    let parameters = camera.parameters();
    let mut all = vec![0.0; 4 + 2 * camera.knots().unwrap().len()];
    all[..4].copy_from_slice(&camera.linearize(u).by_parameters[row][..4]);
    for (knot, weight) in camera.patch(u).unwrap().knots(parameters[5] as usize) {
        all[4 + 2 * knot + row] = parameters[row] * weight;
    }
    all
}

fn assert_near(found: &[f64], expected: &[f64], part: f64, what: &str) {
    let largest = expected.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= part * largest, "{what}: {found} {expected}");
    }
}

#[test]
fn images_and_partials_are_those_of_mrcal() {
    let Some(data) = golden_of("targets", "splined.json") else { return };
    for entry in data["projections"].as_array().unwrap() {
        let (camera, model) = (golden_camera(entry), entry["model"].as_str().unwrap());
        // The text of the largest model has ten digits; mrcal used the binary numbers.
        let (near, part) = if constant(model, "Nx") == 30.0 { (1e-6, 5e-9) } else { (1e-9, 1e-10) };
        for (k, ray) in rows(&entry["rays"]).into_iter().enumerate() {
            let u = Vector3::new(ray[0], -ray[1], -ray[2]);
            let image = camera.linearize(&u);
            let expected = list(&entry["images"][k]);
            let difference = (0..2).map(|row| (image.xy[row] - expected[row]).abs()).fold(0.0, f64::max);
            assert!(difference < near, "{model} {ray:?}: {:?} {expected:?}", image.xy);
            assert_eq!(camera.image(&u), image.xy);
            for row in 0..2 {
                let by = image.by_u[row];
                let what = format!("{model} {ray:?} {row}");
                assert_near(&[by.x, -by.y, -by.z], &list(&entry["by_ray"][k][row]), part, &what);
                let mut expected = vec![0.0; 4 + 2 * camera.knots().unwrap().len()];
                for pair in rows(&entry["by_parameters"][k][row]) {
                    expected[pair[0] as usize] = pair[1];
                }
                assert_near(&by_all(&camera, &u, row), &expected, part, &what);
            }
        }
    }
}

/// Independent implementation of the image for complex arguments: the ray in vision axes, fx, fy, cx, cy, then the knots.
fn written_out(order: i32, size: [usize; 2], fov: f64, v: &[C]) -> [C; 2] {
    let n = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let place = [2.0 * v[0] / (n + v[2]), 2.0 * v[1] / (n + v[2])];
    let s = (size[0] as f64 - f64::from(order)) / (4.0 * (fov.to_radians() / 4.0).tan());
    let mut at = place;
    for row in 0..size[1] {
        for column in 0..size[0] {
            let difference = [0, 1].map(|k| {
                let knot = [column, row][k] as f64 - (size[k] as f64 - 1.0) / 2.0;
                place[k] * s - knot
            });
            let weight = bump(order, difference[0]) * bump(order, difference[1]);
            let knot = 7 + 2 * (row * size[0] + column);
            (0..2).for_each(|k| at[k] += weight * v[knot + k]);
        }
    }
    [0, 1].map(|k| v[3 + k] * at[k] + v[5 + k])
}

/// Returns the uniform B-spline about zero, by truncated powers.
fn bump(order: i32, x: C) -> C {
    let (count, factorial) = (order + 1, [1.0, 1.0, 2.0, 6.0][order as usize]);
    let mut binomial = 1.0;
    let mut sum = C::new(0.0, 0.0);
    for k in 0..=count {
        let shifted = x + 0.5 * f64::from(count) - f64::from(k);
        if shifted.re > 0.0 {
            sum += binomial * shifted.powi(order) / factorial;
        }
        binomial *= -f64::from(count - k) / f64::from(k + 1);
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn partials_are_those_of_the_image(
        (x, y, cubic) in (-0.8..0.8f64, -0.5..0.5f64, any::<bool>()),
        knots in prop::collection::vec(-0.02..0.02f64, 2 * 11 * 8),
    ) {
        let order = if cubic { 3 } else { 2 };
        let parameters = [700.0, 705.0, 640.0, 480.0, f64::from(order), 11.0, 8.0, 120.0];
        let camera = Camera::named(NAME, &parameters).unwrap().with_knots(pairs(&knots)).unwrap();
        let u = Vector3::new(1.3 * x, -1.3 * y, -1.3);
        let image = camera.linearize(&u);
        let values: Vec<f64> = [u.x, -u.y, -u.z].iter().chain(&parameters[..4]).chain(&knots).copied().collect();
        let complex: Vec<C> = values.iter().map(|&value| C::new(value, 0.0)).collect();
        let expected = written_out(order, [11, 8], 120.0, &complex);
        for row in 0..2 {
            prop_assert!((expected[row].re - image.xy[row]).abs() < 1e-10);
            let by = image.by_u[row];
            let found: Vec<f64> = [by.x, -by.y, -by.z].into_iter().chain(by_all(&camera, &u, row)).collect();
            for (k, found) in found.into_iter().enumerate() {
                let mut stepped = complex.clone();
                stepped[k].im = 1e-100;
                let expected = written_out(order, [11, 8], 120.0, &stepped)[row].im / 1e-100;
                prop_assert!((found - expected).abs() < 1e-10 * 700.0, "{k} {row}: {found} {expected}");
            }
        }
        let difference = camera.direction(image.xy).map(|direction| (direction - u.normalize()).amax());
        prop_assert!(difference.is_some_and(|difference| difference < 1e-13), "{difference:?}");
        prop_assert!(camera.faces(&u) && camera.faces(&-u));
    }
}

#[test]
fn polynomials_at_the_edge_go_on_beyond_the_knots() {
    for order in [2.0, 3.0] {
        let parameters = [700.0, 700.0, 640.0, 480.0, order, 5.0, 4.0, 60.0];
        let plain = Camera::named(NAME, &parameters).unwrap();
        // Displacements linear in the position: all polynomials are equal, and extrapolation is exact.
        let knots: Vec<f64> =
            (0..20).flat_map(|k| [0.01 * f64::from(k % 5), 0.02 * f64::from(k / 5)]).collect();
        let camera = plain.with_knots(pairs(&knots)).unwrap();
        let s = (5.0 - order) / (4.0 * 15f64.to_radians().tan());
        for (x, y) in [(0.0, 0.0), (0.9, -0.8), (-1.5, 1.7)] {
            let u = Vector3::new(x, y, -1.0);
            let [[a, b], [c, d]] = [plain.image(&u), camera.image(&u)];
            let place = [(a - 640.0) / 700.0, (b - 480.0) / 700.0];
            let expected = [a + 7.0 * (s * place[0] + 2.0), b + 14.0 * (s * place[1] + 1.5)];
            assert!((c - expected[0]).hypot(d - expected[1]) < 1e-9, "{order} {x} {y}: {c} {d} {expected:?}");
        }
    }
}

#[test]
fn knots_stay_with_other_parameters_and_are_as_many_as_the_constants_say() {
    let parameters = [700.0, 700.0, 640.0, 480.0, 3.0, 5.0, 4.0, 60.0];
    let plain = Camera::named(NAME, &parameters).unwrap();
    assert_eq!(plain.knots().map(<[_]>::len), Some(20));
    assert_eq!(plain.with_knots(pairs(&[0.0; 38])), None);
    let camera = plain.with_knots(pairs(&[0.01; 40])).unwrap();
    let moved = camera.with_parameters(&[701.0, 700.0, 640.0, 480.0, 3.0, 5.0, 4.0, 60.0]).unwrap();
    assert_eq!(moved.knots(), camera.knots());
    let opencv = Camera::named("opencv", &[1.0; 8]).unwrap();
    assert_eq!(
        (opencv.knots(), opencv.with_knots(pairs(&[])), opencv.patch(&Vector3::z())),
        (None, None, None)
    );
}

#[test]
fn constants_of_no_spline_give_no_image() {
    for constants in
        [[4.0, 5.0, 4.0, 60.0], [3.0, 3.0, 4.0, 60.0], [2.0, 5.5, 4.0, 60.0], [3.0, 5.0, 1e18, 60.0]]
    {
        let parameters = [&[700.0, 700.0, 640.0, 480.0][..], &constants].concat();
        let camera = Camera::named(NAME, &parameters).unwrap();
        let u = -Vector3::z();
        assert!(camera.image(&u)[0].is_nan(), "{constants:?}");
        assert_eq!((camera.patch(&u), camera.direction([640.0, 480.0])), (None::<Patch>, None));
    }
}
