//! Observation equations of a problem at given values of the unknowns, in unit weight.
//!
//! Changes of the observations of a group by a step.

use smallvec::SmallVec;

use super::loss::Reweighting;
use super::problem::{AnyProblem, Evaluated};
use super::walk::Buffers;
use crate::Threads;
use crate::normals::{Contribution, Equations, GroupRows, Layout, Prior, TieRows, dot};

/// Equations of a problem at given values: in unit weight, reweighted by a loss, with zero columns for fixed unknowns.
pub(super) struct ObservationEquations<'a> {
    problem: &'a AnyProblem<'a>,
    at: Box<dyn Evaluated + 'a>,
    /// Standard deviations of the observations; infinite for excluded ones.
    observation_sd: &'a [f64],
    /// Flags of fixed or constrained unknowns; None if all are free.
    fixed: Option<Vec<bool>>,
    reweighting: Option<Reweighting>,
    /// Contributions of child systems (see [`super::Linearized::of_part`]).
    contributions: &'a [Contribution<'a>],
}

/// Single equation of unit weight.
#[derive(Debug)]
pub(super) struct Row<'a> {
    /// Its index, in the order of groups and rows, then of ties and rows.
    pub number: usize,
    /// Observed minus computed.
    pub constant: f64,
    columns: &'a [usize],
    coefficients: [&'a [f64]; 3],
}

impl<'a> Row<'a> {
    /// Creates an equation without a number.
    pub fn single(constant: f64, columns: &'a [usize], coefficients: &'a [f64]) -> Self {
        Self { number: usize::MAX, constant, columns, coefficients: [coefficients, &[], &[]] }
    }

    /// Returns the unknowns of the equation, with their coefficients.
    #[inline(always)]
    pub fn taken(&self) -> impl Iterator<Item = (usize, f64)> {
        let [first, second, third] = self.coefficients;
        self.columns.iter().copied().zip(first.iter().chain(second).chain(third).copied())
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

    /// Returns the decrease of the weighted sum of squares of equations and priors by a step: sum of Ax (2 l - Ax).
    pub fn decrease(&self, threads: &Threads, prior: &Prior, step: &[f64]) -> f64 {
        let layout = self.problem.layout();
        let observed = self.problem.for_locals(threads, |buffers, local| {
            let mut sum = 0.0;
            for group in layout.groups_of(local) {
                let mut rows = buffers.rows(layout, group);
                self.write(local, group, &mut rows);
                let of_group = GroupStep::of(step, layout, local, group);
                for row in 0..layout.rows() {
                    let change = of_group.change(&rows, row);
                    sum += change * (2.0 * rows.constant[row] - change);
                }
            }
            sum
        });
        let tied = self.problem.for_ties(threads, |tie, rows| {
            self.write_tie(tie, rows);
            let columns: SmallVec<[f64; 16]> = layout.tie_columns(tie).map(|column| step[column]).collect();
            let rows = rows.constant.iter().zip(rows.coefficients.chunks_exact(columns.len()));
            let decrease = |(constant, coefficients): (&f64, &[f64])| {
                let change = dot(coefficients, &columns);
                change * (2.0 * constant - change)
            };
            rows.map(decrease).sum::<f64>()
        });
        let priors = step.iter().zip(&prior.weight).zip(&prior.right);
        let between = prior.between.iter().map(|&(i, j, weight)| 2.0 * weight * step[i] * step[j]);
        observed.iter().chain(&tied).sum::<f64>()
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

/// Changes of the unknowns of one group by a step.
pub(super) struct GroupStep<'s> {
    pub local: &'s [f64],
    pub retained: &'s [f64],
    pub shared: Vec<f64>,
}

impl<'s> GroupStep<'s> {
    pub fn of(step: &'s [f64], layout: &Layout, local: usize, group: usize) -> Self {
        Self {
            local: &step[layout.local_range(local)],
            retained: &step[layout.retained_range(layout.retained_of(group))],
            shared: layout.shared_columns(group).map(|unknown| step[unknown]).collect(),
        }
    }

    /// Returns the change of a row of the group: A v.
    pub fn change(&self, rows: &GroupRows<'_>, row: usize) -> f64 {
        let part = |values: &[f64], step: &[f64]| dot(&values[row * step.len()..][..step.len()], step);
        part(rows.local, self.local) + part(rows.retained, self.retained) + part(rows.shared, &self.shared)
    }
}
