//! Computations use the given thread pool: the global pool of the process is never started.

#![allow(clippy::unwrap_used, clippy::expect_used)]

use photocore::geometry::{self, ObjectSpace, Perspective, PoseNumbers, RotationSense, Vector3};
use photocore::network::{Camera, Image, Network, Of, Options, Photo, Point};
use photocore::{Context, Threads};
use photogram_programs::comparator::{
    Basis, Calibration as Comparison, Case, Comparator, GridPoint, Measurement, Placement,
};
use photogram_programs::resection::{ControlPoint, Known, Partials, Resection};
use photogram_programs::similarity::{self, Station};
use photogram_programs::sky::{self, Air, Station as Site};
use photogram_programs::stellar::{self, COMMON, Decentering, Form, Kind, Star, Tolerances, Weights};

const SPACE: ObjectSpace = ObjectSpace::Rectangular;
const SENSE: RotationSense = RotationSense::GroundToPhoto;
/// Number larger than all thresholds for parallel execution.
const MANY: usize = 10_500;
const FREE: f64 = f64::INFINITY;

/// Returns deterministic numbers in [-1, 1).
fn noise(index: usize) -> f64 {
    2.0 * ((index as f64 + 1.0) * 0.618_033_988_749_895).fract() - 1.0
}

/// Returns a position in a grid of a hundred columns, relative to its corner.
fn grid(index: usize) -> [f64; 2] {
    [(index % 100) as f64, (index / 100) as f64]
}

