//! Tests of all groups of observations of a network that is tried.

use nalgebra::{DMatrix, DVector};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::NetworkError;
use super::suspects::{Home, Row, Suspect};
use super::trial::Trial;
use crate::adjustment::{Few, GroupTest, Tried, Weighted};
use crate::normals::GroupCofactors;

/// Tests of all suspects; the rows and square blocks of one stand after those of another.
#[derive(Debug, Clone, Default)]
pub struct Tests {
    /// Whether it takes part, or some of its rows do; nothing else is known of those that do not.
    pub active: Vec<bool>,
    /// Directions in which an error shows.
    pub rank: Vec<usize>,
    /// T, see [`GroupTest`].
    pub statistic: Vec<f64>,
    /// The smallest redundancy of a direction that shows.
    pub least: Vec<f64>,
    /// See [`GroupTest::shared`].
    pub shared: Vec<f64>,
    /// Residual of each row over its standard deviation; NaN for rows that are out.
    pub residual: Vec<f64>,
    /// R: the cofactors of these residuals; zero for rows that are out.
    pub cofactors: Vec<f64>,
    /// The estimated error of each row and its standard deviation (a priori unit weight), in the unit of the observation.
    pub error: Vec<f64>,
    /// See [`Tests::error`].
    pub error_sd: Vec<f64>,
}

/// A test of a suspect, in its units.
struct Tested {
    test: GroupTest,
    residual: Few,
    cofactors: Few,
    error: Few,
    error_sd: Few,
}

