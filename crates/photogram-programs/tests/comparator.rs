//! Readings of a comparator against complex-step derivatives, and calibrations of simulated measurements.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use num_complex::Complex64 as C;
use photocore::adjustment::{Method, Options, Status, Stop};
use photocore::{Context, Threads};
use photogram_programs::comparator::{
    Basis, Calibration, CalibrationError, Case, Comparator, GridPoint, Measurement, Placement, Solution,
};
use proptest::prelude::*;

const BASIS: Basis = Basis { degree: 4, centre: [125e3, 130e3], half_range: [120e3, 110e3] };
const OPTIONS: Options = Options {
    method: Method::Damped(Stop::Fraction(1e-8)),
    max_iterations: 30,
    covariance: true,
    loss: None,
    threads: 0,
};

fn comparator() -> Comparator {
    Comparator {
        scale: [1.0 - 5e-6, 1.0 + 22e-6],
        nonorthogonality: 5e-5,
        basis: BASIS,
        coefficients: [vec![2.0, -0.6, -1.5, 0.8, 1.2, -0.9], vec![-0.8, -0.9, 0.7, 1.1, -0.3, -1.0]],
    }
}

/// Independent implementation of equations 34, 36 and 63 for complex arguments; the inverse correction is a fixed-point iteration. Unknowns
/// are point, rotation, translation, scales, nonorthogonality and coefficients.
fn measure(unknowns: &[C]) -> [C; 2] {
    let [x, y, theta, tx, ty, sx, sy, alpha] = *unknowns.first_chunk().unwrap();
    let coefficients = [&unknowns[8..14], &unknowns[14..]];
    let (dx, dy) = (x - tx, y - ty);
    let corrected =
        [theta.cos() * dx - theta.sin() * dy + 125e3, theta.sin() * dx + theta.cos() * dy + 130e3];
    let mut place = corrected;
    for _ in 0..60 {
        let u = (place[0] - BASIS.centre[0]) / BASIS.half_range[0];
        let v = (place[1] - BASIS.centre[1]) / BASIS.half_range[1];
        let functions = [u.powi(4), v.powi(4), u.powi(3), v.powi(3), u * u, v * v];
        place = std::array::from_fn(|axis| {
            corrected[axis] - functions.iter().zip(coefficients[axis]).map(|(f, c)| f * c).sum::<C>()
        });
    }
    let y = place[1] / (sy * alpha.cos());
    [(place[0] - sy * alpha.sin() * y) / sx, y]
}

proptest! {
    #[test]
    fn partials_agree_with_complex_steps(
        x in -1e5..1e5, y in -1e5..1e5, theta in -3.2..3.2, size in prop::sample::select(vec![1.0, 300.0]),
        lean in -0.2..0.2,
    ) {
        let mut comparator = comparator();
        comparator.nonorthogonality = lean;
        comparator.coefficients.iter_mut().flatten().for_each(|value| *value *= size);
        let placement = Placement { rotation: theta, translation: [40.0, -25.0] };
        let measured = comparator.measure([x, y], &placement);
        let unknowns: Vec<C> =
            [&[x, y, theta, 40.0, -25.0][..], &comparator.unknowns()].concat().iter().map(|&v| v.into()).collect();
        for (row, value) in measure(&unknowns).iter().enumerate() {
            prop_assert!((measured.xy[row] - value.re).abs() < 1e-9);
        }
        for unknown in 0..unknowns.len() {
            let mut stepped = unknowns.clone();
            stepped[unknown].im = 1e-30;
            let derivative = measure(&stepped).map(|value| value.im / 1e-30);
            for row in 0..2 {
                let partial = match unknown {
                    0..2 => measured.point[row][unknown],
                    2..5 => measured.case[row][unknown - 2],
                    _ => measured.comparator[row][unknown - 5],
                };
                let size = derivative[0].abs().max(derivative[1].abs());
                prop_assert!((partial - derivative[row]).abs() < 1e-10 * size, "{unknown} {row}: {partial} {derivative:?}");
            }
        }
    }
}

