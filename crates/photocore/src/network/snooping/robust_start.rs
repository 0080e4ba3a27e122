//! Start of data snooping with many gross errors: robust factors of standard deviations, and a robust adjustment.

use std::collections::BTreeSet;

use super::super::NetworkError;
use super::super::group_tests::Tests;
use super::super::test_groups::TestKind;
use super::choosing::Choosing;
use super::conditional::Chosen;
use super::log::Remark;
use super::state::{Snooping, TESTABLE};
use super::tried::{Tried, unless_lost};
use crate::adjustment::Status;
use crate::adjustment::middle;

/// Median of the absolute value of a standard normal variable, and of the length of a vector of two of them.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
const MEDIAN_OF_TWO: f64 = 1.177_410_022_515_474_7;
/// Factor of standard deviations above which the median of test values indicates a common factor.
const OPTIMISTIC: f64 = 2.0;
/// Smallest number of test values for a median.
const ENOUGH: usize = 20;
/// Share of image coordinates beyond [`FAR`] standard deviations that requires a robust start.
const MANY: f64 = 0.05;
const FAR: f64 = 5.0;
/// Length of a residual above which Cauchy's loss reduces its weight to a quarter, in robust standard deviations.
const SUSPICIOUS: f64 = 4.4;
/// Maximum number of robust adjustments after the first.
const SCALES: usize = 5;
/// Largest decrease of the robust factor that ends these.
const STABLE: f64 = 0.8;
/// Median of the test values of a distorted network, in standard deviations.
const DISTORTED: f64 = 10.0;

impl Snooping {
    /// Returns |w| of the testable rows of some groups.
    fn test_values(&self, is_included: impl Fn(usize) -> bool) -> Vec<f64> {
        let value = |(group, k): (usize, usize)| {
            let redundancy = self.redundancy(group, k);
            let w = self.tests.rows[self.groups.rows(group).start + k].residual.abs() / redundancy.sqrt();
            (redundancy > TESTABLE && w.is_finite()).then_some(w)
        };
        let groups = (0..self.groups.len()).filter(|&group| is_included(group));
        groups
            .flat_map(|group| (0..self.groups.rows(group).len()).map(move |k| (group, k)))
            .filter_map(value)
            .collect()
    }

    /// Sets robust factors of too small standard deviations, by type.
    pub(super) fn set_scales(&mut self) {
        (self.factors, self.scales) = (vec![], vec![1.0; self.groups.len()]);
        if !self.settings.known {
            return;
        }
        let all = self.test_values(|_| true);
        let count = all.len();
        let overall = robust_factor(all);
        if count < ENOUGH || overall <= OPTIMISTIC {
            return;
        }
        let kinds: BTreeSet<TestKind> = (0..self.groups.len())
            .filter(|&group| self.tests.groups[group].active)
            .map(|group| self.groups.kind(group))
            .collect();
        for kind in kinds {
            let own = self.test_values(|group| self.groups.kind(group) == kind);
            let factor = if own.len() >= ENOUGH { robust_factor(own) } else { overall }.max(1.0);
            self.factors.push((kind, factor));
            for group in (0..self.groups.len()).filter(|&group| self.groups.kind(group) == kind) {
                self.scales[group] = factor.powi(2);
            }
        }
        self.remarks.push(Remark::Factors { overall, by_type: self.factors.clone() });
    }

    /// Returns whether too many observations disagree for single tests, or the adjustment fails.
    pub(super) fn needs_robust_start(&self) -> bool {
        if let Some(robust) = self.settings.robust {
            return robust;
        }
        if self.standing.status != Status::Converged {
            return true;
        }
        let all = self.test_values(|_| true);
        if all.len() < ENOUGH {
            return false;
        }
        let factor = robust_factor(all).max(1.0);
        let images = self.test_values(|group| self.groups.is_image(group));
        let far = images.iter().filter(|value| **value > FAR * factor).count();
        far as f64 > MANY * images.len() as f64 || (self.settings.known && factor > OPTIMISTIC)
    }

    /// Returns whether the adjustment diverges, or residuals exceed plausible sizes: a consensus is required.
    pub fn needs_consensus(&self) -> bool {
        self.settings.robust != Some(false) && self.runs_off()
    }

    pub(super) fn runs_off(&self) -> bool {
        let all = self.test_values(|_| true);
        self.standing.status != Status::Converged || (all.len() >= ENOUGH && robust_factor(all) > DISTORTED)
    }

