//! Every model of cameras against the golden data of an independent program.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

mod golden;

use photocore::geometry::{Camera, Vector3};
use serde_json::Value;

use golden::{golden, list, rows};

/// Values by name in the order of a model; `more` are those that the golden data do not list. The names of the model differ in case.
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

/// Partials to 1e-10 of the largest of their row.
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
        if !Camera::NAMES.contains(&model) {
            continue;
        }
        let constants = ["r0", "b"].map(|name| (name, entry.get(name).map_or(0.0, |b| b.as_f64().unwrap())));
        let more = [&constants[..], &[("c", -28.5)]].concat();
        let (parameters, columns) = values(model, entry, "params", &more);
        let camera = Camera::named(model, &parameters).unwrap();
        // Any direction: what is corrected does not depend on it.
        let u = Vector3::new(0.2, -0.1, -1.3);
        for point in entry["points"].as_array().unwrap() {
            let measured: [f64; 2] = list(&point["measured"]).try_into().unwrap();
            let (corrected, what) = (list(&point["corrected"]), format!("{name} {measured:?}"));
            let found = camera.correction(measured).unwrap();
            let apart = [0, 1].map(|k| (found[k] - corrected[k]).abs());
            assert!(apart[0].max(apart[1]) < 1e-12 * 20.0, "{what}: {found:?} {corrected:?}");
            let (residual, image) = camera.compare(&u, measured);
            let by_parameters = rows(&point["d_corrected_d_params"]);
            for row in 0..2 {
                let ideal = -28.5 * u[row] / u.z;
                assert!((residual[row] - (corrected[row] - ideal)).abs() < 1e-12 * 20.0, "{what}");
                assert!(image.by_u[row].dot(&u).abs() < 1e-13 * 28.5, "{what}");
                let own = |k: usize| {
                    let place = columns.iter().position(|&column| column == Some(k)).unwrap();
                    -image.by_parameters[row][place]
                };
                let own: Vec<f64> = (0..by_parameters[row].len()).map(own).collect();
                assert_row(&own, &by_parameters[row], &what);
                assert!((image.by_parameters[row][0] - u[row] / u.z).abs() < 1e-15, "{what}");
            }
            // The way back, and its partials: the image moves as the inverse of g.
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
