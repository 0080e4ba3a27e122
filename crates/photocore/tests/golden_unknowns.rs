//! Aerial block with GNSS and IMU, and a rig, against golden data of an independent program, read if available.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::collections::HashMap;

use nalgebra::{DMatrix, Matrix6};
use photocore::adjustment::{self, Method, Status, Stop};
use photocore::geometry::{self, AttitudeNumbers, Matrix3, Perspective, PoseNumbers, RotationSense};
use photocore::network::mounts::OnFrame;
use photocore::network::observations::{Attitude, Control, Position, Quantity};
use photocore::network::{
    AdjustedObservation, AdjustedPhoto, Camera, Common, CommonKind, Image, Network, Observation, Of, Options,
    Photo, Point, Precision, Solution,
};
use photocore::{Context, Threads};
use serde_json::Value;

use crate::golden::{golden, list, rows};

const SENSE: RotationSense = RotationSense::GroundToPhoto;
const NUMBERS: AttitudeNumbers = AttitudeNumbers::OmegaPhiKappa(SENSE);
const FREE: f64 = f64::INFINITY;

/// Network with the index of every block by name, without observations.
struct File<'a> {
    file: &'a Value,
    network: Network,
    index: HashMap<String, usize>,
}

fn matrix(value: &Value) -> Matrix3 {
    Matrix3::from_row_slice(&rows(value).concat())
}

impl<'a> File<'a> {
    /// Photos are the poses with this name prefix.
    fn new(file: &'a Value, photo: &str, cameras: Vec<Camera>) -> Self {
        let (mut index, mut photos, mut points) = (HashMap::new(), vec![], vec![]);
        let blocks = file["inputs"]["initial"].as_object().unwrap();
        for (name, block) in blocks.iter().filter(|(name, _)| name.starts_with(photo)) {
            let numbers = NUMBERS.numbers(&matrix(&block["matrix_photo_to_object"]));
            let pose = [list(&block["position"]), numbers.to_vec()].concat().try_into().unwrap();
            index.insert(name.clone(), photos.len());
            photos.push(Photo::known(pose, [FREE; 6], 0));
        }
        for (name, block) in blocks.iter().filter(|(name, _)| name.starts_with("point")) {
            index.insert(name.clone(), points.len());
            points.push(Point { coordinates: list(&block["value"]).try_into().unwrap(), sd: [FREE; 3] });
        }
        let network = Network {
            poses: PoseNumbers::Angles(SENSE),
            cameras,
            photos,
            points,
            images: vec![],
            ..Network::new()
        };
        Self { file, network, index }
    }

    /// Returns the objects, observed values and covariances of the observations of a type.
    fn observed(&self, kind: &str) -> Vec<(Vec<&'a str>, &'a Value, DMatrix<f64>)> {
        let own = &self.file["inputs"]["observations"][kind];
        let (all, each) = (&own["covariance"]["all"], own["covariance"]["each"].as_array());
        let between = own["between"].as_array().unwrap().iter().zip(own["observed"].as_array().unwrap());
        let found = between.enumerate().map(|(k, (names, observed))| {
            let covariance = rows(each.map_or(all, |each| &each[k]));
            let covariance = DMatrix::from_fn(covariance.len(), covariance.len(), |i, j| covariance[i][j]);
            (
                names.as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect(),
                observed,
                covariance,
            )
        });
        found.collect()
    }

    fn add_common(&mut self, name: &str, kind: CommonKind, sd: f64) {
        let block = &self.file["inputs"]["initial"][name];
        let vector = |value: &Value| -> [f64; 3] {
            if value.is_null() { [0.0; 3] } else { list(value).try_into().unwrap() }
        };
        let (position, attitude) = match kind {
            CommonKind::Boresight => ([0.0; 3], matrix(&block["matrix"])),
            CommonKind::Sensor => (vector(&block["position"]), matrix(&block["matrix_photo_to_object"])),
            _ => (vector(&block["value"]), Matrix3::identity()),
        };
        self.index.insert(name.to_owned(), self.network.commons.len());
        let sd = vec![sd; kind.unknowns().len()];
        self.network.commons.push(Common { kind, position, attitude, sd });
    }

    fn add_images(&mut self, kind: &str, photo: impl Fn(&HashMap<String, usize>, &[&str]) -> usize) {
        for (names, observed, covariance) in self.observed(kind) {
            let sd = [covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt()];
            let point = self.index[*names.last().unwrap()];
            let xy = list(observed).try_into().unwrap();
            self.network.images.push(Image { photo: photo(&self.index, &names), point, xy, sd });
        }
    }

