//! Observation equations of a problem at given values of the unknowns, in unit weight.
//!
//! Products of their matrix A with vectors.

use std::ops::Range;

use nalgebra::DMatrix;
use smallvec::SmallVec;

use super::loss::Reweighting;
use super::problem::{AnyProblem, Evaluated};
use super::terms::Terms;
use super::walk::Buffers;
use crate::normals::{Contribution, Equations, GroupRows, Prior, TieRows};
use crate::{Threads, parallel};

/// Number of parts of the loop over local blocks, for sums that are independent of the number of threads.
const PARTS: usize = 16;

/// Equations of a problem at given values: in unit weight, reweighted by a loss, with zero columns for fixed unknowns.
#[doc(hidden)]
pub struct ObservationEquations<'a> {
    problem: &'a AnyProblem<'a>,
    at: Box<dyn Evaluated + 'a>,
    /// Standard deviations of the observations; infinite for excluded ones.
    observation_sd: &'a [f64],
    /// Flags of fixed or constrained unknowns; None if all are free.
    fixed: Option<Vec<bool>>,
    reweighting: Option<Reweighting>,
    /// Contributions of child systems (see [`Layout::as_part`](crate::normals::Layout::as_part)).
    contributions: &'a [Contribution<'a>],
}

/// Single equation of unit weight.
#[derive(Debug)]
#[doc(hidden)]
pub struct Row<'a> {
    /// Its index, in the order of groups and rows, then of ties and rows, then of unknowns.
    pub number: usize,
    /// Observed minus computed.
    pub constant: f64,
    columns: &'a [usize],
    coefficients: [&'a [f64]; 3],
}

