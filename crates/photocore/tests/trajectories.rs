//! Photos on trajectories with motion during readout: the motion is estimated with its covariance, and reported if undetermined.

#![allow(clippy::unwrap_used)]

use photocore::adjustment::Status;
use photocore::geometry::trajectory::{
    Attitudes, Axes, Basis, Interpolation, Polynomial, Positions, Rotations, Trajectory as Course,
};
use photocore::geometry::{
    AttitudeNumbers, Matrix3, ObjectSpace, Perspective, Pose, PoseNumbers, RotationSense, Vector3,
    angle_axis_rotation, rotation,
};
use photocore::network::mounts::OnTrajectory;
use photocore::network::{
    Camera, Combination, Common, CommonKind, Image, Network, NetworkError, Options, Photo, Point, Solution,
    Trajectory,
};
use photocore::{Context, Threads};

const CAMERA: Perspective = Perspective { principal_distance: -28.0 };
const SENSE: RotationSense = RotationSense::GroundToPhoto;
const SD: f64 = 0.002;
const FREE: f64 = f64::INFINITY;
/// Readout time per image coordinate: rows are read from the top, 80 mm of image height per second.
const BY_XY: [f64; 2] = [0.0, -1.0 / 80.0];
const START: f64 = 0.02;
const PHOTOS: usize = 8;
const POINTS: usize = 42;

/// Velocity in object space and rotation per second: for the photos of a strip, and for the photos of the return strip.
const MOTIONS: [([f64; 3], [f64; 3]); 2] =
    [([5.0, 0.3, -0.1], [0.05, -0.2, 0.1]), ([-4.0, 0.2, 0.3], [-0.1, 0.15, 0.05])];

/// Reproducible generator of normally distributed numbers.
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

fn place(k: usize) -> Vector3 {
    let [i, j] = [k % 7, k / 7].map(|i| i as f64);
    Vector3::new(6.0 * i, 5.0 * j, (1.3 * i + 2.1 * j).sin())
}

/// Returns four photos along X, and four in the opposite direction.
fn pose(k: usize) -> Pose {
    let (along, back) = (8.0 * (k % 4) as f64 + 6.0, k / 4);
    let wiggle = |n: usize| 0.05 * ((7 * k + n) as f64).sin();
    Pose {
        position: Vector3::new(along, 6.0 + 13.0 * back as f64, 30.0 + wiggle(0)),
        attitude: rotation([wiggle(1), wiggle(2), 0.3 * wiggle(3)]).transpose(),
    }
}

fn image(photo: usize, point: usize) -> [f64; 2] {
    let (Pose { position, attitude }, (v, w)) = (pose(photo), MOTIONS[photo / 4]);
    let mut xy = [0.0; 2];
    for _ in 0..30 {
        let t = START + BY_XY[0] * xy[0] + BY_XY[1] * xy[1];
        let at = Pose {
            position: position + t * Vector3::from(v),
            attitude: attitude * angle_axis_rotation(&(t * Vector3::from(w))),
        };
        let u = at.to_camera_frame(&place(point));
        xy = [0, 1].map(|k| CAMERA.principal_distance * u[k] / u[2]);
    }
    xy
}

/// Returns the block with errors of a seed; initial motions are zero.
fn network(seed: u64) -> Network {
    let mut normal = Normal(seed);
    let (mut images, mut times) = (vec![], vec![]);
    for photo in 0..PHOTOS {
        for point in 0..POINTS {
            let exact = image(photo, point);
            if exact[0].abs() < 14.0 && exact[1].abs() < 14.0 {
                images.push(Image { photo, point, xy: exact.map(|x| x + SD * normal.next()), sd: [SD; 2] });
                times.push(START + BY_XY[0] * exact[0] + BY_XY[1] * exact[1]);
            }
        }
    }
    let photo = |k: usize| {
        let Pose { position, attitude } = pose(k);
        let [omega, phi, kappa] = AttitudeNumbers::OmegaPhiKappa(SENSE).numbers(&attitude);
        let pose = [position.x, position.y, position.z, omega, phi, kappa];
        Photo { pose, observed: pose, sd: [FREE; 6], camera: 0 }
    };
    // Approximate position of each photo, and its attitude.
    let line = || Basis::Polynomial(Polynomial { degree: 1, reference: 0.0, scale: 1.0 });
    let trajectory = |k: usize| {
        let Pose { position, attitude } = pose(k);
        let about = vec![position + Vector3::new(0.1, 0.0, -0.1)];
        Trajectory {
            course: Course {
                positions: Positions::new(vec![0.0], about, vec![], Interpolation::Linear).unwrap(),
                attitudes: Attitudes::new(vec![0.0], vec![attitude], Interpolation::Linear).unwrap(),
                position: line(),
                rotation: line(),
                axes: Axes::Table,
                rotations: Rotations::Vector,
                body: None,
            },
            position: vec![MOTIONS.len() * 2 + 2 * k, 2 * (k / 4)],
            rotation: vec![MOTIONS.len() * 2 + 2 * k + 1, 2 * (k / 4) + 1],
        }
    };
    let mut point = |k: usize| {
        if !k.is_multiple_of(4) {
            return Point { coordinates: [f64::NAN; 3], sd: [FREE; 3] };
        }
        let coordinates = place(k).map(|x| x + 0.005 * normal.next());
        Point { coordinates: coordinates.into(), sd: [0.005; 3] }
    };
    // Per strip a velocity and a rotation rate, per photo a shift and a rotation.
    let coefficient = |index: usize| {
        let kinds = [CommonKind::PositionCoefficient, CommonKind::RotationCoefficient];
        Common::vector(kinds[index % 2], [0.0; 3], &[FREE; 3])
    };
    let moves =
        |photo: usize| OnTrajectory { photo, trajectory: photo, time: 0.0, rate: None, offset: None }.into();
    Network {
        space: ObjectSpace::Rectangular,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(CAMERA.into())],
        photos: (0..PHOTOS).map(photo).collect(),
        points: (0..POINTS).map(&mut point).collect(),
        images,
        observations: vec![],
        commons: (0..2 * (MOTIONS.len() + PHOTOS)).map(coefficient).collect(),
        mounts: (0..PHOTOS).map(moves).collect(),
        trajectories: (0..PHOTOS).map(trajectory).collect(),
        image_times: times,
        image_corrections: vec![],
    }
}

