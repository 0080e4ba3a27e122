//! Effects of single observations: columns of R, effects on chosen parameters and own points and photos, the parameter that an error changes
//! most, and inseparable observations. Those on other parameters require a solution of the normal equations.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};

use super::covariance::{Covariances, Of};
use super::error::NetworkError;
use super::model::Owner;
use super::predictions::{AT_LEAST, OnPoint};
use super::suspects::{Home, Suspects};
use super::trial::Trial;
use crate::adjustment::{
    AdjustError, Linearized, ObservationRows, correlation_above, leverage_odds, may_correlate, whitening,
};
use crate::geometry::{AttitudeNumbers, Matrix3};
use crate::{Threads, parallel};

/// Number of right-hand sides per batch.
const TOGETHER: usize = 16;

/// Parameter that an error changes most, in its standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// Owner of the parameter.
    pub of: Of,
    /// Number of the parameter there.
    pub component: usize,
    /// Change by an error of one standard deviation, in the unit of the parameter.
    pub effect: f64,
    /// Change in standard deviations of the parameter (a priori unit weight).
    pub in_sd: f64,
}

impl Covariances {
    /// Returns the test groups of the network, in the order of all tests.
    pub fn suspects(&self) -> &Arc<Suspects> {
        let new = || Suspects::new(&self.assembled, self.images, &|photo| self.camera_of_photo[photo]);
        self.suspects.get_or_init(|| Arc::new(new()))
    }

    /// Returns the effects of errors of one standard deviation in every row of [`Covariances::suspects`] on functions of the parameters:
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
        let (width, suspects) = (solutions.len(), self.suspects());
        let rows = || suspects.rows_of(0..suspects.len());
        Ok((0..width)
            .flat_map(|k| rows().map(move |row| (row, k)))
            .map(|(row, k)| products[row * width + k])
            .collect())
    }
}

impl Trial {
    /// Returns the columns of R for the rows of some groups: the cofactors of their residuals with the residuals of all rows of all groups,
    /// column by column.
    ///
    /// # Errors
    /// Responses before any adjustment; an interruption, insufficient memory.
    pub fn responses(&self, suspects: &[usize], threads: &Threads) -> Result<Vec<f64>, NetworkError> {
        let all = self.rows_of(0..self.suspects.len());
        let starts = self.suspects.row_starts();
        let asked: Vec<usize> = suspects.iter().flat_map(|&index| starts[index]..starts[index + 1]).collect();
        let mut columns = Vec::with_capacity(all.len() * asked.len());
        let rows: Vec<usize> = asked.iter().map(|&row| all[row]).collect();
        self.solutions(&rows, threads, |index, solution, equations| {
            let first = columns.len();
            columns.extend(equations.times(&all, solution, threads).into_iter().map(|share| -share));
            columns[first + asked[index]] += 1.0;
        })?;
        Ok(columns)
    }

    /// Returns, for each row of some groups, the parameter that an error in this row changes most.
    ///
    /// # Errors
    /// Errors of [`Trial::responses`].
    pub fn most_moved(&self, suspects: &[usize], threads: &Threads) -> Result<Vec<Moved>, NetworkError> {
        let rows: Vec<usize> = suspects.iter().flat_map(|&index| self.rows_of(index..index + 1)).collect();
        let turns = self.turns()?;
        let sd = self.unknown_sd(&turns)?;
        let mut found = Vec::with_capacity(rows.len());
        self.solutions(&rows, threads, |_, solution, _| {
            let mut moved = solution.to_vec();
            turns.iter().for_each(|(first, turn)| turned(&mut moved[*first..first + 3], turn));
            let ratio = |unknown: usize| {
                if sd[unknown] > 0.0 { (moved[unknown] / sd[unknown]).abs() } else { 0.0 }
            };
            let most =
                (0..moved.len()).fold(0, |most, next| if ratio(next) > ratio(most) { next } else { most });
            let (of, component) = self.unknown(most);
            found.push(Moved { of, component, effect: moved[most], in_sd: ratio(most) });
        })?;
        Ok(found)
    }

