//! Additional observations: every type in one close-range network against dense algebra, scale from one distance, errors.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use faer::linalg::solvers::DenseSolveCore;
use faer::prelude::Solve;
use faer::{Mat, Side};
use num_complex::Complex64 as C;
use photocore::adjustment::{self, Loss, Method, Status, Stop};
use photocore::geometry::{
    self, AttitudeNumbers, Matrix3, ObjectSpace, Perspective, Pose, PoseNumbers, RotationSense, Vector3,
    rotation,
};
use photocore::network::mounts::OnFrame;
use photocore::network::observations::{
    Attitude, Base, Control, Difference, Distance, EqualHeight, Fault, OnLevel, OnLine, OnPlane, OnPlumbLine,
    Position, Prior, Quantity, Range, Relative,
};
use photocore::network::{
    Camera, Common, CommonKind, Dropped, Image, Mount, Network, NetworkError, Observation, Options, Photo,
    Point, Precision, Reason, Solution,
};
use photocore::{Context, Threads};

use crate::scatter;

const SENSE: RotationSense = RotationSense::GroundToPhoto;
const PRINCIPAL_DISTANCE: f64 = -50.0;
const IMAGE_SD: f64 = 0.002;
const PHOTOS: usize = 5;
const POINTS: usize = 14;
const FREE: [f64; 3] = [f64::INFINITY; 3];

/// Point 9 is above point 8, and points 10 to 12 are collinear.
fn place(k: usize) -> [f64; 3] {
    let along = |from: usize, way: [f64; 3]| [0, 1, 2].map(|i| place(from)[i] + way[i]);
    match k {
        9 => along(8, [0.0, 0.0, 0.7]),
        11 => along(10, [0.2, -0.4, 0.3]),
        12 => along(10, [-0.3, 0.6, -0.45]),
        _ => [0, 1, 2].map(|i| [500.0, 800.0, 20.0][i] + 1.2 * scatter(7 * k + i)),
    }
}

/// Returns photos in an arc of 5 m about the object, towards its centre.
fn pose(k: usize) -> [f64; 6] {
    let turn = 0.5 * (k as f64 - 2.0);
    let back = Vector3::new(turn.sin(), -turn.cos(), 0.3 + 0.1 * scatter(k)).normalize();
    let right = Vector3::new(-back.y, back.x, 0.0).normalize();
    let up = back.cross(&right);
    let roll = rotation([0.0, 0.0, 1.2 * scatter(30 + k)]);
    let attitude = Matrix3::from_columns(&[right, up, back]) * roll;
    let [x, y, z]: [f64; 3] = (Vector3::new(500.0, 800.0, 20.0) + 5.0 * back).into();
    let [omega, phi, kappa] = AttitudeNumbers::OmegaPhiKappa(SENSE).numbers(&attitude);
    [x, y, z, omega, phi, kappa]
}

fn attitude(pose: &[f64; 6]) -> Matrix3 {
    AttitudeNumbers::OmegaPhiKappa(SENSE).attitude([pose[3], pose[4], pose[5]])
}

fn position(pose: &[f64; 6]) -> Vector3 {
    Vector3::new(pose[0], pose[1], pose[2])
}

/// Returns a full covariance matrix of components with the given standard deviations.
fn covariance(sd: &[f64]) -> Precision {
    let n = sd.len();
    let entry = |i: usize, j: usize| sd[i] * sd[j] * if i == j { 1.0 } else { 0.3 * scatter(11 * (i + j)) };
    Precision::Covariance(nalgebra::DMatrix::from_fn(n, n, entry))
}

fn sd(values: &[f64]) -> Precision {
    Precision::Deviations(values.to_vec())
}

/// Returns a network of image observations of all points on all photos, with free points and photos.
fn images_alone() -> Network {
    let mut images = vec![];
    for point in 0..POINTS {
        for photo in 0..PHOTOS {
            let [x, y, z, omega, phi, kappa] = pose(photo);
            let (space, attitude) = (ObjectSpace::Rectangular, [omega, phi, kappa]);
            let seen = geometry::View::new(space, SENSE, [x, y, z], attitude, PRINCIPAL_DISTANCE);
            let exact = seen.project(&geometry::Point::new(space, place(point)));
            let at = 500 + 2 * images.len();
            let xy = [0, 1].map(|k| exact[k] + IMAGE_SD * scatter(at + k));
            images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
        }
    }
    let photo = |k: usize| {
        let start = std::array::from_fn(|i| pose(k)[i] + 0.01 * scatter(900 + 6 * k + i));
        Photo { pose: start, observed: start, sd: [f64::INFINITY; 6], camera: 0 }
    };
    Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(Perspective { principal_distance: PRINCIPAL_DISTANCE }.into())],
        photos: (0..PHOTOS).map(photo).collect(),
        points: (0..POINTS).map(|_| Point { coordinates: [f64::NAN; 3], sd: FREE }).collect(),
        images,
        observations: vec![],
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

fn difference(a: usize, b: usize) -> Vector3 {
    Vector3::from(place(b)) - Vector3::from(place(a))
}

fn distance(a: usize, b: usize) -> Observation {
    let length = difference(a, b).norm() + 1e-3 * scatter(a);
    Distance { points: [a, b], length, sd: 1e-3, instrument: None }.into()
}

