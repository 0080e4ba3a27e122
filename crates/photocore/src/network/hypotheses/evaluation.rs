//! The evaluation of all hypotheses of an adjusted network.

use nalgebra::{DMatrix, DVector};

use super::super::NetworkError;
use super::super::trial::Trial;
use super::catalogue::Catalogue;
use super::effect::Sample;
use super::facts::Facts;
use super::groups::{single_errors, worst};
use super::hypothesis::{About, Hypotheses, Hypothesis};
use super::judged::{Criteria, Judged};
use super::{
    assignment, attitudes, cameras, control, deformations, distances, form, photos, points, positions,
    shutter,
};
use crate::adjustment::{Leverages, correlation_above, whitening};
use crate::geometry::PoseNumbers;
use crate::{Threads, parallel};

/// The errors of sets that are possible for a network.
fn catalogue<'a>(trial: &'a Trial, found: &Leverages, facts: &'a Facts) -> Catalogue<'a> {
    let mut catalogue = Catalogue::new(trial, found, facts);
    let (bundle, control_points) = (catalogue.bundle, catalogue.control_points(trial));
    control::add(&mut catalogue, &control_points);
    distances::add(&mut catalogue);
    cameras::add(&mut catalogue, trial);
    deformations::add(&mut catalogue, trial);
    photos::add(&mut catalogue, trial);
    points::add(&mut catalogue, &trial.assembled.points);
    // Poses that are made of several blocks, or are vectors, have no unknowns of their own that could be displaced.
    if bundle.mounts.is_empty() && matches!(bundle.poses, PoseNumbers::Angles(_)) {
        attitudes::add(&mut catalogue);
        positions::add(&mut catalogue);
        assignment::add(&mut catalogue);
        form::add(&mut catalogue, &control_points);
        shutter::add(&mut catalogue, trial);
    }
    catalogue
}

impl Trial {
    /// Tests all hypotheses of the catalogue at the adjusted values, and computes what an undetected error would change.
    ///
    /// Errors of sets are tested by their scores and solutions with one factor, errors of groups by the selected inverse; groups are those
    /// of [`crate::network::TestGroups`] except image observations, which [`Trial::tests`] has.
    ///
    /// # Errors
    /// Nothing was adjusted before; an interruption, no memory.
    pub fn hypotheses(&mut self, facts: &Facts, threads: &Threads) -> Result<Hypotheses, NetworkError> {
        self.found()?;
        let criteria = Criteria::new(facts);
        let mut singles = single_errors(self, &criteria, threads);
        let worst = worst(&singles, facts);
        let mut ended = if facts.last { self.end() } else { None };

        let (this, problem) = (&*self, &self.assembled.problem);
        let sample = Sample::new(this, ended.as_ref().map_or_else(|| this.found(), Ok)?, facts);
        ended.iter_mut().for_each(|own| own.release(&problem.system));
        let found = ended.as_ref().map_or_else(|| this.found(), Ok)?;
        let failed = |error| NetworkError::new(error, &this.assembled);
        let linearized = found.linearized(problem, threads).map_err(failed)?;
        if facts.last {
            problem.system.release();
        }
        let mut catalogue = catalogue(this, found, facts);
        let mut add = |&k: &usize| singles[k].add(&mut catalogue, facts.by_component);
        let shares: Vec<Vec<(usize, f64)>> = worst.iter().map(&mut add).collect();
        let sums = linearized.additional(problem, &catalogue, threads);
        let count = sums.score.len();
        let of_sets = shares.iter().flatten().map(|own| own.0).min().unwrap_or(count);
        let compared = if facts.by_component { count } else { of_sets };
        let at_checks = sample.at_checks(&linearized, &catalogue, &sums.effects, compared, threads);
        let (mut all, mut columns, mut errors) = (vec![], vec![], vec![]);
        for cause in &catalogue.causes {
            let sees = |own: &(usize, f64)| sums.squares[(own.0, own.0)] > 0.0;
            let seen: Vec<usize> =
                (0..cause.columns.len()).filter(|&k| cause.columns[k].iter().any(sees)).collect();
            if seen.is_empty() {
                continue;
            }
            let own = cause.directions(count, &seen);
            let plausible: Vec<f64> = seen.iter().filter_map(|&k| cause.plausible.get(k).copied()).collect();
            let judged = Judged::new(
                &own.tr_mul(&sums.score),
                &own.tr_mul(&(&sums.squares * &own)),
                &own.tr_mul(&(&sums.redundancy * &own)),
                &plausible,
                &criteria,
            );
            errors.push(match &judged.error {
                Some(error) => &own * DVector::from_column_slice(error),
                None => DVector::zeros(count),
            });
            all.push(Hypothesis {
                code: cause.code,
                about: About::Set(cause.set),
                parameters: seen.iter().map(|&k| cause.parameters[k]).collect(),
                observations: observations(&own, &sums.observations),
                plausible,
                judged,
                sd_between_photos: None,
                effect: None,
                at_checks: (at_checks.columns(0, of_sets) * own.rows(0, of_sets))
                    .transpose()
                    .as_slice()
                    .to_vec(),
            });
            columns.push(own);
        }
        let sets = all.len();
        let parts = (this, found, &*linearized, &catalogue);
        shutter::add_sd_between_photos(parts, &sums.effects, &mut all, threads);
        for (&k, own) in worst.iter().zip(&shares) {
            let mut error = DVector::zeros(count);
            own.iter().for_each(|&(column, share)| error[column] = share);
            errors.push(error);
            if facts.by_component {
                singles[k].compare(&at_checks.select_columns(own.iter().map(|own| &own.0)));
            }
        }
        let changes = sample.changes(&linearized, &catalogue, &sums.effects, &errors, threads);
        let control: Vec<usize> = catalogue.control_points(this).into_iter().map(|own| own.0).collect();
        let effect = |error: usize| {
            let mut own = match error.checked_sub(sets) {
                Some(k) => this.points_of(singles[worst[k]].group),
                // The scale is that of control and positions.
                None if all[error].code.starts_with("control") || all[error].code == "scale" => {
                    control.clone()
                }
                None => vec![],
            };
            own.sort_unstable();
            sample.effect(&changes, error, &own)
        };
        let effects = threads.install(|| parallel::map(errors.len(), 1, effect));
        for (error, effect) in effects.into_iter().enumerate() {
            let own = match error.checked_sub(sets) {
                None => &mut all[error],
                Some(k) => &mut singles[worst[k]].hypothesis,
            };
            own.effect = own.judged.error.is_some().then_some(effect);
        }
        let taken: Vec<DMatrix<f64>> = columns.iter().map(|own| &sums.redundancy * own).collect();
        let block = |i: usize, j: usize| taken[j].tr_mul(&columns[i]).as_slice().to_vec();
        let roots: Vec<DMatrix<f64>> = (0..sets).map(|k| whitening(&block(k, k))).collect();
        let correlation = |k: usize| {
            let (i, j) = (k / sets, k % sets);
            correlation_above(&roots[i], &roots[j], &block(i, j), 0.0)
        };
        let correlations = (0..sets * sets).map(correlation).collect();
        all.extend(singles.into_iter().map(|single| single.hypothesis));
        Ok(Hypotheses { all, sets, correlations })
    }
}

/// The number of observations that depend on some parameters, from the numbers by column.
fn observations(directions: &DMatrix<f64>, counts: &[usize]) -> usize {
    let changed = (0..counts.len()).filter(|&column| directions.row(column).iter().any(|own| *own != 0.0));
    changed.map(|column| counts[column]).max().unwrap_or(0)
}
