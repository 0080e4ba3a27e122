//! Graph of the retained blocks: edges are nonzero blocks of the reduced normal equations.

use super::layout::Layout;
use crate::parallel;

/// Minimum number of retained blocks for several threads.
pub(super) const MANY: usize = 500;

/// Position of a block that is not in a list.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// Undirected graph of retained blocks in compressed form, neighbours ascending. Edges: a shared local block, term, contribution or pair.
#[derive(Debug, Clone)]
pub struct Graph {
    ptr: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Builds the graph of a layout.
    pub fn new(layout: &Layout) -> Self {
        let retained = layout.retained();
        let terms = layout.terms().iter().map(|term| &term.retained[..]);
        let contributions = layout.contributions().iter().map(|blocks| &blocks[..]);
        let pairs = layout.pairs().iter().map(|pair| &pair[..]);
        let terms: Vec<&[u32]> = terms.chain(contributions).chain(pairs).collect();
        let mut terms_of = vec![Vec::new(); retained];
        for (index, term) in terms.iter().enumerate() {
            term.iter().for_each(|&block| terms_of[block as usize].push(index));
        }
        let (unit_ptr, units) = units_by_block(layout);
        let joined = |seen_by: &mut Vec<u32>, block: usize| {
            let mut neighbours = Vec::new();
            seen_by[block] = block as u32;
            let mut join = |other: u32| {
                if std::mem::replace(&mut seen_by[other as usize], block as u32) != block as u32 {
                    neighbours.push(other);
                }
            };
            for &unit in &units[unit_ptr[block]..unit_ptr[block + 1]] {
                layout.main_blocks_of(unit as usize).iter().copied().for_each(&mut join);
                layout.all_shared_of(unit as usize).iter().copied().for_each(&mut join);
            }
            for &term in &terms_of[block] {
                terms[term].iter().copied().for_each(&mut join);
            }
            neighbours.sort_unstable();
            neighbours
        };
        let unseen = || vec![u32::MAX; retained];
        let all: Vec<Vec<u32>> = if retained < MANY {
            let mut seen_by = unseen();
            (0..retained).map(|block| joined(&mut seen_by, block)).collect()
        } else {
            parallel::by_parts(retained, MANY / 4, &|blocks| {
                let mut seen_by = unseen();
                blocks.map(|block| joined(&mut seen_by, block)).collect()
            })
        };
        let mut ptr = vec![0];
        ptr.extend(all.iter().scan(0, |end, own| {
            *end += own.len();
            Some(*end)
        }));
        Self { ptr, neighbours: all.concat() }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.ptr.len() - 1
    }

    /// Whether the graph is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the blocks that share a local block, term, contribution or requested pair with `block`.
    pub fn neighbours(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighbours[self.ptr[block]..self.ptr[block + 1]].iter().map(|&other| other as usize)
    }

    pub(crate) fn degree(&self, block: usize) -> usize {
        self.ptr[block + 1] - self.ptr[block]
    }

    /// Returns the blocks reachable from `start` that are not `done`, in breadth-first order, neighbours by rising degree. Also returns the
    /// number of levels. `level` is zeroed scratch memory for the level of every block, and zeroed again at the end.
    fn breadth_first(&self, start: usize, done: &[bool], level: &mut [u32]) -> (Vec<usize>, u32) {
        level[start] = 1;
        let mut order = vec![start];
        let mut next = 0;
        while let Some(&block) = order.get(next) {
            next += 1;
            let first = order.len();
            order.extend(self.neighbours(block).filter(|&other| !done[other] && level[other] == 0));
            order[first..].iter().for_each(|&other| level[other] = level[block] + 1);
            order[first..].sort_unstable_by_key(|&other| (self.degree(other), other));
        }
        let levels = order.last().map_or(0, |&last| level[last]);
        order.iter().for_each(|&block| level[block] = 0);
        (order, levels)
    }

    /// Returns the subgraph of some blocks, numbered as in the list. `place` is scratch memory for the index of every block, filled with
    /// [`NOWHERE`] before and after.
    pub(crate) fn subgraph(&self, members: &[usize], place: &mut [u32]) -> Self {
        members.iter().zip(0..).for_each(|(&block, new)| place[block] = new);
        let mut part = Self { ptr: vec![0], neighbours: Vec::new() };
        for &block in members {
            let start = part.neighbours.len();
            let inside = self.neighbours(block).map(|other| place[other]).filter(|&new| new != NOWHERE);
            part.neighbours.extend(inside);
            part.neighbours[start..].sort_unstable();
            part.ptr.push(part.neighbours.len());
        }
        members.iter().for_each(|&block| place[block] = NOWHERE);
        part
    }

    /// Returns all blocks breadth first from a pseudo-peripheral block of each component (George and Liu 1981, chapter 4).
    pub(crate) fn breadth_first_line(&self) -> Vec<usize> {
        let (mut done, mut level) = (vec![false; self.len()], vec![0; self.len()]);
        let mut line = Vec::with_capacity(self.len());
        for seed in 0..self.len() {
            if done[seed] {
                continue;
            }
            let (mut component, mut levels) = self.breadth_first(seed, &done, &mut level);
            // Restart from the last block reached, the farthest, as long as the number of levels increases.
            while let Some(&far) = component.last() {
                let (deeper, more) = self.breadth_first(far, &done, &mut level);
                if more <= levels {
                    break;
                }
                (component, levels) = (deeper, more);
            }
            component.iter().for_each(|&block| done[block] = true);
            line.extend(component);
        }
        line
    }

    /// Returns the start of each block's neighbours, and the neighbours; None if a start exceeds 32 bits.
    pub(crate) fn compressed(&self) -> Option<(Vec<u32>, &[u32])> {
        let starts: Result<Vec<u32>, _> = self.ptr.iter().map(|&start| u32::try_from(start)).collect();
        Some((starts.ok()?, &self.neighbours))
    }
}

/// Returns the start of the units of every retained block, and the units, each once per block.
fn units_by_block(layout: &Layout) -> (Vec<usize>, Vec<u32>) {
    let mut last = vec![u32::MAX; layout.retained()];
    let mut each = |take: &mut dyn FnMut(usize, u32)| {
        last.fill(u32::MAX);
        for unit in 0..layout.units() {
            for &block in layout.main_blocks_of(unit).iter().chain(layout.all_shared_of(unit)) {
                if std::mem::replace(&mut last[block as usize], unit as u32) != unit as u32 {
                    take(block as usize, unit as u32);
                }
            }
        }
    };
    let mut ptr = vec![0; layout.retained() + 1];
    each(&mut |block, _| ptr[block + 1] += 1);
    (0..layout.retained()).for_each(|block| ptr[block + 1] += ptr[block]);
    let (mut next, mut units) = (ptr.clone(), vec![0; ptr[layout.retained()]]);
    each(&mut |block, unit| {
        units[next[block]] = unit;
        next[block] += 1;
    });
    (ptr, units)
}