/// Returns a network with all types of observations.
fn network() -> Network {
    let mut network = images_alone();
    network.points[2] = Point { coordinates: place(2), sd: [0.002, 0.0, 0.003] };
    network.points[11] = Point { coordinates: place(11), sd: [f64::INFINITY, 0.004, f64::INFINITY] };
    let control = |point: usize| {
        let coordinates = std::array::from_fn(|k| place(point)[k] + 0.002 * scatter(70 + point + k));
        Control { point, coordinates, precision: covariance(&[0.002, 0.003, 0.002]) }.into()
    };
    let lever_arm = Vector3::new(0.1, -0.3, 0.2);
    let gnss = |photo: usize, precision: Precision| {
        let antenna = position(&pose(photo)) + attitude(&pose(photo)) * lever_arm;
        let coordinates = std::array::from_fn(|k| antenna[k] + 0.01 * scatter(80 + photo + k));
        Position::new(photo, coordinates, lever_arm, precision).into()
    };
    let imu = |photo: usize, precision: Precision| {
        let boresight = rotation([1.5, 0.1, -0.4]);
        let error = rotation([0, 1, 2].map(|k| 1e-3 * scatter(90 + 3 * photo + k)));
        let attitude = attitude(&pose(photo)) * boresight * error;
        Attitude { photo, attitude, boresight: Quantity::Known(boresight), precision }.into()
    };
    let relative = |i: usize, j: usize| {
        let (a, b) = (pose(i), pose(j));
        let error = Vector3::from([0, 1, 2].map(|k| 2e-3 * scatter(110 + k)));
        let turned = rotation([0, 1, 2].map(|k| 5e-4 * scatter(120 + k)));
        let pose = Pose {
            position: attitude(&a).tr_mul(&(position(&b) - position(&a))) + error,
            attitude: attitude(&a).transpose() * attitude(&b) * turned,
        };
        let precision = covariance(&[0.002, 0.003, 0.002, 5e-4, 4e-4, 6e-4]);
        Relative { photos: [i, j], pose, precision }.into()
    };
    let range = |photo: usize, point: usize| {
        let from = position(&pose(photo)) + attitude(&pose(photo)) * lever_arm;
        let length = (Vector3::from(place(point)) - from).norm() + 1e-3 * scatter(150 + photo);
        Range { photo, point, length, sd: 1e-3, lever_arm, instrument: None }
    };
    let components = |a, b, seen: [bool; 3]| {
        std::array::from_fn(|k| seen[k].then(|| difference(a, b)[k] + 1e-3 * scatter(130 + k)))
    };
    let level = |a: usize, b: usize| {
        EqualHeight { points: [a, b], difference: difference(a, b)[2] + 1e-3 * scatter(140 + a), sd: 1e-3 }
            .into()
    };
    network.observations = vec![
        distance(3, 4),
        control(0),
        gnss(0, covariance(&[0.01, 0.01, 0.02])),
        imu(1, sd(&[1e-3, 1e-3, 2e-3])),
        Difference {
            points: [3, 5],
            components: components(3, 5, [true; 3]),
            precision: covariance(&[1e-3, 2e-3, 1e-3]),
        }
        .into(),
        level(6, 7),
        relative(0, 1),
        control(1),
        distance(5, 6),
        Difference {
            points: [8, 7],
            components: components(8, 7, [true, false, true]),
            precision: sd(&[1e-3, 2e-3]),
        }
        .into(),
        gnss(4, sd(&[0.01, 0.02, 0.01])),
        range(2, 9).into(),
        Range { instrument: Some(INSTRUMENT), ..range(3, 2) }.into(),
        imu(3, covariance(&[1e-3, 1e-3, 2e-3])),
        level(7, 8),
    ];
    with_commons(&mut network);
    network
}

/// Indices of the shared parameters in [`Network::commons`], as drawn.
const LEVER_ARM: usize = 0;
const SHIFT: usize = 1;
const DRIFT: usize = 2;
const BORESIGHT: usize = 3;
const INSTRUMENT: usize = 4;
const LEVEL: usize = 5;
const PLUMB_LINE: usize = 6;
const LINE: usize = 7;
const PLANE: usize = 8;
const SENSOR: usize = 9;
/// Photos on frames; the last frame is not observed.
const MOUNTED: [usize; 3] = [5, 6, 8];
const FRAMES: [usize; 3] = [0, 1, 7];
/// Number of types in a network without trajectories.
const KINDS: usize = 10;
const ALL: usize = 9;

/// Returns the true value of a shared parameter.
fn truth(common: usize) -> Pose {
    let position = match CommonKind::ALL[common] {
        CommonKind::LeverArm => [0.1, -0.3, 0.2],
        CommonKind::Shift => [0.05, -0.02, 0.04],
        CommonKind::Drift => [0.004, 0.002, -0.003],
        CommonKind::Instrument => [1.002, 0.003, 0.0],
        CommonKind::Level => [0.0, 0.0, place(1)[2] + 0.1],
        CommonKind::PlumbLine => [place(8)[0], place(8)[1], 0.0],
        CommonKind::Line => place(10),
        CommonKind::Plane => place(3),
        CommonKind::Sensor => [0.4, 0.05, -0.1],
        _ => [0.0; 3],
    };
    let attitude = match CommonKind::ALL[common] {
        CommonKind::Boresight => rotation([1.5, 0.1, -0.4]),
        CommonKind::Line => {
            let along = Vector3::new(0.2, -0.4, 0.3).normalize();
            let across = along.cross(&Vector3::z()).normalize();
            Matrix3::from_columns(&[across, along.cross(&across), along])
        }
        CommonKind::Plane => rotation([0.3, -0.6, 0.2]),
        CommonKind::Sensor => rotation([0.1, -0.2, 0.15]),
        _ => Matrix3::identity(),
    };
    Pose { position: position.into(), attitude }
}

/// Returns the pose of a photo, on a frame or independent.
fn seen(photo: usize) -> Pose {
    let own = |k: usize| Pose { position: position(&pose(k)), attitude: attitude(&pose(k)) };
    match MOUNTED.iter().position(|&mounted| mounted == photo) {
        None => own(photo),
        Some(k) => {
            let (frame, sensor) = (own(FRAMES[k]), truth(SENSOR));
            Pose {
                position: frame.position + frame.attitude * sensor.position,
                attitude: frame.attitude * sensor.attitude,
            }
        }
    }
}

/// Returns the error-free image of a point.
fn imaged(photo: usize, point: usize) -> [f64; 2] {
    let u = seen(photo).to_camera_frame(&place(point).into());
    [0, 1].map(|k| PRINCIPAL_DISTANCE * u[k] / u[2])
}

/// Adds a rig, shared parameters of all types, and observations of them.
fn with_commons(network: &mut Network) {
    let free = network.photos[0];
    for k in PHOTOS..ALL {
        let pose = if MOUNTED.contains(&k) { pose(FRAMES[0]) } else { pose(k).map(|value| value + 0.001) };
        network.photos.push(Photo { pose, observed: pose, ..free });
    }
    for (photo, point) in MOUNTED.iter().flat_map(|&photo| (0..POINTS).map(move |point| (photo, point))) {
        let xy = [0, 1].map(|k| imaged(photo, point)[k] + IMAGE_SD * scatter(1500 + 29 * point + k));
        network.images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
    }
    let mount = |k: usize| OnFrame { photo: MOUNTED[k], frame: FRAMES[k], sensor: SENSOR }.into();
    network.mounts = [0, 1, 2].map(mount).to_vec();
    let infinite = f64::INFINITY;
    let deviations = |kind: CommonKind| match kind {
        CommonKind::LeverArm => vec![0.02, 0.03, infinite],
        CommonKind::Drift => vec![0.002, 0.0, 0.002],
        CommonKind::Boresight => vec![infinite, 0.003, infinite],
        CommonKind::Instrument => vec![infinite, 0.001],
        _ => vec![infinite; kind.unknowns().len()],
    };
    let given = |(common, &kind): (usize, &CommonKind)| {
        let Pose { position, attitude } = truth(common);
        let small =
            |first: usize, size: f64| [0, 1, 2].map(|k| size * scatter(1600 + 10 * common + first + k));
        let turns = kind.unknowns().iter().any(|&(_, component, _)| component > 2);
        let size = if kind == CommonKind::Drift || kind == CommonKind::Instrument { 0.001 } else { 0.01 };
        let attitude = if turns { attitude * rotation(small(3, 0.02)) } else { attitude };
        Common {
            kind,
            position: (position + Vector3::from(small(0, size))).into(),
            attitude,
            sd: deviations(kind),
        }
    };
    network.commons = CommonKind::ALL[..KINDS].iter().enumerate().map(given).collect();
    network.observations.extend(of_commons());
}

