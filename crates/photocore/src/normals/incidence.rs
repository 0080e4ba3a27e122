//! Assignment of local blocks to the fronts into which they are eliminated.

use std::collections::HashMap;
use std::ops::Range;

use rayon::prelude::*;
use smallvec::SmallVec;

use super::layout::Layout;
use super::symbolic::Symbolic;
use crate::parallel;

/// Minimum number of local blocks for sorting with several threads, and local blocks per task.
const MANY: usize = 10_000;
const TOGETHER: usize = 2048;
/// Maximum number of units that are eliminated as one batch; their equations fit into the cache.
const MOST: usize = 16;

/// Groups of every local block by position of their main blocks, and units by *assembly node*. The node is the supernode of the first
/// eliminated block of a unit. Its pattern contains all blocks of the unit, so that the Schur complement is added to a single front.
#[derive(Debug)]
pub(super) struct Incidence {
    groups: Vec<u32>,
    positions: Vec<u32>,
    /// Units by node; units of the same pattern are adjacent.
    by_node: Vec<u32>,
    /// Start of the local blocks and of the independent groups of each supernode; last, units without equations.
    node_ptr: Vec<usize>,
    /// Start of each batch: consecutive units of one node with identical patterns.
    batch_ptr: Vec<usize>,
    /// Index of the shared block list of each group; empty if no group has shared blocks.
    commons: Vec<u32>,
    /// Example group for each of these lists.
    group_with: Vec<u32>,
    /// Index of the set of shared block lists of each unit; empty if no group has shared blocks.
    sets: Vec<u32>,
    /// Lists in each set, ascending: photos of two cameras may alternate in any order.
    members: Vec<Vec<u32>>,
}

impl Incidence {
    pub fn new(layout: &Layout, symbolic: &Symbolic) -> Self {
        let starts = (0..layout.locals()).step_by(TOGETHER);
        let ranges: Vec<Range<usize>> =
            starts.map(|first| first..(first + TOGETHER).min(layout.locals())).collect();
        let with_sort_keys = |range: &Range<usize>| with_sort_keys(layout, symbolic, range.clone());
        let is_many = layout.locals() >= MANY;
        let pieces: Vec<(Vec<[u32; 2]>, Vec<Keyed>)> = if is_many {
            parallel::map_each(ranges.iter().collect(), &with_sort_keys)
        } else {
            ranges.iter().map(with_sort_keys).collect()
        };
        let sorted = || pieces.iter().flat_map(|(sorted, _)| sorted);
        let positions: Vec<u32> = sorted().map(|&[position, _]| position).collect();
        let groups: Vec<u32> = sorted().map(|&[_, group]| group).collect();
        let mut keyed: Vec<Keyed> = pieces.iter().flat_map(|(_, keyed)| keyed).copied().collect();
        let shared = |unit: u32| {
            let own = if layout.has_shared() { layout.groups_of_unit(unit as usize) } else { 0..0 };
            groups[own].iter().map(|&group| layout.shared_of(group as usize))
        };
        let own = |unit: u32| &positions[layout.groups_of_unit(unit as usize)];
        let compare = |&(first, a): &Keyed, &(second, b): &Keyed| {
            let in_full = || own(a).cmp(own(b)).then_with(|| shared(a).cmp(shared(b)));
            first.cmp(&second).then_with(in_full).then(a.cmp(&b))
        };
        if is_many {
            keyed.par_sort_unstable_by(compare);
        } else {
            keyed.sort_unstable_by(compare);
        }
        let by_node = keyed.iter().map(|&(_, unit)| unit).collect();
        let mut node_ptr = vec![0; 2 * symbolic.supernode_count() + 3];
        keyed.iter().for_each(|&(key, _)| node_ptr[(key >> HOME) as usize + 1] += 1);
        for index in 1..node_ptr.len() {
            node_ptr[index] += node_ptr[index - 1];
        }
        let (numbers, group_with) = commons(layout);
        let mut commons = vec![0; if numbers.is_empty() { 0 } else { groups.len() }];
        parallel::each_chunk(&mut commons, MANY, &|part, commons| {
            let groups = &groups[part * MANY..];
            commons.iter_mut().zip(groups).for_each(|(common, &group)| *common = numbers[group as usize]);
        });
        let (batch_ptr, sets, members) = (vec![0], Vec::new(), vec![Vec::new()]);
        let mut incidence =
            Self { groups, positions, by_node, node_ptr, batch_ptr, commons, group_with, sets, members };
        let runs =
            incidence.by_node.chunk_by(|&a, &b| incidence.has_equal_pattern(layout, a as usize, b as usize));
        let lengths: Vec<usize> = runs.flat_map(|run| run.chunks(MOST)).map(<[u32]>::len).collect();
        let mut end = 0;
        incidence.batch_ptr.extend(lengths.into_iter().map(|length| {
            end += length;
            end
        }));
        if !incidence.commons.is_empty() {
            incidence.find_sets(layout);
        }
        incidence
    }

