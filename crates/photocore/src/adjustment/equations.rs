//! Observation equations of a problem at given values of the unknowns, in unit weight.
//!
//! Products of their matrix A with vectors.

use std::ops::{Add, Range};
use std::sync::OnceLock;

use nalgebra::DMatrix;
use smallvec::SmallVec;

use super::loss::Reweighting;
use super::prior_terms::{PriorTerm, PriorTerms, is_weighted};
use super::problem::{AnyProblem, Evaluated};
use super::walk::Buffers;
use crate::normals::{Contribution, Equations, GroupRows, Prior};
use crate::{Threads, parallel};

/// Number of parts of the loop over local blocks, for sums that are independent of the number of threads.
const PARTS: usize = 16;

/// Equations of a problem at given values: in unit weight, reweighted by a loss, with zero columns for fixed unknowns.
#[doc(hidden)]
pub struct ObservationEquations<'a> {
    problem: &'a AnyProblem<'a>,
    at: Box<dyn Evaluated + 'a>,
    prior_terms: PriorTerms,
    /// Normal equations of the terms.
    prior: OnceLock<Prior>,
    /// Standard deviations of the observations; infinite for excluded ones.
    observation_sd: &'a [f64],
    /// Flags of fixed or constrained unknowns; None if all are free.
    fixed: Option<Vec<bool>>,
    reweighting: Option<Reweighting>,
    /// Contributions of child systems (see [`Layout::as_part`](crate::normals::Layout::as_part)).
    contributions: &'a [Contribution<'a>],
}

/// The observation of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EquationOf {
    /// A row of a group, which belongs to a local block.
    Group {
        /// The group.
        group: usize,
        /// Its local block.
        local: usize,
        /// The row in the group.
        row: usize,
    },
    /// A row of a term.
    Term {
        /// The term.
        term: usize,
        /// The row in the term.
        row: usize,
    },
    /// An unknown as an observation of itself.
    Unknown(usize),
}

/// Single equation of unit weight.
#[derive(Debug)]
#[doc(hidden)]
pub struct Row<'a> {
    /// Its observation.
    pub of: EquationOf,
    /// Its index, in the order of groups and rows, then of terms and rows, then of unknowns.
    pub number: usize,
    /// Observed minus computed.
    pub constant: f64,
    columns: &'a [usize],
    coefficients: [&'a [f64]; 3],
}

impl Row<'_> {
    /// Returns the unknowns of the equation, with their coefficients.
    #[inline(always)]
    pub fn entries(&self) -> impl Iterator<Item = (usize, f64)> {
        let [first, second, third] = self.coefficients;
        self.columns.iter().copied().zip(first.iter().chain(second).chain(third).copied())
    }

    /// Returns the change of the equation by a step: a v.
    #[inline(always)]
    pub fn change(&self, step: &[f64]) -> f64 {
        let (mut columns, mut change) = (self.columns, 0.0);
        for part in self.coefficients {
            let (own, others) = columns.split_at(part.len());
            own.iter().zip(part).for_each(|(&unknown, value)| change += value * step[unknown]);
            columns = others;
        }
        change
    }
}

impl<'a> ObservationEquations<'a> {
    /// Creates the equations at given values, with some unknowns constrained and weights modified by the loss.
    pub fn new(
        problem: &'a AnyProblem<'a>,
        reweighting: Option<Reweighting>,
        values: &[f64],
        held: &[usize],
        threads: &Threads,
    ) -> Self {
        let at = threads.install(|| problem.model.at(values));
        Self::evaluated(problem, at, values, held, reweighting)
    }

    /// Creates the equations of a model that is evaluated at given values.
    pub fn evaluated(
        problem: &'a AnyProblem<'a>,
        at: Box<dyn Evaluated + 'a>,
        values: &[f64],
        held: &[usize],
        reweighting: Option<Reweighting>,
    ) -> Self {
        let fixed = Some(problem.fixed(held)).filter(|fixed| fixed.contains(&true));
        let (prior_terms, observation_sd) = (problem.prior_terms(values), &problem.observation_sd[..]);
        Self {
            problem,
            at,
            prior_terms,
            prior: OnceLock::new(),
            observation_sd,
            fixed,
            reweighting,
            contributions: &[],
        }
    }

