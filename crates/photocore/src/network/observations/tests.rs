//! Test of the partials of all types against differences, in all spaces and pose parametrizations.

#![allow(clippy::unwrap_used)]

use super::assembled::ModelValues;
use super::precision::Root;
use super::rows::{CommonSite, PhotoSite, PointSite};
use super::{
    AssembledObservation, Attitude, Common, CommonKind, Control, Difference, Fault, Observation, OnLevel,
    OnLine, OnPlane, OnPlumbLine, Position, Precision, Quantity, Smoothness,
};
use crate::geometry::film::Pattern;
use crate::geometry::{
    Ellipsoid, Matrix3, ObjectSpace, Orientation, Point, Pose, PoseNumbers, RotationSense, Vector3, rotation,
};
use crate::network::commons::{CartesianCommon, CommonState, InBlock};
use crate::network::film::{FilmOf, Readings};
use crate::network::mounts::tests::mounted;
use crate::network::mounts::{AT_PHOTO, Composed, OnFrame, PoseInputs};

/// Two points or photos in rectangular space.
const PLACES: [[f64; 3]; 2] = [[10.0, 20.0, 1.5], [13.0, 18.5, 2.0]];
const ATTITUDES: [[f64; 3]; 2] = [[0.4, -0.3, 1.2], [1.1, 0.5, -0.7]];
/// Number of parameters of a photo, including its camera.
const PHOTO: usize = 7;
/// Number of blocks of points and photos.
const BLOCKS: usize = 4;

/// Shared parameters: one of each type, and a second sensor.
const LEVER_ARM: usize = 0;
const SHIFT: usize = 1;
const DRIFT: usize = 2;
const BORESIGHT: usize = 3;
const INSTRUMENT: usize = 4;
const LEVEL: usize = 5;
const PLUMB_LINE: usize = 6;
const LINE: usize = 7;
const PLANE: usize = 8;
const SENSORS: [usize; 2] = [9, 11];

/// Returns the index of the shared parameter of a type.
fn of_kind(kind: CommonKind) -> usize {
    CommonKind::ALL.iter().position(|&own| own == kind).unwrap()
}

/// A space with two points and two photos, as parameters.
struct Scene {
    space: ObjectSpace,
    poses: PoseNumbers,
    unknowns: Vec<f64>,
    /// Approximate unit of each parameter in units of length or radians.
    units: Vec<f64>,
    commons: Vec<CartesianCommon>,
    /// Whether the second photo is on the frame of the first, with the first sensor.
    rig: bool,
}

fn width(common: &CartesianCommon) -> usize {
    common.kind.unknowns().len()
}

/// Returns shared parameters of all types, near a given position.
fn commons(space: ObjectSpace, [x, y, z]: [f64; 3]) -> Vec<CartesianCommon> {
    let kinds = CommonKind::ALL.iter().chain(&[CommonKind::Sensor]);
    let common = |(k, &kind): (usize, &CommonKind)| {
        let place =
            matches!(kind, CommonKind::Level | CommonKind::PlumbLine | CommonKind::Line | CommonKind::Plane);
        let turns = kind.unknowns().iter().any(|&(_, component, _)| component > 2);
        let position = match kind {
            CommonKind::Scanner => [1.1, 0.9, 0.2],
            _ if place => [x, y, z + 0.3],
            _ => [0.4, 0.2 * k as f64, -0.7],
        };
        let attitude = if turns { rotation([0.2 * k as f64, -0.4, 0.9]) } else { Matrix3::identity() };
        Common { kind, position, attitude, sd: vec![1.0; kind.unknowns().len()] }
    };
    let vertical = match space {
        ObjectSpace::Rectangular => Matrix3::identity(),
        ObjectSpace::Geographic(_) => crate::geometry::local_vertical(x + 0.1, y - 0.05),
    };
    let commons = kinds.enumerate().map(common);
    commons.map(|common| CartesianCommon::new(&common, space, [0.0; 3], &vertical)).collect()
}

