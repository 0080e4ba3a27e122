//! Counts, residuals and redundancy numbers.

use std::collections::BTreeSet;
use std::ops::Range;

use rayon::ThreadPool;

use super::problem::{Model, Problem, Weighted};
use crate::normals::Cofactors;

/// What an adjustment counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Observations proper.
    pub observations: usize,
    /// Unknowns that are observed themselves (a finite standard deviation, not zero).
    pub weighted: usize,
    /// Unknowns that are not fixed, nor held for a datum.
    pub unknowns: usize,
}

impl Counts {
    /// Observations, those of unknowns themselves among them, minus unknowns.
    pub fn degrees_of_freedom(&self) -> i64 {
        (self.observations + self.weighted) as i64 - self.unknowns as i64
    }
}

/// A group of observations after the adjustment.
#[derive(Debug, Clone, Copy)]
pub struct Observed<const ROWS: usize> {
    /// Observed minus computed, in the units of the observations.
    pub residual: [f64; ROWS],
    /// Redundancy numbers; NaN when not asked for.
    pub redundancy: [f64; ROWS],
    /// See [`standardized`]; NaN when not asked for, and where the redundancy is zero.
    pub standardized: [f64; ROWS],
    /// The factor by which a loss has changed their weights; 1 without a loss.
    pub weight: f64,
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
    /// Counts observations and unknowns; a datum of `held` unknowns takes as many degrees of freedom. Outer unknowns, held or not, do not
    /// count: they are free or fixed here.
    pub fn counts(&self, held: &[usize]) -> Counts {
        let layout = self.layout();
        let outer = layout.unknowns_of(layout.outer()).filter(|&unknown| self.sd[unknown] != 0.0);
        let elsewhere = outer.chain(held.iter().copied()).collect::<BTreeSet<usize>>().len();
        Counts {
            observations: self.observation_sd.len(),
            weighted: self.weighted_among(0..self.sd.len()).count(),
            unknowns: self.sd.iter().filter(|&&sd| sd != 0.0).count() - elsewhere,
        }
    }

    /// Redundancy number of each unknown as an observation of itself, 1 - w q; zero unless it is weighted. The cofactors of
    /// fixed and held unknowns, which stand in the normal equations with unit weight, are set to zero on the way; `values` are those at
    /// which these were formed.
    pub(super) fn finish_cofactors(
        &self,
        cofactors: &mut Cofactors,
        held: &[usize],
        values: &[f64],
    ) -> Vec<f64>
    where
        M: Model,
    {
        let mut redundancy = vec![0.0; self.sd.len()];
        self.for_diagonal(cofactors, |unknown, q| {
            if self.is_weighted(unknown) {
                redundancy[unknown] = 1.0 - *q / (self.sd[unknown] * self.sd[unknown]);
            } else if self.sd[unknown] == 0.0 || held.contains(&unknown) {
                *q = 0.0;
            }
        });
        self.stepping_together(cofactors, &self.weighted(values), &mut redundancy);
        redundancy
    }

    /// The redundancy numbers of weighted unknowns that step together, of equations a of unit weight: 1 - a Q a^T.
    fn stepping_together(&self, cofactors: &Cofactors, weighted: &[Weighted], redundancy: &mut [f64]) {
        let layout = self.layout();
        let (mut weighted, mut start) = (weighted.iter().peekable(), 0);
        for kept in 0..layout.kept() {
            let (range, width) = (layout.kept_range(kept), layout.kept_dim(kept));
            while let Some(own) = weighted.next_if(|own| own.first < range.end) {
                let first = start + (own.first - range.start) * (width + 1);
                for (row, unknown) in own.rows().zip(own.unknowns()).filter(|&(_, i)| self.is_weighted(i)) {
                    let q_row = |i: usize| &cofactors.kept[first + i * width..];
                    let along = |i: usize| row.iter().zip(q_row(i)).map(|(a, q)| a * q).sum::<f64>();
                    let share: f64 = row.iter().enumerate().map(|(i, a)| a * along(i)).sum();
                    redundancy[unknown] = 1.0 - share;
                }
            }
            start += width * width;
        }
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
    }
}

impl<M: Model> Problem<M> {
    /// Observed minus computed of every observation at the given values of the unknowns.
    pub(super) fn residuals(&self, pool: &ThreadPool, values: &[f64]) -> Vec<f64> {
        self.residuals_at(pool, &pool.install(|| self.model.prepare(values)))
    }

    /// The same at values that are prepared already.
    pub(super) fn residuals_at(&self, pool: &ThreadPool, prepared: &M::Prepared) -> Vec<f64> {
        let layout = self.layout();
        let rows = layout.rows();
        let by_stretch = self.for_stretches(pool, |buffers, locals| {
            let groups = layout.groups_of(locals.start).start..layout.groups_of(locals.end - 1).end;
            let mut residuals = vec![0.0; groups.len() * rows];
            let mut own = residuals.chunks_exact_mut(rows.max(1));
            for local in locals {
                for (group, own) in layout.groups_of(local).zip(&mut own) {
                    if !self.model.misclose(prepared, local, group, own) {
                        let mut rows = buffers.rows(layout, group);
                        self.model.observe(prepared, local, group, &mut rows);
                        own.copy_from_slice(rows.constant);
                    }
                }
            }
            residuals
        });
        let by_tie = self.for_ties(|tie, rows| {
            self.model.observe_tie(prepared, tie, rows);
            rows.constant.to_vec()
        });
        let mut residuals = by_stretch.concat();
        by_tie.iter().for_each(|of_tie| residuals.extend_from_slice(of_tie));
        residuals
    }
}

impl<M> Problem<M> {
    /// Weighted sum of squares of the given residuals.
    pub fn sum_of_squares(&self, residuals: &[f64]) -> f64 {
        residuals.iter().zip(&self.observation_sd).map(|(residual, sd)| (residual / sd).powi(2)).sum()
    }

    /// Weighted sum of squares of each group, then of each tie, of the given residuals.
    pub(super) fn group_squares(&self, residuals: &[f64]) -> impl Iterator<Item = f64> {
        let layout = self.layout();
        let (rows, first) = (layout.rows(), layout.groups() * layout.rows());
        let groups = (0..layout.groups()).map(move |group| group * rows..(group + 1) * rows);
        let ties = (0..layout.ties().len()).map(move |tie| {
            let range = layout.tie_rows(tie);
            first + range.start..first + range.end
        });
        groups.chain(ties).map(|range| {
            let pairs = residuals[range.clone()].iter().zip(&self.observation_sd[range]);
            pairs.map(|(v, sd)| (v / sd).powi(2)).sum()
        })
    }
}