impl Trial {
    /// Tests every group of observations that takes part.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn tests(&self, pool: &ThreadPool) -> Result<Tests, NetworkError> {
        let found = self.found()?;
        let groups = found.cofactors.groups.as_ref().ok_or(NetworkError::State)?;
        let weighted = self.weighted(&self.assembled.problem.sd, &found.values);
        let test = |suspect: &Suspect| self.test(suspect, found, groups, &weighted);
        let tested: Vec<Option<Tested>> =
            pool.install(|| self.suspects.par_iter().with_min_len(256).map(test).collect());
        let mut all = Tests {
            residual: Vec::with_capacity(self.row_starts[self.suspects.len()]),
            cofactors: Vec::with_capacity(self.block_starts[self.suspects.len()]),
            ..Tests::default()
        };
        for (suspect, tested) in self.suspects.iter().zip(tested) {
            let size = suspect.rows.len();
            all.active.push(tested.is_some());
            match tested {
                Some(Tested { test, residual, cofactors, error, error_sd }) => {
                    all.rank.push(test.rank);
                    all.statistic.push(test.statistic);
                    all.least.push(test.least);
                    all.shared.push(test.shared);
                    all.residual.extend(residual);
                    all.cofactors.extend(cofactors);
                    all.error.extend(error);
                    all.error_sd.extend(error_sd);
                }
                None => {
                    all.rank.push(0);
                    [&mut all.statistic, &mut all.least, &mut all.shared]
                        .into_iter()
                        .for_each(|to| to.push(f64::NAN));
                    for to in [&mut all.residual, &mut all.error, &mut all.error_sd] {
                        to.resize(to.len() + size, f64::NAN);
                    }
                    all.cofactors.resize(all.cofactors.len() + size * size, 0.0);
                }
            }
        }
        Ok(all)
    }

    /// None where nothing of it takes part.
    fn test(
        &self,
        suspect: &Suspect,
        found: &Tried,
        groups: &GroupCofactors,
        weighted: &[Weighted],
    ) -> Option<Tested> {
        if let Home::Group { group, .. } = suspect.home {
            return self.image_test(group, found, groups);
        }
        let size = suspect.rows.len();
        let taking: Vec<usize> = (0..size).filter(|&k| self.is_in(suspect.rows[k].0)).collect();
        if taking.is_empty() {
            return None;
        }
        let (residual, shares, by_point) = self.shares(suspect, found, groups, weighted, &taking);
        let left = |shares: &[f64]| -> Vec<f64> {
            let count = taking.len();
            (0..count * count).map(|k| f64::from(u8::from(k / count == k % count)) - shares[k]).collect()
        };
        let cofactors = left(&shares);
        let test = GroupTest::new(&residual, &cofactors, Some(&left(&by_point)));
        let rows: Vec<(Row, usize)> = taking.iter().map(|&k| suspect.rows[k]).collect();
        let units = self.units(suspect, &rows);
        let (error, error_sd) = in_units(&units, &test.error, &test.cofactors);
        let whole = taking.len() == size;
        let spread = |values: Vec<f64>| match whole {
            true => Few::from_vec(values),
            false => {
                let mut all = Few::from_elem(f64::NAN, size);
                taking.iter().zip(values).for_each(|(&k, value)| all[k] = value);
                all
            }
        };
        let mut block = cofactors;
        if !whole {
            let mut all = vec![0.0; size * size];
            for (i, &row) in taking.iter().enumerate() {
                taking
                    .iter()
                    .enumerate()
                    .for_each(|(j, &column)| all[row * size + column] = block[i * taking.len() + j]);
            }
            block = all;
        }
        Some(Tested {
            test,
            residual: spread(residual),
            cofactors: Few::from_vec(block),
            error: spread(error),
            error_sd: spread(error_sd),
        })
    }

    /// The test of an image of a local point: nearly all are.
    fn image_test(&self, group: usize, found: &Tried, groups: &GroupCofactors) -> Option<Tested> {
        let rows = 2 * group..2 * group + 2;
        if self.assembled.problem.observation_sd[rows.clone()].iter().any(|sd| sd.is_infinite()) {
            return None;
        }
        let (sd, v) = (&self.observation_sd[rows.clone()], &found.residuals[rows]);
        let residual = [v[0] / sd[0], v[1] / sd[1]];
        let block = 4 * group..4 * group + 4;
        let left = |shares: &[f64]| [1.0 - shares[0], -shares[1], -shares[2], 1.0 - shares[3]];
        let cofactors = left(&groups.shares[block.clone()]);
        let test = GroupTest::new(&residual, &cofactors, Some(&left(&groups.by_local[block])));
        let of = |k: usize| (test.error[k] * sd[k], test.cofactors[3 * k].sqrt() * sd[k]);
        let [first, second] = [of(0), of(1)];
        Some(Tested {
            residual: Few::from_slice(&residual),
            cofactors: Few::from_buf(cofactors),
            error: Few::from_slice(&[first.0, second.0]),
            error_sd: Few::from_slice(&[first.1, second.1]),
            test,
        })
    }

    /// Residuals of unit weight of some rows of a suspect, a Q a^T of these, and the same with all known but the own point.
    fn shares(
        &self,
        suspect: &Suspect,
        found: &Tried,
        groups: &GroupCofactors,
        weighted: &[Weighted],
        taking: &[usize],
    ) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let problem = &self.assembled.problem;
        let residual = |&k: &usize| match suspect.rows[k].0 {
            Row::Equation(equation) => found.residuals[equation] / self.observation_sd[equation],
            Row::Unknown(unknown) => problem.prior_row(&problem.sd, &found.values, weighted, unknown).1,
        };
        let residuals = taking.iter().map(residual).collect();
        let count = taking.len();
        let (shares, by_point) = match suspect.home {
            Home::Tie(tie) => {
                let block = &found.cofactors.ties[problem.layout().tie_block(tie)];
                (sub(block, suspect.rows.len(), taking), vec![0.0; count * count])
            }
            Home::Group { .. } | Home::Point(_) | Home::Block(_) => {
                let rows = self.prior_rows(suspect, taking, &problem.sd, &found.values, weighted);
                let q = self.cofactors_at(found, suspect.home);
                let alone = match suspect.home {
                    Home::Point(place) if place < problem.model.locals => {
                        let own = DMatrix::from_row_slice(3, 3, &groups.alone[9 * place..9 * place + 9]);
                        &rows * own * rows.transpose()
                    }
                    _ => DMatrix::zeros(count, count),
                };
                let shares = &rows * q * rows.transpose();
                (shares.transpose().as_slice().to_vec(), alone.transpose().as_slice().to_vec())
            }
        };
        (residuals, shares, by_point)
    }

    /// The equations of some rows of a suspect, of unit weight, by the unknowns of its block.
    pub(super) fn prior_rows(
        &self,
        suspect: &Suspect,
        some: &[usize],
        sd: &[f64],
        values: &[f64],
        weighted: &[Weighted],
    ) -> DMatrix<f64> {
        let range = self.unknowns_at(suspect.home);
        let mut rows = DMatrix::zeros(some.len(), range.len());
        for (i, &k) in some.iter().enumerate() {
            if let Row::Unknown(unknown) = suspect.rows[k].0 {
                let (row, _) = self.assembled.problem.prior_row(sd, values, weighted, unknown);
                row.into_iter().for_each(|(column, value)| rows[(i, column - range.start)] = value);
            }
        }
        rows
    }

    pub(super) fn unknowns_at(&self, home: Home) -> std::ops::Range<usize> {
        let model = &self.assembled.problem.model;
        match home {
            Home::Point(place) => model.of_point(place),
            Home::Block(block) => model.of_block(block),
            Home::Group { .. } | Home::Tie(_) => 0..0,
        }
    }

    /// The cofactors of the unknowns of a point or block.
    pub(super) fn cofactors_at(&self, found: &Tried, home: Home) -> DMatrix<f64> {
        let (model, kept) = (&self.assembled.problem.model, &found.cofactors.kept);
        let width = self.unknowns_at(home).len();
        let values = match home {
            Home::Point(place) if place < model.locals => &found.cofactors.local[9 * place..9 * place + 9],
            // The last kept blocks.
            Home::Point(place) => {
                let behind = model.points.len() - place;
                &kept[kept.len() - 9 * behind..][..9]
            }
            Home::Block(block) => model.cofactors_of_block(&found.cofactors, block),
            Home::Group { .. } | Home::Tie(_) => &[],
        };
        DMatrix::from_row_slice(width, width, values)
    }
}

/// Some rows and columns of a square matrix of so many rows, row by row.
pub(super) fn sub(matrix: &[f64], size: usize, some: &[usize]) -> Vec<f64> {
    some.iter().flat_map(|&i| some.iter().map(move |&j| matrix[i * size + j])).collect()
}

/// Errors of unit weight with their cofactors in other units: values and standard deviations.
pub(super) fn in_units(units: &DMatrix<f64>, error: &[f64], cofactors: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let count = error.len();
    let values = units * DVector::from_column_slice(error);
    let spread = units * DMatrix::from_column_slice(count, count, cofactors) * units.transpose();
    (values.as_slice().to_vec(), spread.diagonal().map(f64::sqrt).as_slice().to_vec())
}
