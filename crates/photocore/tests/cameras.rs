//! Cameras: partials against complex steps and differences, inverses, names.

#![allow(clippy::unwrap_used, clippy::panic)]

use num_complex::Complex64 as C;
use photocore::geometry::camera::ModelFacts;
use photocore::geometry::{Bal, Camera, CameraModel, Unit, Vector3};
use proptest::prelude::*;

/// Returns a camera of the model; parameters are scaled by their units from numbers between -1 and 1.
fn sample(name: &str, numbers: &[f64]) -> Camera {
    let parameters = Camera::model(name).unwrap().parameters;
    // Lens terms, which together contribute at most a third.
    let part = 0.3 / parameters.len() as f64;
    let value = |(&(parameter, unit), number): (&(&str, Unit), &f64)| match (parameter, unit) {
        ("cx" | "cy" | "xp" | "yp" | "r0" | "b1" | "b2" | "dx" | "dy" | "x0" | "y0", Unit::Image) => {
            100.0 * number
        }
        (polynomial, Unit::Image)
            if name.starts_with("on_comparator") && polynomial.starts_with(['x', 'y']) =>
        {
            part * 100.0 * number
        }
        ("alpha" | "omega", _) => 0.7 + 0.2 * number,
        ("order", _) => 3.0,
        ("nx" | "ny", _) => 12.0,
        ("fov_x_deg", _) => 150.0 + 20.0 * number,
        ("beta", _) => 1.0 + 0.2 * number,
        (_, Unit::Image) => 900.0 + 600.0 * number,
        (_, Unit::PerImage(power)) => part * number / 1500f64.powi(power.into()),
        (_, Unit::One) => part * number,
    };
    let values: Vec<f64> = parameters.iter().zip(numbers.iter().cycle()).map(value).collect();
    Camera::named(name, &values).unwrap()
}

