//! Effects of single observations: columns of R, effects on chosen parameters and own points, and inseparable observations. Effects on other
//! parameters require a solution of the normal equations.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::covariance::{Covariances, Of};
use super::error::NetworkError;
use super::group_tests::from_identity;
use super::predictions::{AT_LEAST, ResidualBlock};
use super::test_groups::TestGroups;
use super::trial::Trial;
use crate::adjustment::{
    AdjustError, Linearized, ObservationRows, correlation_above, leverage_odds, may_correlate, whitening,
};
use crate::normals::RowCofactors;
use crate::{Context, Threads, parallel};

/// Number of right-hand sides per batch.
const TOGETHER: usize = 16;

impl Covariances {
    /// Returns the test groups of the network, in the order of all tests.
    pub fn groups(&self) -> &Arc<TestGroups> {
        let new = || TestGroups::new(&self.assembled, self.images, &|photo| self.camera_of_photo[photo]);
        self.groups.get_or_init(|| Arc::new(new()))
    }

    /// Returns the effects of errors of one standard deviation in every row of [`Covariances::groups`] on functions of the parameters:
    /// one number per function and row.
    ///
    /// `partials`: partials of each function by the parameters of `of`, as in [`Covariances::propagate`].
    ///
    /// # Errors
    /// Errors of [`Covariances::propagate`].
    pub fn influences(
        &self,
        partials: &[f64],
        of: &[Of],
        threads: &Threads,
    ) -> Result<Vec<f64>, NetworkError> {
        let (problem, values) = (&self.assembled.problem, self.linearized.values());
        let solutions = self.solutions(partials, of, threads)?;
        let products =
            ObservationRows::products(problem, values, self.linearized.held(), &solutions, threads);
        let (width, equations) = (solutions.len(), self.groups().equations());
        let of = |k: usize| equations.iter().map(move |&equation| (equation as usize, k));
        Ok((0..width).flat_map(of).map(|(equation, k)| products[equation * width + k]).collect())
    }
}

impl Trial {
    /// Returns the columns of R for the rows of some groups: the cofactors of their residuals with the residuals of all rows of all groups,
    /// column by column.
    ///
    /// # Errors
    /// Responses before any adjustment; an interruption, insufficient memory.
    pub fn responses(&self, groups: &[usize], threads: &Threads) -> Result<Vec<f64>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let context = &mut Context::new(threads);
        let failed = |error: AdjustError| NetworkError::new(error, &self.assembled);
        let (values, held) = (found.values.clone(), found.held.clone());
        let linearized = Linearized::form(problem, None, values, held, context).map_err(failed)?;
        let equations = ObservationRows::new(problem, &found.values, &found.held, threads);
        let unknowns = problem.layout().unknowns();
        let all: Vec<usize> = self.groups.equations().iter().map(|&equation| equation as usize).collect();
        let asked: Vec<usize> = groups.iter().flat_map(|&group| self.groups.rows(group)).collect();
        let mut columns = Vec::with_capacity(all.len() * asked.len());
        for some in asked.chunks(TOGETHER) {
            let rights: Vec<f64> = some.iter().flat_map(|&row| equations.right(all[row], unknowns)).collect();
            let solutions = linearized.solve_for(problem, &rights, context).map_err(failed)?;
            for (row, solution) in some.iter().zip(solutions.chunks_exact(unknowns)) {
                let first = columns.len();
                columns.extend(equations.times(&all, solution, threads).into_iter().map(|share| -share));
                columns[first + row] += 1.0;
            }
        }
        Ok(columns)
    }

    /// Returns the effects of errors of one standard deviation in each row of some groups on the coordinates of their own point; NaN without
    /// a point.
    ///
    /// # Errors
    /// Effects before any adjustment.
    pub fn effects(&self, groups: &[usize], threads: &Threads) -> Result<Vec<[f64; 3]>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let prior_terms = self.prior_terms(&problem.sd, &found.values);
        let near = self.near(groups, &problem.observation_sd, &prior_terms, threads)?;
        let is_point =
            |block: Option<usize>| block.is_none_or(|block| block >= problem.model.parameter_blocks());
        let effects = |own: &RowCofactors| -> Vec<[f64; 3]> {
            match own.blocks.iter().find(|(block, _)| is_point(*block)) {
                Some((_, values)) => values.as_chunks().0.to_vec(),
                None => vec![[f64::NAN; 3]; own.rows()],
            }
        };
        Ok(near.iter().flat_map(effects).collect())
    }

    /// Returns pairs of observations of one point with a correlation of their tests above `limit`: their errors are inseparable.
    ///
    /// # Errors
    /// Tests before any adjustment.
    pub fn inseparable(
        &self,
        points: &[usize],
        limit: f64,
        threads: &Threads,
    ) -> Result<Vec<(usize, usize, f64)>, NetworkError> {
        let on_points = self.on_points(points, (limit, false), threads)?;
        let pairs = |points: Range<usize>| -> Vec<(usize, usize, f64)> {
            on_points[points].iter().flat_map(|own| self.pairs_on(own, limit)).collect()
        };
        Ok(threads.install(|| parallel::by_parts(on_points.len(), AT_LEAST, &pairs)))
    }

    fn pairs_on(&self, own: &ResidualBlock, limit: f64) -> Vec<(usize, usize, f64)> {
        let count = own.residual.len();
        let starts = self.groups.starts_among(&own.groups);
        let block = |i: usize, j: usize| -> Vec<f64> {
            let rows = starts[i]..starts[i + 1];
            rows.flat_map(|row| own.cofactors[row * count..][starts[j]..starts[j + 1]].to_vec()).collect()
        };
        let mut found = vec![];
        let is_in =
            |&k: &usize| self.groups.equations_of(own.groups[k]).iter().any(|&equation| self.is_in(equation));
        let taking_part: Vec<usize> = (0..own.groups.len()).filter(is_in).collect();
        let alone: Vec<Vec<f64>> = (0..own.groups.len()).map(|k| block(k, k)).collect();
        let odds: Vec<f64> = alone.iter().map(|cofactors| leverage_odds(from_identity(cofactors))).collect();
        let roots: Vec<DMatrix<f64>> = taking_part.iter().map(|&k| whitening(&alone[k])).collect();
        for (at, &j) in taking_part.iter().enumerate() {
            let others = taking_part[..at].iter().zip(&roots);
            for (&i, root) in others.filter(|(i, _)| may_correlate(odds[**i], odds[j], limit)) {
                let between = block(i, j);
                if between.iter().any(|value| value.is_nan()) {
                    continue;
                }
                let rho = correlation_above(root, &roots[at], &between, limit);
                if rho > limit {
                    found.push((own.groups[i], own.groups[j], rho));
                }
            }
        }
        found
    }
}
