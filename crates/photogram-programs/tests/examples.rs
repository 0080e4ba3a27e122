//! Runs of the examples, compared with expected results.

#![allow(clippy::unwrap_used, dead_code)]

#[path = "../examples/comparator.rs"]
mod comparator;

#[test]
fn the_comparator_comes_out_within_its_standard_deviations() {
    let solution = comparator::adjusted().unwrap();
    let ([x, y], angle) = comparator::TRUTH;
    for (k, truth) in [x, y, angle].into_iter().enumerate() {
        assert!((solution.comparator[k] - truth).abs() < 4.0 * solution.comparator_cofactors[4 * k].sqrt());
    }
    comparator::main().unwrap();
}
