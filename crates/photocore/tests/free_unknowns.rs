//! Free networks with shared parameters and rigs, which follow datum motions; undetermined parameters are reported.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::TAU;

use photocore::adjustment::{self, Method, Status, Stop};
use photocore::geometry::{AttitudeNumbers, Matrix3, Perspective, Pose, RotationSense, Vector3, rotation};
use photocore::network::mounts::OnFrame;
use photocore::network::observations::{
    Attitude, Base, Distance, OnLevel, OnLine, OnPlane, OnPlumbLine, Position, Quantity, Relative,
};
use photocore::network::{
    Camera, Combination, Common, CommonKind, Image, InnerConstraints, Network, NetworkDatum, NetworkError,
    Observation, Options, Photo, Point, Precision, Solution,
};
use photocore::{Context, Threads};

use crate::{noise, noises};

const CAMERA: Perspective = Perspective { principal_distance: -28.0 };
const SD: f64 = 0.002;
const FREE: f64 = f64::INFINITY;
const NUMBERS: AttitudeNumbers = AttitudeNumbers::OmegaPhiKappa(RotationSense::GroundToPhoto);
const POINTS: usize = 14;

/// Returns the observations of points on photos with the given poses, with errors of `errors` standard deviations.
fn network(poses: &[Pose], places: &[Vector3], errors: f64) -> Network {
    let (mut photos, mut images) = (vec![], vec![]);
    for (photo, pose) in poses.iter().enumerate() {
        for (point, place) in places.iter().enumerate() {
            let u = pose.to_camera_frame(place);
            let n = 2 * images.len();
            let xy = [0, 1].map(|k| CAMERA.principal_distance * u[k] / u[2] + errors * SD * noise(n + k));
            images.push(Image { photo, point, xy, sd: [SD; 2] });
        }
        let start = pose.position + errors * 0.02 * noises(40 + photo);
        let [x, y, z] = start.into();
        let [omega, phi, kappa] = NUMBERS.numbers(&pose.attitude);
        let numbers = [x, y, z, omega, phi, kappa];
        photos.push(Photo { pose: numbers, observed: numbers, sd: [FREE; 6], camera: 0 });
    }
    Network {
        cameras: vec![Camera::held(CAMERA.into())],
        photos,
        points: places.iter().map(|_| Point { coordinates: [f64::NAN; 3], sd: [FREE; 3] }).collect(),
        images,
        ..Network::new()
    }
}

/// Returns points; the first six are on a plane, the next three on a line.
fn places() -> Vec<Vector3> {
    let mut all: Vec<Vector3> = (0..POINTS).map(noises).collect();
    let normal = rotation([0.3, -0.6, 0.2]).column(2).into_owned();
    for k in 1..6 {
        let off = normal.dot(&(all[k] - all[0]));
        all[k] -= off * normal;
    }
    all[7] = all[6] + Vector3::new(0.2, -0.4, 0.3);
    all[8] = all[6] - Vector3::new(0.4, -0.8, 0.6);
    all
}

fn around(photos: usize) -> Vec<Pose> {
    let pose = |index: usize| {
        let (sin, cos) = (TAU * index as f64 / photos as f64).sin_cos();
        let position = Vector3::new(6.0 * cos, 5.0 * sin, 0.5 * noise(index));
        let back = position.normalize();
        let right = Vector3::z().cross(&back).normalize();
        Pose { position, attitude: Matrix3::from_columns(&[right, back.cross(&right), back]) }
    };
    (0..photos).map(pose).collect()
}

fn common(kind: CommonKind, position: Vector3, attitude: Matrix3) -> Common {
    let sd = vec![FREE; kind.unknowns().len()];
    Common { kind, position: position.into(), attitude, sd }
}

fn deviations(sd: &[f64]) -> Precision {
    Precision::Deviations(sd.to_vec())
}

const PLANE: usize = 0;
const INSTRUMENT: usize = 1;
const SENSOR: usize = 2;

