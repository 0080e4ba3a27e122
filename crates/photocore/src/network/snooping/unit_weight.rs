//! Unit weight and significance level of the tests of data snooping.

use std::collections::BTreeMap;

use super::log::Standing;
use crate::adjustment::{Tail, chi_square, chi_square_quantile, fisher_limit, log_chi_square, log_fisher};

/// Level of the global test.
const LEVEL: f64 = 0.05;
/// Maximum effect of curvature on the difference of two T, in T^(3/2).
const CURVATURE: f64 = 2e-5;
/// Smallest fraction of the sum of squares that remains without a group: zero within rounding.
const ROUNDING: f64 = 1e-12;
/// Maximum exponent of a likelihood ratio.
const MAX_EXPONENT: f64 = 700.0;

/// Unit weight of the tests: Omega and f of the other observations.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitWeight {
    /// Whether the given standard deviations are correct: chi-square decides, otherwise F.
    pub known: bool,
    pub sum: f64,
    pub freedom: f64,
}

impl UnitWeight {
    pub fn new(known: bool, standing: &Standing) -> Self {
        Self { known, sum: standing.sum_of_squares, freedom: standing.degrees_of_freedom as f64 }
    }

    /// Returns the unit weight without a group.
    pub fn without(self, statistic: f64, dimension: usize) -> Self {
        let sum = (self.sum - statistic).max(ROUNDING * self.sum);
        Self { sum, freedom: self.freedom - dimension as f64, ..self }
    }

    /// Returns F = (T / m) / ((Omega - T) / (f - m)); NaN if it is undefined.
    pub fn fisher(self, statistic: f64, dimension: usize) -> f64 {
        let others = self.without(statistic, dimension);
        if dimension == 0 || others.freedom.is_nan() || others.freedom <= 0.0 {
            return f64::NAN;
        }
        let variance = others.sum / others.freedom;
        if variance > 0.0 { statistic / dimension as f64 / variance } else { f64::INFINITY }
    }

    /// Returns the logarithm of the p-value of a group; NaN if nothing is tested.
    pub fn log_probability(self, statistic: f64, dimension: usize) -> f64 {
        match (dimension, self.known) {
            (0, _) => f64::NAN,
            (_, true) => log_chi_square(statistic, dimension as f64),
            (_, false) => {
                let second = self.freedom - dimension as f64;
                log_fisher(self.fisher(statistic, dimension), dimension as f64, second)
            }
        }
    }

    /// Returns the critical value of T: of chi-square, or of F solved for T.
    fn critical(self, dimension: usize, limit: f64) -> f64 {
        let dimension = dimension as f64;
        if self.known {
            return chi_square_quantile(limit, dimension, Tail::Upper);
        }
        let others = self.freedom - dimension;
        if others.is_nan() || others <= 0.0 {
            return f64::INFINITY;
        }
        let ratio = dimension * fisher_limit(limit, dimension, others) / others;
        self.sum * ratio / (1.0 + ratio)
    }

    /// Returns whether the global test rejects the residuals as too large, with standard deviations scaled by the root of `scale`. None
    /// without a test: the unit weight is estimated from the same residuals.
    pub fn is_rejected(self, scale: f64) -> Option<bool> {
        let below = || chi_square(self.sum / scale, self.freedom, Tail::Upper) < LEVEL / 2.0;
        self.known.then(|| self.freedom > 0.0 && below())
    }

    /// Returns the likelihood ratio of two groups from T and m of each (Akaike weights).
    ///
    /// T refers to linear equations. A large error has a nonlinear effect of the order T^(3/2), which is removed from the difference of
    /// both T.
    pub fn odds(self, (t, m): (f64, usize), (other, n): (f64, usize)) -> f64 {
        let difference = other - t;
        let curvature = CURVATURE * t.max(other).powf(1.5);
        let other = t + (difference.abs() - curvature).max(0.0).copysign(difference);
        let exponent = if self.known {
            (t - other) / 2.0
        } else {
            let left = |t: f64| (self.sum - t).max(ROUNDING * self.sum).max(f64::MIN_POSITIVE);
            self.freedom / 2.0 * (left(other) / left(t)).ln()
        };
        (exponent - (m as f64 - n as f64)).min(MAX_EXPONENT).exp()
    }
}

/// Critical values of T by dimension, computed at first use.
pub(super) struct Criticals {
    unit: UnitWeight,
    limit: f64,
    by_dimension: BTreeMap<usize, f64>,
}

impl Criticals {
    pub fn new(unit: UnitWeight, limit: f64) -> Self {
        Self { unit, limit, by_dimension: BTreeMap::new() }
    }

    pub fn of(&mut self, dimension: usize) -> f64 {
        let (unit, limit) = (self.unit, self.limit);
        *self.by_dimension.entry(dimension).or_insert_with(|| unit.critical(dimension, limit))
    }
}

/// Significance level of the groups.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// Joint level of all tests (Bonferroni), or the false discovery rate.
    pub family: f64,
    /// Number of tests at the start, which does not change.
    pub tests: usize,
    /// Whether the limit increases with the exclusions: step k has k times the limit of the first.
    pub is_rate: bool,
}

impl Level {
    /// Returns the limit of the p-value of the next group after `count` exclusions.
    pub fn limit(&self, count: usize) -> f64 {
        let steps = if self.is_rate { count + 1 } else { 1 };
        (self.family * steps as f64 / self.tests.max(1) as f64).min(0.5)
    }
}