fn scenes() -> [Scene; 6] {
    let ellipsoid = Ellipsoid::new(300.0, 290.0).unwrap();
    let [to_photo, to_ground] =
        [RotationSense::GroundToPhoto, RotationSense::PhotoToGround].map(PoseNumbers::Angles);
    let scene = |space, poses, places: [[f64; 3]; 2], turned: bool, rig: bool| {
        let commons = commons(space, places[0]);
        let photo = |k: usize| {
            let [place, attitude] = [places[1 - k], ATTITUDES[k]];
            let pose = if turned { [attitude, place] } else { [place, attitude] };
            [pose.concat(), vec![0.0]].concat()
        };
        let of_commons: usize = commons.iter().map(width).sum();
        let small = (0..of_commons).map(|k| 0.3 * (1.7 * k as f64).sin()).collect();
        let unknowns: Vec<f64> = [places.concat(), photo(0), photo(1), small].concat();
        let unit = |place: bool, k: usize| match space {
            ObjectSpace::Geographic(_) if place && k < 2 => 1.0 / 300.0,
            _ => 1.0,
        };
        let units = (0..6).map(|k| unit(true, k % 3)).chain((0..2 * PHOTO).map(|k| unit(true, k % PHOTO)));
        let units = units.chain(vec![1.0; of_commons]).collect();
        Scene { space, poses, unknowns, units, commons, rig }
    };
    let geographic = [[0.3, 0.7, 1.5], [0.31, 0.69, 2.0]];
    [
        scene(ObjectSpace::Rectangular, to_photo, PLACES, false, false),
        scene(ObjectSpace::Rectangular, PoseNumbers::Vectors, PLACES, true, false),
        scene(ObjectSpace::Geographic(ellipsoid), to_photo, geographic, false, false),
        scene(ObjectSpace::Geographic(ellipsoid), to_ground, geographic, false, false),
        scene(ObjectSpace::Rectangular, PoseNumbers::Vectors, PLACES, true, true),
        scene(ObjectSpace::Geographic(ellipsoid), to_photo, geographic, false, true),
    ]
}

impl Scene {
    /// Returns the range of parameters of a block: two points, two photos, shared parameters.
    fn of_block(&self, block: usize) -> std::ops::Range<usize> {
        let widths = [3, 3, PHOTO, PHOTO].into_iter().chain(self.commons.iter().map(width));
        let starts: Vec<usize> = std::iter::once(0)
            .chain(widths.scan(0, |sum, width| {
                *sum += width;
                Some(*sum)
            }))
            .collect();
        starts[block]..starts[block + 1]
    }

    fn in_block(&self, common: usize) -> InBlock {
        InBlock::whole(BLOCKS + common, width(&self.commons[common]))
    }

    fn orientations(&self, unknowns: &[f64]) -> ([Orientation; 2], Option<Composed>) {
        let pose = |k: usize| std::array::from_fn(|i| unknowns[6 + PHOTO * k + i]);
        let [first, second] = [0, 1].map(|k| Orientation::new(self.poses, self.space, &pose(k)));
        let mounts = mounted(OnFrame { photo: 3, frame: 2, sensor: SENSORS[0] }.into(), BLOCKS);
        let states = self.states(unknowns);
        let common =
            |common: usize| (std::borrow::Cow::Borrowed(&states[common]), Some(self.in_block(common)));
        let pose_inputs =
            PoseInputs { space: self.space, mounts: &mounts, photo: &|_| first, common: &common };
        let mounted = pose_inputs.composed(3, AT_PHOTO).filter(|_| self.rig);
        ([first, mounted.as_ref().map_or(second, |own| own.orientation)], mounted)
    }

    fn states(&self, unknowns: &[f64]) -> Vec<CommonState> {
        let state = |(k, common): (usize, &CartesianCommon)| common.at(&unknowns[self.of_block(BLOCKS + k)]);
        self.commons.iter().enumerate().map(state).collect()
    }

    /// Returns constants and coefficients of an observation at given values of all parameters.
    fn equations(&self, observation: &Observation, unknowns: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let ((orientations, mounted), states) = (self.orientations(unknowns), self.states(unknowns));
        let (rows, width) = (observation.rows(), unknowns.len());
        let active = AssembledObservation {
            index: 0,
            touches: observation.touches(),
            blocks: (0..BLOCKS + self.commons.len()).collect(),
            root: Precision::Deviations(vec![1.0; rows]).root(rows).unwrap(),
            observation: observation.clone(),
        };
        let point = |i: usize| {
            let coordinates = std::array::from_fn(|k| unknowns[3 * i + k]);
            PointSite { point: Point::new(self.space, coordinates), coordinates, block: i }
        };
        let photo = |i: usize| {
            let made_of = mounted.as_ref().filter(|_| i == 1);
            PhotoSite { orientation: &orientations[i], block: 2 + i, made_of }
        };
        let model = ModelValues {
            space: self.space,
            origin: [0.0; 3],
            point: &point,
            photo: &photo,
            common: &|i| CommonSite { state: &states[i], place: Some(self.in_block(i)) },
            moving: &|_| None,
            width: &|block| self.of_block(block).len(),
        };
        let (mut constant, mut coefficients) = (vec![0.0; rows], vec![f64::NAN; rows * width]);
        active.write(&model, &mut constant, &mut coefficients);
        (constant, coefficients.chunks_exact(width).map(<[f64]>::to_vec).collect())
    }
}

