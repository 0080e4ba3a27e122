//! Counts, residuals, redundancy numbers and medians.

use std::collections::BTreeSet;
use std::ops::Range;

use super::loss::Loss;
use super::prior_terms::{PriorTerms, weighted_among};
use super::problem::{AnyProblem, Evaluated, Problem};
use crate::Threads;
use crate::normals::{Cofactors, dot};

/// Numbers of observations and unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Observations, without weighted unknowns.
    pub observations: usize,
    /// Weighted unknowns (finite, nonzero standard deviation).
    pub weighted: usize,
    /// Unknowns that are neither fixed nor constrained for a datum.
    pub unknowns: usize,
}

impl Counts {
    /// Number of observations and weighted unknowns, minus the number of unknowns.
    pub fn degrees_of_freedom(&self) -> i64 {
        (self.observations + self.weighted) as i64 - self.unknowns as i64
    }
}

/// Group of observations after the adjustment.
#[derive(Debug, Clone, Copy)]
pub struct Observed<const ROWS: usize> {
    /// Observed minus computed, in the units of the observations.
    pub residual: [f64; ROWS],
    /// Redundancy numbers; NaN if not requested.
    pub redundancy: [f64; ROWS],
    /// Standardized residuals (see [`standardized`]); NaN if not requested or if the redundancy is zero.
    pub standardized: [f64; ROWS],
    /// Weight factor from the loss; 1 without a loss.
    pub weight: f64,
}

/// Standardized residual: residual / (standard deviation x root of the redundancy number), a priori unit weight (Baarda's w). NaN without
/// redundancy.
pub fn standardized(residual: f64, sd: f64, redundancy: f64) -> f64 {
    // A redundancy number of pure rounding error would give a meaningless test value.
    if redundancy > 1e-10 { residual / (sd * redundancy.sqrt()) } else { f64::NAN }
}

/// Residual / standard deviation; zero for an excluded observation (infinite standard deviation), whose residual may not be finite.
pub(crate) fn weighted(residual: f64, sd: f64) -> f64 {
    if sd.is_infinite() { 0.0 } else { residual / sd }
}

/// Square of [`weighted`].
pub(super) fn square((&residual, &sd): (&f64, &f64)) -> f64 {
    weighted(residual, sd).powi(2)
}

/// Returns the leading N x N matrix of a slice of cofactors; NaN without cofactors.
pub fn leading_matrix<const N: usize>(cofactors: Option<&[f64]>) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| cofactors.map_or(f64::NAN, |values| values[N * i + j])))
}

impl<M: ?Sized> Problem<M> {
    /// Counts observations and unknowns; each of the `held` unknowns reduces the number of unknowns by one. Outer unknowns are not counted.
    pub fn counts(&self, held: &[usize]) -> Counts {
        let layout = self.layout();
        let outer = layout.unknowns_of(layout.outer()).filter(|&unknown| self.sd[unknown] != 0.0);
        let elsewhere = outer.chain(held.iter().copied()).collect::<BTreeSet<usize>>().len();
        Counts {
            observations: self.observation_sd.len(),
            weighted: weighted_among(&self.sd, 0..self.sd.len()).count(),
            unknowns: self.sd.iter().filter(|&&sd| sd != 0.0).count() - elsewhere,
        }
    }
}