/// Returns strips of 26 photos with observed positions, and two points close to a station.
fn block(strips: usize, points: usize) -> Network {
    let station = |i: usize| [300.0 * (i % 26) as f64, 300.0 * (i / 26) as f64, 1500.0];
    let mut places: Vec<[f64; 3]> =
        (0..points).map(|i| [78.0 * grid(i)[0], 57.0 * grid(i)[1], 20.0 * noise(i)]).collect();
    places.extend([[310.0, 5.0, 1490.0], [297.0, 2.0, 1496.0]]);
    let mut images = vec![];
    for photo in 0..26 * strips {
        let seen = geometry::View::new(SPACE, SENSE, station(photo), [0.0, 0.0, 0.1], -150.0);
        for (point, &place) in places.iter().enumerate() {
            let [x, y] = seen.project(&geometry::Point::new(SPACE, place));
            let xy = [x + 0.005 * noise(2 * images.len()), y + 0.005 * noise(2 * images.len() + 1)];
            if x.abs().max(y.abs()) < 40.0 || point >= points && photo < 3 {
                images.push(Image { photo, point, xy, sd: [0.005; 2] });
            }
        }
    }
    let photo = |i: usize| {
        let [x, y, z] = station(i);
        let pose = [x + 0.05, y - 0.05, z + 0.05, 1e-4, -1e-4, 0.1001];
        Photo { pose, observed: pose, sd: [0.1, 0.1, 0.1, FREE, FREE, FREE], camera: 0 }
    };
    Network {
        space: SPACE,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(Perspective { principal_distance: -150.0 }.into())],
        photos: (0..26 * strips).map(photo).collect(),
        points: places.iter().map(|&coordinates| Point { coordinates, sd: [FREE; 3] }).collect(),
        images,
        observations: vec![],
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

fn adjust_block(network: &Network, threads: &Threads) {
    let options = Options::default();
    let solution = network.adjustment(&options).kept(&[0, 1]).run_in(&mut Context::new(threads)).unwrap();
    let covariances =
        network.covariances(&options, &solution.state, None, &mut Context::new(threads)).unwrap();
    covariances.cofactors(&[Of::Point(0), Of::Photo(0)], None, &mut Context::new(threads)).unwrap();
    network.adjustment(&options).from_state(&solution.state).run_in(&mut Context::new(threads)).unwrap();
    let mut trial = solution.converged.expect("it converges").trial(network);
    trial.linearize(&mut Context::new(threads)).unwrap();
    trial.tests(true, threads).unwrap();
    trial.effects(&[0, 5], threads).unwrap();
    trial.responses(&[0, 5], threads).unwrap();
}

fn resect(threads: &Threads) {
    let photo = geometry::View::new(SPACE, SENSE, [420.0, 310.0, 900.0], [0.05, -0.08, 2.1], -150.0);
    let control = |i: usize| {
        let coordinates = [8.0 * grid(i)[0], 6.0 * grid(i)[1], 50.0 * noise(i)];
        let xy = photo.project(&geometry::Point::new(SPACE, coordinates));
        ControlPoint { coordinates, sd: [0.0; 3], xy, xy_sd: [0.005; 2] }
    };
    let unknown = Known { value: [f64::NAN; 3], sd: [FREE; 3] };
    let resection = Resection {
        space: SPACE,
        sense: SENSE,
        principal_distance: -150.0,
        points: (0..MANY).map(control).collect(),
        position: unknown,
        attitude: unknown,
        start: None,
        partials: Partials::AtComputed,
    };
    resection.adjust_on(&Default::default(), &mut Context::new(threads)).unwrap();
}

fn orient(threads: &Threads) {
    let station = |i: usize| {
        let control = Vector3::new(grid(i)[0], grid(i)[1], noise(i));
        let model = 0.5 * control + Vector3::new(1.0 + 1e-3 * noise(7 * i), 2.0, 3.0);
        Station { control, control_sd: [0.0; 3], model, model_sd: [1.0; 3] }
    };
    let stations: Vec<Station> = (0..MANY).map(station).collect();
    let options = similarity::Options {
        method: similarity::Method::Rigorous,
        start: similarity::Start::Auto,
        max_iterations: 50,
        tolerance: 1e-5,
        trace: false,
        scale: None,
    };
    similarity::orient_on(&stations, &options, &mut Context::new(threads)).unwrap();
}

fn calibrate_comparator(threads: &Threads) {
    let basis = Basis { degree: 4, centre: [125e3, 130e3], half_range: [120e3, 110e3] };
    let coefficients = [vec![0.0; 6], vec![0.0; 6]];
    let comparator = Comparator { scale: [1.0; 2], nonorthogonality: 0.0, basis, coefficients };
    let xy = |i: usize| [2e3 * grid(i)[0] - 1e5, 2e3 * grid(i)[1] - 1e5];
    let quarter = std::f64::consts::FRAC_PI_2;
    let placement =
        |k: usize| Placement { rotation: 0.2 + quarter * k as f64, translation: [300.0 * k as f64, 100.0] };
    let measurement = |i: usize| {
        let (case, point) = (i % 4, i / 4);
        let [x, y] = comparator.measure(xy(point), &placement(case)).xy;
        Measurement { case, point, xy: [x + noise(2 * i), y + noise(2 * i + 1)], sd: [1.0; 2] }
    };
    let calibration = Comparison {
        coefficient_sd: [vec![FREE; 6], vec![FREE; 6]],
        cases: (0..4).map(|k| Case { placement: placement(k), left_handed: false }).collect(),
        points: (0..MANY).map(|i| GridPoint { xy: xy(i), sd: [0.25; 2] }).collect(),
        measurements: (0..4 * MANY).map(measurement).collect(),
        comparator: comparator.clone(),
    };
    calibration.adjust_on(&Default::default(), &mut Context::new(threads)).unwrap();
}

fn calibrate_on_stars(threads: &Threads) {
    let kind =
        Kind { lens: None, form: Form::ScaleFirst, decentering: Decentering::Polar, common_scale: false };
    let mut common = [0.0; COMMON];
    common[3..5].copy_from_slice(&[0.3, 0.3]);
    common[13..].copy_from_slice(&sky::REFRACTION);
    let image = |i: usize| stellar::Image {
        star: i,
        pointing: 0,
        xy: [1e-3 * grid(i)[0] - 0.05, 1e-3 * grid(i)[1] - 0.05],
        weight: [[1e10, 0.0], [0.0, 1e10]],
        sidereal_time: 1.2,
        shift: [0.0; 2],
    };
    let nowhere = Star { place: [1.1, 0.75], catalogue: [1.1, 0.75], weight: None, fixed: true };
    let mut fixed = vec![true; 3 + COMMON];
    fixed[..3].fill(false);
    let mut calibration = stellar::Calibration {
        station: Site::new(0.6, 0.0, Air::new(290.0, 750.0)),
        kind,
        pointings: vec![[0.19, -0.14, 0.6]],
        common,
        fixed,
        weights: Weights { parameters: vec![], values: vec![], root: vec![] },
        stars: vec![nowhere; MANY],
        images: (0..MANY).map(image).collect(),
        axis: None,
    };
    let directions = calibration.directions().unwrap();
    for (star, &place) in calibration.stars.iter_mut().zip(&directions) {
        (star.place, star.catalogue) = (place, place);
    }
    calibration.pointings[0][0] += 1e-4;
    let options = stellar::Options { adjustment: Default::default(), unit: 1.0, whole: true };
    calibration.adjust_on(&options, &mut Context::new(threads)).unwrap();
    calibration.without_effect(threads).unwrap();
    calibration.correction(&Tolerances { refraction: 1e-9, distortion: 1e-9, passes: 20 }, threads).unwrap();
}

#[test]
fn no_thread_is_started_beside_those_of_the_pools() {
    let threads = Threads::new(2).unwrap();
    adjust_block(&block(2, 400), &threads);
    adjust_block(&block(20, MANY), &threads);
    resect(&threads);
    orient(&threads);
    calibrate_comparator(&threads);
    calibrate_on_stars(&threads);
    assert!(
        rayon::ThreadPoolBuilder::new().num_threads(1).build_global().is_ok(),
        "rayon's own threads has started"
    );
}