    /// Numbers the sets of shared block lists of the units. Consecutive units usually have the same set.
    fn find_sets(&mut self, layout: &Layout) {
        let mut known: HashMap<SmallVec<[u32; 16]>, u32> = HashMap::from([(SmallVec::new(), 0)]);
        let (mut sets, mut members, mut last) = (vec![0; layout.units()], vec![Vec::new()], 0);
        for units in self.batches().iter() {
            let mut own = SmallVec::from(self.commons_of(layout, units[0] as usize));
            own.sort_unstable();
            own.dedup();
            if members[last as usize][..] != own[..] {
                last = *known.entry(own).or_insert_with_key(|own| {
                    members.push(own.to_vec());
                    members.len() as u32 - 1
                });
            }
            units.iter().for_each(|&unit| sets[unit as usize] = last);
        }
        (self.sets, self.members) = (sets, members);
    }

    /// Whether the equations of two units have identical patterns.
    fn has_equal_pattern(&self, layout: &Layout, a: usize, b: usize) -> bool {
        layout.is_uncoupled(a) == layout.is_uncoupled(b)
            && self.positions_of(layout, a) == self.positions_of(layout, b)
            && self.commons_of(layout, a) == self.commons_of(layout, b)
    }

    /// Returns the groups of a unit, by position.
    pub fn groups_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        &self.groups[layout.groups_of_unit(unit)]
    }

    /// Returns the positions of the main blocks of the groups of a unit.
    pub fn positions_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        &self.positions[layout.groups_of_unit(unit)]
    }

    /// Returns the index of the shared block list of each group of a unit; empty if no group has shared blocks.
    pub fn commons_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        self.commons.get(layout.groups_of_unit(unit)).unwrap_or_default()
    }

    /// Returns the set of shared block lists of a unit.
    pub fn set_of(&self, unit: usize) -> u32 {
        self.sets.get(unit).copied().unwrap_or_default()
    }

    /// Returns the lists in a set, ascending.
    pub fn members(&self, set: u32) -> &[u32] {
        &self.members[set as usize]
    }

    /// Returns a group with this shared block list.
    pub fn group_with(&self, shared: u32) -> usize {
        self.group_with[shared as usize] as usize
    }

    /// Returns the units of a supernode; after the last supernode, units without equations.
    pub fn units_at(&self, supernode: usize) -> &[u32] {
        &self.by_node[self.node_ptr[2 * supernode]..self.node_ptr[2 * supernode + 2]]
    }

    /// Returns all batches, by node.
    fn batches(&self) -> Batches<'_> {
        Batches { units: &self.by_node, ptr: &self.batch_ptr }
    }

    /// Returns the batches of a supernode; after the last supernode, batches of units without equations.
    pub fn batches_at(&self, supernode: usize) -> Batches<'_> {
        self.batches_between(2 * supernode..2 * supernode + 2)
    }

    /// Returns the batches of local blocks only, whose elimination leaves a contribution.
    pub fn batches_of_locals_at(&self, supernode: usize) -> Batches<'_> {
        self.batches_between(2 * supernode..2 * supernode + 1)
    }

    fn batches_between(&self, nodes: Range<usize>) -> Batches<'_> {
        let place = |start: usize| self.batch_ptr.partition_point(|&end| end < start);
        let (first, last) = (place(self.node_ptr[nodes.start]), place(self.node_ptr[nodes.end]));
        Batches { units: &self.by_node, ptr: &self.batch_ptr[first..=last] }
    }
}