    /// Calls `take` with Q a^T of each of some rows a, and with all rows.
    fn solutions(
        &self,
        of: &[usize],
        threads: &Threads,
        mut take: impl FnMut(usize, &[f64], &ObservationRows),
    ) -> Result<(), NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let go_on = &mut |_| ControlFlow::Continue(());
        let failed = |error: AdjustError| NetworkError::new(error, &self.assembled);
        let (values, held) = (found.values.clone(), found.held.clone());
        let linearized = Linearized::form(problem, None, values, held, threads, go_on).map_err(failed)?;
        let equations = ObservationRows::new(problem, &found.values, &found.held, threads);
        let unknowns = problem.layout().unknowns();
        for (batch, some) in of.chunks(TOGETHER).enumerate() {
            let rights: Vec<f64> = some.iter().flat_map(|&row| equations.right(row, unknowns)).collect();
            let solutions = linearized.solve_for(problem, &rights, threads, go_on).map_err(failed)?;
            for (i, solution) in solutions.chunks_exact(unknowns).enumerate() {
                take(batch * TOGETHER + i, solution, &equations);
            }
        }
        Ok(())
    }

    /// Returns the rows of some groups among the rows of [`ObservationRows`].
    fn rows_of(&self, suspects: Range<usize>) -> Vec<usize> {
        self.suspects.rows_of(suspects).collect()
    }

    /// Returns, for each photo that steps by a rotation vector, the index of its angles and the matrix from steps to angles.
    fn turns(&self) -> Result<Vec<(usize, Matrix3)>, NetworkError> {
        let (values, model) = (&self.found()?.values, &self.assembled.problem.model);
        let turn = |photo| Some((model.of_block(photo).start + 3, self.to_angles(photo, values)?));
        Ok((0..model.cameras.len()).filter_map(turn).collect())
    }

    /// Returns the standard deviations of all parameters (a priori unit weight), with angles for photos that step by a rotation vector.
    fn unknown_sd(&self, turns: &[(usize, Matrix3)]) -> Result<Vec<f64>, NetworkError> {
        let (found, model) = (self.found()?, &self.assembled.problem.model);
        let mut sd = vec![0.0; found.values.len()];
        let mut put = |first: usize, q: &DMatrix<f64>| {
            q.diagonal().iter().enumerate().for_each(|(k, value)| sd[first + k] = value.max(0.0).sqrt());
        };
        for point in 0..model.points.len() {
            put(model.of_point(point).start, &self.cofactors_at(found, Home::Point(point)));
        }
        for block in 0..model.stations() {
            let first = model.of_block(block).start;
            let mut q = self.cofactors_at(found, Home::Block(block));
            if let Some((_, turn)) = turns.iter().find(|own| own.0 == first + 3) {
                let own = turn * q.fixed_view::<3, 3>(3, 3) * turn.transpose();
                q.fixed_view_mut::<3, 3>(3, 3).copy_from(&own);
            }
            put(first, &q);
        }
        Ok(sd)
    }

    /// Returns the owner of a parameter, and its number there.
    fn unknown(&self, unknown: usize) -> (Of, usize) {
        let (model, points) = (&self.assembled.problem.model, &self.assembled.points);
        let stations = model.of_stations();
        if let Some((owner, number)) = model.owner(unknown) {
            let of = match owner {
                Owner::Photo(photo) => Of::Photo(photo),
                Owner::Camera(camera) => Of::Camera(camera),
                Owner::Common(common) => Of::Common(common),
            };
            return (of, number);
        }
        let among = if unknown < stations.start { unknown } else { unknown - stations.len() };
        (Of::Point(points[among / 3]), among % 3)
    }
}

fn turned(step: &mut [f64], turn: &Matrix3) {
    let angles = turn * Vector3::from_column_slice(step);
    step.copy_from_slice(angles.as_slice());
}

