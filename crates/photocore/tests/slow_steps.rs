//! Slowly decreasing steps: second derivatives times residuals are as large as the normal matrix.

#![allow(clippy::unwrap_used, clippy::panic)]

use photocore::adjustment::{Adjustment, Evaluated, Model, Options, Problem, Status};
use photocore::normals::{GroupRows, Layout, Ordering, System};

/// Observations of zero for each unknown x: 1 + x and x - 1 + bend x^2. At the solution x = 0 the normal matrix is 2, and residuals times
/// second derivatives are -2 bend: a Gauss-Newton step leads from x to bend x.
struct Bent(Vec<f64>);

struct At<'a> {
    bends: &'a [f64],
    values: Vec<f64>,
}

impl Model for Bent {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(At { bends: &self.0, values: unknowns[1..].to_vec() })
    }

    fn may_oscillate(&self) -> bool {
        true
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, _: usize, _: usize, rows: &mut GroupRows<'_>) {
        let count = self.bends.len();
        rows.local.fill(0.0);
        rows.retained.fill(0.0);
        for (k, (bend, x)) in self.bends.iter().zip(&self.values).enumerate() {
            rows.constant[2 * k] = -(1.0 + x);
            rows.constant[2 * k + 1] = -(x - 1.0 + bend * x * x);
            rows.retained[2 * k * count + k] = 1.0;
            rows.retained[(2 * k + 1) * count + k] = 1.0 + 2.0 * bend * x;
        }
    }
}

/// Adjusts from x = 0.1 with a fixed local unknown.
fn adjusted(bends: &[f64]) -> Adjustment {
    let count = bends.len();
    let layout = Layout::new(2 * count, 1, &[count], vec![0, 1], vec![0]).unwrap();
    let problem = Problem {
        model: Bent(bends.to_vec()),
        system: System::new(layout, Ordering::Auto).unwrap(),
        observation_sd: vec![1.0; 2 * count],
        initial: [vec![0.0], vec![0.1; count]].concat(),
        prior: vec![0.0; 1 + count],
        sd: [vec![0.0], vec![f64::INFINITY; count]].concat(),
    };
    problem.adjust(&Options::default()).unwrap()
}

#[test]
fn steps_that_swing_or_creep_learn_what_they_leave_out() {
    for (bends, most) in [(vec![-0.975], 8), (vec![0.975], 12), (vec![-0.97, -0.5, 0.3, 0.9], 20)] {
        let adjusted = adjusted(&bends);
        assert_eq!(adjusted.status, Status::Converged, "{bends:?}");
        let iterations = adjusted.iterations.len();
        assert!(iterations <= most, "{bends:?}: {iterations}");
        let farthest = adjusted.unknowns[1..].iter().fold(0.0f64, |most, x| most.max(x.abs()));
        // The last plain step is at most 1e-5 standard deviations and covers the fraction 1 - bend of the error.
        let least = bends.iter().fold(1.0f64, |least, bend| least.min(1.0 - bend));
        assert!(farthest < 1e-5 / least, "{bends:?}: {farthest}");
    }
}

#[test]
fn chords_take_the_place_of_steps_that_fall() {
    let adjusted = adjusted(&[0.1]);
    let lengths: Vec<f64> = adjusted.iterations.iter().map(|each| each.largest_change).collect();
    // A plain step has a tenth of the previous length: five more would be needed.
    assert!(lengths.len() == 2 && lengths[1] < 1e-5, "{lengths:?}");
    assert_eq!(adjusted.status, Status::Converged);
}
