//! Noncentral distributions: power of tests for an error of a given size.
//!
//! A statistic with `m` degrees of freedom and noncentrality `lambda` is a mixture of central distributions with `m + 2 j` degrees of
//! freedom. Their weights are the probabilities of `j` in a Poisson distribution of mean `lambda / 2`.

use super::distributions::{Tail, chi_square, chi_square_quantile, fisher_limit, quantile};
use statrs::function::beta::checked_beta_reg;
use statrs::function::erf::erfc;
use statrs::function::gamma::ln_gamma;

/// Noncentrality above which the relative variation of the variable is below 0.002.
const LARGE: f64 = 1e6;

/// Probability that a noncentral chi-square variable exceeds `x`.
pub fn noncentral_chi_square(x: f64, dof: f64, noncentrality: f64) -> f64 {
    if !(dof > 0.0 && dof.is_finite() && x >= 0.0 && noncentrality >= 0.0) {
        return f64::NAN;
    }
    if noncentrality > LARGE {
        let spread = (4.0 * (dof + 2.0 * noncentrality)).sqrt();
        return if noncentrality.is_infinite() {
            1.0
        } else {
            0.5 * erfc((x - dof - noncentrality) / spread)
        };
    }
    mixture(noncentrality / 2.0, |j| chi_square(x, dof + 2.0 * j, Tail::Upper))
}

/// Probability that a noncentral F variable exceeds `x`; for infinite `second`, chi-square divided by `first`.
pub fn noncentral_fisher(x: f64, first: f64, second: f64, noncentrality: f64) -> f64 {
    if second == f64::INFINITY {
        return noncentral_chi_square(first * x, first, noncentrality);
    }
    if !(first > 0.0 && second > 0.0 && first.is_finite() && x >= 0.0 && noncentrality >= 0.0) {
        return f64::NAN;
    }
    if noncentrality > LARGE {
        return chi_square((first + noncentrality) * second / (first * x), second, Tail::Lower);
    }
    let y = second / (second + first * x);
    mixture(noncentrality / 2.0, |j| checked_beta_reg(second / 2.0, first / 2.0 + j, y).unwrap_or(f64::NAN))
}

/// Noncentrality at which a test of significance `level` has the given `power` (Baarda's lambda0).
///
/// The test is chi-square with `first` degrees of freedom if `second` is infinite, otherwise F with `first` and `second`.
pub fn detectable_noncentrality(level: f64, power: f64, first: f64, second: f64) -> f64 {
    if !(level > 0.0 && level < power && power < 1.0 && first > 0.0 && first.is_finite() && second > 0.0) {
        return f64::NAN;
    }
    let limit = if second.is_infinite() {
        chi_square_quantile(level, first, Tail::Upper) / first
    } else {
        fisher_limit(level, first, second)
    };
    quantile(power, Tail::Lower, |noncentrality| noncentral_fisher(limit, first, second, noncentrality))
}

/// Returns the significance level at which a chi-square test with `dof` degrees of freedom has the given power for a noncentrality, and its
/// critical value. (Baarda's B-method: tests of all dimensions detect the same error with equal power.)
pub fn level_of_equal_power(noncentrality: f64, power: f64, dof: f64) -> (f64, f64) {
    if !(noncentrality >= 0.0 && noncentrality.is_finite() && dof > 0.0 && dof.is_finite()) {
        return (f64::NAN, f64::NAN);
    }
    let limit = quantile(power, Tail::Upper, |x| noncentral_chi_square(x, dof, noncentrality));
    (chi_square(limit, dof, Tail::Upper), limit)
}

/// Mean of `of(j)`, which is between 0 and 1 and increases with `j`, over a Poisson distribution.
fn mixture(mean: f64, of: impl Fn(f64) -> f64) -> f64 {
    let mode = mean.floor();
    let weight = |j: f64| if mean == 0.0 { 1.0 } else { (j * mean.ln() - mean - ln_gamma(j + 1.0)).exp() };
    let mut sum = 0.0;
    let (mut j, mut part) = (mode, weight(mode));
    // Sum upwards from the mode until the rest, bounded by a geometric series, is negligible.
    loop {
        sum += part * of(j);
        let next = mean / (j + 1.0);
        j += 1.0;
        part *= next;
        if sum.is_nan() || part <= 1e-17 * sum * (1.0 - next) {
            break;
        }
    }
    let (mut j, mut part) = (mode, weight(mode));
    while j > 0.0 {
        part *= j / mean;
        j -= 1.0;
        let term = part * of(j);
        sum += term;
        if term <= 1e-17 * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64, tolerance: f64) -> bool {
        (value / expected - 1.0).abs() < tolerance
    }

    /// Value of Baarda (1968): 17.075 for 0.001 and 0.80.
    #[test]
    fn baardas_table() {
        for (level, power, dimension, expected) in [
            (0.001, 0.80, 1.0, 17.0746),
            (0.001, 0.80, 3.0, 21.5450),
            (0.05, 0.80, 2.0, 9.6347),
            (0.001, 0.90, 1.0, 20.9039),
        ] {
            assert!(close(detectable_noncentrality(level, power, dimension, f64::INFINITY), expected, 5e-6));
        }
    }

    #[test]
    fn without_noncentrality_it_is_the_level() {
        assert!(close(noncentral_chi_square(3.841_458_821, 1.0, 0.0), 0.05, 1e-8));
        assert!(close(noncentral_fisher(4.458_970_108, 2.0, 8.0, 0.0), 0.05, 1e-8));
        let (level, limit) = level_of_equal_power(17.074_646_81, 0.80, 1.0);
        assert!(close(level, 0.001, 1e-6) && close(limit, 10.827_566_17, 1e-7));
    }

    /// Closed form for one degree of freedom by the normal distribution; continuous transition to large noncentralities.
    #[test]
    fn from_small_to_large() {
        for (shift, x) in [(0.5_f64, 4.0_f64), (4.13, 10.8), (100.0, 9_900.0), (900.0, 811_000.0)] {
            let tail = |z: f64| 0.5 * erfc(z / std::f64::consts::SQRT_2);
            let expected = tail(x.sqrt() - shift) + tail(x.sqrt() + shift);
            assert!(close(noncentral_chi_square(x, 1.0, shift * shift), expected, 1e-9));
        }
        for ratio in [0.999, 1.0, 1.001] {
            let (below, above) = (0.999_999 * LARGE, 1.000_001 * LARGE);
            let x = ratio * LARGE;
            let step = noncentral_chi_square(x, 3.0, above) - noncentral_chi_square(x, 3.0, below);
            assert!(step.abs() < 2e-3, "{step}");
            let step = noncentral_fisher(x, 1.0, 2.0, above) - noncentral_fisher(x, 1.0, 2.0, below);
            assert!(step.abs() < 2e-5, "{step}");
        }
        // With one degree of freedom in the denominator only huge errors are detectable.
        assert!(detectable_noncentrality(1e-6, 0.8, 1.0, 1.0) > 1e11);
    }

    #[test]
    fn nonsense_is_not_a_number() {
        assert!(noncentral_chi_square(-1.0, 1.0, 1.0).is_nan());
        assert!(noncentral_fisher(1.0, 1.0, f64::NAN, 1.0).is_nan());
        assert!(detectable_noncentrality(0.5, 0.1, 1.0, 8.0).is_nan());
        assert!(level_of_equal_power(f64::INFINITY, 0.8, 1.0).0.is_nan());
    }
}