fn of_commons() -> Vec<Observation> {
    let error = |size: f64, at: usize| size * scatter(1800 + at);
    let gnss = |photo: usize, time: f64| -> Observation {
        let Pose { position, attitude } = seen(photo);
        let antenna = position
            + attitude * truth(LEVER_ARM).position
            + truth(SHIFT).position
            + time * truth(DRIFT).position;
        Position {
            photo,
            coordinates: std::array::from_fn(|k| antenna[k] + error(0.01, 3 * photo + k)),
            lever_arm: Quantity::Common(LEVER_ARM),
            shift: Some(SHIFT),
            drift: Some(DRIFT),
            time,
            precision: covariance(&[0.01, 0.02, 0.01]),
        }
        .into()
    };
    let imu = |photo: usize| -> Observation {
        let turned = rotation([0, 1, 2].map(|k| error(1e-3, 40 + 3 * photo + k)));
        Attitude {
            photo,
            attitude: seen(photo).attitude * truth(BORESIGHT).attitude * turned,
            boresight: Quantity::Common(BORESIGHT),
            precision: covariance(&[1e-3, 2e-3, 1e-3]),
        }
        .into()
    };
    let measured = |a: usize, b: usize| -> Observation {
        let length = 1.002 * difference(a, b).norm() + 0.003 + error(1e-3, 80 + a);
        Distance { points: [a, b], length, sd: 1e-3, instrument: Some(INSTRUMENT) }.into()
    };
    let at_level = |point: usize| -> Observation {
        let difference = place(point)[2] - truth(LEVEL).position.z + error(1e-3, 100 + point);
        OnLevel { point, level: LEVEL, difference, sd: 1e-3 }.into()
    };
    let above = |point: usize| -> Observation {
        let Pose { position, attitude } = truth(PLANE);
        let from = Vector3::from(place(point)) - position;
        let distance = attitude.column(2).dot(&from) + error(1e-3, 120 + point);
        OnPlane { point, plane: PLANE, distance, sd: 2e-3 }.into()
    };
    let plumb = |point: usize| -> Observation {
        OnPlumbLine { point, line: PLUMB_LINE, precision: covariance(&[1e-3, 2e-3]) }.into()
    };
    let aligned =
        |point: usize| -> Observation { OnLine { point, line: LINE, precision: sd(&[1e-3, 2e-3]) }.into() };
    let relative = |i: usize, j: usize| -> Observation {
        let (a, b) = (seen(i), seen(j));
        let pose =
            Pose { position: a.to_camera_frame(&b.position), attitude: a.attitude.transpose() * b.attitude };
        Relative { photos: [i, j], pose, precision: covariance(&[0.01, 0.02, 0.01, 1e-3, 2e-3, 1e-3]) }.into()
    };
    let base = |length: f64| -> Observation { Base { first: None, second: SENSOR, length, sd: 2e-3 }.into() };
    let precision = covariance(&[0.02, 0.02, 0.03, 0.02, 0.03, 0.02]);
    let prior: Observation =
        Prior { commons: vec![SENSOR], components: vec![6], observed: vec![], precision }.into();
    let lists = [
        [(0, -2.0), (1, -1.5), (2, 0.0), (3, 1.0), (4, 1.5), (6, 2.0)].map(|(k, t)| gnss(k, t)).to_vec(),
        [0, 2, 4, 5, 8].map(imu).to_vec(),
        [(0, 3), (1, 4), (5, 13), (2, 8)].map(|(a, b)| measured(a, b)).to_vec(),
        [1, 4, 7].map(at_level).to_vec(),
        [0, 1, 3, 5, 13].map(above).to_vec(),
        [8, 9].map(plumb).to_vec(),
        [10, 11, 12].map(aligned).to_vec(),
        vec![
            relative(2, 5),
            relative(5, 6),
            relative(0, 5),
            base(truth(SENSOR).position.norm() + 1e-3),
            prior,
        ],
    ];
    lists.concat()
}

fn options(method: Method, loss: Option<Loss>) -> Options {
    let adjustment = adjustment::Options { method, max_iterations: 50, covariance: true, loss, threads: 0 };
    Options { adjustment, ..Options::default() }
}

fn adjust_with(network: &Network, options: &Options, threads: usize) -> Result<Solution, NetworkError> {
    let threads = Threads::new(threads).unwrap();
    network.adjustment(options).run_in(&mut Context::new(&threads))
}

fn adjusted(network: &Network) -> Solution {
    let solution = adjust_with(network, &options(Method::Damped(Stop::Fraction(1e-9)), None), 2).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    solution
}

/// Independent implementation of the equations in complex numbers: vectors and matrices as arrays.
mod dense {
    use super::*;

    type V = [C; 3];
    /// Matrix as columns.
    type M = [V; 3];

    fn vector(v: &Vector3) -> V {
        [v.x, v.y, v.z].map(C::from)
    }

    fn matrix(m: &Matrix3) -> M {
        std::array::from_fn(|j| std::array::from_fn(|i| C::from(m[(i, j)])))
    }

    fn times(m: &M, v: &V) -> V {
        std::array::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
    }

    fn product(a: &M, b: &M) -> M {
        std::array::from_fn(|j| times(a, &b[j]))
    }

    fn transposed(m: &M) -> M {
        std::array::from_fn(|j| std::array::from_fn(|i| m[i][j]))
    }

    fn minus(a: &V, b: &V) -> V {
        std::array::from_fn(|k| a[k] - b[k])
    }

    /// Returns the rotation of the axes about one of them.
    fn about(axis: usize, angle: C) -> M {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut m = [[C::from(0.0); 3]; 3];
        (m[axis][axis], m[j][j], m[k][k]) = (C::from(1.0), angle.cos(), angle.cos());
        (m[k][j], m[j][k]) = (angle.sin(), -angle.sin());
        m
    }

