//! Tails and quantiles of the distributions that the tests of an adjustment need.
//!
//! Tails come from the incomplete gamma and beta functions of `statrs`; quantiles are bisected on the tail that is asked for,
//! so that small probabilities keep their digits (chi-square values below 1e-15 count as zero). Arguments outside a distribution's
//! range give NaN.

use statrs::function::beta::checked_beta_reg;
use statrs::function::gamma::{checked_gamma_lr, checked_gamma_ur};

/// On which side of a value a probability lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tail {
    /// Of values smaller than it.
    Lower,
    /// Of values larger than it.
    Upper,
}

/// Probability that a chi-square variable of `dof` degrees of freedom lies on the given side of `x`.
pub fn chi_square(x: f64, dof: f64, tail: Tail) -> f64 {
    if !(dof > 0.0 && dof.is_finite() && x >= 0.0) {
        return f64::NAN;
    }
    if x == 0.0 || x.is_infinite() {
        return if (tail == Tail::Upper) == (x == 0.0) { 1.0 } else { 0.0 };
    }
    match tail {
        Tail::Lower => checked_gamma_lr(dof / 2.0, x / 2.0),
        Tail::Upper => checked_gamma_ur(dof / 2.0, x / 2.0),
    }
    .unwrap_or(f64::NAN)
}

/// The value beyond which, on the given side, a chi-square variable of `dof` degrees of freedom lies with `probability`.
pub fn chi_square_quantile(probability: f64, dof: f64, tail: Tail) -> f64 {
    if !(dof > 0.0 && dof.is_finite()) {
        return f64::NAN;
    }
    quantile(probability, tail, |x| chi_square(x, dof, tail))
}

/// Probability that the absolute value of Student's variable of `dof` degrees of freedom exceeds that of `t`.
pub fn student(t: f64, dof: f64) -> f64 {
    // t^2 is F(1, dof).
    fisher(t * t, 1.0, dof)
}

/// The value that the absolute value of Student's variable of `dof` degrees of freedom exceeds with `probability`.
pub fn student_limit(probability: f64, dof: f64) -> f64 {
    if dof.is_nan() || dof <= 0.0 {
        return f64::NAN;
    }
    quantile(probability, Tail::Upper, |t| student(t, dof))
}

/// Probability that Fisher's variable of `first` and `second` degrees of freedom exceeds `x`.
pub fn fisher(x: f64, first: f64, second: f64) -> f64 {
    if !(first > 0.0 && second > 0.0 && first.is_finite() && second.is_finite() && x >= 0.0) {
        return f64::NAN;
    }
    if x.is_infinite() {
        return 0.0;
    }
    checked_beta_reg(second / 2.0, first / 2.0, second / (second + first * x)).unwrap_or(f64::NAN)
}

/// The value that Fisher's variable of `first` and `second` degrees of freedom exceeds with `probability`.
pub fn fisher_limit(probability: f64, first: f64, second: f64) -> f64 {
    if !(first > 0.0 && second > 0.0) {
        return f64::NAN;
    }
    quantile(probability, Tail::Upper, |x| fisher(x, first, second))
}

/// Bisects the positive numbers, by their exponents first, for the value whose tail holds the probability.
fn quantile(probability: f64, tail: Tail, of: impl Fn(f64) -> f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return f64::NAN;
    }
    // Positive floating-point numbers are ordered as their bits are.
    let (mut low, mut high) = (0_u64, f64::MAX.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let inside = of(f64::from_bits(middle));
        if (inside > probability) == (tail == Tail::Upper) { low = middle } else { high = middle }
    }
    f64::from_bits(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64) -> bool {
        (value / expected - 1.0).abs() < 1e-9
    }

    /// Printed in the tables of every textbook.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        assert!(close(chi_square_quantile(0.05, 1.0, Tail::Upper), 3.841_458_821));
        assert!(close(chi_square_quantile(1e-4, 1.0, Tail::Lower), 1.570_796_335e-8));
        assert!(close(chi_square_quantile(0.025, 81.0, Tail::Lower), 57.998_416_527));
        assert!(close(student_limit(0.05, 5.0), 2.570_581_836));
        assert!(close(fisher_limit(0.05, 2.0, 8.0), 4.458_970_108));
    }

    #[test]
    fn quantiles_invert_tails_up_to_large_degrees_of_freedom() {
        for dof in [1.0, 2.5, 30.0, 1e4, 1e7] {
            for probability in [1e-6, 0.025, 0.5, 0.975] {
                for tail in [Tail::Lower, Tail::Upper] {
                    let x = chi_square_quantile(probability, dof, tail);
                    let back = chi_square(x, dof, tail);
                    assert!((back / probability - 1.0).abs() < 1e-6, "{dof} {probability} {tail:?}: {back}");
                }
            }
        }
    }

    #[test]
    fn nonsense_is_not_a_number() {
        assert!(chi_square(-1.0, 3.0, Tail::Upper).is_nan());
        assert!(chi_square(1.0, f64::NAN, Tail::Upper).is_nan());
        assert!(chi_square_quantile(0.0, 3.0, Tail::Upper).is_nan());
        assert!(student_limit(0.05, 0.0).is_nan());
        assert!(fisher(f64::NAN, 1.0, 1.0).is_nan());
    }
}
