//! Absolute orientation: recovery at any attitude, statistics, errors, interruption.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::ops::ControlFlow;

use photocore::adjustment::Status;
use photocore::geometry::{Vector3, rotation};
use photocore::{Context, Threads};
use photogram_programs::similarity::{
    Cause, Method, Options, Parameters, SimilarityError, Solution, Start, Started, Station, gauss_crout,
    orient_on,
};
use proptest::prelude::*;

const NAN: f64 = f64::NAN;
const PLAIN: Options = Options {
    method: Method::Rigorous,
    start: Start::Auto,
    max_iterations: 50,
    tolerance: 1e-5,
    trace: false,
    scale: None,
};

fn run(stations: &[Station], options: &Options) -> Result<Solution, SimilarityError> {
    let threads = Threads::new(1).unwrap();
    orient_on(stations, options, &mut Context::new(&threads))
}

/// Positions in the unit square with some relief; the first two are far from each other.
const PLACES: [[f64; 3]; 8] = [
    [-0.5, -0.4, 0.02],
    [0.5, 0.45, -0.06],
    [-0.45, 0.4, 0.1],
    [0.4, -0.5, -0.1],
    [0.05, 0.1, 0.03],
    [-0.1, -0.45, 0.07],
    [0.48, 0.02, 0.05],
    [-0.02, 0.5, -0.04],
];

/// Returns stations of an error-free similarity; `known` selects the known coordinates of each.
fn stations(truth: &Parameters, known: impl Fn(usize) -> [bool; 3]) -> Vec<Station> {
    let model = |x: &[f64; 3]| truth.scale * (truth.rotation * Vector3::from(*x)) + truth.translation;
    let station = |(i, place): (usize, &[f64; 3])| {
        let part = known(i);
        Station {
            control: Vector3::from_fn(|k, _| if part[k] { place[k] } else { NAN }),
            control_sd: [0.0; 3],
            model: model(place),
            model_sd: [1.0; 3],
        }
    };
    PLACES.iter().enumerate().map(station).collect()
}

fn mixed(i: usize) -> [bool; 3] {
    [[true; 3], [true, true, false], [false, false, true], [true; 3]][i % 4]
}

fn truth(angles: [f64; 3], scale: f64) -> Parameters {
    Parameters { rotation: rotation(angles), scale, translation: scale * Vector3::new(3.0, -2.0, 0.7) }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    /// Angles are uniform, so that phi approaches and exceeds 90 degrees.
    #[test]
    fn any_attitude_is_recovered(
        angles in prop::array::uniform3(-3.2..3.2),
        power in -4.0..4.0,
        full in any::<bool>(),
    ) {
        let truth = truth(angles, 10f64.powf(power));
        let solution = run(&stations(&truth, |i| if full { [true; 3] } else { mixed(i) }), &PLAIN).unwrap();
        prop_assert_eq!(solution.status, Status::Converged);
        prop_assert!(solution.alternatives.is_empty());
        let found = solution.similarity.parameters();
        prop_assert!((found.scale / truth.scale - 1.0).abs() < 1e-10);
        for i in 0..3 {
            prop_assert!((found.translation[i] - truth.translation[i]).abs() < 1e-9 * truth.scale);
            for j in 0..3 {
                prop_assert!((found.rotation[(i, j)] - truth.rotation[(i, j)]).abs() < 1e-10);
            }
        }
    }
}

#[test]
fn redundancy_numbers_sum_to_the_degrees_of_freedom() {
    let given = stations(&truth([0.1, -0.2, 2.0], 0.3), mixed);
    let known: usize = given.iter().map(|s| s.known().iter().filter(|known| **known).count()).sum();
    let solution = run(&given, &PLAIN).unwrap();
    let all = solution.stations.iter().flat_map(|station| station.redundancy);
    let sum: f64 = all.filter(|r| r.is_finite()).sum();
    assert!((sum - (known as f64 - 7.0)).abs() < 1e-9, "{sum}");
    assert_eq!(solution.started, Started::Report);
}

#[test]
fn the_cycles_of_the_report_end_where_the_engine_does() {
    let mut given = stations(&truth([0.05, -0.08, -1.9], 0.3), mixed);
    for (i, station) in given.iter_mut().enumerate() {
        (0..3).for_each(|k| station.model[k] += 1e-5 * (3.1 * (3 * i + k) as f64).sin());
    }
    let strict = run(&given, &PLAIN).unwrap();
    let report = run(&given, &Options { method: Method::Report, start: Start::Report, ..PLAIN }).unwrap();
    assert!(strict.cycles.is_none());
    assert!(report.cycles.unwrap().len() <= 5);
    for (a, b) in strict.similarity.rotation.iter().zip(report.similarity.rotation.iter()) {
        assert!((a - b).abs() < 1e-9);
    }
    for (a, b) in strict.tangent_cofactors.iter().flatten().zip(report.tangent_cofactors.iter().flatten()) {
        assert!((a - b).abs() < 1e-6 * strict.tangent_cofactors[6][6]);
    }
}

#[test]
fn control_that_does_not_determine_is_refused() {
    let truth = truth([0.0, 0.0, 0.3], 1.0);
    let few = run(&stations(&truth, |i| if i < 2 { [true; 3] } else { [false; 3] }), &PLAIN);
    assert_eq!(few.unwrap_err(), SimilarityError::Insufficient { known: [2, 2, 2] });
    let mut line = stations(&truth, |_| [true; 3]);
    for (i, station) in line.iter_mut().enumerate() {
        let along = i as f64 - 3.0;
        let at = Vector3::new(along, 2.0 * along, 0.1 * along);
        (station.control, station.model) = (at, at);
    }
    let Err(SimilarityError::Undetermined { cause, stations }) = run(&line, &PLAIN) else { panic!() };
    assert_eq!((cause, stations.len()), (Cause::StationsInLine, 8));
}

#[test]
fn the_start_of_the_report_needs_two_horizontal_stations() {
    let truth = truth([0.0, 0.0, 0.3], 1.0);
    let given = stations(&truth, |i| if i == 1 { [false, false, true] } else { [true; 3] });
    let refused = run(&given, &Options { start: Start::Report, ..PLAIN });
    assert!(matches!(refused, Err(SimilarityError::FirstStations(_))));
    assert_eq!(run(&given, &PLAIN).unwrap().started, Started::ClosedForm);
}

#[test]
fn an_interruption_stops_it() {
    let given = stations(&truth([0.0, 0.0, 0.3], 1.0), mixed);
    let (threads, mut stop) = (Threads::new(1).unwrap(), |_| ControlFlow::Break(()));
    let stopped = orient_on(&given, &PLAIN, &mut Context::with_progress(&threads, &mut stop));
    assert_eq!(stopped.unwrap_err(), SimilarityError::Stopped(photocore::Stopped::Interrupted));
}

#[test]
fn gauss_crout_solves_and_refuses_singular_equations() {
    let mut normal = [[0.0; 8]; 7];
    for i in 0..7 {
        for j in 0..7 {
            normal[i][j] = if i == j { 9.0 } else { 1.0 / (1 + i + j) as f64 };
        }
        normal[i][7] = (0..7).map(|j| normal[i][j] * (j as f64 - 2.5)).sum();
    }
    let (_, e) = gauss_crout(&normal).unwrap();
    (0..7).for_each(|j| assert!((e[j] - (j as f64 - 2.5)).abs() < 1e-12));
    normal[4] = normal[3];
    (0..7).for_each(|i| normal[i][4] = normal[i][3]);
    assert!(gauss_crout(&normal).is_none());
}
