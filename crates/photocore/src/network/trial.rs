//! A network tried without some of its observations: tests of what is in and of what is out, adjusted again and again, the symbolic
//! analysis done once.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::covariance::State;
use super::problem::Assembled;
use super::suspects::{Home, Row, Subject, Suspect};
use super::{Network, NetworkError, Options};
use crate::adjustment::{
    self, AdjustError, Few, GroupTest, Loss, Method, Status, Stop, TieCofactors, Tried, Watch, Weighted,
    canonical_correlation,
};
use crate::geometry::{AttitudeNumbers, Matrix3, PoseNumbers};
use crate::normals::{GroupCofactors, LocalCofactors};

/// A network tried without some of its observations.
#[derive(Debug)]
pub struct Trial {
    pub(super) assembled: Assembled,
    options: adjustment::Options,
    pub(super) suspects: Vec<Suspect>,
    /// Where the rows of each suspect start, and its square block; one more at the end.
    pub(super) row_starts: Vec<usize>,
    block_starts: Vec<usize>,
    /// Standard deviations as given: of the equations, of the unknowns.
    observation_sd: Vec<f64>,
    sd: Vec<f64>,
    /// The place in the model of each point that takes part.
    place: Vec<Option<usize>>,
    /// The suspects at each local point, by its place.
    on_place: Vec<Vec<usize>>,
    /// What was held for a datum where the adjustment has ended.
    held: Vec<usize>,
    found: Option<Tried>,
}

/// What is out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Out<'a> {
    /// Of each row of the suspects, one suspect after the other, whether it is out.
    pub rows: &'a [bool],
    /// Points that are out with all their images and components.
    pub points: &'a [usize],
    /// Photos that are out with all their images and components.
    pub photos: &'a [usize],
}

/// How a trial has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    /// How the iterations have.
    pub status: Status,
    /// How many there were.
    pub iterations: usize,
    /// Weighted sum of squares of what takes part.
    pub sum_of_squares: f64,
    /// Observations that take part minus unknowns.
    pub degrees_of_freedom: i64,
    /// Points that have run into a station.
    pub collapsed: Vec<usize>,
}

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

/// What is out against what the rest predicts of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// d^T C^-1 d: chi-square with as many degrees of freedom as there are rows out.
    pub statistic: f64,
    /// Rows that are out.
    pub rows: Vec<usize>,
    /// Observed minus predicted of each, and its standard deviation (a priori unit weight), in the unit of the observation.
    pub error: Vec<f64>,
    /// See [`Prediction::error`].
    pub error_sd: Vec<f64>,
}

/// The observations of one point, that of its coordinates and all its images.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OnPoint {
    /// The suspects, each with its number of rows.
    pub suspects: Vec<usize>,
    /// Residuals of unit weight.
    pub residual: Vec<f64>,
    /// R: their cofactors, square, row by row.
    pub cofactors: Vec<f64>,
}

impl Network {
    /// Prepares for trials of a network: from its initial values on, or from where an adjustment with these options has ended
    /// ([`super::Solution::state`]).
    ///
    /// # Errors
    /// Those of [`Network::adjust`] before its first iteration; a state that is not of this network.
    pub fn trial(
        &self,
        options: &Options,
        state: Option<&State>,
        pool: &ThreadPool,
    ) -> Result<Trial, NetworkError> {
        let assembled = match state {
            Some(state) => {
                let mut assembled = self.assembled_again(options, state, pool)?;
                assembled.problem.initial.clone_from(&state.unknowns);
                assembled
            }
            None => self.assembled_first(options, pool)?,
        };
        let suspects = self.suspects(&assembled);
        let (mut row_starts, mut block_starts) = (vec![0], vec![0]);
        for suspect in &suspects {
            row_starts.push(row_starts[row_starts.len() - 1] + suspect.rows.len());
            block_starts.push(block_starts[block_starts.len() - 1] + suspect.rows.len().pow(2));
        }
        let mut place = vec![None; self.points.len()];
        assembled.points.iter().enumerate().for_each(|(index, &point)| place[point] = Some(index));
        let locals = assembled.problem.model.locals;
        let mut on_place: Vec<Vec<usize>> = vec![vec![]; locals];
        for (index, suspect) in suspects.iter().enumerate() {
            match suspect.home {
                Home::Group { point, .. } => on_place[point].push(index),
                Home::Point(place) if place < locals => on_place[place].push(index),
                _ => {}
            }
        }
        let mut own = options.adjustment;
        if let Method::Full(_) = own.method {
            own.method = Method::default();
        }
        Ok(Trial {
            observation_sd: assembled.problem.observation_sd.clone(),
            sd: assembled.problem.sd.clone(),
            options: own,
            assembled,
            suspects,
            row_starts,
            block_starts,
            place,
            on_place,
            held: state.map_or(vec![], |state| state.held.clone()),
            found: None,
        })
    }
}

