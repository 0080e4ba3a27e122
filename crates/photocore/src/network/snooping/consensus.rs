//! Start of data snooping from a consensus of most observations.
//!
//! Observations under exchanged names are off by thousands of standard deviations. The adjustment of such a network is distorted or
//! diverges, and so are all its tests, robust or not. A minority does not affect resections and intersections by consensus, for any size of
//! its errors.
//!
//! An observation of a point with other rays is tested against its prediction. If fewer than two other rays remain, the point is excluded,
//! and each observation is tested as if it were in use. So both of two rays are reported.

use std::collections::{BTreeMap, BTreeSet};

use super::super::NetworkError;
use super::super::group_tests::{TestOfGroup, Tests};
use super::super::trial::Excluded;
use super::choosing::Choosing;
use super::groups::Groups;
use super::log::{Consequence, Remark, Removal};
use super::settings::ControlParts;
use super::state::Snooping;
use super::tried::Tried;

/// Exclusions by a consensus from which a network is started.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Consensus {
    /// Groups of images that do not agree with most of their point and photo.
    pub images: Vec<usize>,
    /// Photos whose images agree with no pose.
    pub photos: BTreeSet<usize>,
}

impl Groups {
    /// Returns the exclusions by a consensus, and points with too few other rays.
    pub(super) fn excluded_by(&self, consensus: &Consensus) -> Excluded {
        let mut out = self.none_excluded();
        out.photos.clone_from(&consensus.photos);
        let of_photos = consensus.photos.iter().flat_map(|&photo| self.table.on_photo(photo)).copied();
        let groups: Vec<usize> = consensus.images.iter().copied().chain(of_photos).collect();
        self.put_aside(&mut out, &groups);
        out
    }

    /// Excludes groups; returns points with too few rays, which are excluded too.
    fn put_aside(&self, out: &mut Excluded, groups: &[usize]) -> Vec<usize> {
        groups.iter().for_each(|&group| out.set(self.rows(group), true));
        let points: BTreeSet<usize> =
            groups.iter().filter_map(|&group| self.consequences(out, group).0).collect();
        for &point in &points {
            out.points.insert(point);
            self.table.on_point(point).iter().for_each(|&group| out.set(self.rows(group), true));
        }
        points.into_iter().collect()
    }
}

impl Snooping {
    /// Tests the exclusions of a consensus against the others, and includes agreeing ones.
    ///
    /// * `is_adjusted`: whether the network with all observations had an adjustment, which is the current state.
    pub(super) fn decide(
        &mut self,
        network: &mut dyn Tried,
        consensus: &Consensus,
        is_adjusted: bool,
    ) -> Result<(), NetworkError> {
        let (first, tests, start) = (self.standing, self.tests.clone(), self.out.clone());
        let mut out = self.groups.none_excluded();
        let consequences: BTreeMap<usize, Vec<Consequence>> =
            consensus.photos.iter().map(|&photo| (photo, self.exclude_all_of(&mut out, photo))).collect();
        let whole = out.clone();
        let mut images = consensus.images.clone();
        images.retain(|&group| !out.rows[self.groups.rows(group).start]);
        let points = self.groups.put_aside(&mut out, &images);
        if self.adjust(network, out)?.is_err() {
            return self.adjust_again(network, start);
        }
        let mut on_others = images.clone();
        on_others.retain(|&group| !self.groups.point(group).is_some_and(|point| points.contains(&point)));
        let mut entries = self.contradicting(network, &on_others)?;
        let agreeing = on_others.len() - entries.len();
        let choosing = Choosing { tests: &tests, ..self.choosing(self.removable(), 0, false) };
        let (choices, _) = choosing.on_gone_points(network, &points)?;
        entries.extend(self.entries(&choices, 0));
        self.out = whole.clone();
        let mut removed = self.apply(network, entries, &[])?;
        if removed.is_empty() {
            self.adjust_again(network, whole)?;
        }
        if self.runs_off() {
            removed.extend(self.exclude_divergent(network, &points, &images, &tests)?);
        }
        let change = is_adjusted.then(|| {
            let (sum, freedom) = (self.standing.sum_of_squares, self.standing.degrees_of_freedom);
            (first.sum_of_squares - sum, first.degrees_of_freedom - freedom)
        });
        for (photo, dependent) in consequences {
            let mut all = vec![Consequence::Contradicted(photo)];
            all.extend(dependent);
            removed.push(self.log_photo(photo, 0, change, all));
        }
        self.remarks.push(Remark::Consensus { is_adjusted, images: images.len(), agreeing });
        self.note_round(0, first, removed, vec![], 0);
        Ok(())
    }

    /// Excludes again the reinstated observations with which the adjustment diverges.
    ///
    /// Two rays that diverge in front of the cameras agree with any photos in a linear model, because they intersect behind them.
    fn exclude_divergent(
        &mut self,
        network: &mut dyn Tried,
        points: &[usize],
        images: &[usize],
        tests: &Tests,
    ) -> Result<Vec<usize>, NetworkError> {
        let mut first_on: BTreeMap<usize, usize> = BTreeMap::new();
        for &group in images {
            if let Some(point) = self.groups.point(group).filter(|point| points.contains(point))
                && self.groups.rows(group).all(|row| !self.out.rows[row])
            {
                first_on.entry(point).or_insert(group);
            }
        }
        let entry = |group: usize| Removal {
            consequences: vec![Consequence::DivergentRays],
            ..self.untested_entry(group, tests)
        };
        let entries = first_on.into_values().map(entry).collect();
        self.apply(network, entries, &[])
    }

    /// Returns entries for the excluded observations that contradict their predictions. Components of control that agree are not
    /// entered if single components may be excluded.
    fn contradicting(&self, network: &mut dyn Tried, groups: &[usize]) -> Result<Vec<Removal>, NetworkError> {
        let limit = self.level.limit(0).ln();
        let freedom = self.standing.degrees_of_freedom.max(1) as f64;
        let variance = self.standing.sum_of_squares / freedom;
        let (predictions, starts) = (network.predictions(groups)?, self.groups.table.starts_among(groups));
        let entry = |k: usize| {
            let (group, own) = (groups[k], &predictions.rows[starts[k]..starts[k + 1]]);
            let TestOfGroup { active, statistic, rank: dimension, .. } = predictions.groups[k];
            let log_probability = self.log_probability(statistic, dimension, group);
            let fisher = statistic / dimension as f64 / variance;
            let single = |row: usize| {
                self.log_probability((own[row].error / own[row].error_sd).powi(2), 1, group) < limit
            };
            let mut rows: Vec<usize> = (0..own.len()).filter(|&row| !own[row].error.is_nan()).collect();
            if self.groups.control == ControlParts::Components && !self.groups.is_image(group) {
                rows.retain(|&row| single(row));
            }
            let first = self.groups.rows(group).start;
            (active && log_probability < limit && !rows.is_empty()).then(|| Removal {
                fisher: if variance > 0.0 { fisher } else { f64::NAN },
                log_probability,
                error: rows.iter().map(|&row| own[row].error).collect(),
                error_sd: rows.iter().map(|&row| own[row].error_sd).collect(),
                ..self.entry(group, rows.iter().map(|row| first + row).collect(), statistic, dimension)
            })
        };
        Ok((0..groups.len()).filter_map(entry).collect())
    }
}