    /// Returns the rotation vector of a small rotation.
    fn logarithm(r: &M) -> V {
        let w = [r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]].map(|value| value / 2.0);
        // asin s / s in powers of s^2: the library function would lose the imaginary part.
        let square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        let factor = 1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (5.0 / 112.0)));
        w.map(|value| value * factor)
    }

    /// Returns Exp of a rotation vector below about one radian, as a power series in its square, also valid at zero.
    fn exponential(r: &V) -> M {
        let square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        let series = |first: f64| {
            let term = |rest: C, n: f64| 1.0 - square * rest / ((n + 1.0) * (n + 2.0));
            [12.0, 10.0, 8.0, 6.0, 4.0, 2.0, 0.0]
                .into_iter()
                .fold(C::from(1.0), |rest, n| term(rest, n + first))
        };
        let (sine, versine) = (series(1.0), series(2.0) / 2.0);
        let skew = [[C::from(0.0), r[2], -r[1]], [-r[2], C::from(0.0), r[0]], [r[1], -r[0], C::from(0.0)]];
        let twice = product(&skew, &skew);
        std::array::from_fn(|j| {
            std::array::from_fn(|i| f64::from(u8::from(i == j)) + sine * skew[j][i] + versine * twice[j][i])
        })
    }

    /// Dense equations of all observations, in this order: images, weighted components, others.
    pub struct Dense<'a> {
        pub network: &'a Network,
        /// Covariance of all observations.
        pub s: Mat<f64>,
        /// Free and weighted unknowns: points, then photos, then shared parameters.
        pub free: Vec<usize>,
    }

    impl<'a> Dense<'a> {
        pub fn new(network: &'a Network) -> Self {
            let mut blocks: Vec<nalgebra::DMatrix<f64>> = vec![];
            let diagonal = |sd: &[f64]| {
                let squares = sd.iter().map(|sd| sd * sd);
                nalgebra::DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(sd.len(), squares))
            };
            network.images.iter().for_each(|image| blocks.push(diagonal(&image.sd)));
            held(network).for_each(|(_, _, sd)| blocks.push(diagonal(&[sd])));
            held_commons(network).for_each(|(_, _, sd)| blocks.push(diagonal(&[sd])));
            for observation in &network.observations {
                blocks.push(match observation.precision() {
                    Precision::Deviations(sd) => diagonal(&sd),
                    Precision::Covariance(matrix) => matrix,
                });
            }
            let size = blocks.iter().map(|block| block.nrows()).sum();
            let (mut s, mut start) = (Mat::zeros(size, size), 0);
            for block in blocks {
                for (i, j) in (0..block.nrows()).flat_map(|i| (0..block.nrows()).map(move |j| (i, j))) {
                    s[(start + i, start + j)] = block[(i, j)];
                }
                start += block.nrows();
            }
            let fixed_points = network.points.iter().flat_map(|point| point.sd);
            let mounted = |photo: usize| {
                network.mounts.iter().any(|mount| mount.photo() == photo && mount.frame().is_some())
            };
            let photo = |(k, photo): (usize, &Photo)| if mounted(k) { [0.0; 6] } else { photo.sd };
            let all = fixed_points.chain(network.photos.iter().enumerate().flat_map(photo));
            let all = all.chain(network.commons.iter().flat_map(|common| common.sd.clone()));
            let free = all.enumerate().filter(|&(_, sd)| sd != 0.0).map(|(unknown, _)| unknown).collect();
            Self { network, s, free }
        }

        /// Returns the index of the first unknown of a shared parameter.
        pub fn first(&self, common: usize) -> usize {
            let before = self.network.commons[..common].iter().map(|common| common.sd.len());
            3 * self.network.points.len() + 6 * self.network.photos.len() + before.sum::<usize>()
        }

        /// Returns the unknown offsets of a shared parameter, its position and its rotation.
        fn common(&self, x: &[C], i: usize) -> (V, V, M) {
            let own = &self.network.commons[i];
            let mut six = [C::from(0.0); 6];
            for (k, &(_, component, _)) in own.kind.unknowns().iter().enumerate() {
                six[component] = x[self.first(i) + k];
            }
            let [a, b, c, d, e, f] = six;
            let turned = product(&matrix(&own.attitude), &exponential(&[d, e, f]));
            let position = std::array::from_fn(|k| own.position[k] + [a, b, c][k]);
            ([a, b, c], position, turned)
        }

        /// Returns the pose of a photo.
        pub fn photo(&self, x: &[C], i: usize) -> (V, M) {
            let own = |i: usize| -> (V, M) {
                let own = &x[3 * self.network.points.len() + 6 * i..][..6];
                let m = product(&about(2, own[5]), &product(&about(1, own[4]), &about(0, own[3])));
                ([own[0], own[1], own[2]], transposed(&m))
            };
            let mut mounts = self.network.mounts.iter();
            let Some(Mount::OnFrame(mount)) =
                mounts.find(|mount| mount.photo() == i && mount.frame().is_some())
            else {
                return own(i);
            };
            let ((centre, a), (_, arm, turn)) = (own(mount.frame), self.common(x, mount.sensor));
            let arm = times(&a, &arm);
            (std::array::from_fn(|k| centre[k] + arm[k]), product(&a, &turn))
        }

        /// Returns observed minus computed.
        pub fn residuals(&self, x: &[C]) -> Vec<C> {
            let point = |i: usize| -> V { std::array::from_fn(|k| x[3 * i + k]) };
            let photo = |i: usize| self.photo(x, i);
            let place = |i: usize| -> V { self.network.commons[i].position.map(C::from) };
            let told = |d: V, instrument: Option<usize>| {
                let s = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                instrument.map_or(s, |instrument| {
                    let (_, [m, k, _], _) = self.common(x, instrument);
                    m * s + k
                })
            };
            let mut all = vec![];
            for image in &self.network.images {
                let (centre, a) = photo(image.photo);
                let u = times(&transposed(&a), &minus(&point(image.point), &centre));
                all.extend([0, 1].map(|k| image.xy[k] - PRINCIPAL_DISTANCE * u[k] / u[2]));
            }
            all.extend(held(self.network).map(|(unknown, value, _)| value - x[unknown]));
            all.extend(held_commons(self.network).map(|(common, k, _)| -x[self.first(common) + k]));
            for observation in &self.network.observations {
                match observation {
                    Observation::Distance(own) => {
                        let d = minus(&point(own.points[1]), &point(own.points[0]));
                        all.push(own.length - told(d, own.instrument));
                    }
                    Observation::Range(own) => {
                        let (centre, a) = photo(own.photo);
                        let arm = times(&a, &vector(&own.lever_arm));
                        let d = minus(&minus(&point(own.point), &centre), &arm);
                        all.push(own.length - told(d, own.instrument));
                    }
                    Observation::Difference(own) => {
                        let d = minus(&point(own.points[1]), &point(own.points[0]));
                        all.extend((0..3).filter_map(|k| own.components[k].map(|value| value - d[k])));
                    }
                    Observation::EqualHeight(own) => {
                        all.push(own.difference - (point(own.points[1])[2] - point(own.points[0])[2]));
                    }
                    Observation::Control(own) => {
                        all.extend((0..3).map(|k| own.coordinates[k] - point(own.point)[k]));
                    }
                    Observation::Position(own) => {
                        let (centre, a) = photo(own.photo);
                        let arm = match &own.lever_arm {
                            Quantity::Known(arm) => vector(arm),
                            Quantity::Common(common) => self.common(x, *common).1,
                        };
                        let arm = times(&a, &arm);
                        let zero = [C::from(0.0); 3];
                        let [s, d] =
                            [own.shift, own.drift].map(|own| own.map_or(zero, |i| self.common(x, i).1));
                        all.extend(
                            (0..3).map(|k| own.coordinates[k] - centre[k] - arm[k] - s[k] - own.time * d[k]),
                        );
                    }
                    Observation::Attitude(own) => {
                        let boresight = match &own.boresight {
                            Quantity::Known(boresight) => matrix(boresight),
                            Quantity::Common(common) => self.common(x, *common).2,
                        };
                        let computed = product(&photo(own.photo).1, &boresight);
                        all.extend(logarithm(&product(&transposed(&computed), &matrix(&own.attitude))));
                    }
                    Observation::OnLevel(own) => {
                        all.push(own.difference - (point(own.point)[2] - self.common(x, own.level).1[2]));
                    }
                    Observation::OnPlane(own) => {
                        let (d, _, r) = self.common(x, own.plane);
                        let from = times(&transposed(&r), &minus(&point(own.point), &place(own.plane)));
                        all.push(own.distance - (from[2] - d[2]));
                    }
                    Observation::OnPlumbLine(own) => {
                        let (_, at, _) = self.common(x, own.line);
                        all.extend((0..2).map(|k| at[k] - point(own.point)[k]));
                    }
                    Observation::OnLine(own) => {
                        let (q, _, r) = self.common(x, own.line);
                        let from = times(&transposed(&r), &minus(&point(own.point), &place(own.line)));
                        all.extend((0..2).map(|k| q[k] - from[k]));
                    }
                    Observation::Base(own) => {
                        let mut d = self.common(x, own.second).1;
                        if let Some(first) = own.first {
                            d = minus(&d, &self.common(x, first).1);
                        }
                        all.push(own.length - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt());
                    }
                    Observation::Prior(own) => {
                        let each = own.commons.iter().zip(&own.components);
                        all.extend(each.flat_map(|(&common, &count)| {
                            (0..count).map(move |k| -x[self.first(common) + k])
                        }));
                    }
                    Observation::Relative(own) => {
                        let ((ci, ai), (cj, aj)) = (photo(own.photos[0]), photo(own.photos[1]));
                        let t = times(&transposed(&ai), &minus(&cj, &ci));
                        all.extend(minus(&vector(&own.pose.position), &t));
                        let r = product(&transposed(&ai), &aj);
                        all.extend(logarithm(&product(&transposed(&r), &matrix(&own.pose.attitude))));
                    }
                    other => unreachable!("{} is of trajectories", other.kind()),
                }
            }
            all
        }

        /// Returns the residuals, and the partials of the computed values by complex steps.
        pub fn linearized(&self, x: &[f64]) -> (Mat<f64>, Mat<f64>) {
            const STEP: f64 = 1e-100;
            let at: Vec<C> = x.iter().map(|&value| C::from(value)).collect();
            let v = self.residuals(&at);
            let mut a = Mat::zeros(v.len(), self.free.len());
            for (column, &unknown) in self.free.iter().enumerate() {
                let mut stepped = at.clone();
                stepped[unknown].im = STEP;
                for (row, value) in self.residuals(&stepped).iter().enumerate() {
                    a[(row, column)] = -value.im / STEP;
                }
            }
            (Mat::from_fn(v.len(), 1, |i, _| v[i].re), a)
        }
    }

    /// Returns the weighted components of points: unknown, value and standard deviation.
    fn held(network: &Network) -> impl Iterator<Item = (usize, f64, f64)> {
        let each = |(i, point): (usize, &Point)| {
            let Point { coordinates, sd } = *point;
            (0..3).map(move |k| (3 * i + k, coordinates[k], sd[k]))
        };
        let all = network.points.iter().enumerate().flat_map(each);
        all.filter(|&(_, _, sd)| sd > 0.0 && sd.is_finite())
    }

    /// Returns the weighted shared parameters: index, component and standard deviation.
    pub fn held_commons(network: &Network) -> impl Iterator<Item = (usize, usize, f64)> {
        let each = |(i, common): (usize, &Common)| {
            let sd = common.sd.clone();
            sd.into_iter().enumerate().map(move |(k, sd)| (i, k, sd))
        };
        let all = network.commons.iter().enumerate().flat_map(each);
        all.filter(|&(_, _, sd)| sd > 0.0 && sd.is_finite())
    }

    pub fn weighted(network: &Network) -> Vec<usize> {
        held(network).map(|(unknown, _, _)| unknown).collect()
    }
}

