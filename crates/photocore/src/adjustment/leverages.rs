//! Residuals, cofactors and leverages a Q a^T of a problem at adjusted values, for tests of groups of observations.
//!
//! Excluded observations have infinite standard deviations, so that their normal equations are zero. The pattern, order and symbolic
//! factorisation are unchanged and include the cofactors of excluded observations.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;

use super::equations::ObservationEquations;
use super::group_test::{leverage_odds, may_correlate};
use super::linearized::{CofactorError, Inverted, Linearized};
use super::problem::AnyProblem;
use super::result::{AdjustError, Adjustment};
use super::walk::Buffers;
use crate::normals::{
    Cofactors, Equations, FactorOptions, Function, InvertOptions, Layout, LayoutError, RowCofactors,
    SelectedInverse, System,
};
use crate::{Context, Threads, parallel};
use faer::Mat;

/// Problem at adjusted values, with all cofactors inside the pattern of its normal equations.
#[derive(Debug)]
pub struct Leverages {
    /// Unknowns, in the order of the layout.
    pub values: Vec<f64>,
    /// Unknowns constrained for a datum.
    pub held: Vec<usize>,
    /// Residuals (observed minus computed), including excluded observations, in the units of the observations.
    pub residuals: Vec<f64>,
    /// Cofactors, including leverage matrices of groups; those of single equations are their diagonals and not stored again.
    pub cofactors: Cofactors,
    selected: SelectedInverse,
    linearized: Option<Linearized>,
}

impl Leverages {
    /// Moves the data that [`super::Requests::by_groups`] requests out of an adjustment, at its final values; None if it did not store them.
    pub fn of(adjustment: &mut Adjustment, values: &[f64]) -> Option<Self> {
        let (selected, mut cofactors) = (adjustment.selected.take()?, adjustment.cofactors.take()?);
        cofactors.equations = vec![];
        let residuals = std::mem::take(&mut adjustment.residuals);
        let values = values.to_vec();
        let held = adjustment.datum.clone();
        let factor = adjustment.factor.take();
        let linearized = factor.map(|factor| Linearized::of_factor(factor, values.clone(), held.clone()));
        Some(Self { values, held, residuals, cofactors, selected, linearized })
    }

    /// Linearizes and inverts a problem at given values with some unknowns constrained.
    ///
    /// # Errors
    /// Undetermined unknowns, an interruption, or lack of memory.
    pub fn at(
        problem: &AnyProblem<'_>,
        values: Vec<f64>,
        held: Vec<usize>,
        context: &mut Context<'_>,
    ) -> Result<Self, AdjustError> {
        problem.check_lengths(&values)?;
        let equations = ObservationEquations::new(problem, None, &values, &held, context.threads);
        let forming = FactorOptions::UNCACHED;
        let formed = Linearized::of(&equations, values, held, &forming, context)?.determined()?;
        let factor = formed.small_factor(context.threads);
        let inverting = InvertOptions { by_groups: true, ..InvertOptions::default() };
        let found = formed.invert(&equations, &inverting, context)?;
        let Inverted { values, held, mut cofactors, selected, .. } = found;
        cofactors.equations = vec![];
        let residuals = problem.residuals(context.threads, &values);
        let linearized = factor.map(|factor| Linearized::of_factor(factor, values.clone(), held.clone()));
        Ok(Self { values, held, residuals, cofactors, selected, linearized })
    }

