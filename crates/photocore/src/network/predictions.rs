//! Comparison of excluded observations with their prediction by the others, and residual cofactors of points.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::group_tests::{in_units, misclosure, sub};
use super::suspects::{Home, Row, Suspect};
use super::trial::Trial;
use crate::adjustment::{Leverages, Terms};
use crate::normals::{Function, RowCofactors, dot};
use crate::{Threads, parallel};

/// Minimum number of points per thread.
pub(super) const AT_LEAST: usize = 16;

/// Excluded rows of an observation compared with their prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// d^T C^-1 d: chi-square distributed, with one degree of freedom per excluded row.
    pub statistic: f64,
    /// Excluded rows.
    pub rows: Vec<usize>,
    /// Observed minus predicted values and their standard deviations (a priori unit weight), in the unit of the observation.
    pub error: Vec<f64>,
    /// See [`Prediction::error`].
    pub error_sd: Vec<f64>,
}

/// Observations of one point: its coordinates and all its images.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OnPoint {
    /// Test groups, with their rows in this order.
    pub suspects: Vec<usize>,
    /// Whitened residuals.
    pub residual: Vec<f64>,
    /// Cofactors R of the residuals, square, row by row.
    pub cofactors: Vec<f64>,
}

impl Trial {
    /// Tests excluded rows against their prediction by the others (Cook and Weisberg 1982): d^T C^-1 d, with d observed minus predicted and
    /// its cofactors C = S + a Q a^T. None without excluded rows, or if the parameters of the group are excluded.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn predictions(
        &self,
        suspects: &[usize],
        threads: &Threads,
    ) -> Result<Vec<Option<Prediction>>, NetworkError> {
        let found = self.found()?;
        let terms = self.terms(&self.sd, &found.values);
        let near = self.near(suspects, &self.observation_sd, &terms, threads)?;
        let predict = |(&index, near): (&usize, &RowCofactors)| {
            let suspect = self.suspects.get(index);
            let size = suspect.rows.len();
            let out: Vec<usize> = (0..size).filter(|&k| !self.is_in(suspect.rows[k])).collect();
            if out.is_empty() || self.is_gone(&suspect) {
                return None;
            }
            let count = out.len();
            let leverages = DMatrix::from_row_slice(count, count, &sub(&near.equations, size, &out));
            let c = DMatrix::identity(count, count) + leverages;
            let rows: Vec<Row> = out.iter().map(|&k| suspect.rows[k]).collect();
            let misclosures = rows.iter().map(|&row| misclosure(row, &self.observation_sd, found, &terms));
            let d = DVector::from_iterator(count, misclosures);
            let statistic = d.dot(&c.clone().cholesky()?.solve(&d));
            let (error, error_sd) = in_units(&self.units(&suspect, &rows), d.as_slice(), c.as_slice());
            Some(Prediction { statistic, rows: out, error, error_sd })
        };
        Ok(suspects.iter().zip(&near).map(predict).collect())
    }

    /// Returns the cofactors of the equations of some groups, for given standard deviations.
    pub(super) fn near(
        &self,
        suspects: &[usize],
        observation_sd: &[f64],
        terms: &Terms<'_>,
        threads: &Threads,
    ) -> Result<Vec<RowCofactors>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let layout = problem.layout();
        let failed = |error| NetworkError::new(error, &self.assembled);
        let (mut places, mut ties) = (vec![], vec![]);
        for &index in suspects {
            match self.suspects.get(index).home {
                Home::Group { point, .. } => places.push(point),
                Home::Tie(tie) => ties.push(tie),
                Home::Point(_) | Home::Block(_) => {}
            }
        }
        places.sort_unstable();
        places.dedup();
        let of_points =
            found.of_locals(problem, (observation_sd, None), &places, (|_| vec![], None), threads);
        let of_points: HashMap<usize, RowCofactors> =
            places.into_iter().zip(of_points.map_err(failed)?).collect();
        let mut of_ties = found.rows_of_ties(problem, observation_sd, &ties, threads).into_iter();
        let mut of = |&index: &usize| {
            let suspect = self.suspects.get(index);
            let size = suspect.rows.len();
            let rows = match suspect.home {
                Home::Group { group, point } => {
                    let first = size * (group - layout.groups_of(point).start);
                    return Ok(of_points[&point].selected(first..first + size));
                }
                Home::Tie(_) => of_ties.next().unwrap_or_default(),
                Home::Point(_) | Home::Block(_) => self.term_rows(&suspect, terms)?,
            };
            found.of_rows(layout, &rows).map_err(|error| failed(error.into()))
        };
        suspects.iter().map(&mut of).collect()
    }

    /// Returns true if the parameters of a group are excluded with it: fixed now, but not in the input.
    fn is_gone(&self, suspect: &Suspect<'_>) -> bool {
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

    /// Returns R of all observations of some points; empty for points with additional observations.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn on_points(&self, points: &[usize], threads: &Threads) -> Result<Vec<OnPoint>, NetworkError> {
        self.on_points_above(points, 0.0, threads)
    }

    /// Returns R if only correlations above a limit are required: elements of weaker pairs may be NaN.
    pub(super) fn on_points_above(
        &self,
        points: &[usize],
        limit: f64,
        threads: &Threads,
    ) -> Result<Vec<OnPoint>, NetworkError> {
        let problem = &self.assembled.problem;
        self.on_points_with((&problem.observation_sd, &problem.sd), points, (limit, false), threads)
    }

    /// Returns R of excluded points, as if they were active: each one alone, given photos determined by the others. It is empty also for
    /// points that their rays do not determine.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn on_gone_points(&self, points: &[usize], threads: &Threads) -> Result<Vec<OnPoint>, NetworkError> {
        self.on_points_with((&self.observation_sd, &self.sd), points, (0.0, true), threads)
    }

    fn on_points_with(
        &self,
        (observation_sd, sd): (&[f64], &[f64]),
        points: &[usize],
        (limit, gone): (f64, bool),
        threads: &Threads,
    ) -> Result<Vec<OnPoint>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let terms = self.terms(sd, &found.values);
        let further = |place: usize| self.further(place, &terms);
        let places: Vec<Option<usize>> = points.iter().map(|&point| self.local(point)).collect();
        let locals: Vec<usize> = places.iter().flatten().copied().collect();
        let asked = (observation_sd, gone.then_some(sd));
        let cofactors = found.of_locals(problem, asked, &locals, (further, Some(limit)), threads);
        let mut cofactors = cofactors.map_err(|error| NetworkError::new(error, &self.assembled))?.into_iter();
        let all: Vec<Option<(usize, RowCofactors)>> =
            places.into_iter().map(|place| Some((place?, cofactors.next()?))).collect();
        let of = |k: usize| -> Option<OnPoint> {
            let (place, own) = all[k].as_ref()?;
            let (rows, observed) = self.rows_at(*place, observation_sd, found, &terms);
            let count = rows.len();
            let (residual, cofactors) = if gone {
                let own = Some(own.residuals_if_included()).filter(|own| !own.is_empty())?;
                let cofactors = sub(&own, own.len().isqrt(), &rows);
                (cofactors.chunks_exact(count).map(|row| dot(row, &observed)).collect(), cofactors)
            } else {
                let leverages = sub(&own.equations, own.rows(), &rows);
                let identity = |k: usize| f64::from(u8::from(k / count == k % count));
                let left = leverages.iter().enumerate().map(|(k, leverage)| identity(k) - leverage);
                (observed, left.collect())
            };
            Some(OnPoint { suspects: self.on_place(*place).to_vec(), residual, cofactors })
        };
        Ok(threads.install(|| parallel::map(all.len(), AT_LEAST, |k| of(k).unwrap_or_default())))
    }

    /// Returns the test groups of a local point.
    fn on_place(&self, place: usize) -> &[usize] {
        self.suspects.on_point(self.assembled.points[place])
    }

    /// Returns the index of a point in the model, unless it has additional observations.
    fn local(&self, point: usize) -> Option<usize> {
        self.place.get(point).copied().flatten().filter(|&place| self.is_tested_whole(place))
    }

    /// Whether all observations of a point are its images and its coordinates, which are tested together.
    pub(super) fn is_tested_whole(&self, place: usize) -> bool {
        let problem = &self.assembled.problem;
        place < problem.model.locals && problem.layout().ties_of(place).is_empty()
    }

    /// Returns the equations of observed coordinates of a local point.
    fn further(&self, place: usize, terms: &Terms<'_>) -> Vec<Function> {
        let mut own = self.on_place(place).iter().map(|&index| self.suspects.get(index));
        let control = own.find(|suspect| matches!(suspect.home, Home::Point(_)));
        control.and_then(|control| self.term_rows(&control, terms).ok()).unwrap_or_default()
    }

    /// Returns the equation index of each row of the groups at a local point, and its whitened misclosure.
    fn rows_at(
        &self,
        place: usize,
        observation_sd: &[f64],
        found: &Leverages,
        terms: &Terms<'_>,
    ) -> (Vec<usize>, Vec<f64>) {
        let problem = &self.assembled.problem;
        let groups = problem.layout().groups_of(place);
        let (mut rows, mut off) = (vec![], vec![]);
        for &index in self.on_place(place) {
            let suspect = self.suspects.get(index);
            let first = match suspect.home {
                Home::Group { group, .. } => 2 * (group - groups.start),
                _ => 2 * groups.len(),
            };
            for (k, &row) in suspect.rows.iter().enumerate() {
                rows.push(first + k);
                off.push(misclosure(row, observation_sd, found, terms));
            }
        }
        (rows, off)
    }
}