impl Trial {
    /// Returns the effects of errors of one standard deviation in each row of some groups on their own point and photo. Each row has three
    /// coordinates and six pose parameters; NaN without point or photo.
    ///
    /// # Errors
    /// Effects before any adjustment.
    pub fn effects(&self, suspects: &[usize], threads: &Threads) -> Result<Vec<[f64; 9]>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let model = &problem.model;
        let terms = self.terms(&problem.sd, &found.values);
        let near = self.near(suspects, &problem.observation_sd, &terms, threads)?;
        let is_point = |block: Option<usize>| block.is_none_or(|block| block >= model.stations());
        let is_photo = |block: Option<usize>| block.is_some_and(|block| block < model.cameras.len());
        let mut all = Vec::new();
        for (&index, own) in suspects.iter().zip(&near) {
            let suspect = self.suspects.get(index);
            let rows = suspect.rows.len();
            let carrier = match suspect.home {
                Home::Group { group, .. } => Some(model.carrier(model.images[group].photo)),
                _ => None,
            };
            let of = |is: &dyn Fn(Option<usize>) -> bool| own.blocks.iter().find(|(block, _)| is(*block));
            let photo = of(&|block| is_photo(block) && carrier.is_none_or(|carrier| block == Some(carrier)));
            let to_angles = photo.and_then(|(block, _)| self.to_angles((*block)?, &found.values));
            for row in 0..rows {
                let mut effect = [f64::NAN; 9];
                for (block, to, count) in [(of(&is_point), 0, 3), (photo, 3, 6)] {
                    let Some((_, values)) = block else { continue };
                    let width = values.len() / rows;
                    effect[to..to + count].copy_from_slice(&values[row * width..][..count]);
                }
                to_angles.iter().for_each(|to_angles| turned(&mut effect[6..], to_angles));
                all.push(effect);
            }
        }
        Ok(all)
    }

    /// Returns the matrix from rotation vector steps of a photo to changes of its angles; None if it has other steps.
    fn to_angles(&self, photo: usize, values: &[f64]) -> Option<Matrix3> {
        let model = &self.assembled.problem.model;
        let numbers = AttitudeNumbers::OmegaPhiKappa(model.turning_sense(photo)?);
        let first = model.of_block(photo).start + 3;
        let angles = [values[first], values[first + 1], values[first + 2]];
        Some(numbers.by_step(angles).unwrap_or_else(|| Matrix3::repeat(f64::NAN)))
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
        let on_points = self.on_points_above(points, limit, threads)?;
        let pairs = |points: Range<usize>| -> Vec<(usize, usize, f64)> {
            on_points[points].iter().flat_map(|own| self.pairs_on(own, limit)).collect()
        };
        Ok(threads.install(|| parallel::by_parts(on_points.len(), AT_LEAST, &pairs)))
    }

    fn pairs_on(&self, own: &OnPoint, limit: f64) -> Vec<(usize, usize, f64)> {
        let count = own.residual.len();
        let starts = self.suspects.starts_among(&own.suspects);
        let block = |i: usize, j: usize| -> Vec<f64> {
            let rows = starts[i]..starts[i + 1];
            rows.flat_map(|row| own.cofactors[row * count..][starts[j]..starts[j + 1]].to_vec()).collect()
        };
        let mut found = vec![];
        let is_in = |&k: &usize| self.suspects.get(own.suspects[k]).rows.iter().any(|&row| self.is_in(row));
        let taking_part: Vec<usize> = (0..own.suspects.len()).filter(is_in).collect();
        let alone: Vec<Vec<f64>> = (0..own.suspects.len()).map(|k| block(k, k)).collect();
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
                    found.push((own.suspects[i], own.suspects[j], rho));
                }
            }
        }
        found
    }
}

/// Returns the elements of I - R for cofactors R of some residuals.
fn from_identity(cofactors: &[f64]) -> impl Iterator<Item = f64> {
    let next = cofactors.len().isqrt() + 1;
    cofactors.iter().enumerate().map(move |(k, value)| f64::from(u8::from(k % next == 0)) - value)
}