    fn control(&self) -> Vec<Observation> {
        let control = |(names, observed, covariance): (Vec<&str>, &Value, DMatrix<f64>)| {
            let coordinates = list(observed).try_into().unwrap();
            Control { point: self.index[names[0]], coordinates, precision: Precision::Covariance(covariance) }
                .into()
        };
        self.observed("control").into_iter().map(control).collect()
    }
}

fn options() -> Options {
    let method = Method::Damped(Stop::Fraction(1e-9));
    let adjustment = adjustment::Options { method, ..adjustment::Options::default() };
    Options { adjustment, ..Options::default() }
}

fn adjusted(network: &Network) -> Solution {
    let threads = Threads::new(2).unwrap();
    let solution = network.adjustment(&options()).run_in(&mut Context::new(&threads)).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    assert!(solution.adjustment.iterations.len() <= 10, "{}", solution.adjustment.iterations.len());
    solution
}

fn by_step(photo: &AdjustedPhoto) -> Matrix6<f64> {
    let [.., omega, phi, kappa] = photo.pose;
    let mut rates = Matrix6::identity();
    rates.fixed_view_mut::<3, 3>(3, 3).copy_from(&NUMBERS.rates([omega, phi, kappa]));
    rates * Matrix6::from_row_slice(photo.cofactors.as_slice()) * rates.transpose()
}

fn assert_cofactors(own: &[f64], golden: &Value, what: &str) {
    let golden = rows(golden);
    for (i, row) in golden.iter().enumerate() {
        for (j, expected) in row.iter().enumerate() {
            let (scale, found) = ((golden[i][i] * golden[j][j]).sqrt(), own[i * golden.len() + j]);
            assert!((found - expected).abs() <= 1e-8 * scale, "{what} {i} {j}: {found} {expected}");
        }
    }
}

fn assert_position(found: &[f64], block: &Value, what: &str) {
    let (position, sd) =
        if block["position"].is_null() { ("value", "sd") } else { ("position", "sd_position") };
    let sd = list(&block[sd]);
    for (k, expected) in list(&block[position]).into_iter().enumerate() {
        assert!((found[k] - expected).abs() < 1e-6 * sd[k], "{what}: {} {expected}", found[k]);
    }
}

fn assert_attitude(found: &Matrix3, expected: &Value, what: &str) {
    let difference = (found - matrix(expected)).amax();
    assert!(difference < 1e-11, "{what}: {difference:e}");
}

/// Compares unknowns, cofactors, and global statistics.
fn assert_solution(file: &File<'_>, solution: &Solution) {
    let golden = &file.file["solution"];
    let number = |name: &str| golden[name].as_f64().unwrap();
    assert_eq!(solution.degrees_of_freedom as f64, number("degrees_of_freedom"));
    let sigma0 = solution.variance_of_unit_weight.unwrap().sqrt();
    assert!((sigma0 / number("sigma0") - 1.0).abs() < 1e-10, "sigma0 {sigma0}");
    let square = solution.sums_of_squares.total();
    assert!((square / number("sum_of_squares") - 1.0).abs() < 1e-9, "{square}");
    for (name, block) in golden["unknowns_solved"].as_object().unwrap() {
        let cofactors = &golden["cofactors"][name];
        let own: Vec<f64> = if name.starts_with("photo") || name.starts_with("frame") {
            let photo = &solution.photos[file.index[name]];
            let [x, y, z, angles @ ..] = photo.pose;
            assert_position(&[x, y, z], block, name);
            assert_attitude(&NUMBERS.attitude(angles), &block["matrix_photo_to_object"], name);
            by_step(photo).as_slice().to_vec()
        } else if name.starts_with("point") {
            let point = solution.points[file.index[name]].unwrap();
            assert_position(&point.coordinates, block, name);
            point.cofactors.as_slice().to_vec()
        } else {
            let common = &solution.commons[file.index[name]];
            match file.network.commons[file.index[name]].kind {
                CommonKind::Boresight => assert_attitude(&common.attitude, &block["matrix"], name),
                CommonKind::Sensor => {
                    assert_position(&common.position, block, name);
                    assert_attitude(&common.attitude, &block["matrix_photo_to_object"], name);
                }
                _ => assert_position(&common.position, block, name),
            }
            common.cofactors.as_slice().to_vec()
        };
        if !cofactors.is_null() {
            assert_cofactors(&own, cofactors, name);
        }
    }
}