/// Asserts that partials agree with central differences of fourth order.
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

/// Returns true if an observation is invariant to shifts and rotations.
fn stays(observation: &Observation) -> bool {
    let scene = &scenes()[0];
    let turn = rotation([0.2, -0.4, 0.3]);
    let numbers =
        crate::geometry::AttitudeNumbers::OmegaPhiKappa(crate::geometry::RotationSense::GroundToPhoto);
    let mut moved = scene.unknowns.clone();
    for place in [0, 3, 6, 6 + PHOTO] {
        let [x, y, z] = std::array::from_fn(|k| scene.unknowns[place + k]);
        let place_moved = turn * crate::geometry::Vector3::new(x, y, z);
        (0..3).for_each(|k| moved[place + k] = place_moved[k] + 5.0);
    }
    for (photo, orientation) in scene.orientations(&scene.unknowns).0.iter().enumerate() {
        let angles = numbers.numbers(&(turn * orientation.pose().attitude));
        moved[6 + PHOTO * photo + 3..][..3].copy_from_slice(&angles);
    }
    let [before, after] = [&scene.unknowns, &moved].map(|values| scene.equations(observation, values).0);
    before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-12)
}

/// Returns observations of nearly all types, of fixed quantities and of shared parameters.
fn of_kinds() -> Vec<Observation> {
    let equal_precision = |sd: f64, count: usize| Precision::Deviations(vec![sd; count]);
    let two = Precision::Deviations(vec![0.01, 0.02]);
    let [attitude, boresight] = [[0.3, -0.2, 0.9], [0.02, 0.5, -0.1]].map(rotation);
    let of_attitude =
        |boresight| Attitude { photo: 0, attitude, boresight, precision: equal_precision(1e-4, 3) }.into();
    let known = Position::new(1, PLACES[0], Vector3::new(0.3, -1.2, 0.8), equal_precision(0.01, 3));
    let (shift, drift, time) = (Some(SHIFT), Some(DRIFT), -7.5);
    let in_common = Position { lever_arm: Quantity::Common(LEVER_ARM), shift, drift, time, ..known.clone() };
    let coefficients = vec![LEVER_ARM, SHIFT, DRIFT];
    let (factors, observed) = (vec![1.0, -2.0, 1.0], [0.1, 0.0, -0.2]);
    vec![
        Control { point: 1, coordinates: PLACES[0], precision: equal_precision(0.01, 3) }.into(),
        distance(None),
        distance(Some(INSTRUMENT)),
        Difference { points: [1, 0], components: [Some(1.0), None, Some(-2.0)], precision: two.clone() }
            .into(),
        OnLevel { point: 1, level: LEVEL, difference: 0.2, sd: 0.01 }.into(),
        OnPlane { point: 1, plane: PLANE, distance: 0.1, sd: 0.01 }.into(),
        OnPlumbLine { point: 1, line: PLUMB_LINE, precision: two.clone() }.into(),
        OnLine { point: 1, line: LINE, precision: two }.into(),
        range(None),
        range(Some(INSTRUMENT)),
        known.clone().into(),
        Position { shift, ..known }.into(),
        in_common.into(),
        of_attitude(Quantity::Known(boresight)),
        of_attitude(Quantity::Common(BORESIGHT)),
        relative(),
        base(None),
        base(Some(SENSORS[0])),
        prior(vec![SENSORS[0]], vec![6]),
        prior(vec![PLANE], vec![3]),
        prior(vec![PLANE, SENSORS[0]], vec![3, 6]),
        Smoothness { coefficients, factors, observed, precision: equal_precision(0.01, 3) }.into(),
        fiducial(None, true),
        fiducial(Some(Pattern::Quadratic { half: 3.0 }), false),
        film(None, vec![3, 4, 5]),
        film(Some(of_kind(CommonKind::Roll)), vec![0, 2, 3, 5]),
    ]
}

fn distance(instrument: Option<usize>) -> Observation {
    super::Distance { points: [1, 0], length: 4.0, sd: 0.01, instrument }.into()
}

fn range(instrument: Option<usize>) -> Observation {
    let lever_arm = Vector3::new(0.3, -1.2, 0.8);
    super::Range { photo: 1, point: 0, length: 4.0, sd: 0.01, lever_arm, instrument }.into()
}