    /// Adds contributions of child systems.
    pub fn with_contributions(self, contributions: &'a [Contribution<'a>]) -> Self {
        Self { contributions, ..self }
    }

    /// Replaces the standard deviations of the observations.
    pub fn with_deviations(self, observation_sd: &'a [f64]) -> Self {
        Self { observation_sd, ..self }
    }

    /// Fixes or releases some unknowns according to other standard deviations.
    pub fn with_unknowns(mut self, unknowns: impl Iterator<Item = usize>, sd: &[f64]) -> Self {
        if let Some(fixed) = &mut self.fixed {
            unknowns.for_each(|unknown| fixed[unknown] = sd[unknown] == 0.0);
        }
        self
    }

    /// Restores the columns of fixed and constrained unknowns.
    pub fn with_fixed_columns(self) -> Self {
        Self { fixed: None, ..self }
    }

    /// Returns the problem of the equations.
    pub fn problem(&self) -> &'a AnyProblem<'a> {
        self.problem
    }

    /// Returns the prior terms.
    pub fn prior_terms(&self) -> &PriorTerms {
        &self.prior_terms
    }

    /// Standard deviation of the observation of an equation.
    pub fn deviation(&self, equation: usize) -> f64 {
        let unknown = equation.checked_sub(self.observation_sd.len());
        unknown.map_or_else(|| self.observation_sd[equation], |unknown| self.problem.sd[unknown])
    }

    /// Returns the reweighting by the loss.
    pub fn reweighting(&self) -> Option<Reweighting> {
        self.reweighting
    }

    /// Returns the model, evaluated at the linearization point.
    pub fn at(&self) -> &dyn Evaluated {
        &*self.at
    }

    /// Calls `take` with the rows of the groups of a local block.
    #[inline(always)]
    pub fn each_row(&self, buffers: &mut Buffers, local: usize, mut take: impl FnMut(&Row<'_>)) {
        let (layout, Buffers { rows, columns }) = (self.problem.layout(), buffers);
        for group in layout.groups_of(local) {
            columns.clear();
            columns.extend(layout.local_range(local));
            columns.extend(layout.retained_range(layout.retained_of(group)));
            columns.extend(layout.shared_columns(group));
            let mut rows = rows.group(layout, group);
            self.write(local, group, &mut rows);
            let of = |row| EquationOf::Group { group, local, row };
            rows.each(columns, group * layout.rows(), of, &mut take);
        }
    }

    /// Calls `take` with the rows of a term.
    #[inline(always)]
    pub fn each_row_of_term(&self, buffers: &mut Buffers, term: usize, mut take: impl FnMut(&Row<'_>)) {
        let (layout, Buffers { rows, columns }) = (self.problem.layout(), buffers);
        columns.clear();
        columns.extend(layout.term_columns(term));
        let mut rows = rows.term(layout, term);
        self.write_term(term, &mut rows);
        let of = |row| EquationOf::Term { term, row };
        rows.each(columns, layout.equations_of_term(term).start, of, &mut take);
    }

    /// Calls `take` with the row of each weighted unknown of a range, as an observation of itself.
    pub fn each_prior(&self, buffers: &mut Buffers, of: Range<usize>, mut take: impl FnMut(&Row<'_>)) {
        let Buffers { rows, columns } = buffers;
        for term in self.prior_terms.within(of) {
            columns.clear();
            columns.extend(term.unknowns());
            let rows = rows.rows(columns.len(), [0, 0, columns.len()]);
            rows.constant.copy_from_slice(term.constant);
            rows.shared.copy_from_slice(term.coefficients);
            if let Some(fixed) = &self.fixed {
                zero_columns(rows.shared, columns.len(), term.unknowns().map(|unknown| fixed[unknown]));
            }
            let of = |row| EquationOf::Unknown(term.first + row);
            rows.each(columns, self.observation_sd.len() + term.first, of, &mut |row: &Row<'_>| {
                if is_weighted(self.deviation(row.number)) {
                    take(row);
                }
            });
        }
    }

    /// Calls `take` with all rows of a local block: of groups, terms and weighted unknowns.
    pub fn each_row_of_local(&self, buffers: &mut Buffers, local: usize, mut take: impl FnMut(&Row<'_>)) {
        let layout = self.problem.layout();
        self.each_row(buffers, local, &mut take);
        for &term in layout.terms_of(local) {
            self.each_row_of_term(buffers, term as usize, &mut take);
        }
        self.each_prior(buffers, layout.local_range(local), take);
    }

    /// Calls `take` with the rows of terms and weighted unknowns, except for those of local blocks if `retained`.
    pub fn each_other_row(&self, retained: bool, mut take: impl FnMut(&Row<'_>)) {
        let (layout, mut buffers) = (self.problem.layout(), Buffers::default());
        for term in
            (0..layout.terms().len()).filter(|&term| !retained || layout.terms()[term].local.is_none())
        {
            self.each_row_of_term(&mut buffers, term, &mut take);
        }
        let first = if retained { layout.all_locals().end } else { 0 };
        self.each_prior(&mut buffers, first..layout.unknowns(), take);
    }

    /// Sums over the rows of groups and of terms, in parts of consecutive rows that depend on the layout only.
    pub fn fold_rows<T: Send>(
        &self,
        threads: &Threads,
        start: impl Fn() -> T + Sync,
        add: impl Fn(&mut T, &Row<'_>) + Sync,
    ) -> Vec<T> {
        let mut parts = self.problem.for_locals(threads, |buffers, locals| {
            let mut sum = start();
            locals.for_each(|local| self.each_row(buffers, local, |row| add(&mut sum, row)));
            sum
        });
        parts.extend(self.problem.for_terms(threads, |buffers, terms| {
            let mut sum = start();
            terms.for_each(|term| self.each_row_of_term(buffers, term, |row| add(&mut sum, row)));
            sum
        }));
        parts
    }

    /// Computes A x of all equations for several x: one number per x for each row, in order.
    pub fn times(&self, threads: &Threads, xs: &[&[f64]]) -> Vec<f64> {
        let add = |found: &mut Vec<f64>, row: &Row<'_>| found.extend(xs.iter().map(|x| row.change(x)));
        let mut all = self.fold_rows(threads, Vec::new, add).concat();
        all.resize(xs.len() * self.problem.equations(), 0.0);
        self.each_prior(&mut Buffers::default(), 0..self.problem.sd.len(), |row| {
            let found = &mut all[row.number * xs.len()..][..xs.len()];
            found.iter_mut().zip(xs).for_each(|(found, x)| *found = row.change(x));
        });
        all
    }

    /// Computes A^T z over all unknowns for `count` columns z, one after the other; `put` writes the z of a row. Bitwise identical for any
    /// number of threads.
    pub fn transposed(
        &self,
        threads: &Threads,
        count: usize,
        put: impl Fn(&Row<'_>, &mut [f64]) + Sync,
    ) -> Vec<f64> {
        let layout = self.problem.layout();
        let (unknowns, others) = (layout.unknowns(), layout.all_locals().end);
        let part = |part: usize| {
            let locals = part * layout.locals() / PARTS..(part + 1) * layout.locals() / PARTS;
            let (first, width) = (layout.local_dim() * locals.start, layout.local_dim() * locals.len());
            let (mut own, mut shared) = (vec![0.0; count * width], vec![0.0; count * (unknowns - others)]);
            let (mut buffers, mut z) = (Buffers::default(), vec![0.0; count]);
            for local in locals {
                self.each_row(&mut buffers, local, |row| {
                    put(row, &mut z);
                    for (column, &z) in z.iter().enumerate().filter(|&(_, &z)| z != 0.0) {
                        row.entries().for_each(|(unknown, value)| match unknown.checked_sub(others) {
                            None => own[column * width + unknown - first] += value * z,
                            Some(other) => shared[column * (unknowns - others) + other] += value * z,
                        });
                    }
                });
            }
            (first, width, own, shared)
        };
        let parts: Vec<_> = threads.install(|| parallel::map(PARTS, 1, part));
        let mut rights = vec![0.0; count * unknowns];
        for (first, width, own, shared) in parts {
            for (column, right) in rights.chunks_exact_mut(unknowns.max(1)).enumerate() {
                right[first..first + width].copy_from_slice(&own[column * width..][..width]);
                let sums = &shared[column * (unknowns - others)..][..unknowns - others];
                right[others..].iter_mut().zip(sums).for_each(|(right, sum)| *right += sum);
            }
        }
        let mut z = vec![0.0; count];
        self.each_other_row(false, |row| {
            put(row, &mut z);
            for (right, &z) in rights.chunks_exact_mut(unknowns).zip(&z) {
                row.entries().for_each(|(unknown, value)| right[unknown] += value * z);
            }
        });
        rights
    }

    /// Sums over all rows, in an order that depends on the layout only.
    fn sum_rows<T: Send + Add<Output = T>>(
        &self,
        threads: &Threads,
        start: impl Fn() -> T + Sync,
        add: impl Fn(&mut T, &Row<'_>) + Sync,
    ) -> T {
        let observed = self.fold_rows(threads, &start, &add);
        let mut sum = observed.into_iter().fold(start(), |sum, part| sum + part);
        self.each_prior(&mut Buffers::default(), 0..self.problem.sd.len(), |row| add(&mut sum, row));
        sum
    }

    /// Returns the products u^T N v of all pairs of steps.
    pub fn products(&self, threads: &Threads, steps: &[&[f64]]) -> DMatrix<f64> {
        // Stored by unknown.
        let unknowns = 0..steps.first().map_or(0, |step| step.len());
        let turned: Vec<f64> = unknowns.flat_map(|k| steps.iter().map(move |step| step[k])).collect();
        let zeros = || DMatrix::<f64>::zeros(steps.len(), steps.len());
        self.sum_rows(threads, zeros, |sum, row| {
            let mut changes = SmallVec::<[f64; 16]>::from_elem(0.0, steps.len());
            for (unknown, a) in row.entries() {
                let own = &turned[unknown * steps.len()..][..steps.len()];
                changes.iter_mut().zip(own).for_each(|(sum, change)| *sum += a * change);
            }
            for (j, v) in changes.iter().enumerate() {
                sum.column_mut(j).iter_mut().zip(&changes).for_each(|(sum, u)| *sum += u * v);
            }
        })
    }

    /// Returns the decrease of the weighted sum of squares by a step: sum of Ax (2 l - Ax).
    pub fn decrease(&self, threads: &Threads, step: &[f64]) -> f64 {
        self.sum_rows(
            threads,
            || 0.0,
            |sum, row| {
                let change = row.change(step);
                *sum += change * (2.0 * row.constant - change);
            },
        )
    }

    /// Forms the normal equations of the terms. A fixed or constrained unknown has the equation x = 0 with unit weight instead of others.
    /// Outer unknowns have zero weight here.
    fn form_prior(&self) -> Prior {
        let layout = self.problem.layout();
        let is_fixed = |unknown: usize| self.fixed.as_ref().is_some_and(|fixed| fixed[unknown]);
        let weight = (0..layout.unknowns()).map(|i| f64::from(u8::from(is_fixed(i)))).collect();
        let mut prior = Prior { weight, right: vec![0.0; layout.unknowns()], between: vec![] };
        for term in self.prior_terms.within(0..layout.unknowns()) {
            add_prior_term(&mut prior, &term, is_fixed);
        }
        layout.unknowns_of(layout.outer()).for_each(|unknown| prior.weight[unknown] = 0.0);
        prior
    }
}

/// Adds A^T A and A^T l of a term, except for fixed unknowns.
fn add_prior_term(prior: &mut Prior, term: &PriorTerm<'_>, is_fixed: impl Fn(usize) -> bool) {
    for (i, unknown) in term.unknowns().enumerate().filter(|&(_, unknown)| !is_fixed(unknown)) {
        let product = |j: usize| term.rows().map(|row| row[i] * row[j]).sum::<f64>();
        prior.weight[unknown] = product(i);
        prior.right[unknown] = term.rows().zip(term.constant).map(|(row, constant)| row[i] * constant).sum();
        let others = (0..i).filter(|&j| !is_fixed(term.first + j));
        prior.between.extend(others.map(|j| (unknown, term.first + j, product(j))));
    }
}

impl Equations for ObservationEquations<'_> {
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let layout = self.problem.layout();
        self.at.observe(local, group, rows);
        rows.weigh(&self.observation_sd[group * layout.rows()..][..layout.rows()]);
        self.adapt(local, group, rows);
    }

    fn write_batch(&self, locals: &[u32], groups: &[u32], rows: &mut GroupRows<'_>) {
        let written = self.at.observe_batch(locals, groups, self.observation_sd, rows);
        // Shortcut for most equations, because the division into parts is slow.
        if written && self.reweighting.is_none() && self.fixed.is_none() {
            return;
        }
        for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
            let mut rows = rows.part(t, locals.len());
            if written {
                self.adapt(local as usize, group as usize, &mut rows);
            } else {
                self.write(local as usize, group as usize, &mut rows);
            }
        }
    }

    fn write_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let layout = self.problem.layout();
        self.at.observe_term(term, rows);
        rows.weigh(&self.observation_sd[layout.equations_of_term(term)]);
        self.reweigh(rows);
        if let Some(fixed) = &self.fixed {
            zero_columns(
                rows.of_term(),
                layout.terms()[term].rows,
                layout.term_columns(term).map(|unknown| fixed[unknown]),
            );
        }
    }

    fn prior(&self) -> &Prior {
        self.prior.get_or_init(|| self.form_prior())
    }

    fn contribution(&self, below: usize) -> Option<&Contribution<'_>> {
        self.contributions.get(below)
    }
}

impl ObservationEquations<'_> {
    /// Reweights equations of unit weight by the loss, and zeroes the columns of fixed unknowns.
    #[inline(always)]
    fn adapt(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        self.reweigh(rows);
        if let Some(fixed) = &self.fixed {
            let (layout, count) = (self.problem.layout(), rows.constant.len());
            let of = |unknown: usize| fixed[unknown];
            zero_columns(rows.local, count, layout.local_range(local).map(of));
            zero_columns(rows.retained, count, layout.retained_range(layout.retained_of(group)).map(of));
            zero_columns(rows.shared, count, layout.shared_columns(group).map(of));
        }
    }

    /// Reweights equations of unit weight by the loss.
    #[inline(always)]
    fn reweigh(&self, rows: &mut GroupRows<'_>) {
        if let Some(reweighting) = self.reweighting {
            let GroupRows { constant, local, retained, shared } = rows;
            reweighting.apply(constant, &mut [&mut **local, &mut **retained, &mut **shared]);
        }
    }
}

