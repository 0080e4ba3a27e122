//! Counts, residuals and redundancy numbers.

use std::ops::Range;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::problem::{Model, Problem};
use crate::normals::{Cofactors, GroupRows};

/// What an adjustment counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Observations proper.
    pub observations: usize,
    /// Unknowns that are observed themselves (a finite standard deviation, not zero).
    pub weighted: usize,
    /// Unknowns that are not fixed.
    pub unknowns: usize,
}

impl Counts {
    /// Observations, those of unknowns themselves among them, minus unknowns.
    pub fn degrees_of_freedom(&self) -> i64 {
        (self.observations + self.weighted) as i64 - self.unknowns as i64
    }
}

/// Residual / (standard deviation x root of the redundancy number), a priori unit weight (Baarda's w); NaN without redundancy.
pub fn standardized(residual: f64, sd: f64, redundancy: f64) -> f64 {
    // What rounding leaves of a redundancy of zero would make a test value of noise.
    if redundancy > 1e-10 { residual / (sd * redundancy.sqrt()) } else { f64::NAN }
}

/// The matrix at the start of a run of cofactors; NaN where there are none.
pub fn leading_matrix<const N: usize>(cofactors: Option<&[f64]>) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| cofactors.map_or(f64::NAN, |values| values[N * i + j])))
}

impl<M> Problem<M> {
    /// Counts observations and unknowns.
    pub fn counts(&self) -> Counts {
        Counts {
            observations: self.observation_sd.len(),
            weighted: (0..self.sd.len()).filter(|&unknown| self.is_weighted(unknown)).count(),
            unknowns: self.sd.iter().filter(|&&sd| sd != 0.0).count(),
        }
    }

    /// Redundancy number of each unknown as an observation of itself, 1 - w q; zero unless it is weighted. The cofactors of
    /// fixed unknowns, which stand in the normal equations with unit weight, are set to zero on the way.
    pub(super) fn finish_cofactors(&self, cofactors: &mut Cofactors) -> Vec<f64> {
        let mut redundancy = vec![0.0; self.sd.len()];
        self.for_diagonal(cofactors, |unknown, q| {
            if self.is_weighted(unknown) {
                redundancy[unknown] = 1.0 - *q / (self.sd[unknown] * self.sd[unknown]);
            } else if self.sd[unknown] == 0.0 {
                *q = 0.0;
            }
        });
        redundancy
    }

    /// Hands out the cofactor of every unknown.
    fn for_diagonal(&self, cofactors: &mut Cofactors, mut take: impl FnMut(usize, &mut f64)) {
        let layout = self.layout();
        let mut diagonal = |block: &mut [f64], unknowns: Range<usize>| {
            let dim = unknowns.len();
            unknowns.enumerate().for_each(|(d, unknown)| take(unknown, &mut block[d * (dim + 1)]));
        };
        let l = layout.local_dim();
        for (local, block) in cofactors.local.chunks_exact_mut(l * l).enumerate() {
            diagonal(block, layout.local_range(local));
        }
        let mut start = 0;
        for kept in 0..layout.kept() {
            diagonal(&mut cofactors.kept[start..], layout.kept_range(kept));
            start += layout.kept_dim(kept).pow(2);
        }
        diagonal(&mut cofactors.border, layout.border_range());
    }
}

impl<M: Model> Problem<M> {
    /// Observed minus computed of every observation at the given values of the unknowns.
    pub(super) fn residuals(&self, pool: &ThreadPool, values: &[f64]) -> Vec<f64> {
        let layout = self.layout();
        let rows = layout.rows();
        let prepared = pool.install(|| self.model.prepare(values));
        let residuals_of = |local: usize| {
            let groups = layout.groups_of(local);
            let mut residuals = vec![0.0; groups.len() * rows];
            let mut local_part = vec![0.0; rows * layout.local_dim()];
            let (mut kept, mut border) = (Vec::new(), Vec::new());
            for (group, constant) in groups.zip(residuals.chunks_exact_mut(rows)) {
                kept.resize(rows * layout.kept_dim(layout.kept_of(group)), 0.0);
                border.resize(rows * layout.border_of(group).len(), 0.0);
                let mut part =
                    GroupRows { constant, local: &mut local_part, kept: &mut kept, border: &mut border };
                self.model.observe(&prepared, local, group, &mut part);
            }
            residuals
        };
        let by_local: Vec<Vec<f64>> = pool
            .install(|| (0..layout.locals()).into_par_iter().with_min_len(64).map(residuals_of).collect());
        by_local.concat()
    }

    /// Weighted sum of squares of the given residuals.
    pub fn sum_of_squares(&self, residuals: &[f64]) -> f64 {
        residuals.iter().zip(&self.observation_sd).map(|(residual, sd)| (residual / sd).powi(2)).sum()
    }

    /// Weighted sum of squares of observed minus computed unknowns.
    pub fn prior_sum_of_squares(&self, values: &[f64]) -> f64 {
        values.iter().enumerate().map(|(unknown, &value)| self.prior_square(unknown, value)).sum()
    }
}