/// Numbers the distinct shared block lists. Returns the number of each group, empty without shared blocks, and an example group for each
/// list. Image observations of one photo usually have the same list.
fn commons(layout: &Layout) -> (Vec<u32>, Vec<u32>) {
    if !layout.has_shared() {
        return (Vec::new(), Vec::new());
    }
    let mut group_with: Vec<u32> = Vec::new();
    let mut known: HashMap<&[u32], u32> = HashMap::new();
    let mut last: Vec<Option<u32>> = vec![None; layout.retained()];
    let number = |group: usize| {
        let own = &mut last[layout.retained_of(group)];
        let is_same =
            |shared: u32| layout.shared_of(group_with[shared as usize] as usize) == layout.shared_of(group);
        if let Some(shared) = own.filter(|&shared| is_same(shared)) {
            return shared;
        }
        let shared = *known.entry(layout.shared_of(group)).or_insert_with(|| {
            group_with.push(group as u32);
            group_with.len() as u32 - 1
        });
        *own = Some(shared);
        shared
    };
    let numbers = (0..layout.groups()).map(number).collect();
    (numbers, group_with)
}

/// Unit with its sort key: node, independence flag and first three positions (zero if missing).
type Keyed = (u128, u32);

/// Bits of a key below the node.
const HOME: u32 = 96;

/// Returns positions and groups of some local blocks, by position unless independent, and the sort keys of their units.
fn with_sort_keys(layout: &Layout, symbolic: &Symbolic, locals: Range<usize>) -> (Vec<[u32; 2]>, Vec<Keyed>) {
    let (mut sorted, mut keyed) = (Vec::new(), Vec::with_capacity(locals.len()));
    let key = |unit: usize, own: &[[u32; 2]]| {
        let node = node(layout, symbolic, unit, own.first().map(|&[position, _]| position as usize));
        let home = 2 * node as u128 + u128::from(layout.is_uncoupled(unit));
        let first = |key: u128, k: usize| key << 32 | own.get(k).map_or(0, |own| u128::from(own[0]) + 1);
        ((0..3).fold(home, first), unit as u32)
    };
    for local in locals {
        let start = sorted.len();
        let place = |g: usize| [symbolic.position(layout.retained_of(g)) as u32, g as u32];
        sorted.extend(layout.groups_of(local).map(place));
        let (own, uncoupled) = (&mut sorted[start..], layout.uncoupled_of(local));
        if uncoupled.is_empty() {
            own.sort_unstable();
            keyed.push(key(local, own));
        } else {
            keyed.push(key(local, &[]));
            keyed.extend(uncoupled.zip(own.chunks(1)).map(|(unit, own)| key(unit, own)));
        }
    }
    (sorted, keyed)
}

/// Returns the node of a unit, from the first position of its main blocks; after the last supernode if it has no equations.
fn node(layout: &Layout, symbolic: &Symbolic, unit: usize, first: Option<usize>) -> usize {
    let shared = layout.all_shared_of(unit).iter().map(|&block| symbolic.position(block as usize));
    let first = shared.chain(first).min();
    first.map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
}

/// Range of consecutive batches.
#[derive(Clone, Copy)]
pub(super) struct Batches<'a> {
    units: &'a [u32],
    ptr: &'a [usize],
}

impl<'a> Batches<'a> {
    /// Returns the units of each batch.
    pub fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        self.ptr.windows(2).map(move |ends| &self.units[ends[0]..ends[1]])
    }

    /// Number of units in all batches.
    pub fn units(self) -> usize {
        self.ptr[self.ptr.len() - 1] - self.ptr[0]
    }

    /// Splits into parts of at most `most` batches.
    pub fn parts(self, most: usize) -> Vec<Self> {
        let starts = (0..self.ptr.len() - 1).step_by(most);
        starts
            .map(|first| Self { ptr: &self.ptr[first..=(first + most).min(self.ptr.len() - 1)], ..self })
            .collect()
    }
}