/// Compares the cross-cofactors of two blocks of unknowns.
fn assert_cross_cofactors(file: &File<'_>, solution: &Solution) {
    let threads = Threads::new(2).unwrap();
    let of = |name: &str| {
        let index = file.index[name];
        match &name[..5] {
            "photo" | "frame" => Of::PhotoStep(index),
            "point" => Of::Point(index),
            _ => Of::Common(index),
        }
    };
    let options = options();
    let found =
        file.network.covariances(&options, &solution.state, None, &mut Context::new(&threads)).unwrap();
    let golden = &file.file["solution"]["cross_cofactors"];
    for (name, expected) in golden.as_object().unwrap() {
        let (a, b) = name.split_once(" | ").unwrap();
        let own = found.cofactors(&[of(a), of(b)], None, &mut Context::new(&threads)).unwrap();
        let rows_of = found.width(of(a)).unwrap();
        for (i, row) in rows(expected).iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                let at = |i: usize, j: usize| own[(i, j)];
                let (i, j) = (i, rows_of + j);
                let scale = (at(i, i) * at(j, j)).sqrt();
                assert!((at(i, j) - expected).abs() <= 1e-8 * scale, "{name}: {} {expected}", at(i, j));
            }
        }
    }
}

/// Compares residuals, redundancy numbers and standardized residuals of one observation type.
fn assert_kind<'s>(
    file: &File<'_>,
    kind: &str,
    found: impl Iterator<Item = (&'s [f64], &'s [f64], &'s [f64])>,
) {
    let golden = &file.file["solution"]["kinds"][kind];
    let figures = ["residuals", "redundancy", "standardized"].map(|name| rows(&golden[name]));
    let mut count = 0;
    for (row, (residuals, redundancy, standardized)) in found.enumerate() {
        for k in 0..residuals.len() {
            let [v, r, w] = [0, 1, 2].map(|figure| figures[figure][row][k]);
            assert!((redundancy[k] - r).abs() < 1e-8, "{kind} {row}: {} {r}", redundancy[k]);
            assert!((standardized[k] - w).abs() < 1e-5, "{kind} {row}: {} {w}", standardized[k]);
            assert!((residuals[k] - v).abs() < 1e-7 * (1.0 + v.abs()), "{kind} {row}: {} {v}", residuals[k]);
        }
        count += residuals.len();
    }
    assert_eq!(count as f64, golden["rows"].as_f64().unwrap(), "{kind}");
}

fn of_images(
    solution: &Solution,
    range: std::ops::Range<usize>,
) -> impl Iterator<Item = (&[f64], &[f64], &[f64])> {
    let images = solution.images[range].iter().map(|image| image.as_ref().unwrap());
    images.map(|image| (&image.residual[..], &image.redundancy[..], &image.standardized[..]))
}

fn of_kind<'s>(
    network: &Network,
    solution: &'s Solution,
    kind: &str,
) -> impl Iterator<Item = (&'s [f64], &'s [f64], &'s [f64])> {
    let own = network.observations.iter().zip(&solution.observations);
    let own: Vec<&AdjustedObservation> =
        own.filter(|(own, _)| own.kind() == kind).map(|(_, adjusted)| adjusted.as_ref().unwrap()).collect();
    own.into_iter().map(|own| (&own.residual[..], &own.redundancy[..], &own.standardized[..]))
}

#[test]
fn an_aerial_block_with_lever_arm_shifts_drifts_and_boresight() {
    let Some(data) = golden("aerial.json") else { return };
    let camera = Camera::held(Perspective { principal_distance: -100.0 }.into());
    let mut file = File::new(&data, "photo", vec![camera]);
    let prior = &file.observed("lever arm prior")[0];
    let lever_arm_sd = prior.2[(0, 0)].sqrt();
    file.add_common("lever arm", CommonKind::LeverArm, lever_arm_sd);
    file.add_common("boresight", CommonKind::Boresight, FREE);
    for strip in 1..4 {
        file.add_common(&format!("shift{strip}"), CommonKind::Shift, FREE);
        file.add_common(&format!("drift{strip}"), CommonKind::Drift, FREE);
    }
    file.add_images("image", |index, names| index[names[0]]);
    let times = list(&data["inputs"]["observations"]["gnss"]["dt"]);
    let mut observations = vec![];
    for ((names, observed, covariance), time) in file.observed("gnss").into_iter().zip(times) {
        observations.push(Observation::from(Position {
            photo: file.index[names[0]],
            coordinates: list(observed).try_into().unwrap(),
            lever_arm: Quantity::Common(file.index[names[1]]),
            shift: Some(file.index[names[2]]),
            drift: Some(file.index[names[3]]),
            time,
            precision: Precision::Covariance(covariance),
        }));
    }
    for (names, observed, covariance) in file.observed("imu") {
        observations.push(
            Attitude {
                photo: file.index[names[0]],
                attitude: matrix(observed),
                boresight: Quantity::Common(file.index[names[1]]),
                precision: Precision::Covariance(covariance),
            }
            .into(),
        );
    }
    observations.extend(file.control());
    file.network.observations = observations;
    let solution = adjusted(&file.network);
    assert_solution(&file, &solution);
    assert_cross_cofactors(&file, &solution);
    assert_kind(&file, "image", of_images(&solution, 0..solution.images.len()));
    assert_kind(&file, "gnss", of_kind(&file.network, &solution, "position"));
    assert_kind(&file, "imu", of_kind(&file.network, &solution, "attitude"));
    assert_kind(&file, "control", of_kind(&file.network, &solution, "control"));
    let lever_arm = &solution.commons[file.index["lever arm"]];
    let residuals: Vec<f64> = lever_arm.change.iter().map(|change| -change).collect();
    let standardized: Vec<f64> =
        residuals.iter().zip(&lever_arm.redundancy).map(|(v, r)| v / (lever_arm_sd * r.sqrt())).collect();
    let own = (&residuals[..], &lever_arm.redundancy[..], &standardized[..]);
    assert_kind(&file, "lever arm prior", std::iter::once(own));
}

