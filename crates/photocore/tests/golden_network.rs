//! Networks against golden figures of an independent program, read where they are at hand.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

mod golden;

use std::collections::HashMap;
use std::ops::ControlFlow;

use nalgebra::Matrix6;
use photocore::adjustment::{self, Method, Stop};
use photocore::geometry::{AttitudeNumbers, Matrix3, ObjectSpace, Perspective, PoseNumbers, RotationSense};
use photocore::network::observations::{Distance, Observation};
use photocore::network::{
    AdjustedPhoto, Camera, Image, InnerConstraints, Network, Options, Photo, Point, Solution,
};
use serde_json::Value;

use golden::{golden, list, rows};

const SENSE: RotationSense = RotationSense::GroundToPhoto;
const NUMBERS: AttitudeNumbers = AttitudeNumbers::OmegaPhiKappa(SENSE);

/// The network of a file, without its scale bars if so asked, and the index of every block by name.
fn network(file: &Value, bars: bool) -> (Network, HashMap<String, usize>) {
    let (mut index, mut photos, mut points) = (HashMap::new(), vec![], vec![]);
    let blocks = file["inputs"]["initial"].as_object().unwrap();
    let named = |kind: &'static str| {
        (1..).map_while(move |k| Some((format!("{kind}{k}"), blocks.get(&format!("{kind}{k}"))?)))
    };
    for (name, block) in named("photo") {
        let attitude = Matrix3::from_row_slice(&rows(&block["matrix_photo_to_object"]).concat());
        let numbers = [list(&block["position"]), NUMBERS.numbers(&attitude).to_vec()].concat();
        let pose: [f64; 6] = numbers.try_into().unwrap();
        index.insert(name, photos.len());
        photos.push(Photo { pose, observed: pose, sd: [f64::INFINITY; 6], camera: 0 });
    }
    for (name, block) in named("point") {
        index.insert(name, points.len());
        points.push(Point { coordinates: list(&block["value"]).try_into().unwrap(), sd: [f64::INFINITY; 3] });
    }
    let observed = &file["inputs"]["observations"];
    let between = |kind: &str| -> Vec<Vec<usize>> {
        let names = observed[kind]["between"].as_array().unwrap();
        names
            .iter()
            .map(|names| names.as_array().unwrap().iter().map(|name| index[name.as_str().unwrap()]).collect())
            .collect()
    };
    let sd = |kind: &str| observed[kind]["covariance"]["all"][0][0].as_f64().unwrap().sqrt();
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
    let lengths = between("scale bar").into_iter().zip(rows(&observed["scale bar"]["observed"]));
    let network = Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(Perspective { principal_distance: -35.0 }.into())],
        photos,
        points,
        images,
        observations: if bars { lengths.map(bar).collect() } else { vec![] },
        commons: vec![],
        mounts: vec![],
    };
    (network, index)
}

/// The attitude's part of a photo's cofactors taken from its angles to the rotation step: rho = K d(angles).
fn by_step(photo: &AdjustedPhoto) -> Matrix6<f64> {
    let [.., omega, phi, kappa] = photo.pose;
    let mut rates = Matrix6::identity();
    rates.fixed_view_mut::<3, 3>(3, 3).copy_from(&NUMBERS.rates([omega, phi, kappa]));
    rates * Matrix6::from_row_slice(&photo.cofactors) * rates.transpose()
}

fn assert_cofactors(own: &[f64], golden: &Value, what: &str) {
    let golden = rows(golden);
    let width = golden.len();
    for (i, row) in golden.iter().enumerate() {
        for (j, expected) in row.iter().enumerate() {
            let scale = (golden[i][i] * golden[j][j]).sqrt();
            let apart = (own[i * width + j] - expected).abs();
            assert!(apart <= 1e-8 * scale, "{what} {i} {j}: {} {expected}", own[i * width + j]);
        }
    }
}

fn adjust(network: &Network, datum: &InnerConstraints) -> Solution {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let method = Method::Damped(Stop::Fraction(1e-9));
    let adjustment = adjustment::Options { method, ..adjustment::Options::default() };
    let options = Options { adjustment, ..Options::default() };
    network.adjust_in_datum(&options, datum, &pool, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Unknowns to a millionth of their standard deviations, figures of the whole and of every kind of observation.
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
            (list(&block["position"]), list(&block["sd_position"]), [x, y, z])
        } else {
            let point = solution.points[index[name]].as_ref().unwrap();
            (list(&block["value"]), list(&block["sd"]), point.coordinates)
        };
        for k in 0..3 {
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
        } else {
            let own = solution.points[index[name]].as_ref().unwrap().cofactors;
            assert_cofactors(own.as_flattened(), cofactors, name);
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
        };
        assert_solution(&adjust(&network, &datum), golden, &index, name);
    }
}
