//! Photos around an object: attitudes at the singularity of three angles, for some axes.

#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;

use photocore::adjustment::{Method, Published, Status};
use photocore::geometry::{
    AttitudeNumbers, Matrix3, ObjectSpace, Orientation, Perspective, Point as At, PoseNumbers, RotationSense,
    Vector3, angle_axis_rotation,
};
use photocore::network::{Camera, Image, Network, NetworkError, Options, Photo, Point, Solution};
use photocore::{Context, Threads};

use crate::noise;

const CAMERA: Perspective = Perspective { principal_distance: -28.0 };
const SD: f64 = 0.002;

/// Returns the axes x right, y up, z backward of a photo at `from` that looks at `to`.
fn looking(from: Vector3, to: Vector3, up: Vector3) -> Matrix3 {
    let back = (from - to).normalize();
    let right = up.cross(&back).normalize();
    Matrix3::from_columns(&[right, back.cross(&right), back])
}

/// Returns eight level photos on a circle of 6 m about an object of 2 m with four control points. The first is in the direction of +X, with
/// phi of 90 degrees; the opposite phi is -90. `turned` rotates the scene; initial poses are wrong by `error` (radians, metres).
fn around(sense: RotationSense, turned: &Matrix3, image_error: f64, error: f64) -> Network {
    let space = ObjectSpace::Rectangular;
    let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
    let places: Vec<Vector3> =
        (0..20).map(|i| Vector3::from([3 * i, 3 * i + 1, 3 * i + 2].map(noise))).collect();
    let (mut photos, mut images) = (vec![], vec![]);
    for index in 0..8 {
        let (sin, cos) = (index as f64 * FRAC_PI_2 / 2.0).sin_cos();
        let station = Vector3::new(6.0 * cos, 6.0 * sin, 0.0);
        let attitude = turned * looking(station, Vector3::zeros(), Vector3::z());
        let station = turned * station;
        let view = photocore::geometry::View {
            orientation: Orientation::stepping(space, station.into(), &attitude),
            camera: CAMERA,
        };
        for (point, place) in places.iter().enumerate() {
            let [x, y] = view.project(&At::new(space, (turned * place).into()));
            let n = 2 * images.len();
            let xy = [x + image_error * noise(n), y + image_error * noise(n + 1)];
            images.push(Image { photo: index, point, xy, sd: [SD; 2] });
        }
        // The errors are independent of the axes.
        let off = |first: usize| error * Vector3::from([0, 1, 2].map(|k| noise(6 * index + first + k)));
        let start = station + attitude * off(0);
        let [omega, phi, kappa] = numbers.numbers(&(attitude * angle_axis_rotation(&off(3))));
        let pose = [start.x, start.y, start.z, omega, phi, kappa];
        photos.push(Photo::free(pose, 0));
    }
    let point = |(index, place): (usize, &Vector3)| {
        let sd = if index < 4 { [1e-4; 3] } else { [f64::INFINITY; 3] };
        Point { coordinates: (turned * place).into(), sd }
    };
    let points = places.iter().enumerate().map(point).collect();
    let poses = PoseNumbers::Angles(sense);
    Network {
        space,
        poses,
        cameras: vec![Camera::held(CAMERA.into())],
        photos,
        points,
        images,
        ..Network::new()
    }
}

fn adjust(network: &Network) -> Result<Solution, NetworkError> {
    let threads = Threads::new(1).unwrap();
    network.adjustment(&Options::default()).run_in(&mut Context::new(&threads))
}

fn block(cofactors: &[f64], first: usize) -> Matrix3 {
    Matrix3::from_fn(|i, j| cofactors[6 * (first + i) + first + j])
}

/// Compares relative to the largest element.
fn assert_near(found: &Matrix3, expected: &Matrix3, tolerance: f64) {
    assert!((found - expected).amax() < tolerance * expected.amax(), "{found} {expected}");
}

#[test]
fn a_block_around_an_object_does_not_depend_on_its_axes() {
    // About Y: a view along X becomes a view along Z, and phi is zero for all photos.
    let quarter = angle_axis_rotation(&Vector3::new(0.0, FRAC_PI_2, 0.0));
    for sense in [RotationSense::GroundToPhoto, RotationSense::PhotoToGround] {
        let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
        let singular = adjust(&around(sense, &Matrix3::identity(), SD, 0.1)).unwrap();
        let regular = adjust(&around(sense, &quarter, SD, 0.1)).unwrap();
        for solution in [&singular, &regular] {
            assert_eq!(solution.adjustment.status, Status::Converged);
            assert!(solution.weak.photos.is_empty() && solution.undetermined.is_none());
            assert!(solution.adjustment.iterations.len() < 12, "{:?}", solution.adjustment.iterations);
        }
        let ratio = singular.sums_of_squares.total() / regular.sums_of_squares.total();
        assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
        for (a, b) in singular.points.iter().zip(&regular.points) {
            let (a, b) = (a.unwrap(), b.unwrap());
            assert!((quarter * Vector3::from(a.coordinates) - Vector3::from(b.coordinates)).amax() < 1e-9);
            let [a, b] = [a.cofactors, b.cofactors];
            assert_near(&(quarter * a * quarter.transpose()), &b, 1e-7);
        }
        for (a, b) in singular.photos.iter().zip(&regular.photos) {
            let [at, turned] = [a, b].map(|photo| {
                let [x, y, z, omega, phi, kappa] = photo.pose;
                (Vector3::new(x, y, z), [omega, phi, kappa])
            });
            assert!((quarter * at.0 - turned.0).amax() < 1e-9);
            assert!((quarter * numbers.attitude(at.1) - numbers.attitude(turned.1)).amax() < 1e-9);
            let [p, q] = [a, b].map(|photo| block(photo.cofactors.as_slice(), 0));
            assert_near(&(quarter * p * quarter.transpose()), &q, 1e-7);
            // The cofactors of the angles are large if phi is near 90 degrees; the cofactors of the rotation step agree.
            let [p, q] = [(a, at.1), (b, turned.1)].map(|(photo, angles)| {
                let rates = numbers.rates(angles);
                rates * block(photo.cofactors.as_slice(), 3) * rates.transpose()
            });
            let condition = numbers.rates(at.1).determinant().abs().recip();
            assert_near(&p, &q, 1e-7 + 1e-14 * condition * condition);
        }
    }
}