fn adjust(network: &Network) -> Result<Solution, NetworkError> {
    let threads = Threads::new(1).unwrap();
    network.adjustment(&Options::default()).run_in(&mut Context::new(&threads))
}

#[test]
fn motions_are_found_within_their_covariance() {
    const DRAWS: u64 = 30;
    let mut sum = 0.0;
    for seed in 0..DRAWS {
        let solution = adjust(&network(seed)).unwrap();
        assert_eq!(solution.adjustment.status, Status::Converged);
        for (found, (v, w)) in solution.commons.chunks(2).zip(MOTIONS) {
            for (found, truth) in found.iter().zip([v, w]) {
                let error = Vector3::from(found.position) - Vector3::from(truth);
                let cofactors = Matrix3::from_row_slice(found.cofactors.as_slice());
                sum += error.dot(&(cofactors.try_inverse().unwrap() * error));
            }
        }
    }
    // Mean over all draws of three components; limit of four standard deviations of the mean.
    let (count, mean) = (4.0 * DRAWS as f64, sum / (4.0 * DRAWS as f64));
    assert!((mean - 3.0).abs() < 4.0 * (6.0 / count).sqrt(), "{mean}");
}

#[test]
fn redundancy_numbers_add_up_to_the_degrees_of_freedom() {
    let mut network = network(100);
    // One motion is weighted.
    network.commons[2].sd = vec![0.5; 3];
    network.commons[3].sd = vec![0.05; 3];
    let solution = adjust(&network).unwrap();
    let points = || network.points.iter().zip(&solution.points).filter(|(_, found)| found.is_some());
    let (seen, control) = (points().count(), points().filter(|(point, _)| point.held() == [true; 3]).count());
    let images = || solution.images.iter().flatten();
    let freedom = 2 * images().count() + 3 * control + 6 - 3 * seen - 6 * PHOTOS - 12;
    let mut total = images().flat_map(|image| image.redundancy).sum::<f64>();
    total += solution.points.iter().flatten().flat_map(|point| point.redundancy).sum::<f64>();
    total += solution.commons.iter().flat_map(|own| own.redundancy.clone()).sum::<f64>();
    assert!((total - freedom as f64).abs() < 1e-8, "{total} of {freedom}");
}

#[test]
fn a_motion_that_no_row_shows_is_named() {
    let mut network = network(200);
    let of_strip = |network: &Network, k: usize| network.images[k].photo >= 4;
    let times: Vec<usize> = (0..network.images.len()).filter(|&k| of_strip(&network, k)).collect();
    times.iter().for_each(|&k| network.image_times[k] = 0.0);
    let of = |common| Combination { commons: vec![common], ..Combination::default() };
    let expected = [vec![of(2); 3], vec![of(3); 3]].concat();
    let Err(NetworkError::Undetermined(found)) = adjust(&network) else { unreachable!() };
    assert_eq!(found, expected);
}

#[test]
fn photos_at_rest_are_photos() {
    let mut resting = network(300);
    resting.commons[..4].iter_mut().for_each(|motion| motion.sd.fill(0.0));
    let plain = Network {
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
        commons: vec![],
        ..resting.clone()
    };
    let [resting, plain] = [&resting, &plain].map(|network| adjust(network).unwrap());
    for (a, b) in resting.photos.iter().zip(&plain.photos) {
        for k in 0..36 {
            let scale = (b.cofactors[k / 6 * 7] * b.cofactors[k % 6 * 7]).sqrt();
            assert!((a.cofactors[k] - b.cofactors[k]).abs() < 1e-9 * scale);
            assert!((a.pose[k / 6] - b.pose[k / 6]).abs() < 1e-9);
        }
    }
}

#[test]
fn what_a_trajectory_does_not_reach_is_refused() {
    let mut network = network(400);
    let times: Vec<f64> = (0..3).map(f64::from).collect();
    let places = vec![Vector3::zeros(); 3];
    network.trajectories[1].course.positions =
        Positions::new(times, places, vec![], Interpolation::Linear).unwrap();
    network.mounts[1] = OnTrajectory { photo: 1, trajectory: 1, time: 3.0, rate: None, offset: None }.into();
    let found = adjust(&network).err().unwrap();
    // The error names the first observation of the photo.
    assert!(
        matches!(found, NetworkError::OutsideTrajectory { photo: 1, point: Some(_), trajectory: 1, .. }),
        "{found}"
    );
    network.mounts[1] = OnTrajectory { photo: 1, trajectory: 9, time: 0.0, rate: None, offset: None }.into();
    assert_eq!(adjust(&network).err(), Some(NetworkError::Mount(1)));
    network.trajectories[1].position.pop();
    assert_eq!(adjust(&network).err(), Some(NetworkError::Trajectory(1)));
}
