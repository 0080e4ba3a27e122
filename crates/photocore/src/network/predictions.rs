//! Comparison of excluded observations with their prediction by the others, and residual cofactors of points.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::group_tests::{TestOfGroup, TestOfRow, Tests, from_identity, in_units, misclosure, sub};
use super::test_groups::TestKind;
use super::trial::Trial;
use crate::adjustment::{EquationOf, Leverages, PriorTerms};
use crate::normals::{Function, RowCofactors, dot};
use crate::{Threads, parallel};

/// Minimum number of points per thread.
pub(super) const AT_LEAST: usize = 16;

/// Test groups, such as all of a point, with the cofactors of all their residuals.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ResidualBlock {
    /// The groups, with their rows in this order.
    pub groups: Vec<usize>,
    /// Whitened residuals.
    pub residual: Vec<f64>,
    /// Cofactors R of the residuals, square, row by row.
    pub cofactors: Vec<f64>,
}

impl Trial {
    /// Tests excluded rows of some groups against their prediction by the others (Cook and Weisberg 1982): T = d^T C^-1 d, with d observed
    /// minus predicted and its cofactors C = S + a Q a^T, is chi-square distributed with one degree of freedom per excluded row. Groups
    /// without excluded rows, or with excluded parameters, are inactive. Errors are d; redundancies are not defined.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn predictions(&self, groups: &[usize], threads: &Threads) -> Result<Tests, NetworkError> {
        let found = self.found()?;
        let prior_terms = self.prior_terms(&self.sd, &found.values);
        let near = self.near(groups, &self.observation_sd, &prior_terms, threads)?;
        let starts = self.groups.starts_among(groups);
        let mut all = Tests::inactive(groups.len(), starts[groups.len()], 0);
        for (k, (&group, near)) in groups.iter().zip(&near).enumerate() {
            let equations = self.groups.equations_of(group);
            let out: Vec<usize> = (0..equations.len()).filter(|&k| !self.is_in(equations[k])).collect();
            if out.is_empty() || self.is_gone(equations[0]) {
                continue;
            }
            let count = out.len();
            let leverages =
                DMatrix::from_row_slice(count, count, &sub(&near.equations, equations.len(), &out));
            let c = DMatrix::identity(count, count) + leverages;
            let misclosures =
                out.iter().map(|&k| misclosure(equations[k], &self.observation_sd, found, &prior_terms));
            let d = DVector::from_iterator(count, misclosures);
            let Some(root) = c.clone().cholesky() else { continue };
            let statistic = d.dot(&root.solve(&d));
            all.groups[k] = TestOfGroup { active: true, rank: count, statistic, ..all.groups[k] };
            let (error, error_sd) = in_units(&self.units(group, &out), d.as_slice(), c.as_slice());
            for (i, row) in out.into_iter().enumerate() {
                let row = &mut all.rows[starts[k] + row];
                *row = TestOfRow { error: error[i], error_sd: error_sd[i], ..*row };
            }
        }
        Ok(all)
    }

    /// Returns the cofactors of the equations of some groups, for given standard deviations.
    pub(super) fn near(
        &self,
        groups: &[usize],
        observation_sd: &[f64],
        prior_terms: &PriorTerms,
        threads: &Threads,
    ) -> Result<Vec<RowCofactors>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let layout = problem.layout();
        let failed = |error| NetworkError::new(error, &self.assembled);
        let (mut places, mut terms) = (vec![], vec![]);
        for &group in groups {
            match self.equation(self.groups.equations_of(group)[0]) {
                EquationOf::Group { local, .. } => places.push(local),
                EquationOf::Term { term, .. } => terms.push(term),
                EquationOf::Unknown(_) => {}
            }
        }
        places.sort_unstable();
        places.dedup();
        let of_points =
            found.of_locals(problem, (observation_sd, None), &places, (|_| vec![], None), threads);
        let of_points: HashMap<usize, RowCofactors> =
            places.into_iter().zip(of_points.map_err(failed)?).collect();
        let mut of_terms = found.rows_of_terms(problem, observation_sd, &terms, threads).into_iter();
        let mut of = |&group: &usize| {
            let equations = self.groups.equations_of(group);
            let rows = match self.equation(equations[0]) {
                EquationOf::Group { group, local, .. } => {
                    let first = equations.len() * (group - layout.groups_of(local).start);
                    return Ok(of_points[&local].selected(first..first + equations.len()));
                }
                EquationOf::Term { .. } => of_terms.next().unwrap_or_default(),
                EquationOf::Unknown(_) => self.prior_rows(equations, prior_terms)?,
            };
            found.of_rows(layout, &rows).map_err(|error| failed(error.into()))
        };
        groups.iter().map(&mut of).collect()
    }

    /// Returns true if the parameters of the group of an equation are excluded with it: fixed now, but not in the input.
    fn is_gone(&self, equation: u32) -> bool {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let gone = |unknowns: Range<usize>| {
            unknowns.into_iter().any(|unknown| problem.sd[unknown] == 0.0 && self.sd[unknown] != 0.0)
        };
        match self.equation(equation) {
            EquationOf::Group { group, local, .. } => {
                gone(model.of_point(local)) || gone(model.of_block(model.carrier(model.images[group].photo)))
            }
            EquationOf::Term { term, .. } => {
                problem.layout().term_columns(term).any(|unknown| gone(unknown..unknown + 1))
            }
            EquationOf::Unknown(unknown) => gone(self.block_with(unknown)),
        }
    }

    /// Returns R of all observations of some points; empty for points with additional observations.
    ///
    /// * `limit`: the required correlations are above it: elements of weaker pairs may be NaN;
    /// * `gone`: whether the points are excluded, and treated as if they were active: each one alone, given photos determined by the others.
    ///   R is empty also for points that their rays do not determine.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn on_points(
        &self,
        points: &[usize],
        (limit, gone): (f64, bool),
        threads: &Threads,
    ) -> Result<Vec<ResidualBlock>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let (observation_sd, sd) = match gone {
            true => (&self.observation_sd[..], &self.sd[..]),
            false => (&problem.observation_sd[..], &problem.sd[..]),
        };
        let prior_terms = self.prior_terms(sd, &found.values);
        let further = |place: usize| self.further(place, &prior_terms);
        let places: Vec<Option<usize>> = points.iter().map(|&point| self.local(point)).collect();
        let locals: Vec<usize> = places.iter().flatten().copied().collect();
        let asked = (observation_sd, gone.then_some(sd));
        let cofactors = found.of_locals(problem, asked, &locals, (further, Some(limit)), threads);
        let mut cofactors = cofactors.map_err(|error| NetworkError::new(error, &self.assembled))?.into_iter();
        let all: Vec<Option<(usize, RowCofactors)>> =
            places.into_iter().map(|place| Some((place?, cofactors.next()?))).collect();
        let of = |k: usize| -> Option<ResidualBlock> {
            let (place, own) = all[k].as_ref()?;
            let (rows, observed) = self.rows_at(*place, observation_sd, found, &prior_terms);
            let count = rows.len();
            let (residual, cofactors) = if gone {
                let own = Some(own.residuals_if_included()).filter(|own| !own.is_empty())?;
                let cofactors = sub(&own, own.len().isqrt(), &rows);
                (cofactors.chunks_exact(count).map(|row| dot(row, &observed)).collect(), cofactors)
            } else {
                (observed, from_identity(&sub(&own.equations, own.rows(), &rows)).collect())
            };
            Some(ResidualBlock { groups: self.on_place(*place).to_vec(), residual, cofactors })
        };
        Ok(threads.install(|| parallel::map(all.len(), AT_LEAST, |k| of(k).unwrap_or_default())))
    }

    /// Returns the test groups of a local point.
    fn on_place(&self, place: usize) -> &[usize] {
        self.groups.on_point(self.assembled.points[place])
    }

    /// Returns the index of a point in the model, unless it has additional observations.
    pub(super) fn local(&self, point: usize) -> Option<usize> {
        self.place.get(point).copied().flatten().filter(|&place| self.is_tested_whole(place))
    }

    /// Whether all observations of a point are its images and its coordinates, which are tested together.
    pub(super) fn is_tested_whole(&self, place: usize) -> bool {
        let problem = &self.assembled.problem;
        place < problem.model.locals && problem.layout().terms_of(place).is_empty()
    }

    /// Returns the equations of observed coordinates of a local point.
    fn further(&self, place: usize, prior_terms: &PriorTerms) -> Vec<Function> {
        let mut own = self.on_place(place).iter();
        let control = own.find(|&&group| self.groups.kind(group) == TestKind::Control);
        let rows =
            control.and_then(|&group| self.prior_rows(self.groups.equations_of(group), prior_terms).ok());
        rows.unwrap_or_default()
    }

    /// Returns the equation index of each row of the groups at a local point, and its whitened misclosure.
    fn rows_at(
        &self,
        place: usize,
        observation_sd: &[f64],
        found: &Leverages,
        prior_terms: &PriorTerms,
    ) -> (Vec<usize>, Vec<f64>) {
        let groups = self.assembled.problem.layout().groups_of(place);
        let (mut rows, mut off) = (vec![], vec![]);
        for &group in self.on_place(place) {
            let equations = self.groups.equations_of(group);
            let first = match self.groups.kind(group) {
                TestKind::Image => equations[0] as usize - 2 * groups.start,
                _ => 2 * groups.len(),
            };
            for (k, &equation) in equations.iter().enumerate() {
                rows.push(first + k);
                off.push(misclosure(equation, observation_sd, found, prior_terms));
            }
        }
        (rows, off)
    }
}