impl Trial {
    /// The groups of observations, in the order of all tests.
    pub fn subjects(&self) -> impl Iterator<Item = Subject> {
        self.suspects.iter().map(|suspect| suspect.subject)
    }

    /// Where the rows of each start among all rows; one more at the end.
    pub fn row_starts(&self) -> &[usize] {
        &self.row_starts
    }

    /// The component that each row is.
    pub fn components(&self) -> impl Iterator<Item = usize> {
        self.suspects.iter().flat_map(|suspect| suspect.rows.iter().map(|&(_, component)| component))
    }

    /// Standard deviation of each row, in its unit; of unit weight where the components of an observation are correlated.
    pub fn deviations(&self) -> impl Iterator<Item = f64> {
        self.suspects.iter().flat_map(|suspect| suspect.rows.iter().map(|&row| self.deviation(suspect, row)))
    }

    /// Takes the network as it stands where its adjustment has ended, with everything in it.
    ///
    /// # Errors
    /// Values that leave unknowns undetermined; an interruption, no memory.
    pub fn stand(&mut self, pool: &ThreadPool, watch: Watch<'_>) -> Result<Standing, NetworkError> {
        self.take_out(Out::default());
        let problem = &self.assembled.problem;
        let found = Tried::at(problem, problem.initial.clone(), self.held.clone(), pool, watch);
        self.keep(found)
    }

    /// Adjusts without what is out, from where the last trial has ended.
    ///
    /// * `tolerance`: see [`Stop`]; that of the options where it is None.
    ///
    /// # Errors
    /// Unknowns that are not determined without; an interruption, no memory. The last values stay.
    pub fn adjust(
        &mut self,
        out: Out<'_>,
        tolerance: Option<f64>,
        pool: &ThreadPool,
        watch: Watch<'_>,
    ) -> Result<Standing, NetworkError> {
        self.take_out(out);
        let options = adjustment::Options { method: self.method(tolerance), ..self.options };
        let found = Tried::adjust(&self.assembled.problem, &options, pool, watch);
        self.keep(found)
    }

    /// Adjusts with a robust loss from where the last trial has ended, and stays there: the factors by which it has changed the weights
    /// of each image and observation that takes part, in the order of all tests; 1 for others. None where it diverges: then its weights
    /// say nothing, and the next trial begins where this one has.
    ///
    /// # Errors
    /// Those of [`Trial::adjust`].
    pub fn resist(
        &mut self,
        loss: Loss,
        iterations: usize,
        pool: &ThreadPool,
        watch: Watch<'_>,
    ) -> Result<Option<Vec<f64>>, NetworkError> {
        let options = adjustment::Options {
            loss: Some(loss),
            covariance: false,
            max_iterations: iterations,
            ..self.options
        };
        let problem = &self.assembled.problem;
        let found = adjustment::adjust(problem, &options, pool, watch)
            .map_err(|error| NetworkError::new(error, &self.assembled))?;
        if found.status == Status::Diverged {
            return Ok(None);
        }
        let (groups, all) = (problem.layout().groups(), found.weights.unwrap_or_default());
        let weight = |suspect: &Suspect| match suspect.home {
            Home::Group { group, .. } => all.get(group).copied(),
            Home::Tie(tie) => all.get(groups + tie).copied(),
            Home::Point(_) | Home::Block(_) => None,
        };
        let weights = self.suspects.iter().map(|suspect| weight(suspect).unwrap_or(1.0)).collect();
        self.assembled.problem.initial = found.unknowns;
        Ok(Some(weights))
    }

