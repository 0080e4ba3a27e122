//! Tests of all observation groups in outlier detection.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::trial::Trial;
use crate::adjustment::{Alone, EquationOf, GroupTest, Leverages, PriorTerms, weighted};
use crate::normals::Function;
use crate::{Threads, parallel};

/// Test of a group for a gross error; see [`GroupTest`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestOfGroup {
    /// Whether at least some rows of the group are active, or predicted; other results are undefined.
    pub active: bool,
    /// Number of directions with a detectable error.
    pub rank: usize,
    /// T.
    pub statistic: f64,
    /// The smallest redundancy of a detectable direction.
    pub least: f64,
    /// See [`GroupTest::shared`].
    pub shared: f64,
}

/// Row of a tested group; NaN if the row is not part of the test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestOfRow {
    /// Standardized residual.
    pub residual: f64,
    /// Estimated error, in the unit of the observation.
    pub error: f64,
    /// Standard deviation of this error (a priori unit weight).
    pub error_sd: f64,
}

/// Tests of some groups; rows and square blocks are concatenated group by group.
#[derive(Debug, Clone, Default)]
pub struct Tests {
    /// The groups.
    pub groups: Vec<TestOfGroup>,
    /// Their rows.
    pub rows: Vec<TestOfRow>,
    /// Cofactors R of the residuals; zero for excluded rows.
    pub cofactors: Vec<f64>,
}

/// Number of groups per chunk.
const TOGETHER: usize = 256;

impl Tests {
    /// Returns tests of inactive groups.
    pub(super) fn inactive(groups: usize, rows: usize, blocks: usize) -> Self {
        let (nan, active) = (f64::NAN, false);
        let group = TestOfGroup { active, rank: 0, statistic: nan, least: nan, shared: nan };
        let row = TestOfRow { residual: nan, error: nan, error_sd: nan };
        Self { groups: vec![group; groups], rows: vec![row; rows], cofactors: vec![0.0; blocks] }
    }
}

impl From<&GroupTest> for TestOfGroup {
    fn from(test: &GroupTest) -> Self {
        let GroupTest { statistic, least, shared, .. } = *test;
        Self { active: true, rank: test.rank, statistic, least, shared }
    }
}

/// Adjusted network as tests of groups require it.
struct Tested<'a> {
    found: &'a Leverages,
    /// Leverages of all groups of equations.
    leverages: &'a [f64],
    prior_terms: PriorTerms,
    alone: Option<Alone>,
}

impl Trial {
    /// Tests every active observation group, on request with [`TestOfGroup::shared`].
    ///
    /// # Errors
    /// Tests before any adjustment.
    pub fn tests(&self, shared: bool, threads: &Threads) -> Result<Tests, NetworkError> {
        self.tests_of(0..self.groups.len(), shared, threads)
    }

    /// Tests consecutive groups.
    pub(super) fn tests_of(
        &self,
        groups: Range<usize>,
        shared: bool,
        threads: &Threads,
    ) -> Result<Tests, NetworkError> {
        let found = self.found()?;
        let tested = Tested {
            found,
            leverages: found.cofactors.groups.as_deref().ok_or(NetworkError::State)?,
            prior_terms: self.prior_terms(&self.assembled.problem.sd, &found.values),
            alone: shared.then(|| found.alone(&self.assembled.problem, threads)),
        };
        let [row_starts, block_starts] = [self.groups.row_starts(), self.groups.block_starts()];
        let count = |starts: &[usize], some: &Range<usize>| starts[some.end] - starts[some.start];
        let mut all = Tests::inactive(groups.len(), count(row_starts, &groups), count(block_starts, &groups));
        let (mut rows, mut blocks) = (&mut all.rows[..], &mut all.cofactors[..]);
        let mut parts = vec![];
        for (number, own) in all.groups.chunks_mut(TOGETHER).enumerate() {
            let first = groups.start + TOGETHER * number;
            let some = first..first + own.len();
            let rows = rows.split_off_mut(..count(row_starts, &some)).unwrap_or_default();
            let blocks = blocks.split_off_mut(..count(block_starts, &some)).unwrap_or_default();
            parts.push((some, own, rows, blocks));
        }
        threads.install(|| {
            parallel::each_of(parts, &|_, (some, own, rows, blocks)| {
                let [first_row, first_block] = [row_starts[some.start], block_starts[some.start]];
                for (group, own) in some.zip(own) {
                    let rows = &mut rows[row_starts[group] - first_row..row_starts[group + 1] - first_row];
                    let block = &mut blocks[block_starts[group] - first_block..][..rows.len().pow(2)];
                    if let Some(test) = self.test(group, &tested, rows, block) {
                        *own = (&test).into();
                    }
                }
            });
        });
        Ok(all)
    }

