//! Tail probabilities and quantiles of test distributions.
//!
//! Tail probabilities use the incomplete gamma and beta functions of `statrs`. Quantiles are bisected on the requested tail, so that small
//! probabilities are precise (chi-square values below 1e-15 count as zero). For upper tails below the floating-point range, logarithms are
//! computed from continued fractions (Abramowitz and Stegun 1964, 6.5.31 and 26.5.8). Arguments outside the range of a distribution give
//! NaN.

use std::f64::consts::FRAC_1_SQRT_2;

use statrs::function::beta::{checked_beta_reg, ln_beta};
use statrs::function::erf::erfc;
use statrs::function::gamma::{checked_gamma_lr, checked_gamma_ur, ln_gamma};

/// Probability above which tails have full precision; logarithms of smaller ones use a continued fraction.
const SMALL: f64 = 1e-200;

/// Tail of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tail {
    /// Values smaller than the argument.
    Lower,
    /// Values larger than the argument.
    Upper,
}

/// Probability that a chi-square variable with `dof` degrees of freedom is in the given tail of `x`.
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

/// Returns the quantile of a chi-square variable with `dof` degrees of freedom for a tail of `probability`.
pub fn chi_square_quantile(probability: f64, dof: f64, tail: Tail) -> f64 {
    if !(dof > 0.0 && dof.is_finite()) {
        return f64::NAN;
    }
    quantile(probability, tail, |x| chi_square(x, dof, tail))
}

/// Natural logarithm of the probability that a chi-square variable with `dof` degrees of freedom exceeds `x`.
pub fn log_chi_square(x: f64, dof: f64) -> f64 {
    // Closed form exp(-x / 2) for two degrees of freedom: most tested groups are image observations.
    if dof == 2.0 && x >= 0.0 {
        return -0.5 * x;
    }
    let probability = chi_square(x, dof, Tail::Upper);
    if probability.is_nan() || probability > SMALL || x.is_infinite() {
        return probability.ln();
    }
    let (a, x) = (dof / 2.0, x / 2.0);
    // 1 / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ...))
    let fraction = continued_fraction(x + 1.0 - a, |k| (k * (a - k), x + 2.0 * k + 1.0 - a));
    a * x.ln() - x - ln_gamma(a) - fraction.ln()
}

/// Natural logarithm of the probability that an F variable with `first` and `second` degrees of freedom exceeds `x`.
pub fn log_fisher(x: f64, first: f64, second: f64) -> f64 {
    let probability = fisher(x, first, second);
    if probability.is_nan() || probability > SMALL || x.is_infinite() {
        return probability.ln();
    }
    let (a, b) = (second / 2.0, first / 2.0);
    let ratio = first * x / second;
    let y = 1.0 / (1.0 + ratio);
    let fraction = continued_fraction(1.0, |k| {
        let half = (k / 2.0).floor();
        let term = if k % 2.0 == 0.0 {
            half * (b - half) * y / ((a + k - 1.0) * (a + k))
        } else {
            -(a + half) * (a + b + half) * y / ((a + k - 1.0) * (a + k))
        };
        (term, 1.0)
    });
    -a * ratio.ln_1p() - b * ratio.recip().ln_1p() - a.ln() - ln_beta(a, b) - fraction.ln()
}

/// Evaluates the continued fraction `first + a1 / (b1 + a2 / (b2 + ...))` with terms `(ak, bk)` by the method of Lentz.
fn continued_fraction(first: f64, term: impl Fn(f64) -> (f64, f64)) -> f64 {
    let nonzero = |value: f64| if value == 0.0 { f64::MIN_POSITIVE } else { value };
    let mut fraction = nonzero(first);
    let (mut c, mut d) = (fraction, 0.0);
    for k in 1..10_000_u16 {
        let (above, below) = term(f64::from(k));
        d = nonzero(below + above * d).recip();
        c = nonzero(below + above / c);
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    fraction
}

/// Probability that a standard normal variable is below `z`.
pub fn normal(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// Probability that the absolute value of a Student variable with `dof` degrees of freedom exceeds `|t|`.
pub fn student(t: f64, dof: f64) -> f64 {
    // The square of t has the distribution F(1, dof).
    fisher(t * t, 1.0, dof)
}

/// Returns the value that the absolute value of a Student variable with `dof` degrees of freedom exceeds with `probability`.
pub fn student_limit(probability: f64, dof: f64) -> f64 {
    if dof.is_nan() || dof <= 0.0 {
        return f64::NAN;
    }
    quantile(probability, Tail::Upper, |t| student(t, dof))
}

/// Probability that an F variable with `first` and `second` degrees of freedom exceeds `x`.
pub fn fisher(x: f64, first: f64, second: f64) -> f64 {
    if !(first > 0.0 && second > 0.0 && first.is_finite() && second.is_finite() && x >= 0.0) {
        return f64::NAN;
    }
    if x.is_infinite() {
        return 0.0;
    }
    checked_beta_reg(second / 2.0, first / 2.0, second / (second + first * x)).unwrap_or(f64::NAN)
}

/// Returns the value that an F variable with `first` and `second` degrees of freedom exceeds with `probability`.
pub fn fisher_limit(probability: f64, first: f64, second: f64) -> f64 {
    if !(first > 0.0 && second > 0.0) {
        return f64::NAN;
    }
    quantile(probability, Tail::Upper, |x| fisher(x, first, second))
}

/// Bisects the positive numbers, in the order of their bits, for the quantile of a tail.
pub(super) fn quantile(probability: f64, tail: Tail, of: impl Fn(f64) -> f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return f64::NAN;
    }
    // Positive floating-point numbers have the order of their bit patterns.
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

    /// Values from standard tables.
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
    fn logarithms_go_on_where_probabilities_end() {
        // Closed forms for two degrees of freedom: exp(-x / 2), and (1 + 2 x / f)^(-f / 2).
        for x in [1.0, 900.0, 1000.0, 1e5] {
            assert!(close(log_chi_square(x, 2.0), -x / 2.0));
            assert!(close(log_fisher(x, 2.0, 400.0), -200.0 * (x / 200.0).ln_1p()), "{x}");
        }
        // Both sides of the transition to the continued fraction.
        for dof in [1.0, 3.0, 250.0] {
            let (before, after) = (log_chi_square(900.0, dof), log_chi_square(900.0001, dof));
            let near = quantile(SMALL, Tail::Upper, |x| chi_square(x, dof, Tail::Upper));
            assert!(before > after);
            assert!(close(log_chi_square(near * (1.0 + 1e-14), dof), SMALL.ln()), "{dof}");
            let near = quantile(SMALL, Tail::Upper, |x| fisher(x, dof, 500.0));
            assert!(close(log_fisher(near * (1.0 + 1e-13), dof, 500.0), SMALL.ln()), "{dof}");
        }
        assert_eq!(log_chi_square(f64::INFINITY, 3.0), f64::NEG_INFINITY);
        assert_eq!(log_fisher(f64::INFINITY, 3.0, 5.0), f64::NEG_INFINITY);
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