/// Returns all unknowns of a solution: points, then photos, then shared parameters.
fn unknowns(solution: &Solution) -> Vec<f64> {
    let points = solution.points.iter().flat_map(|point| point.expect("takes part").coordinates);
    let photos = points.chain(solution.photos.iter().flat_map(|photo| photo.pose));
    photos.chain(solution.commons.iter().flat_map(|common| common.change.clone())).collect()
}

fn close(found: f64, expected: f64, scale: f64, limit: f64, what: &str) {
    let error = (found - expected).abs() / scale;
    assert!(error < limit, "{what}: {found} instead of {expected}, {error:e}");
}

#[test]
fn every_kind_agrees_with_dense_algebra() {
    let network = network();
    let solution = adjusted(&network);
    let dense = dense::Dense::new(&network);
    let weights = dense.s.llt(Side::Lower).unwrap().inverse();

    // At the solution a step of the dense adjustment is zero.
    let x = unknowns(&solution);
    let (v, a) = dense.linearized(&x);
    let normal = (a.transpose() * &weights * &a).llt(Side::Lower).unwrap();
    let (q, step) = (normal.inverse(), normal.solve(a.transpose() * &weights * &v));
    let mut cofactors = Mat::zeros(x.len(), x.len());
    for (i, &row) in dense.free.iter().enumerate() {
        close(step[(i, 0)], 0.0, q[(i, i)].sqrt(), 1e-7, "unknown");
        dense.free.iter().enumerate().for_each(|(j, &column)| cofactors[(row, column)] = q[(i, j)]);
    }

    // Cofactors of points, photos and shared parameters.
    let block = |first: usize, found: &[f64], n: usize| {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let scale = (cofactors[(first + i, first + i)] * cofactors[(first + j, first + j)]).sqrt();
            let expected = cofactors[(first + i, first + j)];
            close(found[n * i + j], expected, scale.max(1e-30), 1e-8, "cofactor");
        }
    };
    for (i, point) in solution.points.iter().enumerate() {
        block(3 * i, point.unwrap().cofactors.as_slice(), 3);
        assert_eq!(point.unwrap().rays, PHOTOS + MOUNTED.len());
    }
    for (i, photo) in solution.photos.iter().enumerate().filter(|(i, _)| !MOUNTED.contains(i)) {
        block(3 * POINTS + 6 * i, photo.cofactors.as_slice(), 6);
    }
    // Rotations of shared parameters are about their own axes; rotations of photos on frames are in angles.
    let compare = |by_unknowns: &nalgebra::DMatrix<f64>, found: &nalgebra::DMatrix<f64>| {
        let all = nalgebra::DMatrix::from_fn(x.len(), x.len(), |i, j| cofactors[(i, j)]);
        let expected = by_unknowns * all * by_unknowns.transpose();
        for (i, j) in (0..found.nrows()).flat_map(|i| (0..found.nrows()).map(move |j| (i, j))) {
            let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
            close(found[(i, j)], expected[(i, j)], scale.max(1e-30), 1e-8, "cofactor of several");
        }
    };
    for (i, common) in solution.commons.iter().enumerate() {
        let kind = network.commons[i].kind;
        let (mut offset, mut r) = (Vector3::zeros(), Vector3::zeros());
        for (&(_, component, _), &change) in kind.unknowns().iter().zip(&common.change) {
            match component.checked_sub(3) {
                Some(turn) => r[turn] = change,
                None => offset[component] = change,
            }
        }
        // Offsets of lines and planes refer to rotating axes.
        let turning = matches!(kind, CommonKind::Line | CommonKind::Plane);
        let turns = geometry::angle_axis_with_jacobian(&r).1.transpose();
        let mut steps = nalgebra::DMatrix::zeros(common.change.len(), x.len());
        for (row, &(_, component, _)) in kind.unknowns().iter().enumerate() {
            for (column, &(_, by, _)) in kind.unknowns().iter().enumerate() {
                let step = match (component.checked_sub(3), by.checked_sub(3)) {
                    (Some(turn), Some(by)) => turns[(turn, by)],
                    (None, Some(by)) if turning => turns.column(by).cross(&offset)[component],
                    _ => f64::from(u8::from(row == column)),
                };
                steps[(row, dense.first(i) + column)] = step;
            }
        }
        compare(&steps, &common.cofactors);
    }
    for photo in MOUNTED {
        let own = &solution.photos[photo];
        let at: Vec<C> = x.iter().map(|&value| C::from(value)).collect();
        let mut steps = nalgebra::DMatrix::zeros(6, x.len());
        for &unknown in &dense.free {
            let mut stepped = at.clone();
            stepped[unknown].im = 1e-100;
            let (centre, a) = dense.photo(&stepped, photo);
            let part = |value: C, imaginary: bool| if imaginary { value.im / 1e-100 } else { value.re };
            let [real, by] = [false, true].map(|part_of| Matrix3::from_fn(|i, j| part(a[j][i], part_of)));
            let skew = real.transpose() * by;
            (0..3).for_each(|k| steps[(k, unknown)] = part(centre[k], true));
            [(2, 1), (0, 2), (1, 0)]
                .into_iter()
                .enumerate()
                .for_each(|(k, (i, j))| steps[(3 + k, unknown)] = skew[(i, j)]);
        }
        let mut rates = nalgebra::DMatrix::identity(6, 6);
        let angles = [own.pose[3], own.pose[4], own.pose[5]];
        rates.view_mut((3, 3), (3, 3)).copy_from(&AttitudeNumbers::OmegaPhiKappa(SENSE).rates(angles));
        let found = own.cofactors.clone();
        compare(&steps, &(&rates * found * rates.transpose()));
        let (centre, a) = dense.photo(&at, photo);
        for i in 0..3 {
            close(own.pose[i], centre[i].re, 1.0, 1e-9, "position of a photo on a frame");
            (0..3).for_each(|j| close(attitude(&own.pose)[(i, j)], a[j][i].re, 1.0, 1e-12, "its attitude"));
        }
    }

    // Residuals, redundancy numbers, standardized residuals.
    let qvv = &dense.s - &a * &q * a.transpose();
    let (redundancy, weighted) = (&qvv * &weights, &weights * &v);
    let wqw = &weights * &qvv * &weights;
    let standardized = |row: usize| weighted[(row, 0)] / wqw[(row, row)].sqrt();
    let mut row = 0;
    let mut check = |residual: f64, share: f64, test: f64| {
        close(residual, v[(row, 0)], dense.s[(row, row)].sqrt(), 1e-7, "residual");
        close(share, redundancy[(row, row)], 1.0, 1e-8, "redundancy number");
        close(test, standardized(row), 1.0, 1e-6, "standardized residual");
        row += 1;
    };
    for image in &solution.images {
        let image = image.unwrap();
        (0..2).for_each(|k| check(image.residual[k], image.redundancy[k], image.standardized[k]));
    }
    let mut total = 0.0;
    for unknown in dense::weighted(&network) {
        let point = solution.points[unknown / 3].unwrap();
        let given = network.points[unknown / 3];
        let (residual, share) = (given.coordinates[unknown % 3] - x[unknown], point.redundancy[unknown % 3]);
        check(residual, share, residual / given.sd[unknown % 3] / share.sqrt());
        total += share;
    }
    for (common, k, sd) in dense::held_commons(&network) {
        let own = &solution.commons[common];
        let (residual, share) = (-own.change[k], own.redundancy[k]);
        check(residual, share, residual / sd / share.sqrt());
        total += share;
    }
    for observation in &solution.observations {
        let own = observation.as_ref().unwrap();
        (0..own.residual.len()).for_each(|k| check(own.residual[k], own.redundancy[k], own.standardized[k]));
    }
    assert_eq!(row, v.nrows());

    // Sums of redundancy numbers and of squares.
    let freedom = (v.nrows() - dense.free.len()) as i64;
    assert_eq!(solution.degrees_of_freedom, freedom);
    total += solution.images.iter().flat_map(|image| image.unwrap().redundancy).sum::<f64>();
    total += solution.kinds(&network).iter().map(|sums| sums.redundancy).sum::<f64>();
    close(total, freedom as f64, 1.0, 1e-8, "sum of redundancy numbers");
    assert!(solution.adjustment.redundancy_excess.unwrap().abs() < 1e-8);
    let square = (v.transpose() * &weights * &v)[(0, 0)];
    close(solution.sums_of_squares.total(), square, square, 1e-9, "sum of squares");
    close(solution.variance_of_unit_weight.unwrap(), square / freedom as f64, 1.0, 1e-9, "variance");
    let names: Vec<&str> = solution.kinds(&network).iter().map(|sums| sums.kind).collect();
    // The remaining types belong to trajectories and cameras.
    let kinds = photocore::network::observations::KINDS.iter().copied();
    assert_eq!(names, kinds.take_while(|&kind| kind != "velocity").collect::<Vec<&str>>());
    let counts: Vec<[usize; 2]> =
        solution.kinds(&network).iter().map(|sums| [sums.observations, sums.components]).collect();
    let counted = [
        [2, 6],
        [6, 6],
        [2, 5],
        [2, 2],
        [3, 3],
        [5, 5],
        [2, 4],
        [3, 6],
        [2, 2],
        [8, 24],
        [7, 21],
        [4, 24],
        [1, 1],
        [1, 6],
    ];
    assert_eq!(counts, counted);
    let by_kind: f64 = solution.kinds(&network).iter().map(|sums| sums.sum_of_squares).sum();
    close(by_kind, solution.sums_of_squares.observations, 1.0, 1e-9, "sum by kind");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let network = network();
    let options = options(Method::Damped(Stop::Fraction(1e-9)), Some(Loss::Huber(1.0)));
    let [one, two, three] = [1, 2, 3].map(|threads| adjust_with(&network, &options, threads).unwrap());
    for other in [two, three] {
        assert_eq!(unknowns(&one), unknowns(&other));
        assert_eq!(one.observations, other.observations);
        let cofactors = |solution: &Solution| -> Vec<_> {
            solution.points.iter().map(|point| point.unwrap().cofactors).collect()
        };
        assert_eq!(cofactors(&one), cofactors(&other));
    }
    let weights: Vec<f64> = one.observations.iter().map(|own| own.as_ref().unwrap().weight).collect();
    assert!(weights.iter().all(|&weight| weight > 0.0 && weight <= 1.0));
    assert!(weights.iter().any(|&weight| weight < 1.0), "{weights:?}");
}