    /// Excludes points with tiny robust weights, and tests their observations against all others.
    ///
    /// A robust adjustment reveals an erroneous point, but not its erroneous ray. Both of two rays lose their weight, and often a good one
    /// near a large error does.
    pub(super) fn start_robustly(&mut self, network: &mut dyn Tried) -> Result<(), NetworkError> {
        let Ok(Some((sizes, scale))) = unless_lost(self.robust_sizes(network))? else {
            self.set_scales();
            return Ok(());
        };
        let (first, standing, out) = (self.tests.clone(), self.standing, self.out.clone());
        let is_suspicious = |group: &usize| {
            sizes[*group] > SUSPICIOUS * scale
                && self.groups.is_removable(*group)
                && first.groups[*group].active
        };
        let candidates: Vec<usize> = (0..self.groups.len()).filter(is_suspicious).collect();
        let points: BTreeSet<usize> =
            candidates.iter().filter_map(|&group| self.groups.point(group)).collect();
        let (choices, tested) = self.on_points_aside(network, &points, &candidates, &first)?;
        let is_untested =
            |group: &&usize| !self.groups.point(**group).is_some_and(|point| tested.contains(&point));
        let untested = candidates.iter().filter(is_untested);
        let mut entries: Vec<_> = untested.map(|&group| self.untested_entry(group, &first)).collect();
        entries.extend(self.entries(&choices, 0));
        self.out = out;
        let removed = self.apply(network, entries, &[])?;
        if removed.is_empty() {
            let out = self.out.clone();
            self.adjust_again(network, out)?;
        }
        if self.factors.is_empty() {
            self.set_scales();
        }
        self.remarks.push(Remark::Aside(points.len()));
        let returned = self.reinstate(network, 0)?;
        self.note_round(0, standing, removed, returned, 0);
        Ok(())
    }

    /// Returns the robust lengths of residuals, and the factor of their standard deviations; None if no robust adjustment converges.
    ///
    /// Many gross errors increase the median of all residuals. So the factor is estimated again from robust residuals, until it is stable.
    fn robust_sizes(&self, network: &mut dyn Tried) -> Result<Option<(Vec<f64>, f64)>, NetworkError> {
        let is_image = |group: &usize| self.tests.groups[*group].active && self.groups.is_image(*group);
        let images: Vec<usize> = (0..self.groups.len()).filter(is_image).collect();
        let rows =
            || images.iter().flat_map(|&group| (0..self.groups.rows(group).len()).map(move |k| (group, k)));
        let redundancy =
            rows().map(|(group, k)| self.redundancy(group, k)).sum::<f64>() / rows().count() as f64;
        if redundancy.is_nan() || redundancy <= 0.0 {
            return Ok(None);
        }
        let expected = MEDIAN_OF_TWO * redundancy.sqrt();
        let mut scale = robust_factor(self.test_values(|group| is_image(&group))).max(1.0);
        let mut sizes = network.robust_residuals(scale)?;
        for _ in 0..SCALES {
            let Some(own) = &sizes else { return Ok(None) };
            let mut of_images: Vec<f64> = images.iter().map(|&group| own[group]).collect();
            let factor = (middle(&mut of_images) / expected).max(1.0);
            if factor > STABLE * scale {
                break;
            }
            scale = factor;
            sizes = network.robust_residuals(scale)?;
        }
        Ok(sizes.map(|sizes| (sizes, scale)))
    }

    /// Adjusts without some points and candidates, and selects on these points; returns the points that could be tested.
    fn on_points_aside(
        &mut self,
        network: &mut dyn Tried,
        points: &BTreeSet<usize>,
        candidates: &[usize],
        first: &Tests,
    ) -> Result<(Vec<Chosen>, BTreeSet<usize>), NetworkError> {
        let mut out = self.out.clone();
        out.points.extend(points);
        let on_points = points.iter().flat_map(|&point| self.groups.table.on_point(point));
        on_points.chain(candidates).for_each(|&group| out.set(self.groups.rows(group), true));
        if self.adjust(network, out)?.is_err() {
            // Photos are not determined without them: groups without weight are excluded, and tested separately.
            return Ok((vec![], BTreeSet::new()));
        }
        self.set_scales();
        let points: Vec<usize> = points.iter().copied().collect();
        Choosing { tests: first, ..self.choosing(self.removable(), 0, false) }
            .on_gone_points(network, &points)
    }
}

/// Returns the robust standard deviation of test values from their absolute values; 1 without values.
fn robust_factor(mut values: Vec<f64>) -> f64 {
    if values.is_empty() { 1.0 } else { middle(&mut values) / MEDIAN }
}
