//! Comparison of excluded observations with their prediction by the others, and residual cofactors of points.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::group_tests::{in_units, sub};
use super::suspects::{Home, Row, Suspect};
use super::trial::Trial;
use crate::adjustment::{Leverages, Terms, TieCofactors, weighted};
use crate::normals::{LocalCofactors, dot};
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

/// Cofactors near some groups: observations of local points, and ties.
pub(super) struct Around {
    pub(super) points: HashMap<usize, LocalCofactors>,
    pub(super) ties: HashMap<usize, TieCofactors>,
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
        let problem = &self.assembled.problem;
        let around = self.around(suspects, &self.observation_sd, found, threads)?;
        let terms = self.terms(&self.sd, &found.values);
        let predict = |&index: &usize| {
            let suspect = &self.suspects.all[index];
            let out: Vec<usize> =
                (0..suspect.rows.len()).filter(|&k| !self.is_in(suspect.rows[k].0)).collect();
            if out.is_empty() || self.is_gone(suspect) {
                return None;
            }
            let leverages = match suspect.home {
                Home::Group { group, point } => {
                    let own = around.points.get(&point)?;
                    let first = 2 * (group - problem.layout().groups_of(point).start);
                    let rows: Vec<usize> = out.iter().map(|&k| first + k).collect();
                    sub(&own.equations, own.rows(), &rows)
                }
                Home::Tie(tie) => sub(&around.ties.get(&tie)?.equations, suspect.rows.len(), &out),
                Home::Point(_) | Home::Block(_) => {
                    let rows = self.term_rows(suspect, &out, &terms);
                    let leverages = &rows * self.cofactors_at(found, suspect.home) * rows.transpose();
                    leverages.transpose().as_slice().to_vec()
                }
            };
            self.prediction(suspect, &out, &leverages, found, &terms)
        };
        Ok(suspects.iter().map(predict).collect())
    }

    /// Returns the cofactors of all objects of some groups.
    pub(super) fn around(
        &self,
        suspects: &[usize],
        observation_sd: &[f64],
        found: &Leverages,
        threads: &Threads,
    ) -> Result<Around, NetworkError> {
        let problem = &self.assembled.problem;
        let (mut places, mut ties) = (vec![], vec![]);
        for &index in suspects {
            match self.suspects.all[index].home {
                Home::Group { point, .. } => places.push(point),
                Home::Tie(tie) => ties.push(tie),
                Home::Point(_) | Home::Block(_) => {}
            }
        }
        places.sort_unstable();
        places.dedup();
        let named = |error| NetworkError::new(error, &self.assembled);
        let of_points = found.of_locals(problem, observation_sd, &places, |_| vec![], threads);
        let of_ties = found.of_ties(problem, observation_sd, &ties, threads);
        Ok(Around {
            points: places.into_iter().zip(of_points.map_err(named)?).collect(),
            ties: ties.into_iter().zip(of_ties.map_err(named)?).collect(),
        })
    }

    fn prediction(
        &self,
        suspect: &Suspect,
        out: &[usize],
        leverages: &[f64],
        found: &Leverages,
        terms: &Terms<'_>,
    ) -> Option<Prediction> {
        let count = out.len();
        let c = DMatrix::identity(count, count) + DMatrix::from_row_slice(count, count, leverages);
        let residual = |&k: &usize| match suspect.rows[k].0 {
            Row::Equation(equation) => found.residuals[equation] / self.observation_sd[equation],
            Row::Unknown(unknown) => terms.row(unknown).1,
        };
        let d = DVector::from_iterator(count, out.iter().map(residual));
        let statistic = d.dot(&c.clone().cholesky()?.solve(&d));
        let rows: Vec<(Row, usize)> = out.iter().map(|&k| suspect.rows[k]).collect();
        let units = self.units(suspect, &rows);
        let (error, error_sd) = in_units(&units, d.as_slice(), c.as_slice());
        Some(Prediction { statistic, rows: out.to_vec(), error, error_sd })
    }

    /// Returns true if the parameters of a group are excluded with it: fixed now, but not in the input.
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
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let (observation_sd, sd) = (&problem.observation_sd[..], &problem.sd[..]);
        let terms = self.terms(sd, &found.values);
        let further = |place: usize| self.further(place, &terms);
        let places: Vec<Option<usize>> = points.iter().map(|&point| self.local(point)).collect();
        let locals: Vec<usize> = places.iter().flatten().copied().collect();
        let cofactors = found.of_locals_together(problem, observation_sd, &locals, (further, limit), threads);
        let mut cofactors = cofactors.map_err(|error| NetworkError::new(error, &self.assembled))?.into_iter();
        let all: Vec<Option<(usize, LocalCofactors)>> =
            places.into_iter().map(|place| Some((place?, cofactors.next()?))).collect();
        let of = |k: usize| {
            all[k].as_ref().map_or_else(OnPoint::default, |(place, own)| {
                let (rows, residual) = self.rows_at(*place, observation_sd, found, &terms);
                let (count, leverages) = (rows.len(), sub(&own.equations, own.rows(), &rows));
                let identity = |k: usize| f64::from(u8::from(k / count == k % count));
                let cofactors =
                    leverages.iter().enumerate().map(|(k, leverage)| identity(k) - leverage).collect();
                OnPoint { suspects: self.on_place[*place].clone(), residual, cofactors }
            })
        };
        Ok(threads.install(|| parallel::map(all.len(), AT_LEAST, of)))
    }

    /// Returns R of excluded points, as if they were active: each one alone, given photos determined by the others. It is empty also for
    /// points that their rays do not determine.
    ///
    /// # Errors
    /// Predictions before any adjustment.
    pub fn on_gone_points(&self, points: &[usize], threads: &Threads) -> Result<Vec<OnPoint>, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let given = (&self.observation_sd[..], &self.sd[..]);
        let terms = self.terms(&self.sd, &found.values);
        let further = |place: usize| self.further(place, &terms);
        let places: Vec<usize> = points.iter().filter_map(|&point| self.local(point)).collect();
        let cofactors = found.of_gone(problem, given, &places, further, threads);
        let cofactors = cofactors.map_err(|error| NetworkError::new(error, &self.assembled))?;
        let mut found_at = places.iter().zip(cofactors);
        let of = |&point: &usize| {
            let known = self.local(point).and_then(|_| found_at.next()).filter(|(_, own)| !own.is_empty());
            known.map_or_else(OnPoint::default, |(&place, own)| {
                let (rows, observed) = self.rows_at(place, &self.observation_sd, found, &terms);
                let cofactors = sub(&own, own.len().isqrt(), &rows);
                let residual = cofactors.chunks_exact(rows.len()).map(|row| dot(row, &observed)).collect();
                OnPoint { suspects: self.on_place[place].clone(), residual, cofactors }
            })
        };
        Ok(points.iter().map(of).collect())
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
    fn further(&self, place: usize, terms: &Terms<'_>) -> Vec<f64> {
        let mut own = self.on_place[place].iter().map(|&index| &self.suspects.all[index]);
        let Some(suspect) = own.find(|suspect| matches!(suspect.home, Home::Point(_))) else { return vec![] };
        let all: Vec<usize> = (0..suspect.rows.len()).collect();
        self.term_rows(suspect, &all, terms).transpose().as_slice().to_vec()
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
        for &index in &self.on_place[place] {
            let suspect = &self.suspects.all[index];
            let first = match suspect.home {
                Home::Group { group, .. } => 2 * (group - groups.start),
                _ => 2 * groups.len(),
            };
            for (k, &(row, _)) in suspect.rows.iter().enumerate() {
                rows.push(first + k);
                off.push(match row {
                    Row::Equation(equation) => weighted(found.residuals[equation], observation_sd[equation]),
                    Row::Unknown(unknown) => terms.row(unknown).1,
                });
            }
        }
        (rows, off)
    }
}