/// Returns a network with observations of single points, connected by distances of almost no weight if `connected`.
fn of_single_points(connected: bool) -> Network {
    let mut network = images_alone();
    let control = |point: usize| -> Observation {
        let coordinates = std::array::from_fn(|k| place(point)[k] + 0.002 * scatter(70 + point + k));
        Control { point, coordinates, precision: covariance(&[0.002, 0.003, 0.002]) }.into()
    };
    network.points[3] = Point { coordinates: place(3), sd: [0.002, f64::INFINITY, 0.003] };
    network.points[4] = Point { coordinates: place(4), sd: [0.0; 3] };
    let level = Common::vector(CommonKind::Level, [0.0, 0.0, place(6)[2]], &[0.0]);
    network.commons.push(level);
    network.observations = [0, 1, 2, 3, 4, 7, 1].map(control).to_vec();
    network.observations.push(OnLevel { point: 6, level: 0, difference: 0.0, sd: 0.004 }.into());
    if connected {
        let weak = |k: usize| Distance { points: [k, k + 1], length: 1.0, sd: 1e9, instrument: None }.into();
        network.observations.extend((0..7).map(weak));
    }
    network
}

#[test]
fn observations_of_single_points_give_the_same_as_with_connections() {
    for loss in [None, Some(Loss::Huber(1.0))] {
        let options = options(Method::Damped(Stop::Fraction(1e-12)), loss);
        let [alone, connected, again] = [(false, 1), (true, 2), (false, 2)].map(|(connected, threads)| {
            adjust_with(&of_single_points(connected), &options, threads).unwrap()
        });
        assert_eq!(unknowns(&alone), unknowns(&again), "any number of threads");
        assert_eq!(alone.observations, again.observations);
        assert_eq!(alone.degrees_of_freedom + 7, connected.degrees_of_freedom);
        for (a, b) in unknowns(&alone).into_iter().zip(unknowns(&connected)) {
            close(a, b, 1.0, 1e-9, "unknown");
        }
        for (a, b) in alone.points.iter().zip(&connected.points) {
            let (a, b) = (a.unwrap(), b.unwrap());
            let scale = b.cofactors.trace().max(1e-30);
            (0..9).for_each(|k| close(a.cofactors[k], b.cofactors[k], scale, 1e-8, "cofactor"));
            (0..3).for_each(|k| close(a.redundancy[k], b.redundancy[k], 1.0, 1e-8, "redundancy"));
        }
        for (a, b) in alone.observations.iter().zip(&connected.observations) {
            let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
            close(a.weight, b.weight, 1.0, 1e-7, "weight");
            close(a.square, b.square, 1.0, 1e-6, "square");
            for k in 0..a.residual.len() {
                close(a.residual[k], b.residual[k], 0.002, 1e-6, "residual");
                close(a.redundancy[k], b.redundancy[k], 1.0, 1e-8, "redundancy number");
                assert!((a.standardized[k] - b.standardized[k]).abs() < 1e-6 || a.standardized[k].is_nan());
            }
        }
        for (a, b) in alone.images.iter().zip(&connected.images) {
            (0..2)
                .for_each(|k| close(a.unwrap().redundancy[k], b.unwrap().redundancy[k], 1.0, 1e-8, "image"));
        }
    }
}

