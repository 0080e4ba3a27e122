//! Exclusion of whole photos: photos of another exposure, or with exchanged names of many points.

use super::super::NetworkError;
use super::super::trial::Excluded;
use super::log::{Consequence, Removal};
use super::state::Snooping;
use super::tried::Tried;
use crate::adjustment::log_chi_square;
use crate::adjustment::middle;

/// Median test value of a bad photo, in medians of all photos (in standard deviations, at least one).
const FAR: f64 = 5.0;
/// Number of excluded images of a photo, and their share, above which the whole photo is excluded.
const LEAST: usize = 4;
const SHARE: f64 = 0.5;
/// Ratio of the median and the largest test value of a photo if all its images are wrong. A few huge errors, such as exchanged names,
/// increase the other values far less.
const EVEN: f64 = 0.25;
/// Maximum number of photos that are excluded before tests of observations.
const MAX_PHOTOS: usize = 5;

impl Snooping {
    /// Excludes photos whose images disagree: another exposure or wrong names.
    ///
    /// Such a photo affects all around it, so that single observations cannot be tested. The median of its test values is conspicuous, and
    /// a few gross errors do not change it. If an observed pose causes it, the photo is retained, and the pose is tested separately.
    pub(super) fn exclude_bad_photos(&mut self, network: &mut dyn Tried) -> Result<(), NetworkError> {
        for _ in 0..MAX_PHOTOS {
            let medians: Vec<f64> =
                (0..self.groups.table.photo_count()).map(|photo| self.median_of(photo)).collect();
            let mut known: Vec<f64> = medians.iter().copied().filter(|median| !median.is_nan()).collect();
            let usual = middle(&mut known);
            let larger =
                |worst: usize, photo: usize| if medians[photo] > medians[worst] { photo } else { worst };
            let tested = (0..medians.len()).filter(|&photo| !medians[photo].is_nan());
            let Some(worst) = tested.reduce(larger) else { return Ok(()) };
            let median = medians[worst];
            let largest = self.test_values_of(worst).into_iter().fold(0.0, f64::max);
            let is_bad = median >= EVEN * largest && median > FAR * usual.max(1.0);
            if !is_bad
                || self.is_by_pose(network, worst, median)?
                || self.exclude_photo(network, worst, 0, Consequence::Median(median, usual))?.is_none()
            {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Excludes the photos most of whose images are excluded singly; returns their indices in the log.
    pub(super) fn exclude_photos(
        &mut self,
        network: &mut dyn Tried,
        round: usize,
    ) -> Result<Vec<usize>, NetworkError> {
        let mut counts = vec![0; self.groups.table.photo_count()];
        for entry in self.removals.iter().filter(|entry| entry.is_out() && self.groups.is_image(entry.group))
        {
            self.groups.photo(entry.group).into_iter().for_each(|photo| counts[photo] += 1);
        }
        let mut added = vec![];
        for (photo, &count) in counts.iter().enumerate().filter(|(_, count)| **count >= LEAST) {
            let images = self
                .groups
                .table
                .on_photo(photo)
                .iter()
                .filter(|&&group| self.groups.is_image(group))
                .count();
            if !self.out.photos.contains(&photo) && count as f64 > SHARE * images as f64 {
                added.extend(self.exclude_photo(
                    network,
                    photo,
                    round,
                    Consequence::Singly(count, images),
                )?);
            }
        }
        Ok(added)
    }

    /// Excludes a photo with all its observations; returns its index in the log, or None if this leaves parameters undetermined.
    fn exclude_photo(
        &mut self,
        network: &mut dyn Tried,
        photo: usize,
        round: usize,
        reason: Consequence,
    ) -> Result<Option<usize>, NetworkError> {
        let before = self.standing;
        let mut out = self.out.clone();
        let mut consequences = vec![reason];
        consequences.extend(self.exclude_all_of(&mut out, photo));
        if self.adjust(network, out)?.is_err() {
            let out = self.out.clone();
            self.adjust_again(network, out)?;
            return Ok(None);
        }
        let sum = before.sum_of_squares - self.standing.sum_of_squares;
        let freedom = before.degrees_of_freedom - self.standing.degrees_of_freedom;
        Ok(Some(self.log_photo(photo, round, Some((sum, freedom)), consequences)))
    }

    /// Excludes a photo with all its observations; returns dependent exclusions.
    pub(super) fn exclude_all_of(&self, out: &mut Excluded, photo: usize) -> Vec<Consequence> {
        let own = self.groups.table.on_photo(photo);
        own.iter().for_each(|&group| out.set(self.groups.rows(group), true));
        out.photos.insert(photo);
        let mut consequences = vec![];
        for &group in own.iter().filter(|&&group| self.groups.is_image(group)) {
            if let Some(point) = self.groups.consequences(out, group).0
                && out.points.insert(point)
            {
                consequences.extend(self.exclude_point(out, point));
            }
        }
        consequences
    }

    /// Adds the exclusion of a photo to the log, with its decrease of the sum of squares and of the degrees of freedom. These are None if
    /// the network was never adjusted with the photo. Returns the index.
    pub(super) fn log_photo(
        &mut self,
        photo: usize,
        round: usize,
        change: Option<(f64, i64)>,
        consequences: Vec<Consequence>,
    ) -> usize {
        let groups = &self.groups;
        let own = groups.table.on_photo(photo);
        let rows = own.iter().map(|&group| groups.rows(group).len()).sum();
        let (statistic, dimension) =
            change.map_or((f64::NAN, rows), |(sum, freedom)| (sum, usize::try_from(freedom).unwrap_or(0)));
        let group = own.iter().copied().find(|&group| groups.is_image(group)).unwrap_or_default();
        let entry = Removal {
            round,
            photo: Some(photo),
            log_probability: change
                .map_or(f64::NAN, |_| log_chi_square(statistic.max(0.0), dimension.max(1) as f64)),
            redundancy: f64::NAN,
            consequences,
            ..self.entry(group, vec![], statistic, dimension)
        };
        self.removals.push(entry);
        self.removals.len() - 1
    }

    /// Returns the test values of the images of a photo, in standard deviations.
    fn test_values_of(&self, photo: usize) -> Vec<f64> {
        let images = self.groups.table.on_photo(photo).iter().copied();
        images
            .filter(|&group| self.groups.is_image(group) && self.is_testable(group))
            .map(|group| (self.tests.groups[group].statistic / self.tests.groups[group].rank as f64).sqrt())
            .collect()
    }

    /// Returns the median test value of the images of a photo; NaN if there are too few.
    fn median_of(&self, photo: usize) -> f64 {
        let mut values = self.test_values_of(photo);
        if values.len() >= LEAST { middle(&mut values) } else { f64::NAN }
    }

    /// Returns whether the images of a photo agree without its observed pose.
    fn is_by_pose(
        &mut self,
        network: &mut dyn Tried,
        photo: usize,
        median: f64,
    ) -> Result<bool, NetworkError> {
        let own = self.groups.table.on_photo(photo).iter().copied();
        let poses: Vec<usize> =
            own.filter(|&group| !self.groups.is_image(group) && self.tests.groups[group].active).collect();
        if poses.is_empty() {
            return Ok(false);
        }
        let (mut out, before) = (self.out.clone(), self.out.clone());
        poses.into_iter().for_each(|group| out.set(self.groups.rows(group), true));
        if self.adjust(network, out)?.is_err() {
            return Ok(false);
        }
        let left = self.median_of(photo);
        Ok(self.adjust(network, before)?.is_ok() && left < median / FAR)
    }
}