impl Row<'_> {
    /// Returns the unknowns of the equation, with their coefficients.
    #[inline(always)]
    pub fn taken(&self) -> impl Iterator<Item = (usize, f64)> {
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
        threads.install(|| Self::evaluated(problem, problem.model.at(values), held, reweighting))
    }

    /// Creates the equations of an evaluated model.
    pub fn evaluated(
        problem: &'a AnyProblem<'a>,
        at: Box<dyn Evaluated + 'a>,
        held: &[usize],
        reweighting: Option<Reweighting>,
    ) -> Self {
        let fixed = Some(problem.fixed(held)).filter(|fixed| fixed.contains(&true));
        let observation_sd = &problem.observation_sd;
        Self { problem, at, observation_sd, fixed, reweighting, contributions: &[] }
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

    /// Creates the equations with all columns, including fixed unknowns, and without a loss.
    pub fn of_all(problem: &'a AnyProblem<'a>, values: &[f64], threads: &Threads) -> Self {
        let at = threads.install(|| problem.model.at(values));
        let observation_sd = &problem.observation_sd;
        Self { problem, at, observation_sd, fixed: None, reweighting: None, contributions: &[] }
    }

    /// Restores the columns of fixed and constrained unknowns.
    pub fn with_fixed_columns(self) -> Self {
        Self { fixed: None, ..self }
    }

    /// Returns the problem of the equations.
    pub fn problem(&self) -> &'a AnyProblem<'a> {
        self.problem
    }

    /// Standard deviation of an observation.
    pub fn deviation(&self, observation: usize) -> f64 {
        self.observation_sd[observation]
    }

    /// Returns the reweighting by the loss.
    pub fn reweighting(&self) -> Option<Reweighting> {
        self.reweighting
    }

    /// Returns the model, evaluated at the linearization point.
    pub fn at(&self) -> &dyn Evaluated {
        &*self.at
    }

    /// Calls `take` with the rows of a local block.
    #[inline(always)]
    pub fn each_row(&self, buffers: &mut Buffers, local: usize, mut take: impl FnMut(&Row<'_>)) {
        let layout = self.problem.layout();
        let mut columns = std::mem::take(&mut buffers.columns);
        for group in layout.groups_of(local) {
            columns.clear();
            columns.extend(layout.local_range(local));
            columns.extend(layout.retained_range(layout.retained_of(group)));
            columns.extend(layout.shared_columns(group));
            let mut rows = buffers.rows(layout, group);
            self.write(local, group, &mut rows);
            let GroupRows { constant, local: own, retained, shared } = rows;
            for (row, &constant) in constant.iter().enumerate() {
                let coefficients = [&*own, &*retained, &*shared].map(|part| {
                    let width = part.len() / layout.rows();
                    &part[row * width..][..width]
                });
                let number = group * layout.rows() + row;
                take(&Row { number, constant, columns: &columns, coefficients });
            }
        }
        buffers.columns = columns;
    }

    /// Calls `take` with the tie number and row of every tie.
    pub fn each_row_of_ties(&self, mut take: impl FnMut(usize, &Row<'_>)) {
        let mut buffers = Buffers::default();
        (0..self.problem.layout().ties().len())
            .for_each(|tie| self.each_row_of_tie(&mut buffers, tie, |row| take(tie, row)));
    }

    /// Calls `take` with the rows of a tie.
    #[inline(always)]
    pub fn each_row_of_tie(&self, buffers: &mut Buffers, tie: usize, mut take: impl FnMut(&Row<'_>)) {
        let layout = self.problem.layout();
        let first = layout.groups() * layout.rows() + layout.tie_rows(tie).start;
        let Buffers { tie: buffer, columns, .. } = buffers;
        columns.clear();
        columns.extend(layout.tie_columns(tie));
        let mut rows = buffer.rows(layout, tie);
        self.write_tie(tie, &mut rows);
        let each = rows.constant.iter().zip(rows.coefficients.chunks_exact(columns.len().max(1)));
        for (number, (&constant, own)) in (first..).zip(each) {
            take(&Row { number, constant, columns, coefficients: [own, &[], &[]] });
        }
    }

    /// Calls `take` with each weighted unknown of a range and its row, as an observation of itself.
    pub fn each_prior(&self, terms: &Terms<'_>, of: Range<usize>, mut take: impl FnMut(usize, &Row<'_>)) {
        let first = self.observation_sd.len();
        let is_free = |unknown: usize| self.fixed.as_ref().is_none_or(|fixed| !fixed[unknown]);
        terms.rows_within(of, |unknown, row, constant| {
            let (columns, own): (Vec<usize>, Vec<f64>) = row.filter(|own| is_free(own.0)).unzip();
            let coefficients = [&own[..], &[], &[]];
            take(unknown, &Row { number: first + unknown, constant, columns: &columns, coefficients });
        });
    }

    /// Sums over the rows of groups and of ties, in parts of consecutive rows that depend on the layout only.
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
        parts.extend(self.problem.for_ties(threads, |buffers, ties| {
            let mut sum = start();
            ties.for_each(|tie| self.each_row_of_tie(buffers, tie, |row| add(&mut sum, row)));
            sum
        }));
        parts
    }

    /// Computes A x of all equations and priors for several x: one number per x for each row, in order.
    pub fn times(&self, threads: &Threads, terms: &Terms<'_>, xs: &[&[f64]]) -> Vec<f64> {
        let add = |found: &mut Vec<f64>, row: &Row<'_>| found.extend(xs.iter().map(|x| row.change(x)));
        let mut all = self.fold_rows(threads, Vec::new, add).concat();
        all.resize(xs.len() * self.problem.equations(), 0.0);
        self.each_prior(terms, 0..self.problem.sd.len(), |_, row| {
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
                        row.taken().for_each(|(unknown, value)| match unknown.checked_sub(others) {
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
        self.each_row_of_ties(|_, row| {
            put(row, &mut z);
            for (right, &z) in rights.chunks_exact_mut(unknowns).zip(&z) {
                row.taken().for_each(|(unknown, value)| right[unknown] += value * z);
            }
        });
        rights
    }

    /// Returns the products u^T N v of all pairs of steps, with priors in N.
    pub fn products(&self, threads: &Threads, prior: &Prior, steps: &[&[f64]]) -> DMatrix<f64> {
        let zeros = || DMatrix::<f64>::zeros(steps.len(), steps.len());
        let add = |sum: &mut DMatrix<f64>, weight: f64, u: &[f64], v: &[f64]| {
            for (j, v) in v.iter().enumerate() {
                sum.column_mut(j).iter_mut().zip(u).for_each(|(sum, u)| *sum += weight * u * v);
            }
        };
        // Stored by unknown.
        let unknowns = 0..steps.first().map_or(0, |step| step.len());
        let turned: Vec<f64> = unknowns.flat_map(|k| steps.iter().map(move |step| step[k])).collect();
        let of_unknown = |unknown: usize| &turned[unknown * steps.len()..][..steps.len()];
        let changes = |taken: &mut dyn Iterator<Item = (usize, f64)>| {
            let mut changes = SmallVec::<[f64; 16]>::from_elem(0.0, steps.len());
            taken.for_each(|(k, a)| {
                changes.iter_mut().zip(of_unknown(k)).for_each(|(sum, change)| *sum += a * change);
            });
            changes
        };
        let observed = self.fold_rows(threads, zeros, |sum, row| {
            let own = changes(&mut row.taken());
            add(sum, 1.0, &own, &own);
        });
        let mut sum = observed.into_iter().fold(zeros(), |sum, part| sum + part);
        for (unknown, &weight) in prior.weight.iter().enumerate().filter(|&(_, &weight)| weight != 0.0) {
            let own = of_unknown(unknown);
            add(&mut sum, weight, own, own);
        }
        for &(i, j, weight) in &prior.between {
            let (own, other) = (of_unknown(i), of_unknown(j));
            add(&mut sum, weight, own, other);
            add(&mut sum, weight, other, own);
        }
        sum
    }

    /// Returns the decrease of the weighted sum of squares of equations and priors by a step: sum of Ax (2 l - Ax).
    pub fn decrease(&self, threads: &Threads, prior: &Prior, step: &[f64]) -> f64 {
        let add = |sum: &mut f64, row: &Row<'_>| {
            let change = row.change(step);
            *sum += change * (2.0 * row.constant - change);
        };
        let observed = self.fold_rows(threads, || 0.0, add);
        let priors = step.iter().zip(&prior.weight).zip(&prior.right);
        let between = prior.between.iter().map(|&(i, j, weight)| 2.0 * weight * step[i] * step[j]);
        observed.iter().sum::<f64>()
            + priors.map(|((x, weight), right)| x * (2.0 * right - weight * x)).sum::<f64>()
            - between.sum::<f64>()
    }
}

impl Equations for ObservationEquations<'_> {
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let layout = self.problem.layout();
        self.at.observe(local, group, rows);
        rows.weigh(&self.observation_sd[group * layout.rows()..][..layout.rows()]);
        self.adapt(local, group, rows);
    }

    fn write_alike(&self, locals: &[u32], groups: &[u32], rows: &mut GroupRows<'_>) {
        let written = self.at.observe_alike(locals, groups, self.observation_sd, rows);
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

    fn write_tie(&self, tie: usize, rows: &mut TieRows<'_>) {
        let layout = self.problem.layout();
        self.at.observe_tie(tie, rows);
        let first = layout.groups() * layout.rows();
        let sd = &self.observation_sd[first..][layout.tie_rows(tie)];
        weigh(sd, rows.constant, [&mut *rows.coefficients]);
        if let Some(reweighting) = self.reweighting {
            reweighting.apply(rows.constant, &mut [&mut *rows.coefficients]);
        }
        if let Some(fixed) = &self.fixed {
            leave_out(rows.coefficients, sd.len(), layout.tie_columns(tie).map(|unknown| fixed[unknown]));
        }
    }

    fn contribution(&self, below: usize) -> Option<&Contribution<'_>> {
        self.contributions.get(below)
    }
}

impl ObservationEquations<'_> {
    /// Reweights equations of unit weight by the loss, and zeroes the columns of fixed unknowns.
    #[inline(always)]
    fn adapt(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let GroupRows { constant, local: own, retained, shared } = rows;
        if let Some(reweighting) = self.reweighting {
            reweighting.apply(constant, &mut [&mut **own, &mut **retained, &mut **shared]);
        }
        if let Some(fixed) = &self.fixed {
            let (layout, count) = (self.problem.layout(), constant.len());
            let of = |unknown: usize| fixed[unknown];
            leave_out(own, count, layout.local_range(local).map(of));
            leave_out(retained, count, layout.retained_range(layout.retained_of(group)).map(of));
            leave_out(shared, count, layout.shared_columns(group).map(of));
        }
    }
}

impl GroupRows<'_> {
    /// Divides the equations of a group by their standard deviations.
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
fn leave_out(part: &mut [f64], rows: usize, fixed: impl Iterator<Item = bool>) {
    let width = part.len() / rows;
    for (column, _) in fixed.enumerate().filter(|&(_, fixed)| fixed) {
        (0..rows).for_each(|row| part[row * width + column] = 0.0);
    }
}
