//! Tests of trajectories: time and coefficient derivatives against differences, splines against polynomials, slerp against one rotation.

#![allow(clippy::unwrap_used)]

use super::{
    Active, Attitudes, Axes, Basis, BasisModel, Flight, Interpolation, Polynomial, Positions, Rotations,
    Spline, Trajectory,
};
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::{Matrix3, Vector3, angle_axis_rotation, rotation};

/// Derivative by Richardson's scheme with steps of 0.001 and 0.002.
fn slope(at: impl Fn(f64) -> Vector3) -> Vector3 {
    let h = 1e-3;
    (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
}

fn positions(interpolation: Interpolation) -> Positions {
    let times: Vec<f64> = (0..12).map(f64::from).collect();
    let place = |&t: &f64| Vector3::new(70.0 * t, (0.4 * t).sin(), 800.0 + t * t);
    let speed = |&t: &f64| Vector3::new(70.0, 0.4 * (0.4 * t).cos(), 2.0 * t);
    let velocities =
        if interpolation == Interpolation::Hermite { times.iter().map(speed).collect() } else { vec![] };
    Positions::new(times.clone(), times.iter().map(place).collect(), velocities, interpolation).unwrap()
}

fn attitudes(interpolation: Interpolation) -> Attitudes {
    let times: Vec<f64> = (0..9).map(|k| -0.3 + 1.7 * f64::from(k)).collect();
    let turned = |&t: &f64| rotation([0.2 * (0.7 * t).sin(), -0.1 + 0.05 * t, 0.3 * t]);
    Attitudes::new(times.clone(), times.iter().map(turned).collect(), interpolation).unwrap()
}

fn coefficient(scale: f64) -> impl Fn(usize) -> Vector3 {
    move |k| scale * Vector3::new((k as f64).cos(), (2.0 * k as f64 + 1.0).sin(), (0.3 + k as f64).sin())
}

fn all() -> Vec<Trajectory> {
    let polynomial = |degree| Basis::Polynomial(Polynomial { degree, reference: 4.0, scale: 3.0 });
    let spline = |degree, from: f64, every: f64| {
        Basis::Spline(Spline { degree, knots: (0..20).map(|k| from + every * f64::from(k)).collect() })
    };
    let centre = Vector3::new(100.0, -40.0, -900.0);
    let body = || Some(attitudes(Interpolation::Linear));
    [
        (Interpolation::Linear, polynomial(0), Basis::None, None, Axes::Table, Rotations::Vector),
        (Interpolation::Hermite, polynomial(2), polynomial(3), None, Axes::Flight, Rotations::Zxz),
        (
            Interpolation::Lagrange,
            spline(3, -3.0, 1.1),
            spline(1, -2.0, 0.9),
            None,
            Axes::Orbit(centre),
            Rotations::Vector,
        ),
        (
            Interpolation::Hermite,
            spline(2, -3.0, 1.1),
            spline(5, -6.0, 1.0),
            body(),
            Axes::Table,
            Rotations::Vector,
        ),
        (Interpolation::Lagrange, polynomial(2), polynomial(2), body(), Axes::Orbit(centre), Rotations::Zxz),
    ]
    .map(|(interpolation, position, rotation, body, axes, rotations)| Trajectory {
        positions: positions(interpolation),
        attitudes: attitudes(interpolation),
        position,
        rotation,
        axes,
        rotations,
        body,
    })
    .into()
}

/// Times just after a record, and between records.
const TIMES: [f64; 4] = [3.003, 4.5, 5.5123, 0.25];

#[test]
fn rates_agree_with_differences() {
    for trajectory in all() {
        for time in TIMES {
            let at = |t: f64| trajectory.at(time + t, &coefficient(3.0), &coefficient(0.2)).motion;
            let found = at(0.0);
            let velocity = slope(|t| at(t).pose.position);
            assert!((found.velocity - velocity).norm() < 1e-7 * velocity.norm(), "{trajectory:?} {time}");
            let rate = slope(|t| rotation_angle_axis(&found.pose.attitude.tr_mul(&at(t).pose.attitude)));
            assert!((found.rate - rate).norm() < 1e-9 * (1.0 + rate.norm()), "{trajectory:?} {time}");
        }
    }
}

/// Asserts that partials with respect to a coefficient agree with differences.
fn agrees(partials: &Matrix3, moved: impl Fn(Vector3) -> Vector3) {
    for k in 0..3 {
        let expected = slope(|h| moved(h * Vector3::ith(k, 1.0)));
        let error = (partials.column(k) - expected).norm();
        assert!(error < 2e-9 * (1.0 + expected.norm()), "component {k}: {error:e}");
    }
}

#[test]
fn partials_by_coefficients_agree_with_differences() {
    for trajectory in all() {
        // Rotation vectors: zero, tiny and large.
        for (time, size) in TIMES.into_iter().flat_map(|time| [(time, 0.0), (time, 1e-9), (time, 0.3)]) {
            let (c, r) = (coefficient(3.0), coefficient(size));
            let plain = trajectory.at(time, &c, &r);
            let with = |n: usize, of_position: bool, step: Vector3| -> Flight {
                let add =
                    |own: Vector3, k: usize, taken: bool| if k == n && taken { own + step } else { own };
                trajectory.at(time, &|k| add(c(k), k, of_position), &|k| add(r(k), k, !of_position))
            };
            for k in trajectory.position.near(time, true) {
                agrees(&(plain.position.value(k) * plain.axes), |step| {
                    with(k, true, step).motion.pose.position
                });
                agrees(&plain.velocity_by_position(k), |step| with(k, true, step).motion.velocity);
            }
            for k in trajectory.rotation.near(time, true) {
                let attitude = plain.motion.pose.attitude;
                agrees(&(plain.rotation.value(k) * plain.jacobian), |step| {
                    rotation_angle_axis(&attitude.tr_mul(&with(k, false, step).motion.pose.attitude))
                });
                agrees(&plain.rate_by_rotation(k), |step| with(k, false, step).motion.rate);
            }
        }
    }
}

#[test]
fn splines_sum_to_one_and_hold_polynomials() {
    for degree in 1..=5 {
        // Every spline of degree 3 or more reproduces the cube: its coefficients are the blossom at the inner knots (Marsden).
        let knots: Vec<f64> = (0..14).map(|k| 0.7 * f64::from(k) + 0.02 * f64::from(k * k)).collect();
        let spline = Spline { degree, knots };
        assert!(spline.is_sound());
        let (first, last) = spline.span();
        for part in 0..=50 {
            let mut active = Active::default();
            spline.put(first + (last - first) * f64::from(part) / 50.0, &mut active);
            assert_eq!(active.values.len(), degree + 1);
            assert!((active.values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!(active.rates.iter().sum::<f64>().abs() < 1e-13);
            let time = first + (last - first) * f64::from(part) / 50.0;
            let greville = |k: usize| spline.knots[k + 1..=k + degree].iter().sum::<f64>() / degree as f64;
            let line: f64 =
                active.values.iter().enumerate().map(|(j, b)| b * greville(active.first + j)).sum();
            assert!((line - time).abs() < 1e-13, "degree {degree}");
        }
    }
}

#[test]
fn a_uniform_turn_is_one_turn_in_both_ways() {
    let axis = Vector3::new(0.02, -0.05, 0.11);
    let times: Vec<f64> = (0..10).map(|k| 0.5 * f64::from(k)).collect();
    for (interpolation, digits) in [(Interpolation::Linear, 1e-14), (Interpolation::Lagrange, 1e-9)] {
        let turned = times.iter().map(|t| angle_axis_rotation(&(*t * axis))).collect();
        let (attitude, rate) = Attitudes::new(times.clone(), turned, interpolation).unwrap().at(2.3);
        assert!((attitude - angle_axis_rotation(&(2.3 * axis))).norm() < digits, "{interpolation:?}");
        assert!((rate - axis).norm() < 10.0 * digits, "{interpolation:?}");
    }
}

#[test]
fn records_that_do_not_increase_are_refused() {
    let places = vec![Vector3::zeros(); 2];
    assert!(Positions::new(vec![1.0, 1.0], places.clone(), vec![], Interpolation::Linear).is_none());
    assert!(Positions::new(vec![0.0, 1.0], places, vec![], Interpolation::Hermite).is_none());
    assert!(Attitudes::new(vec![], vec![], Interpolation::Linear).is_none());
    assert!(!Spline { degree: 3, knots: vec![0.0; 9] }.is_sound(), "all knots in one place");
}