    /// Where all points of the network are; NaN for those that do not take part.
    pub fn points(&self) -> Vec<[f64; 3]> {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let mut all = vec![[f64::NAN; 3]; self.place.len()];
        for (&point, at) in self.assembled.points.iter().zip(model.coordinates(&problem.initial)) {
            all[point] = std::array::from_fn(|k| at[k] + model.origin[k]);
        }
        all
    }

    /// The values of the unknowns of all photos as they are given: pose, and camera where it is the photo's own.
    pub fn photos(&self) -> Vec<Vec<f64>> {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let positions = if let PoseNumbers::Angles(_) = model.poses { 3 } else { 0 };
        let photo = |photo: usize| {
            let mut values = problem.initial[model.of_block(photo)].to_vec();
            (0..positions).for_each(|k| values[k] += model.origin[k]);
            values
        };
        (0..model.cameras.len()).map(photo).collect()
    }

    fn method(&self, tolerance: Option<f64>) -> Method {
        match (self.options.method, tolerance) {
            (method, None) => method,
            (Method::TrustRegion(Stop::Decrease(_)), Some(limit)) => {
                Method::TrustRegion(Stop::Decrease(limit))
            }
            (_, Some(limit)) => Method::Damped(Stop::Foreseen(limit)),
        }
    }

    fn keep(&mut self, found: Result<Tried, AdjustError>) -> Result<Standing, NetworkError> {
        let found = found.map_err(|error| NetworkError::new(error, &self.assembled))?;
        self.assembled.problem.initial.clone_from(&found.values);
        let points = &self.assembled.points;
        let standing = Standing {
            status: found.status,
            iterations: found.iterations,
            sum_of_squares: found.sum_of_squares,
            degrees_of_freedom: found.degrees_of_freedom(&self.assembled.problem),
            collapsed: found.collapsed.iter().map(|&local| points[local]).collect(),
        };
        self.found = Some(found);
        Ok(standing)
    }

    /// Weights of zero for what is out; points and photos that are out stay where they are.
    fn take_out(&mut self, out: Out<'_>) {
        let Assembled { problem, .. } = &mut self.assembled;
        problem.observation_sd.clone_from(&self.observation_sd);
        problem.sd.clone_from(&self.sd);
        let rows = self.suspects.iter().flat_map(|suspect| suspect.rows.iter());
        for (&(row, _), _) in rows.zip(out.rows).filter(|(_, out)| **out) {
            match row {
                Row::Equation(equation) => problem.observation_sd[equation] = f64::INFINITY,
                Row::Unknown(unknown) => problem.sd[unknown] = f64::INFINITY,
            }
        }
        for place in out.points.iter().filter_map(|&point| self.place[point]) {
            let model = &problem.model;
            problem.sd[model.of_point(place)].fill(0.0);
            let images = 2 * model.start[place]..2 * model.start[place + 1];
            problem.observation_sd[images].fill(f64::INFINITY);
        }
        for &photo in out.photos {
            let model = &problem.model;
            problem.sd[model.of_block(photo)].fill(0.0);
            for image in (0..model.images.len()).filter(|&image| model.images[image].photo == photo) {
                problem.observation_sd[2 * image..2 * image + 2].fill(f64::INFINITY);
            }
        }
    }

    pub(super) fn found(&self) -> Result<&Tried, NetworkError> {
        self.found.as_ref().ok_or(NetworkError::State)
    }

    fn weighted(&self, sd: &[f64], values: &[f64]) -> Vec<Weighted> {
        let problem = &self.assembled.problem;
        adjustment::Model::weighted(&problem.model, values, &problem.prior, sd)
    }

    /// Whether a row takes part.
    fn is_in(&self, row: Row) -> bool {
        match row {
            Row::Equation(equation) => self.assembled.problem.observation_sd[equation].is_finite(),
            Row::Unknown(unknown) => self.assembled.problem.is_weighted(unknown),
        }
    }

