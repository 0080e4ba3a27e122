//! Selection of the groups to exclude in a round: exact with the cofactors R of all rows, else bounded.
//!
//! If R is too large, several groups are excluded in one round. No other excluded group may be on the same point, and each must satisfy
//!
//! sqrt T_j - sum over the selected i of sqrt(h_i h_j T_i) > sqrt(limit)
//!
//! with h of the bound of correlations ([`crate::adjustment::GroupTest::shared`]). Then the remainder of j is significant for any effect of
//! the selected groups. Only groups that share a photo count. Groups of one point are conditioned exactly.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::super::NetworkError;
use super::super::group_tests::{TestOfGroup, Tests};
use super::super::predictions::ResidualBlock;
use super::conditional::{Chosen, Conditional};
use super::groups::Groups;
use super::tried::Tried;
use super::unit_weight::{Criticals, Level, UnitWeight};
use crate::adjustment::GroupTest;

/// Maximum number of exclusions on one point in a round without R of all rows.
const ON_POINT: usize = 2;
/// Maximum number of trial exclusions that search for masked errors.
const AHEAD: usize = 10;

/// Candidates and criteria of a round.
pub(super) struct Choosing<'a> {
    pub groups: &'a Groups,
    /// Tests of all groups at the start of the round.
    pub tests: &'a Tests,
    pub unit: UnitWeight,
    /// Square of the factor of the standard deviations of each group.
    pub scales: &'a [f64],
    pub is_allowed: Vec<bool>,
    pub level: Level,
    /// Number of excluded groups.
    pub excluded: usize,
    /// Whether to search for masked groups if none is significant.
    pub ahead: bool,
}