    /// Returns the redundancy numbers of all rows: the diagonals of their cofactors; NaN for excluded rows.
    pub fn redundancy(&self, tests: &Tests) -> Vec<f64> {
        let of = |(rows, &first): (&[usize], &usize)| {
            let (start, size) = (rows[0], rows[1] - rows[0]);
            (0..size).map(move |k| match tests.rows[start + k].residual {
                residual if residual.is_nan() => f64::NAN,
                _ => tests.cofactors[first + k * (size + 1)],
            })
        };
        self.groups.row_starts().windows(2).zip(self.groups.block_starts()).flat_map(of).collect()
    }

    /// Tests a group, and writes its rows and cofactors; None if all its rows are excluded.
    fn test(
        &self,
        group: usize,
        tested: &Tested<'_>,
        rows: &mut [TestOfRow],
        block: &mut [f64],
    ) -> Option<GroupTest> {
        let (equations, layout) = (self.groups.equations_of(group), self.assembled.problem.layout());
        if (equations[0] as usize) < layout.groups() * layout.rows() {
            return self.image_test(group, tested, rows, block);
        }
        let size = rows.len();
        let active: Vec<usize> = (0..size).filter(|&k| self.is_in(equations[k])).collect();
        if active.is_empty() {
            return None;
        }
        let residual =
            |&k: &usize| misclosure(equations[k], &self.observation_sd, tested.found, &tested.prior_terms);
        let residual: Vec<f64> = active.iter().map(residual).collect();
        let (cofactors, by_point) = self.leverages(equations, tested, &active)?;
        let [cofactors, by_point] =
            [cofactors, by_point].map(|own| from_identity(&own).collect::<Vec<f64>>());
        let test = GroupTest::new(&residual, &cofactors, tested.alone.as_ref().map(|_| &by_point[..]));
        let (error, error_sd) = in_units(&self.units(group, &active), &test.error, &test.cofactors);
        for (i, &row) in active.iter().enumerate() {
            rows[row] = TestOfRow { residual: residual[i], error: error[i], error_sd: error_sd[i] };
            for (j, &column) in active.iter().enumerate() {
                block[row * size + column] = cofactors[i * active.len() + j];
            }
        }
        Some(test)
    }

    /// Tests an image of a local point; nearly all groups are of this type.
    fn image_test(
        &self,
        group: usize,
        tested: &Tested<'_>,
        rows: &mut [TestOfRow],
        block: &mut [f64],
    ) -> Option<GroupTest> {
        let Tested { found, leverages, alone, .. } = tested;
        let first = self.groups.equations_of(group)[0] as usize;
        let own = first..first + 2;
        if self.assembled.problem.observation_sd[own.clone()].iter().any(|sd| sd.is_infinite()) {
            return None;
        }
        let (sd, v) = (&self.observation_sd[own.clone()], &found.residuals[own]);
        let residual = [v[0] / sd[0], v[1] / sd[1]];
        let own = 2 * first..2 * first + 4;
        let left = |leverages: &[f64]| [1.0 - leverages[0], -leverages[1], -leverages[2], 1.0 - leverages[3]];
        block.copy_from_slice(&left(&leverages[own.clone()]));
        let is_whole = || self.groups.point(group).is_some_and(|point| self.local(point).is_some());
        let known = alone.as_ref().map(|alone| left(if is_whole() { &alone.groups[own] } else { &[0.0; 4] }));
        let test = GroupTest::new(&residual, block, known.as_ref().map(|own| &own[..]));
        for (k, row) in rows.iter_mut().enumerate() {
            let (error, error_sd) = (test.error[k] * sd[k], test.cofactors[3 * k].sqrt() * sd[k]);
            *row = TestOfRow { residual: residual[k], error, error_sd };
        }
        Some(test)
    }