    fn deviation(&self, suspect: &Suspect, (row, component): (Row, usize)) -> f64 {
        let model = &self.assembled.problem.model;
        match (row, suspect.subject, suspect.home) {
            (_, Subject::Observation(_), Home::Tie(tie)) => {
                model.observations[tie - model.tied_images()].root.row(component).norm()
            }
            (Row::Equation(equation), ..) => self.observation_sd[equation],
            (Row::Unknown(unknown), ..) => self.sd[unknown],
        }
    }

    /// What leads from errors of unit weight of some rows of a suspect to their units.
    fn units(&self, suspect: &Suspect, rows: &[(Row, usize)]) -> DMatrix<f64> {
        let model = &self.assembled.problem.model;
        if let (Subject::Observation(_), Home::Tie(tie)) = (suspect.subject, suspect.home) {
            let root = &model.observations[tie - model.tied_images()].root;
            let components: Vec<usize> = rows.iter().map(|&(_, component)| component).collect();
            return root.select_rows(&components).select_columns(&components);
        }
        let sd = rows.iter().map(|&row| self.deviation(suspect, row));
        DMatrix::from_diagonal(&DVector::from_iterator(rows.len(), sd))
    }
}

/// Cofactors about some suspects: of the observations of local points, of ties.
struct Around {
    points: HashMap<usize, LocalCofactors>,
    ties: HashMap<usize, TieCofactors>,
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
    fn prior_rows(
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

    fn unknowns_at(&self, home: Home) -> std::ops::Range<usize> {
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

impl Trial {
    /// Tests what is out of some suspects against what the rest predicts (Cook and Weisberg 1982): with d observed minus predicted and
    /// C = S + a Q a^T its cofactors, d^T C^-1 d. None where nothing is out, or its unknowns are.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn predictions(
        &self,
        suspects: &[usize],
        pool: &ThreadPool,
    ) -> Result<Vec<Option<Prediction>>, NetworkError> {
        let found = self.found()?;
        let problem = &self.assembled.problem;
        let around = self.around(suspects, &self.observation_sd, found, pool);
        let weighted = self.weighted(&self.sd, &found.values);
        let predict = |&index: &usize| {
            let suspect = &self.suspects[index];
            let out: Vec<usize> =
                (0..suspect.rows.len()).filter(|&k| !self.is_in(suspect.rows[k].0)).collect();
            if out.is_empty() || self.is_gone(suspect) {
                return None;
            }
            let shares = match suspect.home {
                Home::Group { group, point } => {
                    let own = around.points.get(&point)?;
                    let first = 2 * (group - problem.layout().groups_of(point).start);
                    let rows: Vec<usize> = out.iter().map(|&k| first + k).collect();
                    sub(&own.equations, own.rows(), &rows)
                }
                Home::Tie(tie) => sub(&around.ties.get(&tie)?.equations, suspect.rows.len(), &out),
                Home::Point(_) | Home::Block(_) => {
                    let rows = self.prior_rows(suspect, &out, &self.sd, &found.values, &weighted);
                    let shares = &rows * self.cofactors_at(found, suspect.home) * rows.transpose();
                    shares.transpose().as_slice().to_vec()
                }
            };
            self.prediction(suspect, &out, &shares, found, &weighted)
        };
        Ok(suspects.iter().map(predict).collect())
    }

    /// Cofactors of all that some suspects touch.
    fn around(&self, suspects: &[usize], observation_sd: &[f64], found: &Tried, pool: &ThreadPool) -> Around {
        let problem = &self.assembled.problem;
        let (mut places, mut ties) = (vec![], vec![]);
        for &index in suspects {
            match self.suspects[index].home {
                Home::Group { point, .. } => places.push(point),
                Home::Tie(tie) => ties.push(tie),
                Home::Point(_) | Home::Block(_) => {}
            }
        }
        places.sort_unstable();
        places.dedup();
        let of_points = found.of_locals(problem, observation_sd, &places, |_| vec![], pool);
        let of_ties = found.of_ties(problem, observation_sd, &ties, pool);
        Around {
            points: places.into_iter().zip(of_points).collect(),
            ties: ties.into_iter().zip(of_ties).collect(),
        }
    }

    fn prediction(
        &self,
        suspect: &Suspect,
        out: &[usize],
        shares: &[f64],
        found: &Tried,
        weighted: &[Weighted],
    ) -> Option<Prediction> {
        let count = out.len();
        let c = DMatrix::identity(count, count) + DMatrix::from_row_slice(count, count, shares);
        let residual = |&k: &usize| match suspect.rows[k].0 {
            Row::Equation(equation) => found.residuals[equation] / self.observation_sd[equation],
            Row::Unknown(unknown) => {
                self.assembled.problem.prior_row(&self.sd, &found.values, weighted, unknown).1
            }
        };
        let d = DVector::from_iterator(count, out.iter().map(residual));
        let statistic = d.dot(&c.clone().cholesky()?.solve(&d));
        let rows: Vec<(Row, usize)> = out.iter().map(|&k| suspect.rows[k]).collect();
        let units = self.units(suspect, &rows);
        let (error, error_sd) = in_units(&units, d.as_slice(), c.as_slice());
        Some(Prediction { statistic, rows: out.to_vec(), error, error_sd })
    }

    /// Whether the unknowns of a suspect are out with it: held where they were not given so.
    fn is_gone(&self, suspect: &Suspect) -> bool {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let gone = |unknowns: std::ops::Range<usize>| {
            unknowns.into_iter().any(|unknown| problem.sd[unknown] == 0.0 && self.sd[unknown] != 0.0)
        };
        match (suspect.home, suspect.subject) {
            (Home::Group { group, point }, _) => {
                gone(model.of_point(point)) || gone(model.of_block(model.carrier(model.images[group].photo)))
            }
            (Home::Tie(tie), _) => {
                problem.layout().tie_columns(tie).any(|unknown| gone(unknown..unknown + 1))
            }
            (home, _) => gone(self.unknowns_at(home)),
        }
    }

    /// R of all observations of some points together; empty for points that observations beside images touch.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn on_points(&self, points: &[usize], pool: &ThreadPool) -> Result<Vec<OnPoint>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let (observation_sd, sd) = (&problem.observation_sd[..], &problem.sd[..]);
        let weighted = self.weighted(sd, &found.values);
        let further = |place: usize| self.further(place, sd, &found.values, &weighted);
        let places: Vec<usize> = points.iter().filter_map(|&point| self.local(point)).collect();
        let cofactors = found.of_locals(problem, observation_sd, &places, further, pool);
        let mut found_at = places.iter().zip(cofactors);
        let of = |&point: &usize| {
            let known = self.local(point).and_then(|_| found_at.next());
            known.map_or_else(OnPoint::default, |(&place, own)| {
                let (rows, residual) = self.rows_at(place, (observation_sd, sd), found, &weighted);
                let (count, shares) = (rows.len(), sub(&own.equations, own.rows(), &rows));
                let identity = |k: usize| f64::from(u8::from(k / count == k % count));
                let cofactors = shares.iter().enumerate().map(|(k, share)| identity(k) - share).collect();
                OnPoint { suspects: self.on_place[place].clone(), residual, cofactors }
            })
        };
        Ok(points.iter().map(of).collect())
    }

    /// The same of points that are out with all that was observed of them, as if they took part: each by itself against the photos as
    /// the others determine them. Empty also for points that their rays do not determine.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn on_gone_points(&self, points: &[usize], pool: &ThreadPool) -> Result<Vec<OnPoint>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let given = (&self.observation_sd[..], &self.sd[..]);
        let weighted = self.weighted(&self.sd, &found.values);
        let further = |place: usize| self.further(place, &self.sd, &found.values, &weighted);
        let places: Vec<usize> = points.iter().filter_map(|&point| self.local(point)).collect();
        let cofactors = found.of_gone(problem, given, &places, further, pool);
        let mut found_at = places.iter().zip(cofactors);
        let of = |&point: &usize| {
            let known = self.local(point).and_then(|_| found_at.next()).filter(|(_, own)| !own.is_empty());
            known.map_or_else(OnPoint::default, |(&place, own)| {
                let (rows, observed) = self.rows_at(place, given, found, &weighted);
                let cofactors = sub(&own, own.len().isqrt(), &rows);
                let residual = cofactors.chunks_exact(rows.len()).map(|row| dot(row, &observed)).collect();
                OnPoint { suspects: self.on_place[place].clone(), residual, cofactors }
            })
        };
        Ok(points.iter().map(of).collect())
    }

