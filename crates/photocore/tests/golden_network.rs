//! Networks against golden data of an independent program, read if available.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::collections::HashMap;

use nalgebra::Matrix6;
use photocore::adjustment::{self, Method, Stop};
use photocore::geometry::{self, AttitudeNumbers, Matrix3, Perspective, PoseNumbers, RotationSense};
use photocore::network::observations::{Distance, Observation};
use photocore::network::{
    AdjustedPhoto, Camera, Image, InnerConstraints, Network, Options, Photo, Point, Solution,
};
use photocore::{Context, Threads};
use serde_json::Value;

use crate::golden::{golden, list, rows};

const SENSE: RotationSense = RotationSense::GroundToPhoto;
const NUMBERS: AttitudeNumbers = AttitudeNumbers::OmegaPhiKappa(SENSE);

/// Returns the network of a file, optionally without its scale bars, and the index of every block by name.
fn network(file: &Value, bars: bool) -> (Network, HashMap<String, usize>) {
    let (mut photos, mut points) = (vec![], vec![]);
    let mut index = HashMap::from([("camera".to_owned(), 0)]);
    let blocks = file["inputs"]["initial"].as_object().unwrap();
    let named = |kind: &'static str| {
        (1..).map_while(move |k| Some((format!("{kind}{k}"), blocks.get(&format!("{kind}{k}"))?)))
    };
    for (name, block) in named("photo") {
        let attitude = Matrix3::from_row_slice(&rows(&block["matrix_photo_to_object"]).concat());
        let numbers = [list(&block["position"]), NUMBERS.numbers(&attitude).to_vec()].concat();
        let pose: [f64; 6] = numbers.try_into().unwrap();
        index.insert(name, photos.len());
        photos.push(Photo::free(pose, 0));
    }
    for (name, block) in named("point") {
        index.insert(name, points.len());
        points.push(Point { coordinates: list(&block["value"]).try_into().unwrap(), sd: [f64::INFINITY; 3] });
    }
    let observed = &file["inputs"]["observations"];
    let deviations = |kind: &str| -> Vec<f64> {
        let covariance = rows(&observed[kind]["covariance"]["all"]);
        (0..covariance.len()).map(|k| covariance[k][k].sqrt()).collect()
    };
    let between = |kind: &str| -> Vec<Vec<usize>> {
        let names = observed[kind]["between"].as_array().unwrap();
        names
            .iter()
            .map(|names| names.as_array().unwrap().iter().map(|name| index[name.as_str().unwrap()]).collect())
            .collect()
    };
    let sd = |kind: &str| deviations(kind)[0];
    let image = |(ends, xy): (Vec<usize>, Vec<f64>)| Image {
        photo: ends[0],
        point: ends[1],
        xy: xy.try_into().unwrap(),
        sd: [sd("image"); 2],
    };
    let images = between("image").into_iter().zip(rows(&observed["image"]["observed"])).map(image).collect();
    let bar = |(ends, length): (Vec<usize>, Vec<f64>)| {
        Observation::from(Distance {
            points: ends.try_into().unwrap(),
            length: length[0],
            sd: sd("scale bar"),
            instrument: None,
        })
    };
    let lengths = || between("scale bar").into_iter().zip(rows(&observed["scale bar"]["observed"]));
    if observed.get("control").is_some() {
        let control = between("control").into_iter().zip(rows(&observed["control"]["observed"]));
        for (own, given) in control {
            let sd = deviations("control").try_into().unwrap();
            points[own[0]] = Point { coordinates: given.try_into().unwrap(), sd };
        }
    }
    let camera = match blocks.get("camera") {
        None => Camera::held(Perspective { principal_distance: -35.0 }.into()),
        Some(_) => {
            // c, xp, yp, K1, K2, K3, P1, P2 with priors; b1, b2, r0 are fixed at zero.
            let known = [0.0; 3];
            let given = [&list(&observed["camera prior"]["observed"][0])[..], &known].concat();
            let sd = [&deviations("camera prior")[..], &known].concat();
            Camera::new(geometry::Camera::named("brown", &given).unwrap(), sd)
        }
    };
    let network = Network {
        poses: PoseNumbers::Angles(SENSE),
        cameras: vec![camera],
        photos,
        points,
        images,
        observations: if bars { lengths().map(bar).collect() } else { vec![] },
        ..Network::new()
    };
    (network, index)
}

/// Transforms the attitude part of a photo's cofactors from angles to the rotation step: rho = K d(angles).
fn by_step(photo: &AdjustedPhoto) -> Matrix6<f64> {
    let [.., omega, phi, kappa] = photo.pose;
    let mut rates = Matrix6::identity();
    rates.fixed_view_mut::<3, 3>(3, 3).copy_from(&NUMBERS.rates([omega, phi, kappa]));
    rates * Matrix6::from_row_slice(photo.cofactors.as_slice()) * rates.transpose()
}

fn assert_cofactors(own: &[f64], golden: &Value, what: &str) {
    let golden = rows(golden);
    let width = golden.len();
    for (i, row) in golden.iter().enumerate() {
        for (j, expected) in row.iter().enumerate() {
            let scale = (golden[i][i] * golden[j][j]).sqrt();
            let difference = (own[i * width + j] - expected).abs();
            assert!(difference <= 1e-8 * scale, "{what} {i} {j}: {} {expected}", own[i * width + j]);
        }
    }
}