impl AnyProblem<'_> {
    /// Returns the objective at values with the given residuals: the weighted sum of squares, with a loss for groups and terms.
    pub fn objective(&self, values: &[f64], residuals: &[f64], loss: Option<Loss>) -> f64 {
        let observed: f64 = match loss {
            None => self.sum_of_squares(residuals),
            Some(loss) => self.group_squares(residuals).map(|square| loss.value(square)).sum(),
        };
        observed + self.prior_terms(values).sum_of_squares(0..values.len())
    }

    /// Returns the redundancy number of each unknown as an observation of itself, 1 - a Q a^T for its equation a; zero unless weighted.
    /// Cofactors of fixed and constrained unknowns, which have unit weight in the normal equations, are set to zero. `prior_terms` are those
    /// of the linearization point.
    pub(super) fn finish_cofactors(
        &self,
        cofactors: &mut Cofactors,
        held: &[usize],
        prior_terms: &PriorTerms,
    ) -> Vec<f64> {
        let (mut redundancy, fixed) = (vec![0.0; self.sd.len()], self.fixed(held));
        let mut prior_terms = prior_terms.within(0..self.sd.len()).peekable();
        let mut finish = |block: &mut [f64], unknowns: Range<usize>| {
            let width = unknowns.len();
            for (d, unknown) in unknowns.clone().enumerate() {
                if fixed[unknown] {
                    block[d * (width + 1)] = 0.0;
                }
            }
            while let Some(term) = prior_terms.next_if(|term| term.first < unknowns.end) {
                let first = (term.first - unknowns.start) * (width + 1);
                for (row, unknown) in term.rows().zip(term.unknowns()).filter(|&(_, i)| self.is_weighted(i)) {
                    let along = |i: usize| dot(row, &block[first + i * width..][..row.len()]);
                    redundancy[unknown] =
                        1.0 - row.iter().enumerate().map(|(i, a)| a * along(i)).sum::<f64>();
                }
            }
        };
        let (layout, l) = (self.layout(), self.layout().local_dim());
        for (local, block) in cofactors.local.chunks_exact_mut(l * l).enumerate() {
            finish(block, layout.local_range(local));
        }
        let mut rest = &mut cofactors.retained[..];
        for retained in 0..layout.retained() {
            let (block, behind) = rest.split_at_mut(layout.retained_dim(retained).pow(2));
            finish(block, layout.retained_range(retained));
            rest = behind;
        }
        redundancy
    }

    /// Returns the residuals (observed minus computed) of all observations at given values.
    pub(super) fn residuals(&self, threads: &Threads, values: &[f64]) -> Vec<f64> {
        self.residuals_at(threads, &*threads.install(|| self.model.at(values)))
    }

    /// Returns the residuals of an evaluated model.
    #[doc(hidden)]
    pub fn residuals_at(&self, threads: &Threads, at: &dyn Evaluated) -> Vec<f64> {
        let layout = self.layout();
        let rows = layout.rows();
        let by_stretch = self.for_locals(threads, |buffers, locals| {
            let groups = layout.groups_of(locals.start).start..layout.groups_of(locals.end - 1).end;
            let mut residuals = vec![0.0; groups.len() * rows];
            let mut own = residuals.chunks_exact_mut(rows.max(1));
            for local in locals {
                for (group, own) in layout.groups_of(local).zip(&mut own) {
                    if !at.write_misclosure(local, group, own) {
                        let mut rows = buffers.rows.group(layout, group);
                        at.observe(local, group, &mut rows);
                        own.copy_from_slice(rows.constant);
                    }
                }
            }
            residuals
        });
        let by_term = self.for_terms(threads, |buffers, terms| {
            let mut residuals = vec![];
            for term in terms {
                let mut rows = buffers.rows.term(layout, term);
                at.observe_term(term, &mut rows);
                residuals.extend_from_slice(rows.constant);
            }
            residuals
        });
        let mut residuals = by_stretch.concat();
        residuals.extend(by_term.concat());
        residuals
    }
}

impl<M: ?Sized> Problem<M> {
    /// Weighted sum of squares of the given residuals.
    pub fn sum_of_squares(&self, residuals: &[f64]) -> f64 {
        residuals.iter().zip(&self.observation_sd).map(square).sum()
    }

    /// Returns the weighted sum of squares for each group, then for each term.
    pub(super) fn group_squares(&self, residuals: &[f64]) -> impl Iterator<Item = f64> {
        let layout = self.layout();
        let groups = (0..layout.groups()).map(|group| layout.equations_of_group(group));
        let terms = (0..layout.terms().len()).map(|term| layout.equations_of_term(term));
        groups
            .chain(terms)
            .map(|range| residuals[range.clone()].iter().zip(&self.observation_sd[range]).map(square).sum())
    }
}

/// Returns the upper median of some numbers; None if the list is empty.
#[inline]
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the median: the mean of both middle values of an even number; NaN without values.
pub(crate) fn middle(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        count => f64::midpoint(values[(count - 1) / 2], values[count / 2]),
    }
}
