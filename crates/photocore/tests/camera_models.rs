//! All camera models against golden data of an independent program.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use photocore::geometry::camera::{LensDirection, RadialLimit};
use photocore::geometry::{Camera, Vector3};
use serde_json::Value;

use crate::golden::{golden, list, rows};

/// Returns values by name in the order of a model; `more` are missing in the golden data. The case of the names differs.
fn values(model: &str, entry: &Value, names: &str, more: &[(&str, f64)]) -> (Vec<f64>, Vec<Option<usize>>) {
    let given: Vec<String> =
        entry[names].as_array().unwrap().iter().map(|name| name.as_str().unwrap().into()).collect();
    let numbers = list(&entry["values"]);
    let value = |&(name, _): &(&'static str, _)| {
        let column = given.iter().position(|other| other.eq_ignore_ascii_case(name));
        let other = more.iter().find(|(other, _)| *other == name);
        (column.map_or_else(|| other.map_or(0.0, |(_, value)| *value), |column| numbers[column]), column)
    };
    Camera::model(model).unwrap().parameters.iter().map(value).unzip()
}

/// Returns the columns of a model's row that the golden data list.
fn listed(row: &[f64], columns: &[Option<usize>], count: usize) -> Vec<f64> {
    let place = |k: usize| columns.iter().position(|&column| column == Some(k)).unwrap();
    (0..count).map(|k| row[place(k)]).collect()
}

/// Compares partials to 1e-10 of the largest of their row.
fn assert_row(found: &[f64], expected: &[f64], what: &str) {
    let largest = expected.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-10 * largest, "{what}: {found} {expected}");
    }
}

#[test]
fn backward_cameras_correct_as_the_golden_data() {
    let Some(data) = golden("camera_models.json") else { return };
    for (name, entry) in data["backward"].as_object().unwrap() {
        let model = if name == "brown_balanced" { "brown" } else { name };
        let constants = ["r0", "b"].map(|name| (name, entry.get(name).map_or(0.0, |b| b.as_f64().unwrap())));
        let more = [&constants[..], &[("c", -28.5)]].concat();
        let (parameters, columns) = values(model, entry, "params", &more);
        let camera = Camera::named(model, &parameters).unwrap();
        // An arbitrary direction: the correction is independent of it.
        let u = Vector3::new(0.2, -0.1, -1.3);
        for point in entry["points"].as_array().unwrap() {
            let measured: [f64; 2] = list(&point["measured"]).try_into().unwrap();
            let (corrected, what) = (list(&point["corrected"]), format!("{name} {measured:?}"));
            let found = camera.correction(measured).unwrap();
            let difference = [0, 1].map(|k| (found[k] - corrected[k]).abs());
            assert!(difference[0].max(difference[1]) < 1e-12 * 20.0, "{what}: {found:?} {corrected:?}");
            let (residual, image) = camera.compare(&u, measured);
            let by_parameters = rows(&point["d_corrected_d_params"]);
            for row in 0..2 {
                let ideal = -28.5 * u[row] / u.z;
                assert!((residual[row] - (corrected[row] - ideal)).abs() < 1e-12 * 20.0, "{what}");
                assert!(image.by_u[row].dot(&u).abs() < 1e-13 * 28.5, "{what}");
                let own = listed(&image.by_parameters[row], &columns, by_parameters[row].len());
                let own: Vec<f64> = own.iter().map(|partial| -partial).collect();
                assert_row(&own, &by_parameters[row], &what);
                assert!((image.by_parameters[row][0] - u[row] / u.z).abs() < 1e-15, "{what}");
            }
            // The inverse and its partials: the image changes as the inverse of g.
            let ray = Vector3::new(corrected[0], corrected[1], -28.5);
            let image = camera.linearize(&ray);
            for k in 0..2 {
                assert!((image.xy[k] - measured[k]).abs() < 1e-11, "{what}: {:?}", image.xy);
            }
            let by_measured = rows(&point["d_corrected_d_measured"]);
            for row in 0..2 {
                for k in 0..2 {
                    let product: f64 = (0..2).map(|j| by_measured[row][j] * image.by_u[j][k]).sum();
                    assert!((product - f64::from(row == k)).abs() < 1e-10, "{what}");
                }
            }
            let direction = camera.direction(measured).unwrap();
            assert!((direction - ray.normalize()).amax() < 1e-12, "{what}");
        }
    }
}

