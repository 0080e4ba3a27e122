//! Blocks with faults: distant positions, points behind cameras, nearly undetermined unknowns.

#![allow(clippy::unwrap_used, clippy::panic)]

use photocore::adjustment::{self, Method, Status, Stop};
use photocore::geometry::{ObjectSpace, Orientation, Perspective, Point as At, PoseNumbers, RotationSense};
use photocore::network::{Camera, Coarse, Image, Network, NetworkError, Options, Photo, Point, Solution};
use photocore::{Context, Threads};

use crate::noise;

const FREE: [f64; 3] = [f64::INFINITY; 3];
const CAMERA: Perspective = Perspective { principal_distance: -150.0 };
const POSES: PoseNumbers = PoseNumbers::Angles(RotationSense::GroundToPhoto);
const SD: f64 = 0.005;

/// Returns a free photo with the given pose; photos look down from 1500 m.
fn photo(position: [f64; 3], attitude: [f64; 3]) -> Photo {
    let [[x, y, z], [omega, phi, kappa]] = [position, attitude];
    let pose = [x, y, z, omega, phi, kappa];
    Photo::free(pose, 0)
}

/// Returns a block with true photos and points, every point on every photo, with errors of the image coordinates.
fn block(photos: Vec<Photo>, places: &[[f64; 3]]) -> Network {
    let space = ObjectSpace::Rectangular;
    let mut images = Vec::new();
    for (index, photo) in photos.iter().enumerate() {
        let orientation = Orientation::new(POSES, space, &photo.pose);
        let view = photocore::geometry::View { orientation, camera: CAMERA };
        for (point, &place) in places.iter().enumerate() {
            let [x, y] = view.project(&At::new(space, place));
            let n = 2 * images.len();
            let xy = [x + SD * noise(n), y + SD * noise(n + 1)];
            images.push(Image { photo: index, point, xy, sd: [SD; 2] });
        }
    }
    Network {
        space,
        poses: POSES,
        cameras: vec![Camera::held(CAMERA.into())],
        photos,
        points: places.iter().map(|&coordinates| Point { coordinates, sd: FREE }).collect(),
        images,
        ..Network::new()
    }
}

const PLACES: [[f64; 3]; 8] = [
    [100.0, 80.0, 12.0],
    [880.0, 120.0, 55.0],
    [930.0, 860.0, 7.0],
    [60.0, 900.0, 90.0],
    [500.0, 480.0, 31.0],
    [480.0, 60.0, 64.0],
    [520.0, 940.0, 18.0],
    [90.0, 500.0, 43.0],
];

/// Returns four photos over fixed control and free points.
fn sound() -> Network {
    let stations = [[200.0, 300.0], [800.0, 300.0], [800.0, 700.0], [200.0, 700.0]];
    let photos = stations.iter().enumerate().map(|(i, &[x, y])| {
        let attitude = [0.02 * noise(3 * i), 0.02 * noise(3 * i + 1), 3.0 * noise(3 * i + 2)];
        photo([x, y, 1500.0 + 10.0 * noise(i)], attitude)
    });
    let mut block = block(photos.collect(), &PLACES);
    block.points[..4].iter_mut().for_each(|point| point.sd = [0.0; 3]);
    block.points[4..].iter_mut().for_each(|point| point.coordinates = [f64::NAN; 3]);
    block
}

fn adjust(block: &Network) -> Result<Solution, NetworkError> {
    let adjustment =
        adjustment::Options { method: Method::Damped(Stop::Fraction(1e-6)), ..Default::default() };
    let options = Options { adjustment, ..Options::default() };
    let threads = Threads::new(1).unwrap();
    block.adjustment(&options).run_in(&mut Context::new(&threads))
}

