//! Conditional tests of groups, each after the exclusion of others.
//!
//! v are the residuals of unit weight of some rows, R their cofactors, and S the excluded rows. Then
//!
//! v <- v - R_S R_SS^- v_S,    R <- R - R_S R_SS^- R_S^T,    Omega <- Omega - T_S,    f <- f - m_S
//!
//! is the result of an adjustment without S in a linear model (Hadi and Simonoff 1993).

use nalgebra::DMatrix;

use super::super::predictions::ResidualBlock;
use super::groups::Groups;
use super::log::Rival;
use super::unit_weight::UnitWeight;
use crate::adjustment::{GroupTest, VISIBLE};

/// Relative difference of equal log-probabilities, for which the order of the groups decides. Observations of a point on two photos differ
/// only by the convergence error of the adjustment.
const EQUAL: f64 = 1e-3;
/// Likelihood ratio up to which other groups are alternatives.
const ALTERNATIVE: f64 = 20.0;

/// A selected group, or a part of one.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    pub group: usize,
    /// Selected rows among all rows.
    pub rows: Vec<usize>,
    /// T of these rows.
    pub statistic: f64,
    pub dimension: usize,
    pub log_probability: f64,
    pub fisher: f64,
    /// Estimated errors and their standard deviations, of unit weight.
    pub error: Vec<f64>,
    pub error_sd: Vec<f64>,
    /// Groups that were significant only before the exclusion.
    pub rivals: Vec<Rival>,
    /// T at the start of the round.
    pub first_statistic: f64,
    /// Limit of the p-value.
    pub limit: f64,
}

/// Test value of a group, of unit weight.
#[derive(Debug, Clone, Copy)]
struct Value {
    statistic: f64,
    dimension: usize,
    log_probability: f64,
}

/// Groups with the cofactors of all their residuals.
pub(super) struct Conditional<'a> {
    block: ResidualBlock,
    /// First row of each group, and the number of rows at the end.
    starts: Vec<usize>,
    groups: &'a Groups,
    /// Square of the factor of the standard deviations of each group of the network.
    scales: &'a [f64],
    pub unit: UnitWeight,
    values: Vec<Value>,
}

impl<'a> Conditional<'a> {
    pub fn new(block: ResidualBlock, groups: &'a Groups, scales: &'a [f64], unit: UnitWeight) -> Self {
        let starts = groups.table.starts_among(&block.groups);
        let mut new = Self { block, starts, groups, scales, unit, values: vec![] };
        new.test_all();
        new
    }

    /// Returns the groups of the block.
    pub fn groups(&self) -> &[usize] {
        &self.block.groups
    }

    fn group(&self, place: usize) -> usize {
        self.block.groups[place]
    }

    pub fn scale(&self, place: usize) -> f64 {
        self.scales[self.group(place)]
    }

    /// Returns the logarithm of the p-value of a group.
    pub fn log_probability(&self, place: usize) -> f64 {
        self.values[place].log_probability
    }

    fn test_all(&mut self) {
        let value = |place: usize| {
            let rows: Vec<usize> = (self.starts[place]..self.starts[place + 1]).collect();
            let (test, log_probability) = self.test(&rows, self.scale(place));
            Value { statistic: test.statistic, dimension: test.rank, log_probability }
        };
        self.values = (0..self.block.groups.len()).map(value).collect();
    }

    /// Tests some rows of the block.
    fn test(&self, rows: &[usize], scale: f64) -> (GroupTest, f64) {
        let (count, root) = (self.block.residual.len(), scale.sqrt());
        let residuals: Vec<f64> = rows.iter().map(|&row| self.block.residual[row] / root).collect();
        let cofactors: Vec<f64> = rows
            .iter()
            .flat_map(|&row| rows.iter().map(move |&column| row * count + column))
            .map(|k| self.block.cofactors[k])
            .collect();
        let test = GroupTest::new(&residuals, &cofactors, None);
        let log_probability = self.unit.log_probability(test.statistic, test.rank);
        (test, log_probability)
    }

