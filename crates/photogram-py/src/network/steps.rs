//! Step rules for partitioned adjustments; the documentation is in `_photocore.pyi`.

use std::collections::BTreeMap;

use photocore::adjustment::{History, Iteration};
use pyo3::prelude::*;

#[pyfunction]
pub fn step_rules() -> BTreeMap<&'static str, f64> {
    let mut rules = BTreeMap::from(photocore::adjustment::step_rules());
    rules.insert("least_redundancy", photocore::network::LEAST_REDUNDANCY);
    rules
}

/// Classifies a full step by its length and by the damping and lengths of previous steps.
#[pyfunction]
#[pyo3(signature = (taken, change, *, chord, unknowns, tolerance))]
pub fn judge_full_step(
    taken: Vec<(f64, f64)>,
    change: f64,
    chord: Option<f64>,
    unknowns: usize,
    tolerance: f64,
) -> &'static str {
    let row = |(number, (damping, largest_change))| Iteration {
        number,
        sum_of_squares: f64::NAN,
        largest_change,
        damping,
    };
    let iterations: Vec<Iteration> = taken.into_iter().enumerate().map(row).collect();
    let history = History { iterations: &iterations, chord, unknowns };
    if change <= tolerance || history.leaves_less_than(tolerance, change) {
        "last"
    } else if history.falls_no_more(change) {
        "rests"
    } else if history.is_for_chord(change) {
        "before a chord"
    } else {
        "one of many"
    }
}

#[pyfunction]
pub fn is_chord(chord: f64, change: f64) -> bool {
    History::is_chord(chord, change)
}