    /// The place of a point in the model, where no observation beside images touches it.
    fn local(&self, point: usize) -> Option<usize> {
        self.place.get(point).copied().flatten().filter(|&place| place < self.assembled.problem.model.locals)
    }

    /// The equations of the coordinates of a local point that are observations themselves.
    fn further(&self, place: usize, sd: &[f64], values: &[f64], weighted: &[Weighted]) -> Vec<f64> {
        let mut own = self.on_place[place].iter().map(|&index| &self.suspects[index]);
        let Some(suspect) = own.find(|suspect| matches!(suspect.home, Home::Point(_))) else { return vec![] };
        let all: Vec<usize> = (0..suspect.rows.len()).collect();
        self.prior_rows(suspect, &all, sd, values, weighted).transpose().as_slice().to_vec()
    }

    /// The place of each row of the suspects at a local point among its equations, and how much each is off, of unit weight.
    fn rows_at(
        &self,
        place: usize,
        (observation_sd, sd): (&[f64], &[f64]),
        found: &Tried,
        weighted: &[Weighted],
    ) -> (Vec<usize>, Vec<f64>) {
        let problem = &self.assembled.problem;
        let groups = problem.layout().groups_of(place);
        let (mut rows, mut off) = (vec![], vec![]);
        for &index in &self.on_place[place] {
            let suspect = &self.suspects[index];
            let first = match suspect.home {
                Home::Group { group, .. } => 2 * (group - groups.start),
                _ => 2 * groups.len(),
            };
            for (k, &(row, _)) in suspect.rows.iter().enumerate() {
                rows.push(first + k);
                off.push(match row {
                    Row::Equation(equation) => found.residuals[equation] / observation_sd[equation],
                    Row::Unknown(unknown) => problem.prior_row(sd, &found.values, weighted, unknown).1,
                });
            }
        }
        (rows, off)
    }

