//! The order in which kept blocks are eliminated.

use std::collections::VecDeque;

use super::layout::Layout;

/// How the kept blocks are ordered for elimination.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// The cheapest of the others, by predicted operations.
    #[default]
    Auto,
    /// As they stand in the input.
    Input,
    /// Reverse Cuthill-McKee: a narrow band, the 1987 program's way (GIANT guide, Appendix A).
    ReverseCuthillMckee,
}

impl Ordering {
    /// The orderings to try: itself, or all of them for [`Ordering::Auto`].
    pub fn candidates(self) -> &'static [Ordering] {
        match self {
            Ordering::Auto => &[Ordering::Input, Ordering::ReverseCuthillMckee],
            Ordering::Input => &[Ordering::Input],
            Ordering::ReverseCuthillMckee => &[Ordering::ReverseCuthillMckee],
        }
    }

    /// The name under which reports and options know it.
    pub fn name(self) -> &'static str {
        match self {
            Ordering::Auto => "auto",
            Ordering::Input => "input",
            Ordering::ReverseCuthillMckee => "rcm",
        }
    }

    /// The blocks of a graph in the order of their elimination.
    pub(crate) fn order(self, graph: &Graph) -> Vec<usize> {
        match self {
            Ordering::Auto | Ordering::Input => (0..graph.len()).collect(),
            Ordering::ReverseCuthillMckee => reverse_cuthill_mckee(graph),
        }
    }
}

/// Which kept blocks share a local block: an undirected graph in compressed form, neighbours ascending.
#[derive(Debug, Clone)]
pub struct Graph {
    ptr: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Graph {
    /// Joins every two kept blocks that share a local block.
    pub fn new(layout: &Layout) -> Self {
        let kept = layout.kept();
        let mut locals_of = vec![Vec::new(); kept];
        for local in 0..layout.locals() {
            for group in layout.groups_of(local) {
                let list: &mut Vec<usize> = &mut locals_of[layout.kept_of(group)];
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
            for &local in locals {
                for group in layout.groups_of(local) {
                    let other = layout.kept_of(group);
                    if seen_by[other] != block {
                        seen_by[other] = block;
                        neighbours.push(other as u32);
                    }
                }
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

    /// The blocks that share a local block with `block`.
    pub fn neighbours(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighbours[self.ptr[block]..self.ptr[block + 1]].iter().map(|&other| other as usize)
    }

    fn degree(&self, block: usize) -> usize {
        self.ptr[block + 1] - self.ptr[block]
    }

    /// The blocks reachable from `start` among those not yet `done`, breadth first, neighbours by rising degree;
    /// with the number of levels.
    fn breadth_first(&self, start: usize, done: &[bool]) -> (Vec<usize>, usize) {
        let mut level = std::collections::HashMap::from([(start, 1)]);
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
}

/// Reverse Cuthill-McKee from a pseudo-peripheral block of each component (George and Liu, 1981, chapter 4).
fn reverse_cuthill_mckee(graph: &Graph) -> Vec<usize> {
    let mut done = vec![false; graph.len()];
    let mut order = Vec::with_capacity(graph.len());
    for seed in 0..graph.len() {
        if done[seed] {
            continue;
        }
        let (mut component, mut levels) = graph.breadth_first(seed, &done);
        // The last block reached lies farthest out: start again there as long as that deepens the structure.
        while let Some(&far) = component.last() {
            let (deeper, more) = graph.breadth_first(far, &done);
            if more <= levels {
                break;
            }
            (component, levels) = (deeper, more);
        }
        for &block in &component {
            done[block] = true;
        }
        order.extend(component);
    }
    order.reverse();
    order
}
