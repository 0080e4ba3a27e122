//! Units of elimination: local blocks, and groups of fixed local blocks.

use std::ops::Range;

use smallvec::SmallVec;

use super::Layout;

/// A *unit* is eliminated in one operation: a local block with all its groups. The elimination of a fixed block leaves no contribution and
/// does not couple its groups. Each of these groups is therefore an *independent* unit, numbered after the local blocks, and the block
/// itself has no groups.
impl Layout {
    pub(in crate::normals) fn units(&self) -> usize {
        self.locals + self.uncoupled.len()
    }

    /// Whether a unit is an independent group.
    pub(in crate::normals) fn is_uncoupled(&self, unit: usize) -> bool {
        unit >= self.locals
    }

    /// Returns the local block of a unit.
    pub(in crate::normals) fn local_of(&self, unit: usize) -> usize {
        unit.checked_sub(self.locals).map_or(unit, |uncoupled| self.uncoupled[uncoupled][1] as usize)
    }

    pub(in crate::normals) fn groups_of_unit(&self, unit: usize) -> Range<usize> {
        if let Some(uncoupled) = unit.checked_sub(self.locals) {
            let group = self.uncoupled[uncoupled][0] as usize;
            return group..group + 1;
        }
        let own = self.groups_of(unit);
        if self.has_uncoupled_groups(unit) { own.start..own.start } else { own }
    }

    /// Whether the groups of a local block are independent units, because the block is fixed.
    pub fn has_uncoupled_groups(&self, local: usize) -> bool {
        !self.uncoupled_of(local).is_empty()
    }

    /// Returns the independent groups of a local block, as unit numbers.
    pub(in crate::normals) fn uncoupled_of(&self, local: usize) -> Range<usize> {
        let before = |end: usize| self.locals + self.uncoupled.partition_point(|own| (own[1] as usize) < end);
        before(local)..before(local + 1)
    }

    /// Returns the main retained blocks of the groups of a unit.
    pub(in crate::normals) fn main_blocks_of(&self, unit: usize) -> &[u32] {
        &self.group_retained[self.groups_of_unit(unit)]
    }

    /// Returns the shared blocks of the groups of a unit.
    pub(in crate::normals) fn all_shared_of(&self, unit: usize) -> &[u32] {
        let Range { start, end } = self.groups_of_unit(unit);
        match self.shared_ptr.get(start..=end) {
            Some(ends) => &self.shared[ends[0]..ends[ends.len() - 1]],
            None => &[],
        }
    }

    /// Number of retained unknowns in the Schur complement of a unit; a main block is counted once per group.
    pub(in crate::normals) fn reduced_width(&self, unit: usize) -> usize {
        if self.is_uncoupled(unit) {
            return 0;
        }
        let groups = || self.groups_of_unit(unit);
        let main: usize = groups().map(|group| self.retained_dim(self.retained_of(group))).sum();
        if !self.has_shared() {
            return main;
        }
        let mut shared: SmallVec<[u32; 16]> =
            groups().flat_map(|group| self.shared_of(group)).copied().collect();
        shared.sort_unstable();
        shared.dedup();
        main + shared.into_iter().map(|block| self.retained_dim(block as usize)).sum::<usize>()
    }
}