/// Returns a network with a free datum, including the scale, with a plane, an instrument and a rig; `errors` are in standard deviations of
/// the observations.
fn free(errors: f64) -> Network {
    let places = places();
    let sensor = Pose { position: Vector3::new(0.4, 0.1, -0.1), attitude: rotation([0.1, -0.2, 0.15]) };
    let mut poses = around(5);
    for frame in [0, 2] {
        let Pose { position, attitude } = poses[frame];
        poses.push(Pose {
            position: position + attitude * sensor.position,
            attitude: attitude * sensor.attitude,
        });
    }
    let mut network = network(&poses, &places, errors);
    let plane = rotation([0.3, -0.6, 0.2]) * rotation([0.05, 0.04, 0.3]);
    network.commons = vec![
        common(CommonKind::Plane, places[0] + 0.05 * noises(3), plane),
        common(CommonKind::Instrument, Vector3::new(1.0, 0.0, 0.0), Matrix3::identity()),
        common(CommonKind::Sensor, sensor.position + 0.02 * noises(5), sensor.attitude),
    ];
    network.mounts = vec![
        OnFrame { photo: 5, frame: 0, sensor: SENSOR }.into(),
        OnFrame { photo: 6, frame: 2, sensor: SENSOR }.into(),
    ];
    let plane = |point: usize| {
        let distance = errors * 1e-3 * noise(60 + point);
        Observation::from(OnPlane { point, plane: PLANE, distance, sd: 1e-3 })
    };
    let length = |points: [usize; 2]| {
        let length = 1.3 * (places[points[1]] - places[points[0]]).norm()
            + 0.02
            + errors * 1e-3 * noise(70 + points[0]);
        Distance { points, length, sd: 1e-3, instrument: Some(INSTRUMENT) }.into()
    };
    network.observations = (0..6).map(plane).collect();
    network.observations.extend([[0, 3], [6, 8], [9, 13], [1, 12]].map(length));
    network
}

fn base() -> Observation {
    Base { first: None, second: SENSOR, length: 0.43, sd: 1e-3 }.into()
}

fn options() -> Options {
    let method = Method::Damped(Stop::Fraction(1e-9));
    let adjustment = adjustment::Options { method, max_iterations: 100, ..Default::default() };
    Options { adjustment, ..Options::default() }
}

fn adjust(network: &Network) -> Result<Solution, NetworkError> {
    let threads = Threads::new(1).unwrap();
    network.adjustment(&options()).run_in(&mut Context::new(&threads))
}

