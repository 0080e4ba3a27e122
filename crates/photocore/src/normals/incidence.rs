//! Which front each local block is eliminated into.

use std::collections::HashMap;
use std::ops::Range;

use rayon::prelude::*;
use smallvec::SmallVec;

use super::layout::Layout;
use super::symbolic::Symbolic;
use crate::parallel;

/// Local blocks from which on several threads sort them, and how many of them are taken together.
const MANY: usize = 10_000;
const TOGETHER: usize = 2048;
/// Units that are eliminated side by side at the most: their equations stay in the cache.
const MOST: usize = 16;

/// The groups of every local block by the position of their main blocks in the order of elimination, and the units of the layout by their
/// *assembly node*: the supernode of the first position of all retained blocks they touch. All of them are in the pattern of the node, so
/// that what the elimination of the unit leaves goes into one front.
#[derive(Debug)]
pub(super) struct Incidence {
    groups: Vec<u32>,
    positions: Vec<u32>,
    /// The units by node, those of the same pattern side by side.
    by_node: Vec<u32>,
    /// Where the local blocks and, behind them, the groups apart of each supernode start; then those that have no equations.
    node_ptr: Vec<usize>,
    /// Where each batch starts: a run of units of one node whose equations touch the same unknowns in the same way.
    batch_ptr: Vec<usize>,
    /// What each of the groups has in common with others, as a number; empty where none has anything.
    commons: Vec<u32>,
    /// One group that has it, of each of these.
    group_with: Vec<u32>,
    /// All that the groups of each unit have in common with others, as the number of a set; empty where none has anything.
    sets: Vec<u32>,
    /// What is in each set, ascending: photos of two cameras alternate, and see points with one before the other or after it.
    members: Vec<Vec<u32>>,
}

impl Incidence {
    pub fn new(layout: &Layout, symbolic: &Symbolic) -> Self {
        let starts = (0..layout.locals()).step_by(TOGETHER);
        let ranges: Vec<Range<usize>> =
            starts.map(|first| first..(first + TOGETHER).min(layout.locals())).collect();
        let placed = |range: &Range<usize>| placed(layout, symbolic, range.clone());
        let is_many = layout.locals() >= MANY;
        let pieces: Vec<(Vec<[u32; 2]>, Vec<Keyed>)> = if is_many {
            parallel::map_each(ranges.iter().collect(), &placed)
        } else {
            ranges.iter().map(placed).collect()
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
        let runs = incidence.by_node.chunk_by(|&a, &b| incidence.alike(layout, a as usize, b as usize));
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

    /// Numbers the sets of what the groups of units have in common with others. Neighbours nearly always have the same.
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

    /// Whether the equations of two units touch the same unknowns in the same way.
    fn alike(&self, layout: &Layout, a: usize, b: usize) -> bool {
        layout.is_apart(a) == layout.is_apart(b)
            && self.positions_of(layout, a) == self.positions_of(layout, b)
            && self.commons_of(layout, a) == self.commons_of(layout, b)
    }

    /// The groups of a unit, by position.
    pub fn groups_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        &self.groups[layout.groups_of_unit(unit)]
    }

    /// The positions of the main blocks of the groups of a unit.
    pub fn positions_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        &self.positions[layout.groups_of_unit(unit)]
    }

    /// What each group of a unit has in common with others, as a number; empty where none has anything.
    pub fn commons_of(&self, layout: &Layout, unit: usize) -> &[u32] {
        self.commons.get(layout.groups_of_unit(unit)).unwrap_or_default()
    }

    /// The set of all that the groups of a unit have in common with others.
    pub fn set_of(&self, unit: usize) -> u32 {
        self.sets.get(unit).copied().unwrap_or_default()
    }

    /// What is in a set, ascending.
    pub fn members(&self, set: u32) -> &[u32] {
        &self.members[set as usize]
    }

    /// A group that has in common with others what has this number.
    pub fn group_with(&self, shared: u32) -> usize {
        self.group_with[shared as usize] as usize
    }