/// Returns four placements of a plate of 25 points, measured without errors.
fn calibration(left_handed: bool) -> Calibration {
    let truth = comparator();
    let xy = |i: usize| [5e4 * (i % 5) as f64 - 1e5, 5e4 * (i / 5) as f64 - 1e5];
    let placement = |k: usize| Placement {
        rotation: 0.2 + std::f64::consts::FRAC_PI_2 * k as f64,
        translation: [300.0 * k as f64, 100.0],
    };
    let reading = |case: usize, point: usize| {
        let [x, y] = xy(point);
        truth.measure(if left_handed { [y, x] } else { [x, y] }, &placement(case)).xy
    };
    let start = |k: usize| {
        let Placement { rotation, translation: [x, y] } = placement(k);
        Placement { rotation: rotation + 1e-3, translation: [x - 20.0, y + 30.0] }
    };
    let all = (0..4).flat_map(|case| (0..25).map(move |point| (case, point)));
    Calibration {
        comparator: Comparator {
            scale: [1.0; 2],
            nonorthogonality: 0.0,
            basis: BASIS,
            coefficients: [vec![0.0; 6], vec![0.0; 6]],
        },
        coefficient_sd: [vec![f64::INFINITY; 6], vec![f64::INFINITY; 6]],
        cases: (0..4).map(|k| Case { placement: start(k), left_handed }).collect(),
        points: (0..25).map(|i| GridPoint { xy: xy(i), sd: [0.25; 2] }).collect(),
        measurements: all
            .map(|(case, point)| Measurement { case, point, xy: reading(case, point), sd: [1.0; 2] })
            .collect(),
    }
}

fn adjust(calibration: &Calibration) -> Result<Solution, CalibrationError> {
    let threads = Threads::new(1).unwrap();
    calibration.adjust_on(&OPTIONS, &mut Context::new(&threads))
}

#[test]
fn a_calibration_without_errors_returns_the_truth() {
    for left_handed in [false, true] {
        let solution = adjust(&calibration(left_handed)).unwrap();
        assert_eq!(solution.adjustment.status, Status::Converged);
        let truth = comparator().unknowns();
        for (i, (found, true_value)) in solution.comparator.iter().zip(&truth).enumerate() {
            let tolerance = if i < 3 { 1e-12 } else { 1e-7 };
            assert!((found - true_value).abs() < tolerance, "{i}: {found} for {true_value}");
        }
        assert!(solution.residuals.as_flattened().iter().all(|v| v.abs() < 1e-7));
    }
}

#[test]
fn redundancy_sums_to_the_degrees_of_freedom() {
    let solution = adjust(&calibration(false)).unwrap();
    assert_eq!(solution.degrees_of_freedom, 200 + 50 - (50 + 12 + 15));
    let all = [solution.redundancy, solution.point_redundancy].concat();
    let sum: f64 = all.as_flattened().iter().sum();
    assert!((sum - solution.degrees_of_freedom as f64).abs() < 1e-6, "{sum}");
}

#[test]
fn coefficients_may_be_fixed_one_by_one() {
    let mut calibration = calibration(false);
    for axis in 0..2 {
        calibration.comparator.coefficients[axis][2] = comparator().coefficients[axis][2];
        calibration.coefficient_sd[axis][2] = 0.0;
    }
    let solution = adjust(&calibration).unwrap();
    assert_eq!(solution.comparator[5], comparator().coefficients[0][2]);
    assert_eq!(solution.comparator_cofactors[5 * 16], 0.0);
    assert!((solution.comparator[3] - comparator().coefficients[0][0]).abs() < 1e-7);
}

#[test]
fn what_is_not_determined_is_named() {
    let mut free = calibration(false);
    free.points.iter_mut().for_each(|point| point.sd = [f64::INFINITY; 2]);
    let Err(CalibrationError::Undetermined(combinations)) = adjust(&free) else {
        panic!("a datum out of nothing")
    };
    assert!(combinations.iter().any(|(_, comparator)| *comparator));
    let mut lost = calibration(false);
    lost.points.push(GridPoint { xy: [0.0; 2], sd: [f64::INFINITY; 2] });
    assert!(matches!(adjust(&lost), Err(CalibrationError::UndeterminedPoints(points)) if points == [25]));
}

#[test]
fn contradictions_are_errors() {
    let mut outside = calibration(false);
    outside.measurements[7].case = 4;
    assert_eq!(adjust(&outside).unwrap_err(), CalibrationError::Index(7));
    let mut short = calibration(false);
    short.coefficient_sd[1].pop();
    assert_eq!(adjust(&short).unwrap_err(), CalibrationError::Coefficients { expected: 6, found: 5 });
    let mut nowhere = calibration(false);
    nowhere.measurements[0].xy[0] = f64::NAN;
    assert_eq!(adjust(&nowhere).unwrap_err(), CalibrationError::NotFinite);
}