/// Compares images to 1e-12 of their size, partials to 1e-10 of the largest of their row, and the inverse of every image.
fn forward(model: &str, entry: &Value, ray: &str, axes: Vector3, more: &[(&str, f64)]) {
    let (parameters, columns) = values(model, entry, "params", more);
    let camera = Camera::named(model, &parameters).unwrap();
    assert_eq!(Camera::model(model).unwrap().lens, LensDirection::Forward);
    for each in entry["rays"].as_array().unwrap() {
        let u = Vector3::from_vec(list(&each[ray])).component_mul(&axes);
        let (image, expected, what) = (camera.linearize(&u), list(&each["image"]), format!("{model} {u}"));
        assert_eq!(image.xy, camera.image(&u), "{what}");
        let size = expected[0].hypot(expected[1]).max(1.0);
        for row in 0..2 {
            assert!((image.xy[row] - expected[row]).abs() < 1e-12 * size, "{what}: {:?}", image.xy);
            let by_ray = Vector3::from_vec(list(&each["d_image_d_ray"][row])).component_mul(&axes);
            assert_row(image.by_u[row].as_slice(), by_ray.as_slice(), &what);
            assert!(image.by_u[row].dot(&u).abs() < 1e-13 * image.by_u[row].norm(), "{what}");
            let by_parameters = list(&each["d_image_d_params"][row]);
            let own = listed(&image.by_parameters[row], &columns, by_parameters.len());
            assert_row(&own, &by_parameters, &what);
        }
        let direction = camera.direction([expected[0], expected[1]]).unwrap();
        assert!((direction - u.normalize()).amax() < 1e-12, "{what}: {direction}");
    }
}

#[test]
fn forward_cameras_see_as_the_golden_data() {
    let Some(data) = golden("camera_models.json") else { return };
    let vision = Vector3::new(1.0, -1.0, -1.0);
    let models = data["forward"].as_object().unwrap();
    assert_eq!(models.len(), 22);
    for (name, entry) in models {
        // Lower-case names are the OpenCV models.
        let model = if name == "opencv_fisheye" { "opencv_fisheye_skew" } else { &name.to_lowercase() };
        forward(model, entry, "ray", vision, &[]);
    }
    let same = Vector3::new(1.0, 1.0, 1.0);
    forward("bal", &data["bal"], "ray_photo_axes", same, &[]);
    let aicon = &data["brown_forward_balanced"];
    forward("brown_forward", aicon, "ray_photo_axes", same, &[("r0", aicon["r0"].as_f64().unwrap())]);
}

fn assert_limit(found: Option<RadialLimit>, golden: &Value, what: &str) {
    match (found, golden) {
        (None, Value::Null) => {}
        (Some(found), Value::Object(limit)) => {
            for (found, name) in [(found.radius, "r"), (found.distorted, "r_distorted")] {
                let expected = limit[name].as_f64().unwrap();
                assert!((found / expected - 1.0).abs() < 1e-12, "{what}: {found} {expected}");
            }
        }
        (found, golden) => panic!("{what}: {found:?} {golden}"),
    }
}

#[test]
fn radial_parts_end_where_the_golden_data_say() {
    let Some(data) = golden("camera_models.json") else { return };
    for entry in data["radial_domain"].as_array().unwrap() {
        let (numerator, denominator) = (list(&entry["numerator"]), list(&entry["denominator"]));
        let term = |terms: &[f64], k: usize| terms.get(k).copied().unwrap_or_default();
        let [n, d] = [numerator, denominator].map(|terms| [0, 1, 2, 3].map(|k| term(&terms, k)));
        let what = format!("{n:?} {d:?}");
        if n[3] == 0.0 {
            let camera = [1.0, 1.0, 0.0, 0.0, n[0], n[1], 0.0, 0.0, n[2], d[0], d[1], d[2]];
            assert_limit(
                Camera::named("full_opencv", &camera).unwrap().radial_limit(),
                &entry["limit"],
                &what,
            );
        }
        if d == [0.0; 4] {
            let camera = [1.0, 1.0, 0.0, 0.0, n[0], n[1], n[2], n[3]];
            assert_limit(
                Camera::named("opencv_fisheye", &camera).unwrap().radial_limit(),
                &entry["limit"],
                &what,
            );
        }
        if d == [0.0; 4] && n[3] == 0.0 {
            let camera = [-30.0, 0.0, 0.0, n[0], n[1], n[2], 0.0, 0.0, 0.0, 0.0, 0.0];
            assert_limit(Camera::named("brown", &camera).unwrap().radial_limit(), &entry["limit"], &what);
        }
    }
}