impl Choosing<'_> {
    /// Returns the groups to exclude in a round, in this order.
    pub fn choose(&self, network: &mut dyn Tried) -> Result<Vec<Chosen>, NetworkError> {
        if !self.groups.is_small {
            return self.bounded(network);
        }
        let residual = self.tests.rows.iter().map(|row| row.residual).collect();
        let block = ResidualBlock {
            groups: (0..self.groups.len()).collect(),
            residual,
            cofactors: network.responses()?,
        };
        Ok(self.sequence(self.in_use(block), self.unit, usize::MAX))
    }

    /// Selects groups on points that are excluded with all their observations, each given the photos as determined by the others. Returns
    /// the selection, and the points that could be tested.
    pub fn on_gone_points(
        &self,
        network: &mut dyn Tried,
        points: &[usize],
    ) -> Result<(Vec<Chosen>, BTreeSet<usize>), NetworkError> {
        let mut blocks = network.on_points(points, true)?;
        blocks.retain(|own| !own.groups.is_empty());
        let tested = blocks.iter().filter_map(|own| self.groups.point(own.groups[0])).collect();
        let with_own = |own: ResidualBlock| {
            let test = GroupTest::new(&own.residual, &own.cofactors, None);
            let (sum, freedom) = (self.unit.sum + test.statistic, self.unit.freedom + test.rank as f64);
            (own, UnitWeight { sum, freedom, ..self.unit })
        };
        Ok((self.on_blocks(blocks.into_iter().map(with_own).collect(), usize::MAX), tested))
    }

    /// Returns a block with zeros for excluded rows.
    fn in_use(&self, mut block: ResidualBlock) -> ResidualBlock {
        let rows = block.groups.iter().flat_map(|&group| self.groups.rows(group));
        let out: Vec<usize> = rows
            .enumerate()
            .filter(|&(_, row)| self.tests.rows[row].residual.is_nan())
            .map(|(k, _)| k)
            .collect();
        let count = block.residual.len();
        for k in out {
            block.residual[k] = 0.0;
            block.cofactors[k * count..(k + 1) * count].fill(0.0);
            (0..count).for_each(|row| block.cofactors[row * count + k] = 0.0);
        }
        block
    }

    /// Selects groups of a block while the next is significant, or masks one that is.
    fn sequence(&self, block: ResidualBlock, unit: UnitWeight, most: usize) -> Vec<Chosen> {
        let mut conditional = Conditional::new(block, self.groups, self.scales, unit);
        let mut is_allowed: Vec<bool> =
            conditional.groups().iter().map(|&group| self.is_allowed[group]).collect();
        let (mut chosen, mut sure) = (vec![], 0);
        while chosen.len() < most {
            let limit = self.level.limit(self.excluded + chosen.len());
            let Some(place) = conditional.least_probable(&is_allowed) else { break };
            let is_significant = conditional.log_probability(place) < limit.ln();
            let may_mask = || {
                let scale = conditional.scale(place);
                chosen.len() < sure + AHEAD && conditional.unit.is_rejected(scale) != Some(false)
            };
            let goes_on = is_significant || (self.ahead && may_mask());
            if !goes_on {
                break;
            }
            let rows = conditional.rows_to_exclude(place);
            let mut next = conditional.exclude(place, &rows, &is_allowed, limit);
            next.first_statistic = self.tests.groups[next.group].statistic;
            is_allowed[place] = false;
            chosen.push(next);
            if is_significant {
                sure = chosen.len();
            }
        }
        chosen.truncate(sure);
        chosen
    }

    fn bounded(&self, network: &mut dyn Tried) -> Result<Vec<Chosen>, NetworkError> {
        let limit = self.level.limit(self.excluded);
        let mut critical = Criticals::new(self.unit, limit);
        let allowed = || (0..self.groups.len()).filter(|&group| self.is_allowed[group]);
        let mut candidates: Vec<usize> =
            allowed().filter(|&group| is_beyond(self.tests, self.scales, &mut critical, group)).collect();
        if candidates.is_empty() && self.ahead {
            let ratio = |group: usize| self.tests.groups[group].statistic / self.scales[group];
            let mut all: Vec<(f64, usize)> = allowed().map(|group| (-ratio(group), group)).collect();
            let most = AHEAD.min(all.len());
            if most > 0 {
                all.select_nth_unstable_by(most - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            }
            all.truncate(most);
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            candidates = all.into_iter().map(|(_, group)| group).collect();
        }
        let mut chosen = self.on_points(network, &candidates)?;
        chosen.sort_by(|a, b| {
            let by_value =
                a.log_probability.total_cmp(&b.log_probability).then(b.statistic.total_cmp(&a.statistic));
            by_value.then(a.group.cmp(&b.group))
        });
        let mut load = Load { groups: self.groups, tests: self.tests, of_photo: HashMap::new() };
        chosen.retain(|own| {
            let leaves = load.leaves(own, critical.of(own.dimension) * self.scales[own.group]);
            if leaves {
                load.add(own);
            }
            leaves
        });
        Ok(chosen)
    }

    /// Selects on the point of each candidate, or a candidate without a point itself.
    fn on_points(&self, network: &mut dyn Tried, candidates: &[usize]) -> Result<Vec<Chosen>, NetworkError> {
        let mut seen = BTreeSet::new();
        let of_point = |&group: &usize| self.groups.point(group).is_none_or(|point| seen.insert(point));
        let first: Vec<usize> = candidates.iter().copied().filter(of_point).collect();
        let points: Vec<usize> = first.iter().filter_map(|&group| self.groups.point(group)).collect();
        let mut on_points = network.on_points(&points, false)?.into_iter();
        let blocks = first.into_iter().map(|group| {
            let of_point = self.groups.point(group).and_then(|_| on_points.next());
            let block = of_point.filter(|own| !own.groups.is_empty()).map(|own| self.in_use(own));
            (block.unwrap_or_else(|| self.block_of(group)), self.unit)
        });
        Ok(self.on_blocks(blocks.collect(), ON_POINT))
    }

    fn block_of(&self, group: usize) -> ResidualBlock {
        let size = self.groups.rows(group).len();
        let cofactors = &self.tests.cofactors[self.groups.table.block_starts()[group]..][..size * size];
        let residual = self.tests.rows[self.groups.rows(group)].iter().map(|row| row.residual);
        let residual = residual.map(|value| if value.is_nan() { 0.0 } else { value }).collect();
        ResidualBlock { groups: vec![group], residual, cofactors: cofactors.to_vec() }
    }

    /// Selects in each of some blocks; blocks of equal sizes of groups in sequence.
    fn on_blocks(&self, blocks: Vec<(ResidualBlock, UnitWeight)>, most: usize) -> Vec<Chosen> {
        let mut classes: HashMap<Vec<usize>, usize> = HashMap::new();
        let mut by_class: BTreeMap<usize, Vec<Chosen>> = BTreeMap::new();
        for (block, unit) in blocks {
            let sizes = block.groups.iter().map(|&group| self.groups.rows(group).len()).collect();
            let number = classes.len();
            let class = *classes.entry(sizes).or_insert(number);
            by_class.entry(class).or_default().extend(self.sequence(block, unit, most));
        }
        by_class.into_values().flatten().collect()
    }
}

/// Returns whether T of a group exceeds its critical value.
pub(super) fn is_beyond(tests: &Tests, scales: &[f64], critical: &mut Criticals, group: usize) -> bool {
    let TestOfGroup { rank, statistic, .. } = tests.groups[group];
    rank > 0 && statistic > critical.of(rank) * scales[group]
}

/// Bound of the effects on other test values by photo: the sum of sqrt(h_i T_i).
struct Load<'a> {
    groups: &'a Groups,
    tests: &'a Tests,
    of_photo: HashMap<usize, f64>,
}

impl Load<'_> {
    fn shared(&self, group: usize) -> f64 {
        let shared = self.tests.groups[group].shared;
        if shared.is_nan() { 0.0 } else { shared }
    }

    /// Returns whether a group is significant for any effect of the selected groups.
    fn leaves(&self, chosen: &Chosen, critical: f64) -> bool {
        let photos = self.groups.own_photos(chosen.group).into_iter();
        let load = photos.filter_map(|photo| self.of_photo.get(&photo).copied()).fold(0.0, f64::max);
        let left = chosen.statistic.max(0.0).sqrt() - self.shared(chosen.group).sqrt() * load;
        load == 0.0 || left > critical.sqrt()
    }

    fn add(&mut self, chosen: &Chosen) {
        let size = (self.shared(chosen.group) * chosen.statistic.max(0.0)).sqrt();
        for photo in self.groups.own_photos(chosen.group) {
            *self.of_photo.entry(photo).or_default() += size;
        }
    }
}
