//! Rules and state of the step control.

use super::options::{NEGLIGIBLE, Stop};
use crate::Iteration;

/// Maximum change, in standard deviations, for the second-order term of a loss, which is harmful farther from the solution.
pub(super) const NEAR: f64 = 1.0;
/// Relative increase of the sum of squares that is accepted as rounding error.
pub(super) const ROUNDING: f64 = 1e-12;
/// Relative predicted decrease of the sum of squares by a damped step, and its change in standard deviations, that count as rounding error.
const DAMPED_ROUNDING: f64 = 1e-14;
const DAMPED_NEGLIGIBLE: f64 = 1e-6;
/// Maximum decrease of the sum of squares between two failures of full steps that counts as stagnation, as a multiple of the variance of
/// unit weight. It corresponds to 0.01 standard deviations of a combination of unknowns.
pub(super) const STILL: f64 = 1e-4;
/// Minimum mean change, in standard deviations, for a recomputation of local unknowns instead of their linearization.
pub(super) const FAR: f64 = 30.0;

/// Gain ratio below which damped steps are accelerated.
pub(super) const BENDS: f64 = 0.75;
/// Maximum damping: the step is parallel to the gradient and must lower the sum of squares if any step does.
pub(super) const MOST_DAMPING: f64 = 1e9;

/// Maximum change of a short step, in standard deviations.
pub(super) const SHORT: f64 = 1.0;

/// Damping, as a fraction of the diagonal of the normal matrix.
pub(super) struct Damping {
    /// Damping of the first damped step.
    pub first: f64,
    /// Limit below which damping is replaced by `floor`.
    least: f64,
    floor: f64,
    /// Factor after a failure, and its growth with each further failure in sequence.
    rise: f64,
    growth: f64,
    /// Factor after a success, as a function of the gain: the ratio of actual to predicted decrease.
    fall: fn(f64) -> f64,
}

/// Damping after failures of full steps: zero as soon as possible.
pub(super) const AFTER_FAILURES: Damping =
    Damping { first: 1e-3, least: 1e-5, floor: 0.0, rise: 10.0, growth: 1.0, fall: |_| 0.1 };
/// Damping of all steps. With less than the least, the seven null pivots of a network without datum would be rounding errors.
pub(super) const ALWAYS: Damping =
    Damping { first: 1e-4, least: 1e-10, floor: 1e-10, rise: 2.0, growth: 2.0, fall: by_gain };

/// Returns a factor of the damping: 1/3 after a good prediction, up to 2 after a poor one.
fn by_gain(gain: f64) -> f64 {
    (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)
}

/// Returns the constants of the step control by name, for partitioned problems (Helmert blocking).
pub fn step_rules() -> [(&'static str, f64); 8] {
    [
        ("rounding", ROUNDING),
        ("negligible", NEGLIGIBLE),
        ("far", FAR),
        ("still", STILL),
        ("first_damping", AFTER_FAILURES.first),
        ("least_damping", AFTER_FAILURES.least),
        ("most_damping", MOST_DAMPING),
        ("near", NEAR),
    ]
}

/// State of the step control between steps.
pub(super) struct Control {
    pub stop: Stop,
    damping: &'static Damping,
    /// Factor of the damping at the next failure.
    rise: f64,
    /// Lowest sum of squares.
    pub best: f64,
    /// Sum of squares at the last failure of a full step, and the unknowns that the step moved most.
    pub refused: Option<(f64, Vec<usize>)>,
    /// Whether this step followed a valley.
    pub in_valley: bool,
    /// Number of steps along a valley,
    pub along: usize,
    /// and of other failures of full steps.
    pub failures: usize,
    /// Whether steps follow a curved valley.
    pub bends: bool,
    /// Decreases of the sum of squares by damped steps.
    pub falls: Vec<f64>,
}

impl Control {
    /// Begins at the sum of squares of the initial values.
    pub fn new(stop: Stop, damping: &'static Damping, best: f64) -> Self {
        Self {
            stop,
            damping,
            rise: damping.rise,
            best,
            refused: None,
            in_valley: false,
            along: 0,
            failures: 0,
            bends: false,
            falls: vec![],
        }
    }

    /// Whether every step is damped.
    pub fn always(&self) -> bool {
        self.damping.floor > 0.0
    }

    /// Damps every step from now on.
    pub fn damp_always(&mut self) {
        (self.damping, self.rise) = (&ALWAYS, ALWAYS.rise);
        self.falls.clear();
    }

    /// Whether a step with this damping is not much shortened.
    pub fn is_whole(&self, damping: f64) -> bool {
        damping <= if self.always() { self.damping.first } else { 0.0 }
    }

    /// Whether the stopping rule ends a sequence of damped steps at this one, or its predicted decrease is a rounding error.
    pub fn is_last_damped(&self, step: &Iteration, predicted: f64) -> bool {
        let rounding = (DAMPED_ROUNDING * self.best).max(DAMPED_NEGLIGIBLE.powi(2));
        let ends = self.stop.at_change(step.largest_change) || self.stop.at_decrease(predicted, self.best);
        predicted <= rounding || self.is_whole(step.damping) && ends
    }

    /// Returns the damping after a successful step.
    pub fn eased(&mut self, damping: f64, gain: f64) -> f64 {
        self.rise = self.damping.rise;
        let eased = damping * (self.damping.fall)(gain);
        if eased < self.damping.least { self.damping.floor } else { eased }
    }

    /// Returns the damping after a failed step.
    pub fn raised(&mut self, damping: f64) -> f64 {
        if damping == 0.0 {
            return self.damping.first;
        }
        let raised = damping * self.rise;
        self.rise *= self.damping.growth;
        if self.always() { raised } else { raised.max(self.damping.first) }
    }
}
