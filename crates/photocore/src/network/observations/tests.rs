//! What every kind must hold: partials that agree with differences, in all spaces and for all numbers of a pose.

#![allow(clippy::unwrap_used)]

use super::tied::TiedModel;
use super::{Fault, Observation, Precision, TiedObservation};
use crate::geometry::{Ellipsoid, Matrix3, ObjectSpace, Orientation, Point, PoseNumbers, RotationSense};

/// Two points or photos in rectangular space.
pub const PLACES: [[f64; 3]; 2] = [[10.0, 20.0, 1.5], [13.0, 18.5, 2.0]];
const ATTITUDES: [[f64; 3]; 2] = [[0.4, -0.3, 1.2], [1.1, 0.5, -0.7]];
/// Unknowns of a photo, those of its camera among them.
const PHOTO: usize = 7;

/// A space with two places of points and two photos, as unknowns.
struct Scene {
    space: ObjectSpace,
    poses: PoseNumbers,
    unknowns: Vec<f64>,
    /// What a unit of each unknown moves in units of length or radians, about.
    units: Vec<f64>,
}

fn scenes() -> [Scene; 4] {
    let ellipsoid = Ellipsoid::new(300.0, 290.0).unwrap();
    let [to_photo, to_ground] =
        [RotationSense::GroundToPhoto, RotationSense::PhotoToGround].map(PoseNumbers::Angles);
    let scene = |space, poses, places: [[f64; 3]; 2], turned: bool| {
        let photo = |k: usize| {
            let [place, attitude] = [places[1 - k], ATTITUDES[k]];
            let pose = if turned { [attitude, place] } else { [place, attitude] };
            [pose.concat(), vec![0.0]].concat()
        };
        let unknowns: Vec<f64> = [places.concat(), photo(0), photo(1)].concat();
        let unit = |place: bool, k: usize| match space {
            ObjectSpace::Geographic(_) if place && k < 2 => 1.0 / 300.0,
            _ => 1.0,
        };
        let units = (0..6).map(|k| unit(true, k % 3)).chain((0..2 * PHOTO).map(|k| unit(true, k % PHOTO)));
        Scene { space, poses, unknowns, units: units.collect() }
    };
    let geographic = [[0.3, 0.7, 1.5], [0.31, 0.69, 2.0]];
    [
        scene(ObjectSpace::Rectangular, to_photo, PLACES, false),
        scene(ObjectSpace::Rectangular, PoseNumbers::Vectors, PLACES, true),
        scene(ObjectSpace::Geographic(ellipsoid), to_photo, geographic, false),
        scene(ObjectSpace::Geographic(ellipsoid), to_ground, geographic, false),
    ]
}

impl Scene {
    fn orientations(&self, unknowns: &[f64]) -> [Orientation; 2] {
        let pose = |k: usize| std::array::from_fn(|i| unknowns[6 + PHOTO * k + i]);
        [0, 1].map(|k| Orientation::new(self.poses, self.space, &pose(k)))
    }

    /// Constant and coefficients of an observation at given values, over all unknowns.
    fn equations(&self, observation: &Observation, unknowns: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let orientations = self.orientations(unknowns);
        let touches = observation.touches();
        let rows = observation.rows();
        let width = 3 * touches.points.len() + PHOTO * touches.photos.len();
        let tied = TiedObservation {
            index: 0,
            points: touches.points.clone(),
            photos: touches.photos.clone(),
            root: Precision::Deviations(vec![1.0; rows]).root(rows).unwrap(),
            observation: observation.clone(),
        };
        let point = |i: usize| {
            let coordinates = std::array::from_fn(|k| unknowns[3 * i + k]);
            (Point::new(self.space, coordinates), coordinates)
        };
        let model = TiedModel {
            space: self.space,
            origin: [0.0; 3],
            point: &point,
            photo: &|photo| (&orientations[photo], PHOTO),
        };
        let (mut constant, mut coefficients) = (vec![0.0; rows], vec![f64::NAN; rows * width]);
        tied.write(&model, &mut constant, &mut coefficients);
        let columns = touches.points.iter().flat_map(|i| 3 * i..3 * i + 3);
        let columns = columns.chain(touches.photos.iter().flat_map(|i| 6 + PHOTO * i..6 + PHOTO * (i + 1)));
        let columns: Vec<usize> = columns.collect();
        let spread = |row: &[f64]| {
            let mut all = vec![0.0; unknowns.len()];
            columns.iter().zip(row).for_each(|(&column, &value)| all[column] = value);
            all
        };
        (constant, coefficients.chunks_exact(width).map(spread).collect())
    }
}

