//! Which front each local block is eliminated into.

use super::layout::Layout;
use super::symbolic::Symbolic;

/// Local blocks that are eliminated side by side at the most: their equations stay in the cache.
const MOST: usize = 16;

/// The groups of every local block by the position of their main blocks in the order of elimination, and the local blocks by
/// their *home*: the supernode of the first position of all kept blocks they touch. All of them are in the pattern of
/// the home, so that what the elimination of the local block leaves goes into one front.
#[derive(Debug)]
pub(super) struct Incidence {
    groups: Vec<u32>,
    positions: Vec<u32>,
    /// The local blocks by home, those of the same pattern side by side.
    by_home: Vec<u32>,
    /// Where those of each supernode start; then those that have no equations.
    home_ptr: Vec<usize>,
    /// Where each stack starts: a run of blocks of one home whose equations touch the same unknowns in the same way.
    stack_ptr: Vec<usize>,
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
        let home = homes(layout, symbolic, &positions);
        let mut by_home: Vec<u32> = (0..layout.locals() as u32).collect();
        let further = |local: u32| {
            let own = if layout.has_further() { layout.groups_of(local as usize) } else { 0..0 };
            groups[own].iter().map(|&group| layout.further_of(group as usize))
        };
        let key = |local: u32| (home[local as usize], &positions[layout.groups_of(local as usize)]);
        by_home.sort_unstable_by(|&a, &b| {
            key(a).cmp(&key(b)).then_with(|| further(a).cmp(further(b))).then(a.cmp(&b))
        });
        let mut home_ptr = vec![0; symbolic.supernode_count() + 2];
        by_home.iter().for_each(|&local| home_ptr[home[local as usize] + 1] += 1);
        for index in 1..home_ptr.len() {
            home_ptr[index] += home_ptr[index - 1];
        }
        let mut incidence = Self { groups, positions, by_home, home_ptr, stack_ptr: vec![0] };
        let runs = incidence.by_home.chunk_by(|&a, &b| incidence.alike(layout, a as usize, b as usize));
        let lengths: Vec<usize> = runs.flat_map(|run| run.chunks(MOST)).map(<[u32]>::len).collect();
        let mut end = 0;
        incidence.stack_ptr.extend(lengths.into_iter().map(|length| {
            end += length;
            end
        }));
        incidence
    }

    /// Whether the equations of two local blocks touch the same unknowns in the same way.
    fn alike(&self, layout: &Layout, a: usize, b: usize) -> bool {
        let common = |&group: &u32| (layout.further_of(group as usize), layout.border_of(group as usize));
        let commons = |local: usize| self.groups_of(layout, local).iter().map(common);
        self.positions_of(layout, a) == self.positions_of(layout, b)
            && (!layout.has_common() || commons(a).eq(commons(b)))
    }

    /// The groups of a local block, by position.
    pub fn groups_of(&self, layout: &Layout, local: usize) -> &[u32] {
        &self.groups[layout.groups_of(local)]
    }

    /// The positions of the main blocks of the groups of a local block.
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

    /// All stacks, by home.
    pub fn stacks(&self) -> Stacks<'_> {
        Stacks { locals: &self.by_home, ptr: &self.stack_ptr }
    }

    /// The stacks of a supernode; after the last supernode those of the local blocks without equations.
    pub fn stacks_at(&self, supernode: usize) -> Stacks<'_> {
        let place = |start: usize| self.stack_ptr.partition_point(|&end| end < start);
        let (first, last) = (place(self.home_ptr[supernode]), place(self.home_ptr[supernode + 1]));
        Stacks { locals: &self.by_home, ptr: &self.stack_ptr[first..=last] }
    }
}

/// The home of every local block, from the positions of its main blocks; after the last supernode where it has no equations.
fn homes(layout: &Layout, symbolic: &Symbolic, positions: &[u32]) -> Vec<usize> {
    let home = |local: usize| {
        let groups = layout.groups_of(local);
        let further = groups.clone().flat_map(|group| layout.further_of(group));
        let further = further.map(|&block| symbolic.position(block as usize));
        let main = positions[groups].iter().map(|&position| position as usize);
        main.chain(further).min().map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
    };
    (0..layout.locals()).map(home).collect()
}

/// Consecutive stacks.
#[derive(Clone, Copy)]
pub(super) struct Stacks<'a> {
    locals: &'a [u32],
    ptr: &'a [usize],
}

impl<'a> Stacks<'a> {
    /// Their local blocks, stack by stack.
    pub fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        self.ptr.windows(2).map(move |ends| &self.locals[ends[0]..ends[1]])
    }

    /// How many local blocks they have.
    pub fn locals(self) -> usize {
        self.ptr[self.ptr.len() - 1] - self.ptr[0]
    }

    /// Parts of so many stacks at the most.
    pub fn parts(self, most: usize) -> Vec<Self> {
        let starts = (0..self.ptr.len() - 1).step_by(most);
        starts
            .map(|first| Self { ptr: &self.ptr[first..=(first + most).min(self.ptr.len() - 1)], ..self })
            .collect()
    }
}
