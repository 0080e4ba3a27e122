//! Exclusion of groups with all observations that depend on them.

use std::sync::Arc;

use super::super::NetworkError;
use super::super::group_tests::{TestOfGroup, Tests};
use super::super::trial::Excluded;
use super::conditional::Chosen;
use super::log::{Consequence, Kept, Removal};
use super::state::Snooping;
use super::tried::{Lost, Tried, unless_lost};

/// Maximum number of attempts per round to determine all parameters.
const ATTEMPTS: usize = 5;

impl Snooping {
    /// Adjusts without the exclusions, and tests; the state is unchanged if they leave parameters undetermined.
    pub(super) fn adjust(
        &mut self,
        network: &mut dyn Tried,
        out: Excluded,
    ) -> Result<Result<(), Lost>, NetworkError> {
        let tolerance = if self.groups.is_small { self.settings.exact } else { self.settings.rough };
        self.adjust_to(network, out, tolerance)
    }

    pub(super) fn adjust_to(
        &mut self,
        network: &mut dyn Tried,
        out: Excluded,
        tolerance: f64,
    ) -> Result<Result<(), Lost>, NetworkError> {
        match unless_lost(network.adjust(&out, tolerance))? {
            Ok(standing) => {
                (self.standing, self.out, self.tests) = (standing, out, Arc::new(network.tests()?));
                Ok(Ok(()))
            }
            Err(lost) => Ok(Err(lost)),
        }
    }

    /// Adjusts without exclusions that were adjusted before.
    pub(super) fn adjust_again(
        &mut self,
        network: &mut dyn Tried,
        out: Excluded,
    ) -> Result<(), NetworkError> {
        self.adjust(network, out)?.map_err(NetworkError::from)
    }

    /// Excludes groups with all dependent observations, and adjusts. Groups that are needed to determine the network are retained. Returns
    /// the indices of the others in the log.
    pub(super) fn apply(
        &mut self,
        network: &mut dyn Tried,
        entries: Vec<Removal>,
        returning: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let mut pending = entries;
        if pending.is_empty() && returning.is_empty() {
            return Ok(vec![]);
        }
        for _ in 0..ATTEMPTS {
            let mut out = self.without_rows_of(returning);
            let log: Vec<Removal> =
                pending.iter().map(|entry| self.exclude(&mut out, entry.clone())).collect();
            match self.adjust(network, out)? {
                Ok(()) => {
                    let first = self.removals.len();
                    self.removals.extend(log);
                    return Ok((first..self.removals.len())
                        .filter(|&k| self.removals[k].kept.is_none())
                        .collect());
                }
                Err(Lost { points, .. }) if !points.is_empty() => {
                    let is_lost = |entry: &Removal| {
                        self.groups.point(entry.group).is_some_and(|point| points.contains(&point))
                    };
                    pending.iter_mut().filter(|entry| is_lost(entry)).for_each(|entry| {
                        entry.consequences.push(Consequence::PointUndetermined);
                    });
                }
                Err(lost) => {
                    let any = pending.iter().any(|entry| self.concerns(entry, &lost));
                    let needed: Vec<Removal> =
                        pending.iter().filter(|entry| !any || self.concerns(entry, &lost)).cloned().collect();
                    needed.into_iter().for_each(|entry| self.keep(entry));
                    pending.retain(|entry| !self.kept.contains(&entry.group));
                }
            }
        }
        pending.into_iter().for_each(|entry| self.keep(entry));
        Ok(vec![])
    }

    /// Returns the exclusions without the rows of some entries of the log.
    pub(super) fn without_rows_of(&self, entries: &[usize]) -> Excluded {
        let mut out = self.out.clone();
        entries.iter().for_each(|&place| out.set(self.removals[place].rows.iter().copied(), false));
        out
    }

