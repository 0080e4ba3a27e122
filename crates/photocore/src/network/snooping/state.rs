//! State of data snooping: exclusions, tests and log.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::super::NetworkError;
use super::super::group_tests::Tests;
use super::super::test_groups::TestKind;
use super::super::trial::Excluded;
use super::choosing::Choosing;
use super::groups::Groups;
use super::log::{Predicted, Remark, Removal, Round, Standing};
use super::settings::{ControlParts, Settings};
use super::tried::Tried;
use super::unit_weight::{Level, UnitWeight};

/// Smallest redundancy number of a tested row.
pub(super) const TESTABLE: f64 = 0.01;
/// The same of rows that are no image coordinates, if single components of control are tested. Precise control at the edge of a
/// block, or a precise distance, has a redundancy number of a thousandth. Its test value is still meaningful.
const TESTABLE_COMPONENT: f64 = 1e-5;

/// Data snooping of a network.
#[derive(Debug)]
pub struct Snooping {
    pub(super) settings: Settings,
    pub(super) groups: Groups,
    pub(super) out: Excluded,
    pub(super) removals: Vec<Removal>,
    pub(super) rounds: Vec<Round>,
    pub(super) remarks: Vec<Remark>,
    /// Groups that were reinstated once.
    pub(super) returns: HashSet<usize>,
    /// Groups that are not excluded in further rounds.
    pub(super) kept: HashSet<usize>,
    /// Predictions of entries of the log.
    pub(super) predicted: HashMap<usize, Predicted>,
    pub(super) before: Standing,
    pub(super) standing: Standing,
    pub(super) tests: Arc<Tests>,
    pub(super) level: Level,
    pub(super) factors: Vec<(TestKind, f64)>,
    /// Square of the factor of the standard deviations of each group.
    pub(super) scales: Vec<f64>,
}

impl Snooping {
    /// Adjusts and tests a network without some observations.
    pub(super) fn begin(
        network: &mut dyn Tried,
        groups: Groups,
        settings: Settings,
        out: Option<Excluded>,
    ) -> Result<Self, NetworkError> {
        let out = out.unwrap_or_else(|| groups.none_excluded());
        let tolerance = if groups.is_small { settings.exact } else { settings.rough };
        let standing = network.adjust(&out, tolerance)?;
        let mut new = Self {
            level: Level { family: settings.level, tests: 0, is_rate: settings.is_rate },
            scales: vec![1.0; groups.len()],
            settings,
            groups,
            out,
            removals: vec![],
            rounds: vec![],
            remarks: vec![],
            returns: HashSet::new(),
            kept: HashSet::new(),
            predicted: HashMap::new(),
            before: standing,
            standing,
            tests: Arc::new(network.tests()?),
            factors: vec![],
        };
        new.level.tests = (0..new.groups.len()).filter(|&group| new.is_testable(group)).count();
        Ok(new)
    }

    /// Returns the unit weight of tests of the current network.
    pub(super) fn unit(&self) -> UnitWeight {
        UnitWeight::new(self.settings.known, &self.standing)
    }

    /// Returns the selection among allowed groups, with the number of exclusions before.
    pub(super) fn choosing(&self, is_allowed: Vec<bool>, excluded: usize, ahead: bool) -> Choosing<'_> {
        Choosing {
            groups: &self.groups,
            tests: &self.tests,
            unit: self.unit(),
            scales: &self.scales,
            is_allowed,
            level: self.level,
            excluded,
            ahead,
        }
    }

    /// Returns whether each group may be excluded: testable, and not retained before.
    pub(super) fn allowed(&self) -> Vec<bool> {
        let is_allowed = |group: usize| {
            self.groups.is_removable(group) && self.is_testable(group) && !self.kept.contains(&group)
        };
        (0..self.groups.len()).map(is_allowed).collect()
    }

    pub(super) fn removable(&self) -> Vec<bool> {
        (0..self.groups.len()).map(|group| self.groups.is_removable(group)).collect()
    }

    /// Returns whether an error in some direction of a group shows in its own residuals.
    pub(super) fn is_testable(&self, group: usize) -> bool {
        let components = self.groups.control == ControlParts::Components;
        let least = if components && !self.groups.is_image(group) { TESTABLE_COMPONENT } else { TESTABLE };
        self.tests.groups[group].active
            && self.tests.groups[group].rank > 0
            && (0..self.groups.rows(group).len()).any(|k| self.redundancy(group, k) > least)
    }

    /// Returns the redundancy number of a row of a group; zero if it is excluded.
    pub(super) fn redundancy(&self, group: usize, k: usize) -> f64 {
        let rows = self.groups.rows(group);
        let place = self.groups.table.block_starts()[group] + k * (rows.len() + 1);
        if self.tests.rows[rows.start + k].residual.is_nan() { 0.0 } else { self.tests.cofactors[place] }
    }
}
