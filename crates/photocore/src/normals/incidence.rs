//! Which front each local block is eliminated into.

use super::layout::Layout;
use super::symbolic::Symbolic;

/// Local blocks that are eliminated side by side at the most: their equations stay in the cache.
const MOST: usize = 16;

/// The groups of every local block by the position of their kept blocks in the order of elimination, and the local blocks by
/// their *home*: the supernode of the first of these positions. All kept blocks of a local block are in the pattern of
/// its home, so that what the elimination of the local block leaves goes into one front.
#[derive(Debug)]
pub(super) struct Incidence {
    groups: Vec<u32>,
    positions: Vec<u32>,
    /// The local blocks by home, those of the same pattern side by side.
    by_home: Vec<u32>,
    /// Where those of each supernode start; then those that have no equations.
    home_ptr: Vec<usize>,
}

impl Incidence {
    pub fn new(layout: &Layout, symbolic: &Symbolic) -> Self {
        let mut sorted: Vec<(u32, u32)> = Vec::with_capacity(layout.groups());
        for local in 0..layout.locals() {
            let start = sorted.len();
            let place = |g: usize| (symbolic.position(layout.kept_of(g)) as u32, g as u32);
            sorted.extend(layout.groups_of(local).map(place));
            sorted[start..].sort_unstable();
        }
        let (positions, groups): (Vec<u32>, Vec<u32>) = sorted.into_iter().unzip();
        let home = |local: u32| match layout.groups_of(local as usize) {
            groups if groups.is_empty() => symbolic.supernode_count(),
            groups => symbolic.supernode_of(positions[groups.start] as usize),
        };
        let mut by_home: Vec<u32> = (0..layout.locals() as u32).collect();
        // Ascending positions, so ascending homes; a block without any comes last.
        by_home.sort_unstable_by_key(|&local| {
            let groups = layout.groups_of(local as usize);
            (groups.is_empty(), &positions[groups], local)
        });
        let mut home_ptr = vec![0; symbolic.supernode_count() + 2];
        by_home.iter().for_each(|&local| home_ptr[home(local) + 1] += 1);
        for index in 1..home_ptr.len() {
            home_ptr[index] += home_ptr[index - 1];
        }
        Self { groups, positions, by_home, home_ptr }
    }

    /// The groups of a local block, by position.
    pub fn groups_of(&self, layout: &Layout, local: usize) -> &[u32] {
        &self.groups[layout.groups_of(local)]
    }

    /// The positions of the groups of a local block.
    pub fn positions_of(&self, layout: &Layout, local: usize) -> &[u32] {
        &self.positions[layout.groups_of(local)]
    }

    /// All local blocks, by home.
    pub fn locals(&self) -> &[u32] {
        &self.by_home
    }

    /// The local blocks whose home is a supernode; after the last supernode those without equations.
    pub fn locals_at(&self, supernode: usize) -> &[u32] {
        &self.by_home[self.home_ptr[supernode]..self.home_ptr[supernode + 1]]
    }

    /// Cuts local blocks of one home into stacks: runs of blocks whose equations touch the same unknowns in the same way.
    pub fn stacks<'a>(&'a self, layout: &'a Layout, locals: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
        let borders = |local: u32| {
            let groups = self.groups_of(layout, local as usize).iter();
            groups.map(|&group| layout.border_of(group as usize))
        };
        let alike = move |a: &u32, b: &u32| {
            let positions = |local: u32| self.positions_of(layout, local as usize);
            positions(*a) == positions(*b) && (layout.border_dim() == 0 || borders(*a).eq(borders(*b)))
        };
        locals.chunk_by(alike).flat_map(|run| run.chunks(MOST))
    }
}
