//! Calibration of a measuring comparator: a plate of 25 points in four placements gives the scales and the nonorthogonality of the axes.

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use photocore::adjustment::Options;
use photogram_programs::comparator::{
    Basis, Calibration, Case, Comparator, GridPoint, Measurement, Placement, Solution,
};

/// Basis without polynomials.
const BASIS: Basis = Basis { degree: 1, centre: [125e3, 130e3], half_range: [120e3, 110e3] };
/// True scales, and the nonorthogonality in radians.
pub const TRUTH: ([f64; 2], f64) = ([1.0 - 5e-6, 1.0 + 22e-6], 5e-5);

fn comparator(scale: [f64; 2], nonorthogonality: f64) -> Comparator {
    Comparator { scale, nonorthogonality, basis: BASIS, coefficients: [vec![], vec![]] }
}

/// Returns the data in micrometres; the plate has a standard deviation of 0.25, measurements are rounded to integers.
fn calibration() -> Calibration {
    let truth = comparator(TRUTH.0, TRUTH.1);
    let xy = |i: usize| [5e4 * (i % 5) as f64 - 1e5, 5e4 * (i / 5) as f64 - 1e5];
    let placement = |k: usize| Placement { rotation: FRAC_PI_2 * k as f64, translation: [300.0, 100.0] };
    let all = (0..4).flat_map(|case| (0..25).map(move |point| (case, point)));
    let measured = |(case, point)| {
        let [x, y] = truth.measure(xy(point), &placement(case)).xy;
        Measurement { case, point, xy: [x.round(), y.round()], sd: [1.0; 2] }
    };
    Calibration {
        comparator: comparator([1.0; 2], 0.0),
        coefficient_sd: [vec![], vec![]],
        cases: (0..4).map(|k| Case { placement: placement(k), left_handed: false }).collect(),
        points: (0..25).map(|i| GridPoint { xy: xy(i), sd: [0.25; 2] }).collect(),
        measurements: all.map(measured).collect(),
    }
}

/// Adjusts the calibration.
pub fn adjusted() -> Result<Solution, Box<dyn Error>> {
    let calibration = calibration();
    Ok(calibration.adjust(&Options::default())?)
}

/// Prints the parameters of the comparator.
pub fn main() -> Result<(), Box<dyn Error>> {
    let solution = adjusted()?;
    for (k, name) in ["scale of x", "scale of y", "lack of orthogonality (rad)"].into_iter().enumerate() {
        let (value, sd) = (solution.comparator[k], solution.comparator_cofactors[4 * k].sqrt());
        println!("{name}: {value:.7}, sd {sd:.1e}");
    }
    Ok(())
}