#[test]
fn a_rig_with_an_unknown_sensor() {
    let Some(data) = golden("rig.json") else { return };
    let camera = |name: &str| {
        let parameters = list(&data["cameras"][name]);
        Camera::held(geometry::Camera::named("opencv", &parameters).unwrap())
    };
    let mut file = File::new(&data, "frame", vec![camera("sensor1"), camera("sensor2")]);
    file.add_common("sensor2 in frame", CommonKind::Sensor, FREE);
    let frames = file.network.photos.len();
    for frame in 0..frames {
        let photo = Photo { camera: 1, ..file.network.photos[frame] };
        file.network.photos.push(photo);
        file.network.mounts.push(OnFrame { photo: frames + frame, frame, sensor: 0 }.into());
    }
    file.add_images("image sensor 1", |index, names| index[names[0]]);
    let first = file.network.images.len();
    file.add_images("image sensor 2", |index, names| frames + index[names[0]]);
    file.network.observations = file.control();
    let solution = adjusted(&file.network);
    assert_solution(&file, &solution);
    assert_cross_cofactors(&file, &solution);
    assert_kind(&file, "image sensor 1", of_images(&solution, 0..first));
    assert_kind(&file, "image sensor 2", of_images(&solution, first..solution.images.len()));
    assert_kind(&file, "control", of_kind(&file.network, &solution, "control"));

    let derived = &data["derived_pose_sensor2_frame3"];
    let own = &solution.photos[frames + file.index["frame3"]];
    let [x, y, z, angles @ ..] = own.pose;
    for (found, expected) in [x, y, z].into_iter().zip(list(&derived["position"])) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
    assert_attitude(&NUMBERS.attitude(angles), &derived["matrix_photo_to_object"], "derived");
    assert_cofactors(by_step(own).as_slice(), &derived["cofactors"], "derived");

    // The same cofactors by further right-hand sides.
    let threads = Threads::new(2).unwrap();
    let photo = frames + file.index["frame3"];
    let all =
        file.network.covariances(&options(), &solution.state, None, &mut Context::new(&threads)).unwrap();
    let by_steps = all.cofactors(&[Of::PhotoStep(photo)], None, &mut Context::new(&threads)).unwrap();
    assert_cofactors(by_steps.as_slice(), &derived["cofactors"], "derived, by steps");
    let in_angles = all.cofactors(&[Of::Photo(photo)], None, &mut Context::new(&threads)).unwrap();
    for (k, (a, b)) in in_angles.iter().zip(&own.cofactors).enumerate() {
        let scale = (own.cofactors[k / 6 * 7] * own.cofactors[k % 6 * 7]).sqrt();
        assert!((a - b).abs() < 1e-8 * scale);
    }

    // A frame without its own photo: the first frame loses its photo with all observations.
    let mut network = file.network.clone();
    network.images.retain(|image| image.photo != 0);
    let without = adjusted(&network);
    assert_eq!([0, frames].map(|photo| without.photos[photo].images > 0), [false, true]);
    assert!(without.photos[0].cofactors.iter().all(|value| value.is_finite()));

    // A sensor fixed at its estimate does not change the solution.
    let mut network = file.network.clone();
    let found = &solution.commons[0];
    network.commons[0] = Common {
        kind: CommonKind::Sensor,
        position: found.position,
        attitude: found.attitude,
        sd: vec![0.0; 6],
    };
    let known = adjusted(&network);
    assert_eq!(known.degrees_of_freedom, solution.degrees_of_freedom + 6);
    for (a, b) in known.photos.iter().zip(&solution.photos) {
        (0..6).for_each(|k| assert!((a.pose[k] - b.pose[k]).abs() < 1e-8));
        (0..6).for_each(|k| assert!(a.cofactors[7 * k] < b.cofactors[7 * k] * (1.0 + 1e-9)));
    }
}