/// Independent implementation of the image for complex arguments: u, then the parameters; None for other models.
fn written_out(name: &str, v: &[C]) -> Option<[C; 2]> {
    let radial = |k1: C, k2: C| {
        let p = [-v[0] / v[2], -v[1] / v[2]];
        let q = p[0] * p[0] + p[1] * p[1];
        p.map(|p| v[3] * (1.0 + k1 * q + k2 * q * q) * p)
    };
    match name {
        "perspective" => Some([v[3] * v[0] / v[2], v[3] * v[1] / v[2]]),
        "bal" => Some(radial(v[4], v[5])),
        "radial" => {
            let [x, y] = radial(v[6], v[7]);
            Some([v[4] + x, v[5] - y])
        }
        "cahvor" => {
            let ray = [v[0], -v[1], -v[2]];
            let axis = [v[8].cos() * v[7].sin(), v[8].sin(), v[8].cos() * v[7].cos()];
            let dot = |a: &[C; 3], b: &[C; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let along = dot(&ray, &axis);
            let t = dot(&ray, &ray) / (along * along) - 1.0;
            let mu = v[9] + v[10] * t + v[11] * t * t;
            let bent: Vec<C> = (0..3).map(|k| (1.0 + mu) * ray[k] - mu * along * axis[k]).collect();
            Some([v[3] * bent[0] / bent[2] + v[5], v[4] * bent[1] / bent[2] + v[6]])
        }
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_camera_sees_directions_and_has_the_partials_of_its_image(
        to_camera_frame in (prop::array::uniform2(-0.6..0.6f64), -8.0..-1.0f64),
        numbers in prop::array::uniform5(-1.0..1.0f64),
    ) {
        let ([x, y], z) = to_camera_frame;
        let u = Vector3::new(-z * x, -z * y, z);
        for name in Camera::NAMES {
            let camera = sample(name, &numbers);
            let image = camera.linearize(&u);
            prop_assert_eq!(image.xy, camera.image(&u));
            let (residual, compared) = camera.compare(&u, image.xy);
            prop_assert!(residual.iter().all(|v| v.abs() < 1e-9), "{name}: {residual:?}");
            prop_assert!((0..2).all(|row| compared.by_u[row].dot(&u).abs() < 1e-9));
            let values: Vec<f64> = u.iter().copied().chain(camera.parameters()).collect();
            for row in 0..2 {
                let by_u = image.by_u[row];
                prop_assert!(by_u.dot(&u).abs() < 1e-12 * by_u.norm() * u.norm());
                let found: Vec<f64> = by_u.iter().chain(&image.by_parameters[row]).copied().collect();
                prop_assert_eq!(found.len(), values.len());
                let scale = by_u.norm().max(1.0);
                // Constants are fixed.
                for (k, partial) in found[..found.len() - camera.constants()].iter().enumerate() {
                    let size = size_of(&camera, k);
                    let (expected, near) = partial_of(name, &values, k, size, row);
                    let difference = (size * (partial - expected)).abs();
                    prop_assert!(difference < near * scale, "{name} {k}: {partial} {expected}");
                }
            }
            let direction = camera.direction(image.xy);
            let back = direction.map(|direction| (direction - u.normalize()).amax());
            prop_assert!(back.is_some_and(|difference| difference < 1e-12), "{camera:?}: {direction:?}");
            prop_assert_eq!(camera.with_parameters(&camera.parameters()), Some(camera.clone()));
            prop_assert_eq!(camera.name(), *name);
        }
    }
}

/// Returns the typical size of an argument of a camera (u, then the parameters): 1, or the reciprocal power of 1000 image units.
fn size_of(camera: &Camera, k: usize) -> f64 {
    match k.checked_sub(3).map(|parameter| camera.parameter_names()[parameter].1) {
        Some(Unit::PerImage(power)) => 1000f64.powi(-i32::from(power)),
        _ => 1.0,
    }
}

/// Returns a partial by a complex step for implemented models, else by a central difference, and its accuracy.
fn partial_of(name: &str, values: &[f64], k: usize, size: f64, row: usize) -> (f64, f64) {
    const STEP: f64 = 1e-100;
    let mut stepped: Vec<C> = values.iter().map(|&value| C::new(value, 0.0)).collect();
    stepped[k].im = STEP;
    if let Some(image) = written_out(name, &stepped) {
        return (image[row].im / STEP, 1e-10);
    }
    let step = 1e-6 * values[k].abs().max(size);
    let at = |step: f64| {
        let mut moved = values.to_vec();
        moved[k] += step;
        let (u, parameters) = moved.split_at(3);
        Camera::named(name, parameters).unwrap().image(&Vector3::from_column_slice(u))[row]
    };
    ((at(step) - at(-step)) / (2.0 * step), 1e-5)
}

#[test]
fn a_camera_has_a_name_and_as_many_parameters_as_its_model() {
    assert_eq!(Camera::named("nothing", &[]), None);
    assert_eq!(Camera::model("nothing"), None);
    for name in Camera::NAMES {
        let ModelFacts { formula, parameters, constants, .. } = Camera::model(name).unwrap();
        assert!(formula.contains("image = "), "{name}");
        assert!(Camera::named(name, &vec![1.0; parameters.len() + 1]).is_none());
        let camera = Camera::named(name, &vec![1.0; parameters.len()]).unwrap();
        assert_eq!(camera.parameter_names(), parameters);
        assert_eq!(camera.with_parameters(&[]), None);
        assert_eq!(camera.constants(), constants);
    }
}

#[test]
fn a_lens_beyond_which_nothing_is_seen_says_so() {
    let barrel = Bal { parameters: [1000.0, -0.3, 0.0] };
    // r (1 - 0.3 r^2) increases to r = 1.054.
    let edge = 1000.0 * (1.0f64 / 0.9).sqrt() * 2.0 / 3.0;
    assert!(barrel.direction([edge - 1.0, 0.0]).is_some());
    assert!(barrel.direction([edge + 1.0, 0.0]).is_none());
    assert!(barrel.direction([f64::NAN, 0.0]).is_none());
    assert_eq!(barrel.direction([0.0, 0.0]), Some(-Vector3::z()));
}
