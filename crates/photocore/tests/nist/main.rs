//! The engine against certified values of the NIST Statistical Reference Datasets (nonlinear regression).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod problems;

use std::f64::consts::PI;

use num_complex::Complex64;
use photocore::adjustment::{
    AdjustError, Adjustment, Evaluated, Method, Model, Options, Problem, Status, Stop, adjust,
};
use photocore::normals::{GroupRows, Layout, Ordering, System};
use photocore::{Context, Threads};

use problems::{Certified, PROBLEMS};

/// Curve y(x) with parameters: the retained block. The local block is one fixed unknown without observations.
struct Curve<'a> {
    name: &'a str,
    x: &'a [f64],
    y: &'a [f64],
}

/// Number of unknowns in front of the parameters.
const FIRST: usize = 1;
/// Imaginary step of the partials (Squire and Trapp 1998), small enough that its square vanishes.
const STEP: f64 = 1e-30;

/// Returns the arctangent near the real axis: the library function loses small imaginary parts.
fn arctangent(value: Complex64) -> Complex64 {
    Complex64::new(value.re.atan(), value.im / (1.0 + value.re * value.re))
}

/// Returns the model functions as printed by NIST.
fn curve(name: &str, b: &[Complex64], x: f64) -> Complex64 {
    match name {
        "Misra1a" => b[0] * (1.0 - (-b[1] * x).exp()),
        "Chwirut2" => (-b[0] * x).exp() / (b[1] + b[2] * x),
        "DanWood" => b[0] * (b[1] * x.ln()).exp(),
        "Roszman1" => b[0] - b[1] * x - arctangent(b[2] / (x - b[3])) / PI,
        "MGH09" => b[0] * (b[1] * x + x * x) / (b[2] * x + x * x + b[3]),
        "Thurber" => {
            (b[0] + b[1] * x + b[2] * x.powi(2) + b[3] * x.powi(3))
                / (1.0 + b[4] * x + b[5] * x.powi(2) + b[6] * x.powi(3))
        }
        "Rat43" => b[0] / ((1.0 + (b[1] - b[2] * x).exp()).ln() / b[3]).exp(),
        "MGH10" => b[0] * (b[1] / (b[2] + x)).exp(),
        "Eckerle4" => b[0] / b[1] * (-0.5 * ((x - b[2]) / b[1]).powi(2)).exp(),
        _ => unreachable!("{name}"),
    }
}

struct At<'a> {
    model: &'a Curve<'a>,
    parameters: Vec<f64>,
}

impl Model for Curve<'_> {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { model: self, parameters: unknowns[FIRST..].to_vec() })
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, _: usize, group: usize, rows: &mut GroupRows<'_>) {
        let Curve { name, x, y } = self.model;
        let at: Vec<Complex64> = self.parameters.iter().map(|&value| value.into()).collect();
        rows.constant[0] = y[group] - curve(name, &at, x[group]).re;
        rows.local[0] = 0.0;
        for k in 0..at.len() {
            let mut beside = at.clone();
            beside[k].im = STEP;
            rows.retained[k] = curve(name, &beside, x[group]).im / STEP;
        }
    }
}

/// Adjusts a problem from initial values. Observations have their certified standard deviation.
fn run(certified: &Certified, start: &[f64], method: Method) -> Result<Adjustment, AdjustError> {
    let count = certified.x.len();
    let layout = Layout::new(1, 1, &[start.len()], vec![0, count], vec![0; count]).unwrap();
    let initial = [&[0.0], start].concat();
    let problem = Problem {
        model: Curve { name: certified.name, x: certified.x, y: certified.y },
        system: System::new(layout, Ordering::Input).unwrap(),
        observation_sd: vec![certified.residual_sd; count],
        prior: initial.clone(),
        sd: [vec![0.0], vec![f64::INFINITY; start.len()]].concat(),
        initial,
    };
    let options = Options { method, max_iterations: 5000, covariance: true, loss: None, threads: 0 };
    let threads = Threads::new(1).unwrap();
    adjust(&problem, &options, &mut Context::new(&threads))
}