    /// Returns the factored normal equations, which solve for retained unknowns; they are formed again if the factor is large.
    ///
    /// # Errors
    /// Lack of memory.
    pub fn linearized(
        &self,
        problem: &AnyProblem<'_>,
        threads: &Threads,
    ) -> Result<Cow<'_, Linearized>, AdjustError> {
        if let Some(own) = &self.linearized {
            return Ok(Cow::Borrowed(own));
        }
        let (values, held) = (self.values.clone(), self.held.clone());
        Ok(Cow::Owned(Linearized::form(problem, None, values, held, &mut Context::new(threads))?))
    }

    /// Releases the residuals, the largest cofactors and the inverse, whose memory the next factor takes over.
    pub fn release(&mut self, system: &System) {
        (self.residuals, self.cofactors.local, self.cofactors.groups) = (vec![], vec![], None);
        system.reuse(&mut self.selected);
    }

    /// Weighted sum of squares of the included observations.
    pub fn sum_of_squares(&self, problem: &AnyProblem<'_>) -> f64 {
        problem.objective(&self.values, &self.residuals, None)
    }

    /// Number of included observations and weighted unknowns, minus the number of unknowns.
    pub fn degrees_of_freedom(&self, problem: &AnyProblem<'_>) -> i64 {
        let out = problem.observation_sd.iter().filter(|sd| sd.is_infinite()).count();
        problem.counts(&self.held).degrees_of_freedom() - out as i64
    }

    /// Returns the cofactors of all equations of some local blocks, from the selected inverse: a solution with the factor for each equation
    /// would cost several times as much.
    ///
    /// * `observation_sd`: standard deviations of the observations;
    /// * `included`: standard deviations of the unknowns, if excluded blocks are treated as included ones;
    /// * `terms`: prior equations of the weighted unknowns of a block, in unit weight;
    /// * `limit`: if given, cofactors between groups of fixed local blocks are added, which are outside the pattern of the normal equations.
    ///   They remain NaN if all possible correlations are below this limit.
    ///
    /// # Errors
    /// The problem has another layout; an interruption or lack of memory.
    pub fn of_locals(
        &self,
        problem: &AnyProblem<'_>,
        (observation_sd, included): (&[f64], Option<&[f64]>),
        locals: &[usize],
        (terms, limit): (impl Fn(usize) -> Vec<Function> + Sync, Option<f64>),
        threads: &Threads,
    ) -> Result<Vec<RowCofactors>, AdjustError> {
        let mut asked = self.equations(problem, threads).with_deviations(observation_sd);
        let mut weight = asked.prior().weight.clone();
        if let Some(sd) = included {
            let unknowns = || locals.iter().flat_map(|&local| problem.layout().local_range(local));
            for unknown in unknowns() {
                let own = sd[unknown];
                weight[unknown] = if own == 0.0 { 1.0 } else { (own * own).recip() };
            }
            asked = asked.with_unknowns(unknowns(), sd);
        }
        let same = included.is_some() || std::ptr::eq(observation_sd, &problem.observation_sd[..]);
        let others = (!same).then(|| self.equations(problem, threads));
        let of = |&local: &usize| {
            let (of_groups, of_terms) = rows_of_local(&asked, local);
            let mut rows = of_groups.clone();
            rows.extend(terms(local));
            let (mut formed, terms) = match &others {
                Some(included) => rows_of_local(included, local),
                None => (of_groups, of_terms),
            };
            formed.extend(terms);
            problem.system.local_cofactors(&self.selected, (&formed, &weight), &rows, local)
        };
        let found = threads.install(|| parallel::map(locals.len(), 1, |k| of(&locals[k])));
        let mut found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        if let Some(limit) = limit {
            self.add_cofactors_between_groups(problem, observation_sd, (locals, limit), &mut found, threads)?;
        }
        Ok(found)
    }

    /// Computes cofactors between groups of fixed local blocks from the factor.
    fn add_cofactors_between_groups(
        &self,
        problem: &AnyProblem<'_>,
        observation_sd: &[f64],
        (locals, limit): (&[usize], f64),
        found: &mut [RowCofactors],
        threads: &Threads,
    ) -> Result<(), AdjustError> {
        let layout = problem.layout();
        let chosen_on = |(place, &local): (usize, &usize)| {
            let rows = correlated_rows(&found[place], layout, local, limit);
            (place, local, rows)
        };
        let difference = locals.iter().enumerate().filter(|&(_, &local)| layout.has_uncoupled_groups(local));
        let chosen: Vec<_> = difference.map(chosen_on).filter(|(.., rows)| !rows.is_empty()).collect();
        if chosen.is_empty() {
            return Ok(());
        }
        let asked = self.equations(problem, threads).with_deviations(observation_sd);
        let (formed, mut context) = (self.linearized(problem, threads)?, Context::new(threads));
        for (place, local, chosen) in chosen {
            let own = &mut found[place];
            let (rows_of_groups, _) = rows_of_local(&asked, local);
            let functions: Vec<Function> = chosen.iter().map(|&row| rows_of_groups[row].clone()).collect();
            let cofactors = match formed.cofactors(problem, &functions, None, None, &mut context) {
                Err(CofactorError::Adjust(error)) => return Err(error),
                found => found.unwrap_or_default(),
            };
            let (count, rows) = (chosen.len().max(1), own.rows());
            for (&row, from) in chosen.iter().zip(cofactors.chunks_exact(count)) {
                chosen
                    .iter()
                    .zip(from)
                    .for_each(|(&column, &value)| own.equations[row * rows + column] = value);
            }
        }
        Ok(())
    }

    /// Returns the equations of some terms as functions of the unknowns, for given standard deviations.
    pub fn rows_of_terms(
        &self,
        problem: &AnyProblem<'_>,
        observation_sd: &[f64],
        terms: &[usize],
        threads: &Threads,
    ) -> Vec<Vec<Function>> {
        if terms.is_empty() {
            return vec![];
        }
        let asked = self.equations(problem, threads).with_deviations(observation_sd);
        let mut buffers = Buffers::default();
        let mut of_term = |&term: &usize| {
            let mut rows = vec![];
            asked.each_row_of_term(&mut buffers, term, |row| rows.push(row.entries().collect()));
            rows
        };
        terms.iter().map(&mut of_term).collect()
    }

    /// Returns the cofactors of functions of one local block, or of retained blocks, which need no equations: the selected inverse contains
    /// them.
    ///
    /// # Errors
    /// Pairs of retained blocks outside the pattern of the normal equations.
    pub fn of_rows(&self, layout: &Layout, rows: &[Function]) -> Result<RowCofactors, LayoutError> {
        let unknowns = || rows.iter().flatten().map(|&(unknown, _)| unknown);
        let dim = layout.local_dim();
        let (blocks, q): (Vec<_>, _) = match unknowns().find(|unknown| layout.all_locals().contains(unknown))
        {
            Some(unknown) => {
                let local = unknown / dim;
                let own = &self.cofactors.local[local * dim * dim..];
                (vec![(None, layout.local_range(local))], Mat::from_fn(dim, dim, |i, j| own[i * dim + j]))
            }
            None => {
                let all: BTreeSet<usize> = unknowns().map(|unknown| layout.retained_with(unknown)).collect();
                let ranges = all.iter().map(|&block| (Some(block), layout.retained_range(block)));
                (ranges.collect(), self.selected.over(all.iter().copied())?)
            }
        };
        let columns: Vec<usize> = blocks.iter().flat_map(|(_, range)| range.clone()).collect();
        let mut a = Mat::<f64>::zeros(rows.len(), columns.len());
        for (i, row) in rows.iter().enumerate() {
            for &(unknown, value) in row {
                columns.binary_search(&unknown).into_iter().for_each(|column| a[(i, column)] = value);
            }
        }
        let along = &a * q;
        let leverages = &along * a.transpose();
        let mut columns = 0..columns.len();
        let mut of_block = |(block, range): (Option<usize>, Range<usize>)| {
            let own: Vec<usize> = columns.by_ref().take(range.len()).collect();
            (
                block,
                (0..rows.len()).flat_map(|i| own.iter().map(move |&k| (i, k))).map(|at| along[at]).collect(),
            )
        };
        Ok(RowCofactors {
            by_local: vec![],
            blocks: blocks.into_iter().map(&mut of_block).collect(),
            equations: (0..rows.len().pow(2)).map(|k| leverages[(k / rows.len(), k % rows.len())]).collect(),
        })
    }

    /// Returns the equations at these values.
    pub(super) fn equations<'a>(
        &self,
        problem: &'a AnyProblem<'a>,
        threads: &Threads,
    ) -> ObservationEquations<'a> {
        ObservationEquations::new(problem, None, &self.values, &self.held, threads)
    }
}