#[test]
fn at_ninety_degrees_the_angles_are_not_given_and_all_else_is() {
    let sense = RotationSense::GroundToPhoto;
    // Start at the solution, without errors: phi remains 90 degrees to the last digits.
    let network = around(sense, &Matrix3::identity(), 0.0, 0.0);
    let solution = adjust(&network).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    for (index, photo) in solution.photos.iter().enumerate() {
        let singular = index % 4 == 0;
        for i in 0..6 {
            for j in 0..6 {
                let q = photo.cofactors[6 * i + j];
                assert_eq!(q.is_nan(), singular && (i > 2 || j > 2), "{index}: {i} {j}");
                assert_eq!(q.to_bits(), photo.cofactors[6 * j + i].to_bits());
            }
        }
        if singular {
            assert_eq!(photo.pose[5], 0.0, "kappa");
        }
        let [.., omega, phi, kappa] = photo.pose;
        let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
        let [.., o, p, k] = network.photos[index].pose;
        assert!((numbers.attitude([omega, phi, kappa]) - numbers.attitude([o, p, k])).amax() < 1e-8);
    }
}

#[test]
fn weighted_angles_are_observations_of_the_angles() {
    let quarter = angle_axis_rotation(&Vector3::new(0.0, FRAC_PI_2, 0.0));
    // With these axes phi is zero for all photos.
    let upright =
        [(RotationSense::GroundToPhoto, quarter), (RotationSense::PhotoToGround, Matrix3::identity())];
    for (sense, turned) in upright {
        let mut network = around(sense, &turned, SD, 0.02);
        for (index, photo) in network.photos.iter_mut().enumerate() {
            // Three, one or zero weighted angles.
            let weighted = [3, 1, 0][index % 3];
            photo.sd[6 - weighted..].fill(0.002);
        }
        // The historic program has the angles as unknowns.
        let mut published = Options::default();
        published.adjustment.method = Method::Full(Published::Percent(1e-10));
        published.adjustment.max_iterations = 30;
        let threads = Threads::new(2).unwrap();
        let expected = network.adjustment(&published).run_in(&mut Context::new(&threads)).unwrap();
        let found = adjust(&network).unwrap();
        assert_eq!(found.adjustment.status, Status::Converged);
        assert_eq!(found.degrees_of_freedom, expected.degrees_of_freedom);
        let [camera, as_unknowns] = [&found, &expected].map(|own| own.sums_of_squares.camera);
        assert!(camera > 1.0 && (camera / as_unknowns - 1.0).abs() < 1e-7, "{camera} {as_unknowns}");
        for (a, b) in found.photos.iter().zip(&expected.photos) {
            for (k, (x, y)) in a.pose.iter().zip(b.pose).enumerate() {
                let sd = b.cofactors[7 * k].sqrt();
                assert!((x - y).abs() < 1e-6 * sd, "{k}: {x} {y}");
            }
            for (i, (q, expected)) in a.cofactors.iter().zip(&b.cofactors).enumerate() {
                let scale = (b.cofactors[7 * (i / 6)] * b.cofactors[7 * (i % 6)]).sqrt();
                assert!((q - expected).abs() < 1e-7 * scale, "{i}: {q} {expected}");
            }
            for (r, expected) in a.redundancy.iter().zip(&b.redundancy) {
                assert!((r - expected).abs() < 1e-7, "{r} {expected}");
            }
        }
    }
}

#[test]
fn weighted_angles_near_ninety_degrees_do_not_hinder() {
    let sense = RotationSense::GroundToPhoto;
    for sd in [0.01, 0.1, 1.0] {
        let mut network = around(sense, &Matrix3::identity(), SD, 0.02);
        network.photos.iter_mut().for_each(|photo| photo.sd[3..].fill(sd));
        let solution = adjust(&network).unwrap();
        let Solution { adjustment, degrees_of_freedom, .. } = &solution;
        assert_eq!(adjustment.status, Status::Converged);
        assert!(adjustment.iterations.len() < 8, "{}: {}", sd, adjustment.iterations.len());
        let images = solution.images.iter().flatten().flat_map(|image| image.redundancy);
        let photos = solution.photos.iter().flat_map(|photo| photo.redundancy.clone());
        let points = solution.points.iter().flatten().flat_map(|point| point.redundancy);
        let sum: f64 = images.chain(photos).chain(points).sum();
        assert!((sum - *degrees_of_freedom as f64).abs() < 1e-7, "{sum} {degrees_of_freedom}");
    }
}
