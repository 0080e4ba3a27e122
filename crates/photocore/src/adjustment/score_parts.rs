//! Parts of the score and the redundancy of additional parameters by groups of observations.
//!
//! Let D = Q_vv P C be the part of the partials that the unknowns do not absorb. An error of one parameter has the score
//! u = D^T P v = sum of c_g and the redundancy R = D^T P D = sum of C_g, c_g and C_g being the sums over the observations of group g. Its
//! estimate is d = u / R. If the error differs between independent groups, the variance of d is the sum of (c_g - d C_g)^2 over R^2
//! (Huber 1967; Liang and Zeger 1986).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::additional::{AT_LEAST, AdditionalParameters, LocalRows, PARTS};
use super::equations::EquationOf;
use super::linearized::Linearized;
use super::problem::AnyProblem;
use super::walk::Buffers;
use crate::{Threads, parallel};

/// Parts of scores and redundancies: a row per group, a column per parameter.
#[derive(Debug)]
pub struct ScoreParts {
    /// c_g.
    pub score: DMatrix<f64>,
    /// C_g.
    pub redundancy: DMatrix<f64>,
}

/// Number of groups, and the group of an observation.
pub type Groups<'a> = (usize, &'a (dyn Fn(EquationOf) -> usize + Sync));

impl ScoreParts {
    fn new(groups: usize, count: usize) -> Self {
        let zero = DMatrix::zeros(groups, count);
        Self { score: zero.clone(), redundancy: zero }
    }

    /// Adds an observation: observed minus computed, and its row of D.
    fn add(&mut self, group: usize, constant: f64, left: &DVector<f64>) {
        for (k, left) in left.iter().enumerate() {
            self.score[(group, k)] += left * constant;
            self.redundancy[(group, k)] += left * left;
        }
    }

    /// Standard deviation of the estimate of a parameter if its error differs between groups.
    pub fn sd(&self, parameter: usize) -> f64 {
        let (score, redundancy) = (self.score.column(parameter), self.redundancy.column(parameter));
        let estimate = score.sum() / redundancy.sum();
        (score - redundancy * estimate).norm() / redundancy.sum()
    }
}

impl Linearized {
    /// Divides scores and redundancies of single parameters among groups of observations.
    ///
    /// `effects`: changes of the unknowns that are not local by an error of each parameter, a column per parameter.
    pub fn score_parts(
        &self,
        problem: &AnyProblem<'_>,
        parameters: &dyn AdditionalParameters,
        effects: &DMatrix<f64>,
        (groups, group_of): Groups<'_>,
        threads: &Threads,
    ) -> ScoreParts {
        let extended = self.extended(problem, parameters, threads);
        let (layout, count) = (problem.layout(), parameters.count());
        let (first, effects) = (layout.all_locals().end, effects.transpose());
        // Partials without their part that unknowns of retained blocks absorb.
        let left = |others: &[(usize, f64)], partials: &[(usize, f64)]| {
            let mut left = DVector::zeros(count);
            partials.iter().for_each(|&(k, partial)| left[k] += partial);
            others
                .iter()
                .for_each(|&(unknown, value)| left.axpy(-value, &effects.column(unknown - first), 1.0));
            left
        };
        let add = |parts: &mut ScoreParts, rows: &LocalRows, inverse: &[f64]| {
            let mut lefts: Vec<DVector<f64>> =
                rows.rows().map(|(_, _, others, partials)| left(others, partials)).collect();
            let width = rows.width();
            let mut right = DMatrix::zeros(count, width);
            for ((_, own, ..), left) in rows.rows().zip(&lefts) {
                own.iter().enumerate().for_each(|(k, value)| right.column_mut(k).axpy(*value, left, 1.0));
            }
            let change = right * DMatrix::from_row_slice(width, width, inverse);
            for (((constant, own, ..), left), &of) in rows.rows().zip(&mut lefts).zip(rows.of()) {
                own.iter().enumerate().for_each(|(k, value)| left.axpy(-value, &change.column(k), 1.0));
                parts.add(group_of(of), constant, left);
            }
        };
        let of_locals = |locals: Range<usize>| {
            let mut parts = ScoreParts::new(groups, count);
            let (mut rows, mut buffers) = (LocalRows::default(), Buffers::default());
            for local in locals {
                extended.write(&mut buffers, local, &mut rows);
                add(&mut parts, &rows, &extended.inverse(local, &rows));
            }
            parts
        };
        let (all, length) = (layout.locals(), layout.locals().div_ceil(PARTS).max(AT_LEAST));
        let ranges = (0..all).step_by(length).map(|start| start..all.min(start + length)).collect();
        let found = threads.install(|| parallel::map_each(ranges, &of_locals));
        let mut sums = found.into_iter().fold(ScoreParts::new(groups, count), |mut sums, part| {
            sums.score += part.score;
            sums.redundancy += part.redundancy;
            sums
        });
        extended.each_retained(|rows| add(&mut sums, rows, &[]));
        sums
    }
}