/// A core called from Rust needs no memory for an interpreter; `reserved` is set by callers that do.
#[test]
fn memory_is_that_of_the_adjustment_and_what_the_caller_takes() {
    let room = |memory, reserved| {
        let options = Options { memory: Some(memory), reserved, ..Options::default() };
        let threads = Threads::new(1).unwrap();
        sound().adjustment(&options).run_in(&mut Context::new(&threads)).map(drop)
    };
    assert_eq!(room(16 << 20, 0), Ok(()));
    match room(16 << 20, 12 << 20) {
        Err(NetworkError::Memory { needed, available }) => {
            assert!(needed > 20 << 20 && available == 16 << 20, "{needed}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn positions_too_large_for_double_precision_are_named() {
    for value in [1e308, 1e101, -1e16] {
        for sd in [0.0, 30.0, f64::INFINITY] {
            let mut block = sound();
            block.photos[2].pose[0] = value;
            block.photos[2].sd[..3].fill(sd);
            let expected = Coarse { photos: vec![2], points: vec![] };
            assert_eq!(adjust(&block).err(), Some(NetworkError::Coarse(expected)), "{value} {sd}");
            let mut block = sound();
            block.points[1].coordinates[0] = value;
            let expected = Coarse { photos: vec![], points: vec![1] };
            assert_eq!(adjust(&block).err(), Some(NetworkError::Coarse(expected)), "{value}");
        }
    }
}

#[test]
fn a_photo_far_off_takes_no_digits_from_the_others() {
    let expected = adjust(&sound()).unwrap();
    let mut block = sound();
    // Fixed and without observations, at coordinates rounded to 0.1 mm: a local origin at the mean would round the other photos as well.
    let mut far = photo([1e12, 1e12, 1500.0], [0.0; 3]);
    far.sd = [0.0; 6];
    block.photos.push(far);
    let found = adjust(&block).unwrap();
    assert_eq!(found.adjustment.status, Status::Converged);
    let sum = expected.sums_of_squares.total();
    assert!((found.sums_of_squares.total() - sum).abs() < 1e-9 * sum);
    for (a, b) in found.photos.iter().zip(&expected.photos) {
        (0..3).for_each(|k| assert!((a.pose[k] - b.pose[k]).abs() < 1e-8));
    }
}

#[test]
fn points_behind_a_camera_are_told() {
    let block = sound();
    let seen = adjust(&block).unwrap();
    assert!(seen.unseen.behind.is_empty());
    let mut upward = block.clone();
    for (photo, adjusted) in upward.photos.iter_mut().zip(&seen.photos) {
        (photo.pose, photo.sd) = (adjusted.pose, [0.0; 6]);
    }
    // Rotated by 180 degrees about its x axis the photo looks up.
    upward.photos[2].pose[3] += std::f64::consts::PI;
    for (point, adjusted) in upward.points.iter_mut().zip(&seen.points) {
        *point = Point { coordinates: adjusted.unwrap().coordinates, sd: [0.0; 3] };
    }
    let expected: Vec<usize> =
        (0..block.images.len()).filter(|&image| block.images[image].photo == 2).collect();
    assert_eq!(adjust(&upward).unwrap().unseen.behind, expected);
}

#[test]
fn what_is_hardly_determined_is_named_and_ends() {
    // Stations on a line, with weighted positions: the roll about it depends on their ten-centimetre deviation from the line.
    let stations = [[200.0, 500.0, 1500.0], [500.0, 500.1, 1500.0], [800.0, 500.0, 1500.0]];
    let photos = stations.iter().map(|&position| {
        let mut photo = photo(position, [0.0; 3]);
        photo.sd[..3].fill(0.1);
        photo
    });
    let mut block = block(photos.collect(), &PLACES);
    block.points.iter_mut().for_each(|point| point.coordinates = [f64::NAN; 3]);
    for (index, photo) in block.photos.iter_mut().enumerate() {
        (0..3).for_each(|k| photo.observed[k] += 0.1 * noise(3 * index + k));
    }
    let solution = adjust(&block).unwrap();
    assert!(solution.adjustment.iterations.len() < 30);
    let weak: Vec<usize> = solution.weak.photos.iter().map(|&(photo, _)| photo).collect();
    assert!(
        solution.weak.photos.iter().any(|&(_, unknown)| unknown == 3),
        "omega: {weak:?} {:?}",
        solution.undetermined
    );
}