fn relative() -> Observation {
    let pose = Pose { position: Vector3::new(2.0, -1.0, 0.4), attitude: rotation([0.4, -0.2, 1.1]) };
    super::Relative { photos: [1, 0], pose, precision: Precision::Deviations(vec![0.01; 6]) }.into()
}

fn base(first: Option<usize>) -> Observation {
    super::Base { first, second: SENSORS[1], length: 0.5, sd: 0.01 }.into()
}

fn prior(commons: Vec<usize>, components: Vec<usize>) -> Observation {
    let count = components.iter().sum();
    let (precision, observed) = (Precision::Deviations(vec![0.01; count]), vec![0.5; count]);
    super::Prior { commons, components, observed, precision }.into()
}

fn fiducial(pattern: Option<Pattern>, projective: bool) -> Observation {
    let film = FilmOf {
        placement: of_kind(CommonKind::FilmPlacement),
        size: of_kind(CommonKind::FilmSize),
        bend: (!projective).then(|| of_kind(CommonKind::FilmBend)),
        projective,
        roll: projective.then(|| of_kind(CommonKind::Roll)),
        scanner: of_kind(CommonKind::Scanner),
        curves: vec![],
        readings: Readings { pitch: 0.5, origin: [3.0, 4.0], down: projective, half_range: [9.0; 2] },
        weights: pattern.map_or(vec![], |_| vec![of_kind(CommonKind::Pattern)]),
        pattern,
        mirrored: projective,
    };
    let (mark, precision) = (of_kind(CommonKind::Fiducial), Precision::Deviations(vec![0.1; 2]));
    super::Fiducial { mark, near: [0.4, 0.2], film, reading: [3.2, 4.1], precision }.into()
}

fn film(roll: Option<usize>, components: Vec<usize>) -> Observation {
    let (placement, size) = (of_kind(CommonKind::FilmPlacement), of_kind(CommonKind::FilmSize));
    let count = components.len();
    let (observed, precision) = (vec![0.1; count], Precision::Deviations(vec![0.01; count]));
    super::Film { placement, size, roll, components, observed, precision }.into()
}

#[test]
fn partials_of_kinds_agree_with_differences() {
    of_kinds().iter().for_each(agrees);
}

#[test]
fn what_is_between_places_moves_with_the_network() {
    assert!([distance(None), range(None), relative()].iter().all(stays));
}

#[test]
fn what_contradicts_itself_is_refused() {
    let distance = |points, sd| {
        Observation::from(super::Distance { points, length: 1.0, sd, instrument: None })
            .check(3, 2, &[])
            .err()
    };
    assert_eq!(distance([0, 2], 0.1), None);
    assert_eq!(distance([0, 3], 0.1), Some(Fault::NoPoint(3)));
    assert_eq!(distance([1, 1], 0.1), Some(Fault::Twice));
    for sd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(distance([0, 1], sd), Some(Fault::Deviation));
    }
    let control = |precision| {
        Observation::from(super::Control { point: 0, coordinates: [0.0; 3], precision })
            .check(1, 0, &[])
            .err()
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
        let attitude = super::Attitude {
            photo: 1,
            attitude: matrix,
            boresight: Quantity::Known(Matrix3::identity()),
            precision,
        };
        Observation::from(attitude).check(0, 2, &[]).err()
    };
    assert_eq!(attitude(Matrix3::identity()), None);
    assert_eq!(attitude(-Matrix3::identity()), Some(Fault::Rotation));
}

#[test]
fn common_unknowns_of_other_types_are_refused() {
    let common = |kind: CommonKind| Common::vector(kind, [0.0; 3], &vec![1.0; kind.unknowns().len()]);
    let commons = [common(CommonKind::Level), common(CommonKind::Plane)];
    let level = |level| super::OnLevel { point: 0, level, difference: 0.0, sd: 1.0 };
    let check = |own: Observation| own.check(1, 0, &commons).err();
    assert_eq!(check(level(0).into()), None);
    assert_eq!(check(level(1).into()), Some(Fault::OtherCommon { common: 1, needed: CommonKind::Level }));
    assert_eq!(check(level(2).into()), Some(Fault::NoCommon(2)));
    let prior = |components: usize| {
        let precision = Precision::Deviations(vec![1.0; components]);
        let (commons, components) = (vec![1], vec![components]);
        check(super::Prior { commons, components, observed: vec![], precision }.into())
    };
    assert_eq!(prior(3), None);
    assert_eq!(prior(1), Some(Fault::Deviations { components: 3, given: 1 }));
}