    fn concerns(&self, entry: &Removal, lost: &Lost) -> bool {
        let photos =
            self.groups.affected_photos(entry.group).into_iter().chain(self.groups.photo(entry.group));
        photos.into_iter().any(|photo| lost.photos.contains(&photo))
    }

    fn keep(&mut self, entry: Removal) {
        self.kept.insert(entry.group);
        self.removals.push(Removal { kept: Some(Kept::Needed), ..entry });
    }

    /// Excludes a group and all observations that depend on it.
    fn exclude(&mut self, out: &mut Excluded, mut entry: Removal) -> Removal {
        out.set(entry.rows.iter().copied(), true);
        let (point, loses_photo) = self.groups.consequences(out, entry.group);
        if loses_photo {
            out.set(entry.rows.iter().copied(), false);
            self.kept.insert(entry.group);
            return Removal { kept: Some(Kept::PhotoUndetermined), ..entry };
        }
        let is_undetermined = entry.consequences.contains(&Consequence::PointUndetermined);
        let own = self.groups.point(entry.group).filter(|_| is_undetermined);
        let mut points: Vec<usize> = point.into_iter().chain(own).collect();
        points.sort_unstable();
        for point in points {
            if out.points.insert(point) {
                entry.consequences.extend(self.exclude_point(out, point));
            }
        }
        let all = std::mem::take(&mut entry.consequences);
        for consequence in all {
            if !entry.consequences.contains(&consequence) {
                entry.consequences.push(consequence);
            }
        }
        entry
    }

    /// Excludes all observations of a point; returns a consequence for each group.
    pub(super) fn exclude_point(&self, out: &mut Excluded, point: usize) -> Vec<Consequence> {
        let mut consequences = vec![];
        for &group in self.groups.table.on_point(point) {
            if self.groups.rows(group).any(|row| !out.rows[row]) {
                out.set(self.groups.rows(group), true);
                consequences.push(Consequence::SingleRay(group));
            }
        }
        consequences
    }

    /// Returns the selected groups as entries of the log.
    pub(super) fn entries(&self, choices: &[Chosen], round: usize) -> Vec<Removal> {
        let entry = |own: &Chosen| {
            let in_units = |values: &[f64]| {
                own.rows
                    .iter()
                    .zip(values)
                    .map(|(&row, value)| value * self.groups.table.deviations()[row])
                    .collect()
            };
            Removal {
                round,
                first_statistic: own.first_statistic,
                fisher: own.fisher,
                log_probability: own.log_probability,
                limit: own.limit,
                error: in_units(&own.error),
                error_sd: in_units(&own.error_sd),
                rivals: own.rivals.clone(),
                ..self.entry(own.group, own.rows.clone(), own.statistic, own.dimension)
            }
        };
        choices.iter().map(entry).collect()
    }

    /// Returns the entry of a group that is excluded without a separate test.
    pub(super) fn untested_entry(&self, group: usize, tests: &Tests) -> Removal {
        let rows = self.groups.rows(group);
        let TestOfGroup { statistic, rank: dimension, .. } = tests.groups[group];
        Removal {
            fisher: self.unit().fisher(statistic, dimension),
            error: tests.rows[rows.clone()].iter().map(|row| row.error).collect(),
            error_sd: tests.rows[rows.clone()].iter().map(|row| row.error_sd).collect(),
            ..self.entry(group, rows.collect(), statistic, dimension)
        }
    }

    /// Returns an entry of a group before the first round.
    pub(super) fn entry(&self, group: usize, rows: Vec<usize>, statistic: f64, dimension: usize) -> Removal {
        Removal {
            round: 0,
            group,
            photo: None,
            rows,
            dimension,
            first_statistic: statistic,
            statistic,
            fisher: f64::NAN,
            log_probability: f64::NAN,
            limit: self.level.limit(0),
            error: vec![],
            error_sd: vec![],
            redundancy: self.tests.groups[group].least,
            rivals: vec![],
            consequences: vec![],
            prediction: None,
            returned: None,
            kept: None,
        }
    }
}
