//! Reinstatement of exclusions that agree with the other observations.

use std::collections::BTreeSet;

use super::super::NetworkError;
use super::log::{Predicted, Removal};
use super::state::Snooping;
use super::tried::Tried;
use crate::adjustment::{log_chi_square, log_fisher};

impl Snooping {
    /// Reinstates agreeing observations, one adjustment after the other; returns their indices in the log.
    pub(super) fn reinstate(
        &mut self,
        network: &mut dyn Tried,
        round: usize,
    ) -> Result<Vec<usize>, NetworkError> {
        let mut all = vec![];
        loop {
            let returning = self.agreeing(network)?;
            if returning.is_empty() || self.adjust(network, self.without_rows_of(&returning))?.is_err() {
                return Ok(all);
            }
            self.note_return(&returning, round);
            all.extend(returning);
        }
    }

    /// Tests all exclusions; returns the best agreeing one, or all that are independent.
    pub(super) fn agreeing(&mut self, network: &mut dyn Tried) -> Result<Vec<usize>, NetworkError> {
        let is_tested =
            |place: &usize| self.removals[*place].is_out() && !self.removals[*place].rows.is_empty();
        let places: Vec<usize> = (0..self.removals.len()).filter(is_tested).collect();
        if places.is_empty() {
            return Ok(vec![]);
        }
        let groups: Vec<usize> = places.iter().map(|&place| self.removals[place].group).collect();
        let (predictions, starts) = (network.predictions(&groups)?, self.groups.table.starts_among(&groups));
        // Another entry may have excluded other rows of the same group.
        let predicted = |k: usize| {
            let (Removal { group, rows, .. }, test) = (&self.removals[places[k]], &predictions.groups[k]);
            let first = self.groups.rows(*group).start;
            Predicted {
                statistic: test.statistic,
                log_probability: self.log_probability(test.statistic, test.rank, *group),
                error: rows.iter().map(|row| predictions.rows[starts[k] + row - first].error).collect(),
            }
        };
        let known = (0..places.len()).filter(|&k| predictions.groups[k].active);
        self.predicted = known.map(|k| (places[k], predicted(k))).collect();
        let limit = self.level.limit(0).ln();
        let mut agreeing: Vec<(f64, usize)> =
            self.predicted.iter().map(|(&place, own)| (own.log_probability, place)).collect();
        agreeing
            .retain(|&(log_p, place)| log_p >= limit && !self.returns.contains(&self.removals[place].group));
        agreeing.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let sorted = agreeing.into_iter().map(|(_, place)| place);
        if self.groups.is_small {
            return Ok(sorted.take(1).collect());
        }
        let mut taken = BTreeSet::new();
        let is_independent = |place: &usize| {
            let mut photos = self.groups.own_photos(self.removals[*place].group);
            let is_independent = photos.is_disjoint(&taken);
            if is_independent {
                taken.append(&mut photos);
            }
            is_independent
        };
        Ok(sorted.filter(is_independent).collect())
    }

    /// Records the reinstatement of entries of the log.
    pub(super) fn note_return(&mut self, places: &[usize], round: usize) {
        for &place in places {
            self.returns.insert(self.removals[place].group);
            self.removals[place].prediction = self.predicted.get(&place).cloned();
            self.removals[place].returned = Some(round);
        }
    }

    /// Returns the logarithm of the p-value of an exclusion, given the network without it.
    pub(super) fn log_probability(&self, statistic: f64, dimension: usize, group: usize) -> f64 {
        let dimension = dimension as f64;
        if self.settings.known {
            return log_chi_square(statistic / self.scales[group], dimension);
        }
        let (sum, freedom) = (self.standing.sum_of_squares, self.standing.degrees_of_freedom as f64);
        if freedom > 0.0 && sum > 0.0 {
            log_fisher(statistic / dimension / (sum / freedom), dimension, freedom)
        } else {
            0.0
        }
    }
}