impl GroupRows<'_> {
    /// Calls `take` with each row; `first` is the number of the first one.
    #[inline(always)]
    fn each(
        &self,
        columns: &[usize],
        first: usize,
        of: impl Fn(usize) -> EquationOf,
        take: &mut impl FnMut(&Row<'_>),
    ) {
        let rows = self.constant.len();
        for (row, &constant) in self.constant.iter().enumerate() {
            let coefficients = [&*self.local, &*self.retained, &*self.shared].map(|part| {
                let width = part.len() / rows;
                &part[row * width..][..width]
            });
            take(&Row { of: of(row), number: first + row, constant, columns, coefficients });
        }
    }

    /// Divides the equations by their standard deviations.
    #[inline(always)]
    pub(crate) fn weigh(&mut self, sd: &[f64]) {
        weigh(sd, self.constant, [&mut *self.local, &mut *self.retained, &mut *self.shared]);
    }

    /// Excludes one of these observations.
    #[cold]
    pub(crate) fn exclude(&mut self, row: usize) {
        exclude(row, self.constant, &mut [&mut *self.local, &mut *self.retained, &mut *self.shared]);
    }
}

/// Divides equations by their standard deviations, and excludes observations of infinite standard deviation.
#[inline(always)]
fn weigh<const N: usize>(sd: &[f64], constant: &mut [f64], mut parts: [&mut [f64]; N]) {
    let widths = parts.each_ref().map(|part| part.len() / constant.len());
    for (row, sd) in sd.iter().enumerate() {
        if sd.is_infinite() {
            exclude(row, constant, &mut parts);
            continue;
        }
        constant[row] /= sd;
        let weight = sd.recip();
        for (part, width) in parts.iter_mut().zip(widths) {
            part[row * width..][..width].iter_mut().for_each(|value| *value *= weight);
        }
    }
}

/// Sets an equation to 0 = 0. Zero weight is insufficient, because the observation and its partials may not be finite.
#[cold]
fn exclude(row: usize, constant: &mut [f64], parts: &mut [&mut [f64]]) {
    for part in parts {
        let width = part.len() / constant.len();
        part[row * width..][..width].fill(0.0);
    }
    constant[row] = 0.0;
}

/// Zeroes the columns of fixed unknowns; `fixed` has one flag per column.
#[inline(always)]
fn zero_columns(part: &mut [f64], rows: usize, fixed: impl Iterator<Item = bool>) {
    let width = part.len() / rows;
    for (column, _) in fixed.enumerate().filter(|&(_, fixed)| fixed) {
        (0..rows).for_each(|row| part[row * width + column] = 0.0);
    }
}