    /// How an error of one standard deviation in each row of some suspects moves its own point and its own photo: for each row the three
    /// coordinates, then the six numbers of the pose; NaN where it has none.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn effects(&self, suspects: &[usize], pool: &ThreadPool) -> Result<Vec<[f64; 9]>, NetworkError> {
        let found = self.found()?;
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let around = self.around(suspects, &problem.observation_sd, found, pool);
        let weighted = self.weighted(&problem.sd, &found.values);
        let mut all = Vec::new();
        for &index in suspects {
            let suspect = &self.suspects[index];
            let rows = suspect.rows.len();
            match suspect.home {
                Home::Group { group, point } => {
                    let Some(own) = around.points.get(&point) else { continue };
                    let first = 2 * (group - problem.layout().groups_of(point).start);
                    let photo = model.carrier(model.images[group].photo);
                    let other = own.others.iter().find(|other| other.0 == photo);
                    for row in first..first + rows {
                        let mut effect = [f64::NAN; 9];
                        effect[..3].copy_from_slice(&own.local[3 * row..3 * row + 3]);
                        if let Some((_, values)) = other {
                            let width = values.len() / own.rows();
                            effect[3..].copy_from_slice(&values[row * width..][..6]);
                        }
                        all.push(effect);
                    }
                }
                Home::Tie(tie) => {
                    let Some(own) = around.ties.get(&tie) else { continue };
                    let stations = model.stations();
                    let point = own.blocks.iter().find(|block| block.0 >= stations);
                    let photo = own.blocks.iter().find(|block| block.0 < model.cameras.len());
                    for row in 0..rows {
                        let mut effect = [f64::NAN; 9];
                        for (block, to, count) in [(point, 0, 3), (photo, 3, 6)] {
                            let Some((_, values)) = block else { continue };
                            let width = values.len() / rows;
                            effect[to..to + count].copy_from_slice(&values[row * width..][..count]);
                        }
                        all.push(effect);
                    }
                }
                home => {
                    let some: Vec<usize> = (0..rows).collect();
                    let a = self.prior_rows(suspect, &some, &problem.sd, &found.values, &weighted);
                    let along = a * self.cofactors_at(found, home);
                    for row in 0..rows {
                        let mut effect = [f64::NAN; 9];
                        match home {
                            Home::Point(_) => (0..3).for_each(|k| effect[k] = along[(row, k)]),
                            Home::Block(block) if block < model.cameras.len() => {
                                (0..6).for_each(|k| effect[3 + k] = along[(row, k)]);
                            }
                            _ => {}
                        }
                        all.push(effect);
                    }
                }
            }
        }
        self.to_angles(suspects, &found.values, &mut all);
        Ok(all)
    }

    /// Turns steps by a rotation vector into those of the angles of a photo.
    fn to_angles(&self, suspects: &[usize], values: &[f64], effects: &mut [[f64; 9]]) {
        let model = &self.assembled.problem.model;
        let mut rest = effects;
        for &index in suspects {
            let suspect = &self.suspects[index];
            let (own, others) = rest.split_at_mut(suspect.rows.len());
            rest = others;
            let photo = match suspect.home {
                Home::Group { group, .. } => Some(model.carrier(model.images[group].photo)),
                Home::Block(block) if block < model.cameras.len() => Some(block),
                _ => None,
            };
            let turning = photo.and_then(|photo| Some((photo, model.turning_sense(photo)?)));
            let Some((photo, sense)) = turning else { continue };
            let first = model.of_block(photo).start + 3;
            let angles = [values[first], values[first + 1], values[first + 2]];
            let rates = AttitudeNumbers::OmegaPhiKappa(sense).rates(angles);
            let inverse = rates.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
            for effect in own {
                let turned = inverse * nalgebra::Vector3::new(effect[6], effect[7], effect[8]);
                effect[6..].copy_from_slice(turned.as_slice());
            }
        }
    }

    /// Pairs of observations of one point whose tests are correlated by more than `limit`, with their correlation: errors of them cannot
    /// be told apart.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn inseparable(
        &self,
        points: &[usize],
        limit: f64,
        pool: &ThreadPool,
    ) -> Result<Vec<(usize, usize, f64)>, NetworkError> {
        let on_points = self.on_points(points, pool)?;
        let pairs = |own: &OnPoint| -> Vec<(usize, usize, f64)> { self.pairs_on(own, limit) };
        Ok(pool.install(|| on_points.par_iter().flat_map_iter(pairs).collect()))
    }

    fn pairs_on(&self, own: &OnPoint, limit: f64) -> Vec<(usize, usize, f64)> {
        let count = own.residual.len();
        let mut starts = vec![0];
        own.suspects.iter().for_each(|&index| {
            starts.push(starts[starts.len() - 1] + self.suspects[index].rows.len());
        });
        let block = |i: usize, j: usize| -> Vec<f64> {
            let rows = starts[i]..starts[i + 1];
            rows.flat_map(|row| own.cofactors[row * count..][starts[j]..starts[j + 1]].to_vec()).collect()
        };
        let mut found = vec![];
        for j in 0..own.suspects.len() {
            for i in 0..j {
                let out = |k: usize| !self.suspects[own.suspects[k]].rows.iter().any(|row| self.is_in(row.0));
                if out(i) || out(j) {
                    continue;
                }
                let rho = canonical_correlation(&block(i, i), &block(j, j), &block(i, j));
                if rho > limit {
                    found.push((own.suspects[i], own.suspects[j], rho));
                }
            }
        }
        found
    }
}

/// The product of two vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Some rows and columns of a square matrix of so many rows, row by row.
fn sub(matrix: &[f64], size: usize, some: &[usize]) -> Vec<f64> {
    some.iter().flat_map(|&i| some.iter().map(move |&j| matrix[i * size + j])).collect()
}

/// Errors of unit weight with their cofactors in other units: values and standard deviations.
fn in_units(units: &DMatrix<f64>, error: &[f64], cofactors: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let count = error.len();
    let values = units * DVector::from_column_slice(error);
    let spread = units * DMatrix::from_column_slice(count, count, cofactors) * units.transpose();
    (values.as_slice().to_vec(), spread.diagonal().map(f64::sqrt).as_slice().to_vec())
}