/// Returns a network with a fixed first photo, scaled by a distance of the given length between points 3 and 4.
fn scaled(length: f64) -> Network {
    let mut network = images_alone();
    network.photos[0].sd = [0.0; 6];
    network.observations = vec![Distance { points: [3, 4], length, sd: 1e-3, instrument: None }.into()];
    network
}

#[test]
fn one_distance_gives_the_scale() {
    let (once, twice) = (adjusted(&scaled(1.5)), adjusted(&scaled(3.0)));
    let centre = position(&images_alone().photos[0].pose);
    let from_centre = |solution: &Solution, point: usize| {
        Vector3::from(solution.points[point].unwrap().coordinates) - centre
    };
    for point in 0..POINTS {
        let difference = from_centre(&twice, point) - 2.0 * from_centre(&once, point);
        assert!(difference.norm() < 1e-8, "{difference}");
    }
    for (solution, length) in [(&once, 1.5), (&twice, 3.0)] {
        let own = solution.observations[0].as_ref().unwrap();
        let adjusted = (from_centre(solution, 3) - from_centre(solution, 4)).norm();
        assert!((adjusted - length).abs() < 1e-9);
        assert!(own.redundancy[0].abs() < 1e-8 && own.standardized[0].is_nan(), "{own:?}");
        // Two equations per image observation, and the length; minus three per point and six per photo except one.
        let freedom = 2 * PHOTOS * POINTS + 1 - 3 * POINTS - 6 * (PHOTOS - 1);
        assert_eq!(solution.degrees_of_freedom, freedom as i64);
    }
}

