//! Exclusions that other groups would explain as well: they are reinstated, and reported with the odds of both.

use super::super::NetworkError;
use super::super::group_tests::Tests;
use super::choosing::is_beyond;
use super::conditional::Chosen;
use super::log::{Kept, Rival};
use super::state::Snooping;
use super::tried::Tried;
use super::unit_weight::Criticals;

/// Maximum likelihood ratio of alternatives.
const ODDS: f64 = 20.0;

impl Snooping {
    /// Reinstates excluded groups with alternatives, and returns the others. Images are excepted: only their own point depends on the choice.
    ///
    /// `choices` are those of the round, `before` the tests before it.
    pub(super) fn without_disputed(
        &mut self,
        network: &mut dyn Tried,
        removed: Vec<usize>,
        choices: &[Chosen],
        before: &Tests,
    ) -> Result<Vec<usize>, NetworkError> {
        let single: Vec<usize> = removed.iter().copied().filter(|&place| self.is_alone(place)).collect();
        let rivals = |&place: &usize| {
            let group = self.removals[place].group;
            let mut rivals = match (self.groups.is_small, &single[..]) {
                (true, _) => {
                    choices.iter().rfind(|own| own.group == group).map_or(vec![], |own| own.rivals.clone())
                }
                // Several exclusions change the test values of each other.
                (false, [_]) => self.insignificant_without(group, before),
                (false, _) => vec![],
            };
            rivals.retain(|rival| rival.odds < ODDS && !self.groups.is_image(rival.group));
            (!rivals.is_empty()).then_some((place, rivals))
        };
        let disputed: Vec<(usize, Vec<Rival>)> = single.iter().filter_map(rivals).collect();
        let places: Vec<usize> = disputed.iter().map(|own| own.0).collect();
        if disputed.is_empty() || self.adjust(network, self.without_rows_of(&places))?.is_err() {
            return Ok(removed);
        }
        for (place, rivals) in disputed {
            let entry = &mut self.removals[place];
            self.kept.extend(rivals.iter().map(|rival| rival.group).chain([entry.group]));
            (entry.rivals, entry.kept) = (rivals, Some(Kept::Disputed));
        }
        Ok(removed.into_iter().filter(|place| !places.contains(place)).collect())
    }

    /// Returns whether an entry is a group other than an image, without further exclusions.
    fn is_alone(&self, place: usize) -> bool {
        let entry = &self.removals[place];
        !entry.rows.is_empty() && !self.groups.is_image(entry.group) && entry.consequences.is_empty()
    }

    /// Returns groups with about the test value of an excluded one that are not significant without it.
    fn insignificant_without(&self, group: usize, before: &Tests) -> Vec<Rival> {
        let mut critical = Criticals::new(self.unit(), self.level.limit(0));
        let mut falls = |other: usize| {
            self.tests.groups[other].active
                && !self.groups.is_image(other)
                && self.groups.is_removable(other)
                && is_beyond(before, &self.scales, &mut critical, other)
                && !is_beyond(&self.tests, &self.scales, &mut critical, other)
                && !self.removals.iter().any(|entry| entry.is_out() && entry.group == other)
        };
        let change = |other: usize| {
            (before.groups[group].statistic - before.groups[other].statistic) / self.scales[group] / 2.0
        };
        let near = (0..self.groups.len()).filter(|&other| falls(other) && change(other).abs() < ODDS.ln());
        near.map(|other| Rival {
            group: other,
            statistic: before.groups[other].statistic,
            dimension: before.groups[other].rank,
            odds: change(other).exp(),
        })
        .collect()
    }
}