    /// Returns the first of the least probable groups in use.
    pub fn least_probable(&self, is_allowed: &[bool]) -> Option<usize> {
        let log_p = |place: &usize| self.values[*place].log_probability;
        let tested =
            |place: &usize| is_allowed[*place] && self.values[*place].dimension > 0 && !log_p(place).is_nan();
        let all = || (0..self.values.len()).filter(tested);
        let least = all().map(|place| log_p(&place)).reduce(f64::min).filter(|least| least.is_finite())?;
        all().find(|place| log_p(place) <= least + EQUAL * least.abs().max(1.0))
    }

    /// Returns the rows of a group of the block: the least probable of its parts, if parts are separate.
    pub fn rows_to_exclude(&self, place: usize) -> Vec<usize> {
        let first = self.starts[place];
        let all = || (first..self.starts[place + 1]).collect();
        let Some(parts) = self.groups.parts(self.group(place)) else { return all() };
        let tested = parts.into_iter().filter_map(|part| {
            let rows: Vec<usize> = part.into_iter().map(|row| first + row).collect();
            let log_p = self.test(&rows, self.scale(place)).1;
            (!log_p.is_nan()).then_some((rows, log_p))
        });
        tested.reduce(|best, next| if next.1 < best.1 { next } else { best }).map_or_else(all, |best| best.0)
    }

    /// Excludes rows of a group of the block, and tests the others without them. The limit is the one of p-values.
    pub fn exclude(&mut self, place: usize, rows: &[usize], is_allowed: &[bool], limit: f64) -> Chosen {
        let (group, scale, unit) = (self.group(place), self.scale(place), self.unit);
        let (test, log_probability) = self.test(rows, scale);
        let statistic = scale * test.statistic;
        self.unit = unit.without(statistic, test.rank);
        self.condition(rows);
        let before = std::mem::take(&mut self.values);
        self.test_all();
        let log_limit = limit.ln();
        let is_rival = |other: &usize| {
            let now = &self.values[*other];
            let is_significant = now.dimension > 0 && now.log_probability < log_limit;
            *other != place
                && is_allowed[*other]
                && before[*other].log_probability < log_limit
                && !is_significant
        };
        let rival = |other: usize| {
            let Value { statistic, dimension, .. } = before[other];
            let odds = unit.odds((test.statistic, test.rank), (statistic, dimension));
            Rival { group: self.group(other), statistic, dimension, odds }
        };
        let mut rivals: Vec<Rival> = (0..before.len()).filter(is_rival).map(rival).collect();
        rivals.retain(|rival| rival.odds < ALTERNATIVE);
        rivals.sort_by(|a, b| a.odds.total_cmp(&b.odds));
        let first = self.groups.rows(group).start;
        Chosen {
            group,
            rows: rows.iter().map(|row| first + row - self.starts[place]).collect(),
            statistic,
            dimension: test.rank,
            log_probability,
            fisher: unit.fisher(statistic, test.rank),
            error: test.error.iter().map(|error| error * scale.sqrt()).collect(),
            error_sd: (0..rows.len()).map(|k| test.cofactors[k * (rows.len() + 1)].sqrt()).collect(),
            rivals,
            first_statistic: f64::NAN,
            limit,
        }
    }

    fn condition(&mut self, rows: &[usize]) {
        let ResidualBlock { residual: v, cofactors: r, .. } = &mut self.block;
        let count = v.len();
        let eigen =
            DMatrix::from_fn(rows.len(), rows.len(), |i, j| r[rows[i] * count + rows[j]]).symmetric_eigen();
        for (k, &value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > VISIBLE) {
            let direction = eigen.eigenvectors.column(k) / value.sqrt();
            let along: Vec<f64> = (0..count)
                .map(|row| rows.iter().zip(&direction).map(|(&own, part)| r[row * count + own] * part).sum())
                .collect();
            let size: f64 = rows.iter().zip(&direction).map(|(&own, part)| v[own] * part).sum();
            for (row, &factor) in along.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                v[row] -= factor * size;
                let own = &mut r[row * count..][..count];
                own.iter_mut().zip(&along).for_each(|(value, other)| *value -= factor * other);
            }
        }
        rows.iter().for_each(|&row| v[row] = 0.0);
    }
}