#[test]
fn a_free_network_with_a_scale_holds_six_unknowns() {
    let mut network = scaled(1.5);
    network.photos[0].sd = [f64::INFINITY; 6];
    let free = adjust_with(&network, &options(Method::TrustRegion(Stop::Decrease(1e-12)), None), 2).unwrap();
    assert_eq!(free.datum.held, (0..6).map(|unknown| (0, unknown)).collect::<Vec<_>>());
    let fixed = adjusted(&scaled(1.5));
    assert_eq!(free.degrees_of_freedom, fixed.degrees_of_freedom);
    for (a, b) in free.images.iter().zip(&fixed.images) {
        (0..2).for_each(|k| {
            assert!((a.unwrap().redundancy[k] - b.unwrap().redundancy[k]).abs() < 1e-6);
            assert!((a.unwrap().residual[k] - b.unwrap().residual[k]).abs() < 1e-4 * IMAGE_SD);
        });
    }
}

#[test]
fn points_that_nothing_else_holds_are_named() {
    // Fixed photos, and a point on the ray of its only valid photo: a second photo with the same ray.
    let mut network = images_alone();
    network.photos.iter_mut().enumerate().for_each(|(k, photo)| {
        (photo.pose, photo.sd) = (pose(k), [0.0; 6]);
    });
    network.photos.push(network.photos[0]);
    let [first, ..] = network.images.clone().try_into().unwrap_or_else(|all: Vec<Image>| [all[0]]);
    network.images.retain(|image| image.point != 0);
    network.images.push(first);
    network.images.push(Image { photo: PHOTOS, ..first });
    network.observations = vec![distance(1, 2)];
    let found = adjust_with(&network, &Options::default(), 1).unwrap();
    assert_eq!(found.dropped, [Dropped { point: 0, reason: Reason::NotDetermined }], "a local point");
    assert!(found.points[0].is_none() && found.points[5].unwrap().cofactors[0] > 0.0);
    network.observations = vec![EqualHeight { points: [3, 4], difference: 0.0, sd: 1.0 }.into()];
    network.observations.push(EqualHeight { points: [0, 0], difference: 0.0, sd: 1.0 }.into());
    let refused = adjust_with(&network, &Options::default(), 1).err();
    let (index, kind, fault) = (1, "equal height", Fault::Twice);
    assert_eq!(refused, Some(NetworkError::Observation { index, kind, fault }));
    // A difference in X determines the point along its ray, unless the photo looks along Y.
    let components = [Some(difference(0, 1)[0]), None, None];
    network.observations = vec![Difference { points: [0, 1], components, precision: sd(&[0.01]) }.into()];
    let solved = adjust_with(&network, &Options::default(), 1);
    assert!(solved.is_ok(), "a difference finds the point on its ray: {:?}", solved.err());
}

#[test]
fn observations_of_points_that_are_left_out_do_not_take_part() {
    let mut network = network();
    network.images.retain(|image| image.point != 6 || image.photo == 0);
    let solution = adjusted(&network);
    assert!(solution.points[6].is_none());
    for (own, observation) in network.observations.iter().zip(&solution.observations) {
        assert_eq!(own.touches().points.contains(&6), observation.is_none());
    }
    assert!(solution.adjustment.redundancy_excess.unwrap().abs() < 1e-8);
    let counted: usize = solution.kinds(&network).iter().map(|sums| sums.observations).sum();
    assert_eq!(counted, network.observations.len() - 2);
}

#[test]
fn what_cannot_be_is_refused_by_its_index() {
    let refused = |index: usize, observation: Observation| {
        let mut network = network();
        let kind = observation.kind();
        network.observations[index] = observation;
        let expected = move |fault| NetworkError::Observation { index, kind, fault };
        (adjust_with(&network, &Options::default(), 1).expect_err("refused"), expected)
    };
    let length = |points, length, sd| Distance { points, length, sd, instrument: None }.into();
    let (found, expected) = refused(4, length([3, POINTS], 1.0, 0.1));
    assert_eq!(found, expected(Fault::NoPoint(POINTS)));
    assert_eq!(found.to_string(), "observation 4, of kind distance, names point 14, which is not there");
    let (found, expected) = refused(2, length([3, 3], 1.0, 0.1));
    assert_eq!(found, expected(Fault::Twice));
    let (found, expected) = refused(2, length([3, 4], 1.0, -0.1));
    assert_eq!(found, expected(Fault::Deviation));
    let (found, expected) = refused(0, length([3, 4], f64::NAN, 0.1));
    assert_eq!(found, expected(Fault::NotFinite));
    let pose = Pose { position: Vector3::zeros(), attitude: Matrix3::identity() };
    let relative = |photos, precision| Relative { photos, pose, precision }.into();
    let (found, expected) = refused(1, relative([0, ALL], sd(&[1.0; 6])));
    assert_eq!(found, expected(Fault::NoPhoto(ALL)));
    let singular = nalgebra::DMatrix::from_element(6, 6, 1.0);
    let (found, expected) = refused(1, relative([0, 1], Precision::Covariance(singular)));
    assert_eq!(found, expected(Fault::Covariance));
    let (found, expected) = refused(1, relative([0, 1], sd(&[1.0; 5])));
    assert_eq!(found, expected(Fault::Deviations { components: 6, given: 5 }));
    let components = [None; 3];
    let nothing = Difference { points: [0, 1], components, precision: sd(&[]) };
    let (found, expected) = refused(3, nothing.into());
    assert_eq!(found, expected(Fault::Nothing));
}