    /// The units whose node is a supernode; after the last supernode those without equations.
    pub fn units_at(&self, supernode: usize) -> &[u32] {
        &self.by_node[self.node_ptr[2 * supernode]..self.node_ptr[2 * supernode + 2]]
    }

    /// All batches, by node.
    fn batches(&self) -> Batches<'_> {
        Batches { units: &self.by_node, ptr: &self.batch_ptr }
    }

    /// The batches of a supernode; after the last supernode those of the units without equations.
    pub fn batches_at(&self, supernode: usize) -> Batches<'_> {
        self.batches_between(2 * supernode..2 * supernode + 2)
    }

    /// Of these those of local blocks, whose elimination leaves something to others.
    pub fn batches_of_locals_at(&self, supernode: usize) -> Batches<'_> {
        self.batches_between(2 * supernode..2 * supernode + 1)
    }

    fn batches_between(&self, nodes: Range<usize>) -> Batches<'_> {
        let place = |start: usize| self.batch_ptr.partition_point(|&end| end < start);
        let (first, last) = (place(self.node_ptr[nodes.start]), place(self.node_ptr[nodes.end]));
        Batches { units: &self.by_node, ptr: &self.batch_ptr[first..=last] }
    }
}

/// Numbers what groups have in common with others: that of each group, none where no group has anything, and a group that has it of each
/// number. The images of one photo nearly always have the same.
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

/// A unit, and what it is sorted by before all else: its node and whether it is a group apart, and the first three of its positions, zero
/// where there are fewer.
type Keyed = (u128, u32);

/// Bits of a key below the node.
const HOME: u32 = 96;

/// The positions and groups of some local blocks, by position unless they stand apart, and the keys of their units.
fn placed(layout: &Layout, symbolic: &Symbolic, locals: Range<usize>) -> (Vec<[u32; 2]>, Vec<Keyed>) {
    let (mut sorted, mut keyed) = (Vec::new(), Vec::with_capacity(locals.len()));
    let key = |unit: usize, own: &[[u32; 2]]| {
        let node = node(layout, symbolic, unit, own.first().map(|&[position, _]| position as usize));
        let home = 2 * node as u128 + u128::from(layout.is_apart(unit));
        let first = |key: u128, k: usize| key << 32 | own.get(k).map_or(0, |own| u128::from(own[0]) + 1);
        ((0..3).fold(home, first), unit as u32)
    };
    for local in locals {
        let start = sorted.len();
        let place = |g: usize| [symbolic.position(layout.retained_of(g)) as u32, g as u32];
        sorted.extend(layout.groups_of(local).map(place));
        let (own, apart) = (&mut sorted[start..], layout.apart_of(local));
        if apart.is_empty() {
            own.sort_unstable();
            keyed.push(key(local, own));
        } else {
            keyed.push(key(local, &[]));
            keyed.extend(apart.zip(own.chunks(1)).map(|(unit, own)| key(unit, own)));
        }
    }
    (sorted, keyed)
}

/// The node of a unit, from the first position of its main blocks; after the last supernode where it has no equations.
fn node(layout: &Layout, symbolic: &Symbolic, unit: usize, first: Option<usize>) -> usize {
    let shared = layout.all_shared_of(unit).iter().map(|&block| symbolic.position(block as usize));
    let first = shared.chain(first).min();
    first.map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
}

/// Consecutive batches.
#[derive(Clone, Copy)]
pub(super) struct Batches<'a> {
    units: &'a [u32],
    ptr: &'a [usize],
}

impl<'a> Batches<'a> {
    /// Their units, batch by batch.
    pub fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        self.ptr.windows(2).map(move |ends| &self.units[ends[0]..ends[1]])
    }

    /// How many units they have.
    pub fn units(self) -> usize {
        self.ptr[self.ptr.len() - 1] - self.ptr[0]
    }

    /// Parts of so many batches at the most.
    pub fn parts(self, most: usize) -> Vec<Self> {
        let starts = (0..self.ptr.len() - 1).step_by(most);
        starts
            .map(|first| Self { ptr: &self.ptr[first..=(first + most).min(self.ptr.len() - 1)], ..self })
            .collect()
    }
}
