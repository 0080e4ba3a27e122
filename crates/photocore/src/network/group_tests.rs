//! Tests of all observation groups in outlier detection.

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::suspects::{Home, Row, Suspect, Suspects};
use super::trial::Trial;
use crate::adjustment::{Alone, Few, GroupTest, Leverages, Terms, weighted};
use crate::normals::Function;
use crate::{Threads, parallel};

/// Tests of all groups; rows and square blocks are concatenated group by group.
#[derive(Debug, Clone, Default)]
pub struct Tests {
    /// Whether at least some rows of the group are active; results of other groups are undefined.
    pub active: Vec<bool>,
    /// Number of directions with a detectable error.
    pub rank: Vec<usize>,
    /// T, see [`GroupTest`].
    pub statistic: Vec<f64>,
    /// The smallest redundancy of a detectable direction.
    pub least: Vec<f64>,
    /// See [`GroupTest::shared`].
    pub shared: Vec<f64>,
    /// Standardized residual of each row; NaN for excluded rows.
    pub residual: Vec<f64>,
    /// Cofactors R of these residuals; zero for excluded rows.
    pub cofactors: Vec<f64>,
    /// Estimated error of each row and its standard deviation (a priori unit weight), in the unit of the observation.
    pub error: Vec<f64>,
    /// See [`Tests::error`].
    pub error_sd: Vec<f64>,
}

/// Number of groups per chunk.
const TOGETHER: usize = 1024;

/// Unwritten part of [`Tests`] for consecutive groups.
struct Part<'a> {
    active: &'a mut [bool],
    rank: &'a mut [usize],
    /// Statistic, least and shared.
    of_suspects: [&'a mut [f64]; 3],
    /// Residual, error and its standard deviation.
    of_rows: [&'a mut [f64]; 3],
    cofactors: &'a mut [f64],
}

impl Tests {
    /// Returns tests of inactive groups.
    fn unknown(suspects: &Suspects) -> Self {
        let count = suspects.len();
        let (rows, blocks) = (suspects.row_starts()[count], suspects.block_starts()[count]);
        let nothing = |count: usize| vec![f64::NAN; count];
        Self {
            active: vec![false; count],
            rank: vec![0; count],
            statistic: nothing(count),
            least: nothing(count),
            shared: nothing(count),
            residual: nothing(rows),
            cofactors: vec![0.0; blocks],
            error: nothing(rows),
            error_sd: nothing(rows),
        }
    }

    /// Splits the tests into chunks of [`TOGETHER`] groups.
    fn parts<'a>(&'a mut self, suspects: &Suspects) -> Vec<Part<'a>> {
        let (row_starts, block_starts) = (suspects.row_starts(), suspects.block_starts());
        let Self { active, rank, statistic, least, shared, residual, cofactors, error, error_sd } = self;
        let of_suspects = [statistic, least, shared].map(|all| all.chunks_mut(TOGETHER));
        let [mut statistic, mut least, mut shared] = of_suspects;
        let mut of_rows = [residual, error, error_sd].map(|all| &mut all[..]);
        let mut cofactors = &mut cofactors[..];
        let of_part = |(first, (active, rank)): (usize, (&'a mut [bool], &'a mut [usize]))| {
            let (first, last) = (first * TOGETHER, first * TOGETHER + active.len());
            let rows = row_starts[last] - row_starts[first];
            let of_suspects = [&mut statistic, &mut least, &mut shared];
            Part {
                of_suspects: of_suspects.map(|chunks| chunks.next().unwrap_or_default()),
                of_rows: of_rows.each_mut().map(|rest| rest.split_off_mut(..rows).unwrap_or_default()),
                cofactors: cofactors
                    .split_off_mut(..block_starts[last] - block_starts[first])
                    .unwrap_or_default(),
                active,
                rank,
            }
        };
        active.chunks_mut(TOGETHER).zip(rank.chunks_mut(TOGETHER)).enumerate().map(of_part).collect()
    }
}