fn adjust(network: &Network, datum: Option<&InnerConstraints>) -> Solution {
    let threads = Threads::new(2).unwrap();
    let method = Method::Damped(Stop::Fraction(1e-9));
    let adjustment = adjustment::Options { method, ..adjustment::Options::default() };
    let options = Options { adjustment, ..Options::default() };
    let context = &mut Context::new(&threads);
    match datum {
        Some(datum) => network.adjustment(&options).in_datum(datum).run_in(context).unwrap(),
        None => network.adjustment(&options).run_in(context).unwrap(),
    }
}

/// Compares unknowns to a millionth of their standard deviations, and global statistics and statistics per observation type.
fn assert_solution(solution: &Solution, golden: &Value, index: &HashMap<String, usize>, what: &str) {
    let number = |name: &str| golden[name].as_f64().unwrap();
    assert_eq!(solution.degrees_of_freedom as f64, number("degrees_of_freedom"), "{what}");
    let sigma0 = solution.variance_of_unit_weight.unwrap().sqrt();
    assert!((sigma0 / number("sigma0") - 1.0).abs() < 1e-10, "{what}: sigma0 {sigma0}");
    for (name, block) in golden["unknowns_solved"].as_object().unwrap() {
        let (position, sd, own) = if name.starts_with("photo") {
            let photo = &solution.photos[index[name]];
            let [x, y, z, omega, phi, kappa] = photo.pose;
            let attitude = NUMBERS.attitude([omega, phi, kappa]);
            let expected = Matrix3::from_row_slice(&rows(&block["matrix_photo_to_object"]).concat());
            assert!((attitude - expected).amax() < 1e-9, "{what} {name}: {}", (attitude - expected).amax());
            (list(&block["position"]), list(&block["sd_position"]), vec![x, y, z])
        } else if name == "camera" {
            (list(&block["value"]), list(&block["sd"]), solution.cameras[0].parameters.clone())
        } else {
            let point = solution.points[index[name]].as_ref().unwrap();
            (list(&block["value"]), list(&block["sd"]), point.coordinates.to_vec())
        };
        for k in 0..position.len() {
            assert!((own[k] - position[k]).abs() < 1e-6 * sd[k], "{what} {name}: {} {}", own[k], position[k]);
        }
    }
    let images = &golden["kinds"]["image"];
    let figures = rows(&images["redundancy"]).into_iter().zip(rows(&images["standardized"]));
    for (own, (redundancy, standardized)) in solution.images.iter().zip(figures) {
        let own = own.as_ref().unwrap();
        for k in 0..2 {
            assert!(
                (own.redundancy[k] - redundancy[k]).abs() < 1e-8,
                "{what}: {:?} {redundancy:?}",
                own.redundancy
            );
            assert!((own.standardized[k] - standardized[k]).abs() < 1e-6, "{what}: {:?}", own.standardized);
        }
    }
    for (name, cofactors) in golden["cofactors"].as_object().unwrap() {
        if name.starts_with("photo") {
            assert_cofactors(by_step(&solution.photos[index[name]]).as_slice(), cofactors, name);
        } else if name == "camera" {
            let count = rows(cofactors).len();
            let all = &solution.cameras[0].cofactors;
            let width = solution.cameras[0].parameters.len();
            let own: Vec<f64> =
                all.as_slice().chunks(width).take(count).flat_map(|row| &row[..count]).copied().collect();
            assert_cofactors(&own, cofactors, name);
        } else {
            let own = solution.points[index[name]].as_ref().unwrap().cofactors;
            assert_cofactors(own.as_slice(), cofactors, name);
        }
    }
}

#[test]
fn a_free_network_with_and_without_scale_bars_in_four_datums() {
    let Some(file) = golden("free_network.json") else { return };
    let solutions = file["solutions"].as_object().unwrap();
    assert_eq!(solutions.len(), 5);
    for (name, golden) in solutions {
        let (network, index) = network(&file, !name.starts_with("no scale bar"));
        let carriers = golden["datum"].as_array().unwrap().iter().map(|name| name.as_str().unwrap());
        let (photos, points): (Vec<&str>, Vec<&str>) = carriers.partition(|name| name.starts_with("photo"));
        let datum = InnerConstraints {
            points: points.iter().map(|&name| index[name]).collect(),
            photos: photos.iter().map(|&name| index[name]).collect(),
            scale: golden["with_scale"].as_bool().unwrap(),
            ..Default::default()
        };
        assert_solution(&adjust(&network, Some(&datum)), golden, &index, name);
    }
}

#[test]
fn a_block_that_calibrates_its_camera_with_priors() {
    let Some(file) = golden("selfcal.json") else { return };
    let (network, index) = network(&file, false);
    let (solution, golden) = (adjust(&network, None), &file["solution"]);
    assert_solution(&solution, golden, &index, "selfcal");
    let camera = &solution.cameras[0];
    let redundancy = rows(&golden["kinds"]["camera prior"]["redundancy"]).remove(0);
    for (k, expected) in redundancy.iter().enumerate() {
        assert!((camera.redundancy[k] - expected).abs() < 1e-8, "{:?}", camera.redundancy);
    }
    let residuals = rows(&golden["kinds"]["image"]["residuals"]);
    for (own, expected) in solution.images.iter().zip(residuals) {
        let difference = (0..2).map(|k| (own.unwrap().residual[k] - expected[k]).abs());
        // A millionth of the standard deviation of an observation.
        assert!(difference.fold(0.0, f64::max) < 1e-9);
    }
    let sum = |kind: &str| golden["kinds"][kind]["sum_of_squares"].as_f64().unwrap();
    let sums = solution.sums_of_squares;
    for (own, kind) in [(sums.plates, "image"), (sums.camera, "camera prior"), (sums.ground, "control")] {
        assert!((own / sum(kind) - 1.0).abs() < 1e-9, "{kind}: {own}");
    }
}