    /// Returns the leverages A Q A^T of some rows of a group that is no image of a local point, and the leverages with only the own point
    /// free; zero for points with additional observations, which are tested apart from them.
    fn leverages(
        &self,
        equations: &[u32],
        tested: &Tested<'_>,
        active: &[usize],
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let (problem, Tested { found, prior_terms, alone, .. }) = (&self.assembled.problem, tested);
        let (size, count) = (equations.len(), active.len());
        let mut by_point = vec![0.0; count * count];
        let unknown = match self.equation(equations[0]) {
            EquationOf::Unknown(unknown) => unknown,
            EquationOf::Term { term, .. } => {
                let block = &found.cofactors.terms[problem.layout().term_block(term)];
                return Some((sub(block, size, active), by_point));
            }
            EquationOf::Group { .. } => return None,
        };
        let rows = self.prior_rows(equations, prior_terms).ok()?;
        let leverages = sub(&found.of_rows(problem.layout(), &rows).ok()?.equations, size, active);
        let place = unknown / 3;
        if let Some(alone) = alone.as_ref().filter(|_| self.is_tested_whole(place)) {
            let all: Vec<f64> = active.iter().flat_map(|&k| rows[k].iter().map(|own| own.1)).collect();
            let rows = DMatrix::from_row_slice(count, 3, &all);
            let own = DMatrix::from_row_slice(3, 3, &alone.locals[9 * place..][..9]);
            by_point = (&rows * own * rows.transpose()).as_slice().to_vec();
        }
        Some((leverages, by_point))
    }

    /// Returns the whitened equations of weighted parameters, over all parameters of their block; zero for excluded rows.
    pub(super) fn prior_rows(
        &self,
        equations: &[u32],
        prior_terms: &PriorTerms,
    ) -> Result<Vec<Function>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let of = |&equation: &u32| {
            let unknown = equation as usize - problem.layout().equations();
            let range = self.block_with(unknown);
            let mut function: Function = range.clone().map(|unknown| (unknown, 0.0)).collect();
            let (row, _) = prior_terms.row(unknown);
            let free = row.into_iter().filter(|(i, _)| problem.sd[*i] != 0.0 && !found.held.contains(i));
            free.for_each(|(i, value)| function[i - range.start].1 = value);
            function
        };
        Ok(equations.iter().map(of).collect())
    }

    /// Returns all parameters of the point or block of a parameter.
    pub(super) fn block_with(&self, unknown: usize) -> Range<usize> {
        let layout = self.assembled.problem.layout();
        if layout.all_locals().contains(&unknown) {
            layout.local_range(unknown / layout.local_dim())
        } else {
            layout.retained_range(layout.retained_with(unknown))
        }
    }

    /// Returns the cofactors of a point of the model.
    pub(super) fn cofactors_of_point(&self, found: &Leverages, place: usize) -> DMatrix<f64> {
        let (model, retained) = (&self.assembled.problem.model, &found.cofactors.retained);
        // Points are the last retained blocks.
        let values = match place < model.locals {
            true => &found.cofactors.local[9 * place..],
            false => &retained[retained.len() - 9 * (model.points.len() - place)..],
        };
        DMatrix::from_row_slice(3, 3, &values[..9])
    }
}

/// Returns the misclosure of an equation, divided by its standard deviation.
pub(super) fn misclosure(
    equation: u32,
    observation_sd: &[f64],
    found: &Leverages,
    prior_terms: &PriorTerms,
) -> f64 {
    let equation = equation as usize;
    match equation.checked_sub(observation_sd.len()) {
        None => weighted(found.residuals[equation], observation_sd[equation]),
        Some(unknown) => prior_terms.row(unknown).1,
    }
}

/// Returns the elements of I - M for a square matrix M.
pub(super) fn from_identity(matrix: &[f64]) -> impl Iterator<Item = f64> {
    let next = matrix.len().isqrt() + 1;
    matrix.iter().enumerate().map(move |(k, value)| f64::from(u8::from(k % next == 0)) - value)
}

/// Returns some rows and columns of a square matrix with `size` rows, row by row.
pub(super) fn sub(matrix: &[f64], size: usize, some: &[usize]) -> Vec<f64> {
    some.iter().flat_map(|&i| some.iter().map(move |&j| matrix[i * size + j])).collect()
}

/// Converts whitened errors and their cofactors to other units: values and standard deviations.
pub(super) fn in_units(units: &DMatrix<f64>, error: &[f64], cofactors: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let count = error.len();
    let values = units * DVector::from_column_slice(error);
    let spread = units * DMatrix::from_column_slice(count, count, cofactors) * units.transpose();
    (values.as_slice().to_vec(), spread.diagonal().map(f64::sqrt).as_slice().to_vec())
}