/// Asserts that partials agree with central differences of the fourth order.
pub fn agrees(observation: &Observation) {
    for (index, scene) in scenes().iter().enumerate() {
        let (_, rows) = scene.equations(observation, &scene.unknowns);
        for unknown in 0..scene.unknowns.len() {
            let step = 1e-3 * scene.units[unknown];
            let at = |times: f64| {
                let mut moved = scene.unknowns.clone();
                moved[unknown] += times * step;
                scene.equations(observation, &moved).0
            };
            let [near, back, far, far_back] = [1.0, -1.0, 2.0, -2.0].map(at);
            for (row, partials) in rows.iter().enumerate() {
                // The constant is observed minus computed.
                let change = 8.0 * (back[row] - near[row]) - (far_back[row] - far[row]);
                let expected = change / (12.0 * step);
                let error = (partials[unknown] - expected).abs() * scene.units[unknown];
                assert!(error < 1e-8, "scene {index}, row {row}, unknown {unknown}: {error:e}");
            }
        }
    }
}

/// Whether an observation stays as it is when everything is shifted and turned.
pub fn stays(observation: &Observation) -> bool {
    let scene = &scenes()[0];
    let turn = crate::geometry::rotation([0.2, -0.4, 0.3]);
    let numbers =
        crate::geometry::AttitudeNumbers::OmegaPhiKappa(crate::geometry::RotationSense::GroundToPhoto);
    let mut moved = scene.unknowns.clone();
    for place in [0, 3, 6, 6 + PHOTO] {
        let [x, y, z] = std::array::from_fn(|k| scene.unknowns[place + k]);
        let place_moved = turn * crate::geometry::Vector3::new(x, y, z);
        (0..3).for_each(|k| moved[place + k] = place_moved[k] + 5.0);
    }
    for (photo, orientation) in scene.orientations(&scene.unknowns).iter().enumerate() {
        let angles = numbers.numbers(&(turn * orientation.pose().attitude));
        moved[6 + PHOTO * photo + 3..][..3].copy_from_slice(&angles);
    }
    let [before, after] = [&scene.unknowns, &moved].map(|values| scene.equations(observation, values).0);
    before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn what_contradicts_itself_is_refused() {
    let distance =
        |points, sd| Observation::from(super::Distance { points, length: 1.0, sd }).check(3, 2).err();
    assert_eq!(distance([0, 2], 0.1), None);
    assert_eq!(distance([0, 3], 0.1), Some(Fault::NoPoint(3)));
    assert_eq!(distance([1, 1], 0.1), Some(Fault::Twice));
    for sd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(distance([0, 1], sd), Some(Fault::Deviation));
    }
    let control = |precision| {
        Observation::from(super::Control { point: 0, coordinates: [0.0; 3], precision }).check(1, 0).err()
    };
    assert_eq!(
        control(Precision::Deviations(vec![1.0; 2])),
        Some(Fault::Deviations { components: 3, given: 2 })
    );
    let covariance = |xy: f64, yx: f64| {
        let mut matrix = nalgebra::DMatrix::identity(3, 3);
        (matrix[(0, 1)], matrix[(1, 0)]) = (xy, yx);
        control(Precision::Covariance(matrix))
    };
    assert_eq!(covariance(0.5, 0.5), None);
    assert_eq!(covariance(0.5, 0.4), Some(Fault::Covariance));
    assert_eq!(covariance(1.5, 1.5), Some(Fault::Covariance));
    let attitude = |matrix: Matrix3| {
        let precision = Precision::Deviations(vec![0.1; 3]);
        let attitude =
            super::Attitude { photo: 1, attitude: matrix, boresight: Matrix3::identity(), precision };
        Observation::from(attitude).check(0, 2).err()
    };
    assert_eq!(attitude(Matrix3::identity()), None);
    assert_eq!(attitude(-Matrix3::identity()), Some(Fault::Rotation));
}
