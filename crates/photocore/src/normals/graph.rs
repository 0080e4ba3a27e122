//! Which kept blocks share a local block, a tie or what a system below leaves.

use std::collections::{HashMap, VecDeque};

use super::layout::Layout;

/// Which kept blocks share a local block, a tie or what a system below leaves: an undirected graph in compressed form, neighbours ascending.
#[derive(Debug, Clone)]
pub struct Graph {
    ptr: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Joins every two kept blocks that share one.
    pub fn new(layout: &Layout) -> Self {
        let kept = layout.kept();
        let ties = layout.ties().iter().map(|tie| &tie.kept);
        let ties: Vec<&Vec<u32>> = ties.chain(layout.contributions()).collect();
        let mut ties_of = vec![Vec::new(); kept];
        for (index, tie) in ties.iter().enumerate() {
            tie.iter().for_each(|&block| ties_of[block as usize].push(index));
        }
        let mut locals_of = vec![Vec::new(); kept];
        for local in 0..layout.locals() {
            for block in layout.groups_of(local).flat_map(|group| layout.blocks_of(group)) {
                let list: &mut Vec<usize> = &mut locals_of[block];
                if list.last() != Some(&local) {
                    list.push(local);
                }
            }
        }
        let mut ptr = vec![0];
        let mut neighbours = Vec::new();
        let mut seen_by = vec![usize::MAX; kept];
        for (block, locals) in locals_of.iter().enumerate() {
            seen_by[block] = block;
            let start = neighbours.len();
            let mut join = |other: usize| {
                if seen_by[other] != block {
                    seen_by[other] = block;
                    neighbours.push(other as u32);
                }
            };
            for &local in locals {
                layout.groups_of(local).flat_map(|group| layout.blocks_of(group)).for_each(&mut join);
            }
            for &tie in &ties_of[block] {
                ties[tie].iter().for_each(|&other| join(other as usize));
            }
            neighbours[start..].sort_unstable();
            ptr.push(neighbours.len());
        }
        Self { ptr, neighbours }
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.ptr.len() - 1
    }

    /// Whether there are no blocks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The blocks that share a local block or a tie with `block`.
    pub fn neighbours(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighbours[self.ptr[block]..self.ptr[block + 1]].iter().map(|&other| other as usize)
    }

    pub(crate) fn degree(&self, block: usize) -> usize {
        self.ptr[block + 1] - self.ptr[block]
    }

    /// The blocks reachable from `start` among those not yet `done`, breadth first, neighbours by rising degree;
    /// with the number of levels.
    pub(crate) fn breadth_first(&self, start: usize, done: &[bool]) -> (Vec<usize>, usize) {
        let mut level = HashMap::from([(start, 1)]);
        let mut order = vec![start];
        let mut queue = VecDeque::from([start]);
        let mut levels = 1;
        while let Some(block) = queue.pop_front() {
            let next = level[&block] + 1;
            let mut fresh: Vec<usize> =
                self.neighbours(block).filter(|other| !done[*other] && !level.contains_key(other)).collect();
            fresh.sort_by_key(|&other| (self.degree(other), other));
            for other in fresh {
                level.insert(other, next);
                levels = next;
                order.push(other);
                queue.push_back(other);
            }
        }
        (order, levels)
    }

    /// The graph of some blocks among themselves, counted as in the list.
    pub(crate) fn subgraph(&self, members: &[usize]) -> Self {
        let index: HashMap<usize, u32> = members.iter().zip(0..).map(|(&block, new)| (block, new)).collect();
        let mut part = Self { ptr: vec![0], neighbours: Vec::new() };
        for &block in members {
            let start = part.neighbours.len();
            part.neighbours.extend(self.neighbours(block).filter_map(|other| index.get(&other)));
            part.neighbours[start..].sort_unstable();
            part.ptr.push(part.neighbours.len());
        }
        part
    }

    /// All blocks breadth first from a pseudo-peripheral block of each component (George and Liu 1981, chapter 4).
    pub(crate) fn breadth_first_line(&self) -> Vec<usize> {
        let mut done = vec![false; self.len()];
        let mut line = Vec::with_capacity(self.len());
        for seed in 0..self.len() {
            if done[seed] {
                continue;
            }
            let (mut component, mut levels) = self.breadth_first(seed, &done);
            // The last block reached lies farthest out: start again there as long as that deepens the structure.
            while let Some(&far) = component.last() {
                let (deeper, more) = self.breadth_first(far, &done);
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

    /// Where the neighbours of each block start, and the neighbours.
    pub(crate) fn compressed(&self) -> (Vec<u32>, &[u32]) {
        (self.ptr.iter().map(|&start| start as u32).collect(), &self.neighbours)
    }
}