#[test]
fn common_unknowns_move_with_a_free_network() {
    let mut network = free(1.0);
    // Deviations from a plane in metres decrease with the scale: another observation must define the scale.
    network.observations.push(base());
    let threads = Threads::new(2).unwrap();
    let minimal = adjust(&network).unwrap();
    assert_eq!(minimal.adjustment.status, Status::Converged);
    assert_eq!(minimal.datum.held.len(), 6, "{:?}", minimal.datum.held);
    assert!(minimal.datum.held.iter().all(|&(photo, _)| photo < 5), "frames are held, not photos on them");

    let datum = |points: std::ops::Range<usize>| {
        NetworkDatum::Inner(InnerConstraints { points: points.collect(), ..Default::default() })
    };
    let (first, second) = (datum(0..7), datum(7..14));
    let by_first = network.in_datum(&options(), &minimal.state, &first, &mut Context::new(&threads)).unwrap();
    let direct = network.in_datum(&options(), &minimal.state, &second, &mut Context::new(&threads)).unwrap();
    let by_way = network.in_datum(&options(), &by_first.state, &second, &mut Context::new(&threads)).unwrap();
    for (k, (a, b)) in direct.commons.iter().zip(&by_way.commons).enumerate() {
        let sd = |i: usize| b.cofactors[i * (b.change.len() + 1)].sqrt();
        for i in 0..a.change.len() {
            assert!((a.change[i] - b.change[i]).abs() < 1e-6 * sd(i), "{k}: {:?} {:?}", a.change, b.change);
            for j in 0..a.change.len() {
                let at = i * a.change.len() + j;
                let difference = (a.cofactors[at] - b.cofactors[at]).abs() / sd(i) / sd(j);
                assert!(difference < 1e-7, "{k} {i} {j}: {difference:e}");
            }
        }
    }
    for (a, b) in direct.photos.iter().zip(&by_way.photos) {
        for k in 0..36 {
            let scale = (b.cofactors[k / 6 * 7] * b.cofactors[k % 6 * 7]).sqrt();
            assert!((a.cofactors[k] - b.cofactors[k]).abs() < 1e-7 * scale);
        }
    }
    // Observable quantities are independent of the datum.
    let scaled = |solution: &Solution| {
        let at = |point: usize| Vector3::from(solution.points[point].unwrap().coordinates);
        let scale = solution.commons[INSTRUMENT].position[0];
        let sensor = Vector3::from(solution.commons[SENSOR].position).norm();
        [scale * (at(9) - at(13)).norm(), scale * sensor, solution.commons[INSTRUMENT].position[1]]
    };
    for (a, b) in scaled(&direct).into_iter().zip(scaled(&minimal)) {
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
    let sd = |solution: &Solution, k: usize| solution.commons[INSTRUMENT].cofactors[3 * k].sqrt();
    assert!(
        (sd(&direct, 1) / sd(&minimal, 1) - 1.0).abs() < 1e-7,
        "the constant does not depend on the datum"
    );
    for (a, b) in direct.observations.iter().zip(&minimal.observations) {
        let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
        for k in 0..a.residual.len() {
            assert!((a.redundancy[k] - b.redundancy[k]).abs() < 1e-8);
            assert!((a.residual[k] - b.residual[k]).abs() < 1e-9);
        }
    }
}

#[test]
fn the_base_of_a_rig_gives_the_scale() {
    let mut network = free(1.0);
    network.observations.push(base());
    assert_eq!(adjust(&network).unwrap().datum.held.len(), 6);
    // Three points of equal height determine the tilts.
    let mut upright = network.clone();
    upright.commons.push(common(CommonKind::Level, Vector3::zeros(), Matrix3::identity()));
    let level = |point: usize| OnLevel { point, level: 3, difference: noise(point), sd: 1e-3 }.into();
    upright.observations.extend([9, 10, 11].map(level));
    assert_eq!(adjust(&upright).unwrap().datum.held.len(), 4);
}

/// Residuals of points on lines rotate with the network if the axes of the lines are fixed: exact points without residuals.
#[test]
fn points_on_lines_that_are_exact() {
    let places = places();
    let mut network = free(0.0);
    let along = (places[7] - places[6]).normalize();
    let across = along.cross(&Vector3::z()).normalize();
    let line = Matrix3::from_columns(&[across, along.cross(&across), along]) * rotation([0.02, -0.03, 0.0]);
    network.commons.push(common(CommonKind::Line, places[6] + 0.05 * noises(4), line));
    let on_line = |point: usize| OnLine { point, line: 3, precision: deviations(&[1e-3, 2e-3]) }.into();
    network.observations.extend((6..9).map(on_line));
    let (found, mut at_the_end) = from_the_end(&network);
    assert_eq!(adjust(&at_the_end).unwrap().datum.held.len(), 7);
    let (first, second) = (None, SENSOR);
    let length = Vector3::from(found.commons[SENSOR].position).norm();
    at_the_end.observations.push(Base { first, second, length, sd: 1e-3 }.into());
    let [x, y, z] = found.points[9].unwrap().coordinates;
    at_the_end.commons.push(common(CommonKind::PlumbLine, Vector3::new(x, y, z), Matrix3::identity()));
    let plumb = OnPlumbLine { point: 9, line: 4, precision: deviations(&[1e-3; 2]) };
    at_the_end.observations.push(plumb.into());
    assert_eq!(adjust(&at_the_end).unwrap().datum.held.len(), 6, "one point on a plumb line says nothing");
}

/// Returns a strip along X of given uniformity, with positions whose shift and drift are unknown.
fn strip(wiggle: f64) -> Network {
    let places: Vec<Vector3> =
        (0..24).map(|k| Vector3::new(k as f64 * 0.9 - 2.0, 2.0 * noise(k), 0.3 * noise(k + 100))).collect();
    let pose = |k: usize| Pose {
        position: Vector3::new(2.5 * k as f64, 0.0, 8.0) + wiggle * noises(k),
        attitude: rotation([0.02 * noise(k), -0.03 * noise(k + 9), 0.0]).transpose(),
    };
    let poses: Vec<Pose> = (0..6).map(pose).collect();
    let mut network = network(&poses, &places, 0.0);
    network.commons = [CommonKind::Shift, CommonKind::Drift]
        .map(|kind| common(kind, Vector3::zeros(), Matrix3::identity()))
        .to_vec();
    let gnss = |(photo, pose): (usize, &Pose)| -> Observation {
        Position {
            photo,
            coordinates: pose.position.into(),
            lever_arm: Quantity::Known(Vector3::zeros()),
            shift: Some(0),
            drift: Some(1),
            time: photo as f64 - 2.5,
            precision: deviations(&[0.01; 3]),
        }
        .into()
    };
    network.observations = poses.iter().enumerate().map(gnss).collect();
    network
}

#[test]
fn positions_with_shift_and_drift_give_a_straight_strip_no_datum() {
    assert_eq!(adjust(&strip(0.0)).unwrap().datum.held.len(), 7);
    let held = adjust(&strip(0.4)).unwrap().datum.held.len();
    assert_eq!(held, 3, "shifts alone: the form of the line gives the rest");
}

#[test]
fn a_lever_arm_and_a_shift_of_parallel_photos_are_named() {
    let mut network = strip(0.4);
    network.photos.iter_mut().for_each(|photo| photo.sd[3..].fill(0.0));
    for photo in &mut network.photos {
        photo.pose[3..].fill(0.0);
        photo.observed = photo.pose;
    }
    let photos = network.photos.clone();
    for image in &mut network.images {
        let [x, y, z, ..] = photos[image.photo].pose;
        let k = image.point;
        let place = Vector3::new(k as f64 * 0.9 - 2.0, 2.0 * noise(k), 0.3 * noise(k + 100));
        let u = place - Vector3::new(x, y, z);
        image.xy = [0, 1].map(|k| CAMERA.principal_distance * u[k] / u[2]);
    }
    network.commons.push(common(CommonKind::LeverArm, Vector3::zeros(), Matrix3::identity()));
    // Control points define the datum.
    for k in [0, 5, 23] {
        let place = [k as f64 * 0.9 - 2.0, 2.0 * noise(k), 0.3 * noise(k + 100)];
        network.points[k] = Point { coordinates: place, sd: [0.01; 3] };
    }
    assert!(adjust(&network).is_ok());
    for own in &mut network.observations {
        if let Observation::Position(own) = own {
            own.lever_arm = Quantity::Common(2);
        }
    }
    let refused = adjust(&network).err();
    let combination = Combination { commons: vec![0, 2], ..Combination::default() };
    assert_eq!(refused, Some(NetworkError::Undetermined(vec![combination; 3])));
    // Different headings separate them.
    network.photos[3..].iter_mut().for_each(|photo| photo.sd[3..].fill(FREE));
    assert!(adjust(&network).is_err(), "they are still parallel");
}

/// Returns the solution, and the network with it as initial values: before the adjustment points are not on planes and lines.
fn from_the_end(network: &Network) -> (Solution, Network) {
    let found = adjust(network).unwrap();
    let mut at_the_end = network.clone();
    for (own, adjusted) in at_the_end.commons.iter_mut().zip(&found.commons) {
        (own.position, own.attitude) = (adjusted.position, adjusted.attitude);
    }
    for (photo, adjusted) in at_the_end.photos.iter_mut().zip(&found.photos) {
        (photo.pose, photo.observed) = (adjusted.pose, adjusted.pose);
    }
    (found, at_the_end)
}

/// Returns the datum defect of a network without errors.
fn open_of_exact(network: &Network) -> usize {
    adjust(&from_the_end(network).1).unwrap().datum.held.len()
}

#[test]
fn a_boresight_of_photos_that_nothing_else_turns_is_named() {
    let mut network = free(1.0);
    network.commons.push(common(CommonKind::Boresight, Vector3::zeros(), Matrix3::identity()));
    let imu = |photo: usize| -> Observation {
        let attitude = NUMBERS.attitude(std::array::from_fn(|k| network.photos[photo].pose[3 + k]));
        let boresight = Quantity::Common(3);
        Attitude { photo, attitude, boresight, precision: deviations(&[1e-3; 3]) }.into()
    };
    let observed = imu(0);
    let mut one = network.clone();
    one.observations.push(observed.clone());
    one.observations.push(base());
    // One attitude with its boresight gives no information: the network and the boresight rotate in opposite directions.
    let Err(NetworkError::Undetermined(found)) = adjust(&one) else { panic!("determined") };
    assert_eq!(found.len(), 3);
    assert!(found.iter().any(|combination| combination.commons.contains(&3)), "{found:?}");
    // For photos on one frame the attitude of one is an observation of both.
    let pose = Pose { position: Vector3::new(0.4, 0.1, -0.1), attitude: rotation([0.1, -0.2, 0.15]) };
    let mut network = free(0.0);
    // Exact distances by an instrument with a free scale, and of points from a plane, give no scale.
    assert_eq!(open_of_exact(&network), 7);
    let relative = Relative { photos: [0, 5], pose, precision: deviations(&[1e-3; 6]) };
    network.observations.push(relative.into());
    assert_eq!(open_of_exact(&network), 6, "a pose on the frame has a length");
}