impl Part<'_> {
    /// Writes the test of the next group with `size` rows.
    fn put(&mut self, size: usize, tested: Option<Tested>) {
        let (active, rank) = (self.active.split_off_first_mut(), self.rank.split_off_first_mut());
        let own = self.of_suspects.each_mut().map(|rest| rest.split_off_first_mut());
        let rows = self.of_rows.each_mut().map(|rest| rest.split_off_mut(..size).unwrap_or_default());
        let block = self.cofactors.split_off_mut(..size * size).unwrap_or_default();
        let Some(Tested { test, residual, cofactors, error, error_sd }) = tested else { return };
        active.into_iter().for_each(|to| *to = true);
        rank.into_iter().for_each(|to| *to = test.rank);
        let of_test = [test.statistic, test.least, test.shared];
        own.into_iter().zip(of_test).for_each(|(to, value)| to.into_iter().for_each(|to| *to = value));
        rows.into_iter().zip([residual, error, error_sd]).for_each(|(to, own)| to.copy_from_slice(&own));
        block.copy_from_slice(&cofactors);
    }
}

/// Test of one group, in its units.
pub(super) struct Tested {
    pub test: GroupTest,
    pub residual: Few,
    pub cofactors: Few,
    error: Few,
    error_sd: Few,
}

impl Trial {
    /// Tests every active observation group, on request with [`Tests::shared`].
    ///
    /// # Errors
    /// Tests before any adjustment.
    pub fn tests(&self, shared: bool, threads: &Threads) -> Result<Tests, NetworkError> {
        let found = self.found()?;
        let groups = found.cofactors.groups.as_deref().ok_or(NetworkError::State)?;
        let terms = self.terms(&self.assembled.problem.sd, &found.values);
        let alone = shared.then(|| found.alone(&self.assembled.problem, threads));
        let mut all = Tests::unknown(&self.suspects);
        let parts = all.parts(&self.suspects);
        let fill = |number: usize, mut part: Part<'_>| {
            for index in TOGETHER * number..(TOGETHER * (number + 1)).min(self.suspects.len()) {
                let suspect = self.suspects.get(index);
                part.put(suspect.rows.len(), self.test(&suspect, (found, groups), &terms, alone.as_ref()));
            }
        };
        threads.install(|| parallel::each_of(parts, &fill));
        Ok(all)
    }

    /// Returns the redundancy numbers of all rows: the diagonals of their cofactors; NaN for excluded rows.
    pub fn redundancy(&self, tests: &Tests) -> Vec<f64> {
        let of = |(rows, &first): (&[usize], &usize)| {
            let (start, size) = (rows[0], rows[1] - rows[0]);
            (0..size).map(move |k| match tests.residual[start + k] {
                residual if residual.is_nan() => f64::NAN,
                _ => tests.cofactors[first + k * (size + 1)],
            })
        };
        self.suspects.row_starts().windows(2).zip(self.suspects.block_starts()).flat_map(of).collect()
    }

    /// Tests a group; None if all its rows are excluded.
    pub(super) fn test(
        &self,
        suspect: &Suspect<'_>,
        (found, groups): (&Leverages, &[f64]),
        terms: &Terms<'_>,
        alone: Option<&Alone>,
    ) -> Option<Tested> {
        if let Home::Group { group, point } = suspect.home {
            return self.image_test((group, point), (found, groups), alone);
        }
        let size = suspect.rows.len();
        let taking: Vec<usize> = (0..size).filter(|&k| self.is_in(suspect.rows[k])).collect();
        if taking.is_empty() {
            return None;
        }
        let (residual, leverages, by_point) = self.leverages(suspect, found, terms, &taking, alone)?;
        let left = |leverages: &[f64]| -> Vec<f64> {
            let count = taking.len();
            (0..count * count).map(|k| f64::from(u8::from(k / count == k % count)) - leverages[k]).collect()
        };
        let cofactors = left(&leverages);
        let known = alone.map(|_| left(&by_point));
        let test = GroupTest::new(&residual, &cofactors, known.as_deref());
        let rows: Vec<Row> = taking.iter().map(|&k| suspect.rows[k]).collect();
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

    /// Tests an image of a local point; nearly all groups are of this type.
    fn image_test(
        &self,
        (group, place): (usize, usize),
        (found, groups): (&Leverages, &[f64]),
        alone: Option<&Alone>,
    ) -> Option<Tested> {
        let rows = 2 * group..2 * group + 2;
        if self.assembled.problem.observation_sd[rows.clone()].iter().any(|sd| sd.is_infinite()) {
            return None;
        }
        let (sd, v) = (&self.observation_sd[rows.clone()], &found.residuals[rows]);
        let residual = [v[0] / sd[0], v[1] / sd[1]];
        let block = 4 * group..4 * group + 4;
        let left = |leverages: &[f64]| [1.0 - leverages[0], -leverages[1], -leverages[2], 1.0 - leverages[3]];
        let cofactors = left(&groups[block.clone()]);
        let known = alone
            .map(|alone| left(if self.is_tested_whole(place) { &alone.groups[block] } else { &[0.0; 4] }));
        let test = GroupTest::new(&residual, &cofactors, known.as_ref().map(|own| &own[..]));
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

    /// Returns whitened residuals of some rows, their leverages A Q A^T, and the leverages with only the own point free; zero for points
    /// with additional observations, which are tested apart from them.
    fn leverages(
        &self,
        suspect: &Suspect<'_>,
        found: &Leverages,
        terms: &Terms<'_>,
        taking: &[usize],
        alone: Option<&Alone>,
    ) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
        let problem = &self.assembled.problem;
        let (size, count) = (suspect.rows.len(), taking.len());
        let residual = |&k: &usize| misclosure(suspect.rows[k], &self.observation_sd, found, terms);
        let residuals = taking.iter().map(residual).collect();
        if let Home::Tie(tie) = suspect.home {
            let block = &found.cofactors.ties[problem.layout().tie_block(tie)];
            return Some((residuals, sub(block, size, taking), vec![0.0; count * count]));
        }
        let rows = self.term_rows(suspect, terms).ok()?;
        let leverages = sub(&found.of_rows(problem.layout(), &rows).ok()?.equations, size, taking);
        let by_point = match (suspect.home, alone) {
            (Home::Point(place), Some(alone)) if self.is_tested_whole(place) => {
                let all: Vec<f64> = taking.iter().flat_map(|&k| rows[k].iter().map(|own| own.1)).collect();
                let rows = DMatrix::from_row_slice(count, 3, &all);
                let own = DMatrix::from_row_slice(3, 3, &alone.locals[9 * place..9 * place + 9]);
                (&rows * own * rows.transpose()).as_slice().to_vec()
            }
            _ => vec![0.0; count * count],
        };
        Some((residuals, leverages, by_point))
    }

    /// Returns the whitened equations of the parameters of a group, over all parameters of its block; zero for excluded rows.
    pub(super) fn term_rows(
        &self,
        suspect: &Suspect<'_>,
        terms: &Terms<'_>,
    ) -> Result<Vec<Function>, NetworkError> {
        let (found, sd) = (self.found()?, &self.assembled.problem.sd);
        let range = self.unknowns_at(suspect.home);
        let of = |&row: &Row| {
            let mut function: Function = range.clone().map(|unknown| (unknown, 0.0)).collect();
            if let Some(unknown) = self.unknown_of(row) {
                let (row, _) = terms.row(unknown);
                let free = row.into_iter().filter(|(i, _)| sd[*i] != 0.0 && !found.held.contains(i));
                free.for_each(|(i, value)| function[i - range.start].1 = value);
            }
            function
        };
        Ok(suspect.rows.iter().map(of).collect())
    }

    pub(super) fn unknowns_at(&self, home: Home) -> std::ops::Range<usize> {
        let model = &self.assembled.problem.model;
        match home {
            Home::Point(place) => model.of_point(place),
            Home::Block(block) => model.of_block(block),
            Home::Group { .. } | Home::Tie(_) => 0..0,
        }
    }

    /// Returns the cofactors of the parameters of a point or block.
    pub(super) fn cofactors_at(&self, found: &Leverages, home: Home) -> DMatrix<f64> {
        let (model, retained) = (&self.assembled.problem.model, &found.cofactors.retained);
        let width = self.unknowns_at(home).len();
        let values = match home {
            Home::Point(place) if place < model.locals => &found.cofactors.local[9 * place..9 * place + 9],
            // Points are the last retained blocks.
            Home::Point(place) => {
                let behind = model.points.len() - place;
                &retained[retained.len() - 9 * behind..][..9]
            }
            Home::Block(block) => model.cofactors_of_block(&found.cofactors, block),
            Home::Group { .. } | Home::Tie(_) => &[],
        };
        DMatrix::from_row_slice(width, width, values)
    }
}

/// Returns the misclosure of a row, divided by its standard deviation.
pub(super) fn misclosure((row, _): Row, observation_sd: &[f64], found: &Leverages, terms: &Terms<'_>) -> f64 {
    let row = row as usize;
    match row.checked_sub(observation_sd.len()) {
        None => weighted(found.residuals[row], observation_sd[row]),
        Some(unknown) => terms.row(unknown).1,
    }
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