/// No direction is returned beyond the largest radius of an image; inside of it there is one.
#[test]
fn a_lens_ends_where_its_radial_part_does() {
    for (name, parameters) in [
        ("simple_radial", vec![1000.0, 0.0, 0.0, -0.3]),
        ("full_opencv", vec![1000.0, 1000.0, 0.0, 0.0, 0.2, -0.05, 0.0, 0.0, 0.0, 0.6, 0.1, 0.0]),
        ("opencv_fisheye", vec![1000.0, 1000.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0]),
        ("fov", vec![1000.0, 1000.0, 0.0, 0.0, 0.9]),
        ("simple_division", vec![1000.0, 0.0, 0.0, 0.2]),
        ("cahvor", vec![1000.0, 1000.0, 0.0, 0.0, 0.0, 0.0, 0.01, -0.3, 0.02]),
    ] {
        let camera = Camera::named(name, &parameters).unwrap();
        let edge = 1000.0 * camera.radial_limit().unwrap().distorted;
        for (part, seen) in [(0.5, true), (0.999, true), (1.001, false), (2.0, false)] {
            let xy = [0.6 * part * edge, 0.8 * part * edge];
            let direction = camera.direction(xy);
            assert_eq!(direction.is_some(), seen, "{name} {part}: {direction:?}");
            if let Some(direction) = direction {
                let back = camera.image(&direction);
                assert!((0..2).all(|k| (back[k] - xy[k]).abs() < 1e-9), "{name} {part}: {back:?} {xy:?}");
            }
        }
        assert_eq!(camera.direction([f64::NAN, 0.0]), None, "{name}");
    }
    // A backward camera, whose correction folds.
    let brown = [-30.0, 0.0, 0.0, -1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let camera = Camera::named("brown", &brown).unwrap();
    let limit = camera.radial_limit().unwrap();
    assert!((limit.radius - (1.0f64 / 3e-4).sqrt()).abs() < 1e-12 * limit.radius);
    assert!(camera.direction([0.0, 0.99 * limit.radius]).is_some());
    assert_eq!(camera.direction([0.0, 1.01 * limit.radius]), None);
    assert!(camera.image(&Vector3::new(0.99 * limit.distorted, 0.0, -30.0))[0].is_finite());
    assert!(camera.image(&Vector3::new(1.01 * limit.distorted, 0.0, -30.0))[0].is_nan());
}

/// Series replace the terms for a small field of view, for which the quotients lose digits.
#[test]
fn series_continue_what_they_stand_for() {
    let ray = |r: f64| Vector3::new(0.6 * r, 0.8 * r, -1.0);
    for (name, more) in [("fov", &[0.8][..]), ("fisheye", &[])] {
        let camera = Camera::named(name, &[&[1.0, 1.0, 0.0, 0.0], more].concat()).unwrap();
        // Radii on both sides of the switch.
        for (below, above) in [(0.99e-4, 1.01e-4), (1.1e-4, 1.3e-4)] {
            let [a, b] = [below, above].map(|r| camera.linearize(&ray(r)));
            for row in 0..2 {
                let moved = a.by_u[row].dot(&(ray(above) - ray(below)));
                assert!((b.xy[row] - a.xy[row] - moved).abs() < 1e-12, "{name}");
                assert!((a.by_u[row] - b.by_u[row]).amax() < 1e-4, "{name}");
            }
        }
    }
    // The sign of atan makes this less than one.
    let near =
        Camera::named("fov", &[1.0, 1.0, 0.0, 0.0, 0.005]).unwrap().image(&Vector3::new(1.0, 0.0, -1.0));
    assert!((near[0] - 1.0 + 6.25e-6).abs() < 1e-9, "{near:?}");
    for omega in [0.0, 1e-6, 4.9e-5, 5.1e-5] {
        let camera = Camera::named("fov", &[1.0, 1.0, 0.0, 0.0, omega]).unwrap();
        let u = Vector3::new(0.5, -0.3, -1.0);
        let image = camera.linearize(&u);
        let factor = 1.0 + omega * omega * (1.0 / 12.0 - 0.34 / 3.0);
        assert!((image.xy[0] - 0.5 * factor).abs() < 1e-15 + 1e-16, "{omega}");
        assert!((image.by_parameters[0][4] - omega * (1.0 / 12.0 - 0.34 / 3.0)).abs() < 1e-10, "{omega}");
        assert!((camera.direction(image.xy).unwrap() - u.normalize()).amax() < 1e-14, "{omega}");
    }
}

/// Points beyond the limit are folded back; cameras with more than a hemisphere see points behind the projection centre.
#[test]
fn cameras_say_what_they_fold_and_where_they_look() {
    let aside = |tangent: f64| Vector3::new(0.6 * tangent, -0.8 * tangent, -1.0);
    for (name, parameters) in [
        ("bal", vec![1000.0, -0.3, 0.0]),
        ("radial", vec![1000.0, 500.0, 500.0, -0.3, 0.0]),
        ("simple_radial", vec![1000.0, 500.0, 500.0, -0.3]),
        ("cahvor", vec![1000.0, 1000.0, 500.0, 500.0, 0.0, 0.0, 0.0, -0.3, 0.0]),
        ("brown_forward", vec![-1.0, 0.0, 0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ] {
        let camera = Camera::named(name, &parameters).unwrap();
        let limit = camera.radial_limit().unwrap().radius;
        for (part, folded) in [(0.5, false), (0.999, false), (1.001, true)] {
            assert_eq!(camera.folds(&aside(part * limit), [0.0; 2]), folded, "{name} {part}");
        }
        assert!(camera.faces(&aside(0.1)) && !camera.faces(&-aside(0.1)), "{name}");
    }
    let brown = [-30.0, 1.0, 2.0, -1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let camera = Camera::named("brown", &brown).unwrap();
    let limit = camera.radial_limit().unwrap().radius;
    for (part, folded) in [(0.999, false), (1.001, true)] {
        assert_eq!(camera.folds(&aside(0.1), [1.0, 2.0 - part * limit]), folded);
    }
    let behind = Vector3::new(0.4, 0.3, 0.2);
    for (name, parameters, faces) in [
        ("fisheye", vec![1.0, 1.0, 0.0, 0.0], true),
        ("equirectangular", vec![1000.0, 500.0], true),
        ("simple_division", vec![1.0, 0.0, 0.0, -0.2], true),
        ("simple_division", vec![1.0, 0.0, 0.0, 0.01], false),
        ("eucm", vec![1.0, 1.0, 0.0, 0.0, 0.7, 1.0], true),
        ("eucm", vec![1.0, 1.0, 0.0, 0.0, 0.2, 1.0], false),
        ("pinhole", vec![1.0, 1.0, 0.0, 0.0], false),
    ] {
        let camera = Camera::named(name, &parameters).unwrap();
        assert_eq!(camera.faces(&behind), faces, "{name}");
        let back = camera.direction(camera.image(&behind));
        let same = back.is_some_and(|back| (back - behind.normalize()).amax() < 1e-12);
        assert_eq!(same, faces, "{name}: {back:?}");
    }
}

/// The last column is adjacent to the first.
#[test]
fn residuals_of_a_panorama_are_wrapped() {
    let camera = Camera::named("equirectangular", &[1200.0, 600.0]).unwrap();
    let u = Vector3::new(-1e-3, 0.2, 1.0);
    let [column, row] = camera.image(&u);
    assert!(column < 1.0);
    let ([x, y], _) = camera.compare(&u, [column + 1199.5, row + 0.25]);
    assert!((x + 0.5).abs() < 1e-9 && (y - 0.25).abs() < 1e-9, "{x} {y}");
}

/// Balancing is a scale, which the principal distance absorbs.
#[test]
fn a_balanced_lens_is_one_with_another_principal_distance() {
    let (r0, c) = (13.5, -28.5);
    let [k1, k2, k3, p1, p2] = [-1.1e-4, 1.5e-7, -2e-11, 5.8e-6, -6.8e-6];
    let scale = 1.0 - r0 * r0 * (k1 + r0 * r0 * (k2 + r0 * r0 * k3));
    let own = |c: f64, scale: f64, r0: f64| {
        let terms = [k1, k2, k3, p1, p2].map(|term| term / scale);
        let all = [&[c, 0.02, -0.05][..], &terms, &[1e-4, -7e-5, r0]].concat();
        Camera::named("brown", &all).unwrap()
    };
    let (balanced, unbalanced) = (own(c, 1.0, r0), own(c / scale, scale, 0.0));
    for measured in [[11.0, -7.0], [-4.0, 9.0], [0.1, 0.2]] {
        let [a, b] = [&balanced, &unbalanced].map(|camera| camera.direction(measured).unwrap());
        assert!((a - b).amax() < 1e-15);
    }
}

/// The table in the documentation of `Camera` lists all cameras with the names of their parameters in order.
#[test]
fn the_documentation_lists_the_parameters_of_every_camera() {
    let listed =
        include_str!("../src/geometry/camera/parameters.md").lines().filter(|line| line.starts_with("| [`"));
    let cells: Vec<Vec<&str>> = listed.map(|line| line.split('|').map(str::trim).collect()).collect();
    assert_eq!(cells.len(), Camera::NAMES.len());
    for (cells, &name) in cells.iter().zip(Camera::NAMES) {
        let model = Camera::model(name).unwrap();
        let names: Vec<&str> = model.parameters.iter().map(|&(name, _)| name).collect();
        let (free, constants) = names.split_at(names.len() - model.constants);
        assert_eq!(cells[2..5], [&format!("`{name}`"), &free.join(", "), &constants.join(", ")]);
    }
}