/// Returns the equations of the groups and of the terms of a local block.
fn rows_of_local(equations: &ObservationEquations<'_>, local: usize) -> (Vec<Function>, Vec<Function>) {
    let (mut of_groups, mut of_terms, mut buffers) = (vec![], vec![], Buffers::default());
    equations.each_row(&mut buffers, local, |row| of_groups.push(row.entries().collect()));
    for &term in equations.problem().layout().terms_of(local) {
        equations.each_row_of_term(&mut buffers, term as usize, |row| of_terms.push(row.entries().collect()));
    }
    (of_groups, of_terms)
}

/// Returns the rows of groups of a fixed local block whose residuals may have correlations above a limit.
fn correlated_rows(own: &RowCofactors, layout: &Layout, local: usize, limit: f64) -> Vec<usize> {
    let (rows, all, groups) = (layout.rows(), own.rows(), layout.groups_of(local).len());
    let odds = |group: usize| {
        let block = (0..rows * rows).map(|k| (group * rows + k / rows) * all + group * rows + k % rows);
        leverage_odds(block.map(|at| own.equations[at]))
    };
    let odds: Vec<f64> = (0..groups).map(odds).collect();
    let mut order: Vec<usize> = (0..groups).collect();
    order.sort_by(|a, b| odds[*b].total_cmp(&odds[*a]));
    let partner =
        |group: usize| order.iter().find(|&&other| other != group).map_or(0.0, |&other| odds[other]);
    let may = |&group: &usize| may_correlate(odds[group], partner(group), limit);
    (0..groups).filter(may).flat_map(|group| group * rows..(group + 1) * rows).collect()
}