/// Returns the number of agreeing digits of the worst value.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    let of =
        |(found, certified): (&f64, &f64)| -((found - certified).abs() / certified.abs()).max(1e-16).log10();
    found.iter().zip(certified).map(of).fold(f64::INFINITY, f64::min)
}

/// Returns the agreeing digits of parameters, of their standard deviations, and of the sum of squares.
fn agreement(certified: &Certified, adjusted: &Adjustment) -> [f64; 3] {
    let squares: f64 = adjusted.residuals.iter().map(|v| v * v).sum();
    let count = certified.parameters.len();
    let sigma = (squares / (certified.x.len() - count) as f64).sqrt() / certified.residual_sd;
    let cofactors = adjusted.cofactors.as_ref().unwrap();
    let sd: Vec<f64> = (0..count).map(|k| sigma * cofactors.retained[k * count + k].sqrt()).collect();
    [
        digits(&adjusted.unknowns[FIRST..], certified.parameters),
        digits(&sd, certified.parameter_sd),
        digits(&[squares], &[certified.sum_of_squares]),
    ]
}

/// Number of digits that must agree; certified values have eleven.
const WANTED: f64 = 6.0;
/// From the first start every descent reaches a plateau, on which the parameters are not determined.
const PLATEAU: (&str, usize) = ("MGH10", 0);
/// From the first start the curve is zero at nearly all points: small steps need more than 5,000 iterations.
const FAR: (&str, usize) = ("Eckerle4", 0);

#[test]
fn certified_values_come_out_from_both_starts() {
    println!(
        "| problem | level | start | stops by | ends | iterations | digits of parameters | of their sds | of the sum |"
    );
    println!("|---|---|---:|---|---|---:|---:|---:|---:|");
    for certified in &PROBLEMS {
        for (number, start) in certified.starts.iter().enumerate() {
            for (name, method) in [
                ("corrections", Method::Damped(Stop::Fraction(1e-9))),
                ("decrease", Method::TrustRegion(Stop::Decrease(1e-14))),
            ] {
                let adjusted = run(certified, start, method).unwrap();
                let head = format!("| {} | {} | {}", certified.name, certified.level, number + 1);
                let (ended, count) = (adjusted.status, adjusted.iterations.len());
                let case = format!("{head} | {name} | {ended:?} | {count} |");
                let solved = ended == Status::Converged && adjusted.cofactors.is_some();
                let by_steps = matches!(method, Method::Damped(Stop::Fraction(_)));
                if (certified.name, number) == PLATEAU || (by_steps && (certified.name, number) == FAR) {
                    assert!(!solved, "{case}");
                    assert!(ended != Status::Converged || adjusted.undetermined.is_some(), "{case}");
                    println!("{case} | | |");
                    continue;
                }
                assert!(solved, "{case}");
                let found = agreement(certified, &adjusted);
                assert!(found.iter().all(|&digits| digits > WANTED), "{case} {found:?}");
                println!("{case} {:.1} | {:.1} | {:.1} |", found[0], found[1], found[2]);
            }
        }
    }
}

#[test]
fn any_control_of_steps_goes_with_any_rule_that_stops_it() {
    let rules = [Stop::Fraction(1e-9), Stop::Decrease(1e-14)];
    for certified in PROBLEMS.iter().filter(|certified| certified.name != PLATEAU.0) {
        for method in rules.into_iter().flat_map(|rule| [Method::Damped(rule), Method::TrustRegion(rule)]) {
            let adjusted = run(certified, certified.starts[1], method).unwrap();
            assert_eq!(adjusted.status, Status::Converged, "{} {method:?}", certified.name);
            let found = agreement(certified, &adjusted);
            assert!(found.iter().all(|&digits| digits > WANTED), "{} {method:?} {found:?}", certified.name);
        }
    }
}
