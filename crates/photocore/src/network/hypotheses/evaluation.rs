//! The evaluation of all hypotheses of an adjusted network.

use nalgebra::DVector;

use super::super::NetworkError;
use super::super::trial::Trial;
use super::catalogue::Catalogue;
use super::effect::Sample;
use super::facts::Facts;
use super::groups::single_errors;
use super::hypothesis::{About, Hypotheses, Hypothesis};
use super::judged::{Criteria, Judged};
use super::{attitudes, cameras, control, form, positions, shutter};
use crate::Threads;
use crate::adjustment::{Leverages, canonical_correlation};
use crate::geometry::{ObjectSpace, PoseNumbers};

/// The errors of sets that are possible for a network.
fn catalogue<'a>(trial: &'a Trial, found: &Leverages, facts: &'a Facts) -> Catalogue<'a> {
    let mut catalogue = Catalogue::new(trial, found, facts);
    let (bundle, points) = (catalogue.bundle, catalogue.control_points(trial));
    control::add(&mut catalogue, &points);
    cameras::add(&mut catalogue, trial);
    // Poses that are made of several blocks, or are vectors, have no unknowns of their own that could be displaced.
    if bundle.mounts.is_empty() && matches!(bundle.poses, PoseNumbers::Angles(_)) {
        attitudes::add(&mut catalogue);
        if bundle.space == ObjectSpace::Rectangular {
            positions::add(&mut catalogue);
            form::add(&mut catalogue, &points);
            shutter::add(&mut catalogue, trial);
        }
    }
    catalogue
}

impl Trial {
    /// Tests all hypotheses of the catalogue at the adjusted values, and computes what an undetected error would change.
    ///
    /// Errors of sets are tested by their scores and solutions with one factor, errors of groups by the selected inverse; groups are those
    /// of [`crate::network::Suspects`] except image observations, which [`Trial::tests`] has.
    ///
    /// # Errors
    /// Nothing was adjusted before; an interruption, no memory.
    pub fn hypotheses(&self, facts: &Facts, threads: &Threads) -> Result<Hypotheses, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let failed = |error| NetworkError::new(error, &self.assembled);
        let linearized = found.linearized(problem, threads).map_err(failed)?;
        let criteria = Criteria::new(facts);
        let sample = Sample::new(self, found, &linearized, &facts.checks);

        let catalogue = catalogue(self, found, facts);
        let sums = linearized.additional(problem, &catalogue, threads);
        let (mut all, mut columns, mut errors) = (vec![], vec![], vec![]);
        for cause in &catalogue.causes {
            let seen: Vec<usize> = (0..cause.columns.len())
                .filter(|&k| sums.squares[(cause.columns[k], cause.columns[k])] > 0.0)
                .collect();
            if seen.is_empty() {
                continue;
            }
            let own: Vec<usize> = seen.iter().map(|&k| cause.columns[k]).collect();
            let plausible: Vec<f64> = seen.iter().filter_map(|&k| cause.plausible.get(k).copied()).collect();
            let judged = Judged::new(
                &DVector::from_iterator(own.len(), own.iter().map(|&k| sums.score[k])),
                &sums.squares.select_rows(&own).select_columns(&own),
                &sums.redundancy.select_rows(&own).select_columns(&own),
                &plausible,
                &criteria,
            );
            let mut error = DVector::zeros(sums.score.len());
            own.iter().zip(judged.error.iter().flatten()).for_each(|(&k, &value)| error[k] = value);
            errors.push(error);
            all.push(Hypothesis {
                code: cause.code,
                about: About::Set(cause.set),
                parameters: seen.iter().map(|&k| cause.parameters[k]).collect(),
                observations: own.iter().map(|&k| sums.observations[k]).max().unwrap_or(0),
                plausible,
                judged,
                effect: None,
            });
            columns.push(own);
        }
        let changes = sample.changes(&catalogue, &sums.effects, &errors, threads);
        for (k, own) in all.iter_mut().enumerate().filter(|(_, own)| own.judged.error.is_some()) {
            own.effect = Some(sample.effect(&changes, k, &[], facts.limit));
        }
        let sets = all.len();
        let block = |i: &[usize], j: &[usize]| -> Vec<f64> {
            i.iter()
                .flat_map(|&i| j.iter().map(move |&j| (i, j)))
                .map(|place| sums.redundancy[place])
                .collect()
        };
        let correlation = |(i, j): (usize, usize)| {
            let (i, j): (&[usize], &[usize]) = (&columns[i], &columns[j]);
            canonical_correlation(&block(i, i), &block(j, j), &block(i, j))
        };
        let pairs = (0..sets).flat_map(|i| (0..sets).map(move |j| (i, j)));
        let correlations = pairs.map(correlation).collect();
        all.extend(single_errors(self, found, &linearized, &sample, (facts, &criteria), threads));
        Ok(Hypotheses { all, sets, correlations })
    }
}
