//! The equations of a stack, gathered.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::{Part, Place, Run, Segment, Slot, Stack};
use crate::normals::equations::{Equations, GroupRows};
use crate::normals::layout::Layout;
use crate::normals::symbolic::Symbolic;
use crate::normals::system::System;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::{Kernel, LANES, run_unsized};

impl Stack {
    /// Gathers the equations of local blocks of one pattern.
    pub fn gather(&mut self, system: &System, equations: &impl Equations, locals: &[u32]) {
        self.place(system, locals);
        run_unsized(Gather { stack: self, system, equations });
    }

    #[inline(always)]
    fn write(&mut self, system: &System, equations: &impl Equations) {
        let (rows, l) = (system.layout.rows(), system.layout.local_dim());
        let (depth, incidence) = (self.locals.len(), &system.incidence);
        for slot in &self.slots {
            // Where each local block has one group on the main block, all of them stand one after the other.
            let together = if slot.groups.len() == 1 { depth } else { 1 };
            let count = together * rows;
            for (k, p) in slot.groups.clone().enumerate() {
                let Place { width, rows: common, .. } = self.places[p];
                for t in (0..depth).step_by(together) {
                    let at = (t * slot.groups.len() + k) * rows;
                    let mut part = GroupRows {
                        constant: &mut self.constants[slot.constants + at..][..count],
                        local: &mut self.local_rows[(p * depth + t) * rows * l..][..count * l],
                        kept: &mut self.kept_rows[slot.kept + at * slot.dim..][..count * slot.dim],
                        common: &mut self.common_rows[common + t * rows * width..][..count * width],
                    };
                    let locals = &self.locals[t..t + together];
                    let group =
                        |t: usize| incidence.groups_of(&system.layout, locals[t] as usize)[p] as usize;
                    equations.write_alike(locals, group, &mut part);
                }
            }
        }
    }

    /// Lays out the buffers for local blocks of one pattern.
    fn place(&mut self, system: &System, locals: &[u32]) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let (rows, l, depth) = (layout.rows(), layout.local_dim(), locals.len());
        self.locals.clear();
        self.locals.extend_from_slice(locals);
        self.slots.clear();
        self.places.clear();
        self.parts.clear();
        let Some(&first) = locals.first() else { return };
        let groups = system.incidence.groups_of(layout, first as usize);
        let positions = system.incidence.positions_of(layout, first as usize);
        let mut common = 0;
        for (p, (&group, &position)) in groups.iter().zip(positions).enumerate() {
            match self.slots.last_mut() {
                Some(slot) if slot.position == position as usize => slot.groups.end += 1,
                _ => self.slots.push(Slot {
                    position: position as usize,
                    row: 0,
                    dim: symbolic.dim(position as usize),
                    groups: p..p + 1,
                    constants: 0,
                    kept: 0,
                    coupling: 0,
                }),
            }
            let start = self.parts.len();
            let width =
                if layout.has_common() { self.place_parts(layout, symbolic, group as usize) } else { 0 };
            self.places.push(Place { parts: start..self.parts.len(), width, rows: common });
            common += depth * rows * width;
        }
        let with_further = if layout.has_further() { groups } else { &[] };
        let further = with_further.iter().flat_map(|&group| layout.further_of(group as usize));
        let further = further.map(|&block| symbolic.position(block as usize));
        let home = further.chain(positions.first().map(|&main| main as usize)).min();
        let home = home.map_or(0, |first| symbolic.supernode_of(first));
        let (mut kept, mut coupling) = (0, 0);
        for slot in &mut self.slots {
            // Every kept block of a local block is in the pattern of its home.
            slot.row = symbolic.panel_row(home, slot.position).unwrap_or_default();
            slot.constants = slot.groups.start * rows * depth;
            (slot.kept, slot.coupling) = (kept, coupling);
            kept += slot.groups.len() * rows * depth * slot.dim;
            coupling += l * depth * slot.dim;
        }
        coupling = self.place_segments(symbolic, home, l * depth, coupling);
        self.constants.resize(groups.len() * rows * depth, 0.0);
        self.local_rows.resize(groups.len() * rows * depth * l, 0.0);
        // Products read beyond the end.
        self.kept_rows.resize(kept + LANES, 0.0);
        self.common_rows.resize(common + LANES, 0.0);
        self.coupling.resize(coupling + LANES, 0.0);
        self.reduced.resize(l * depth, 0.0);
        self.triangles.resize(depth, Triangle::default());
    }

    /// Appends the parts of what a group has in common with others; returns how many unknowns they have.
    fn place_parts(&mut self, layout: &Layout, symbolic: &Symbolic, group: usize) -> usize {
        let part = |(position, unknowns, column)| Part { position, unknowns, segment: 0, shift: 0, column };
        self.parts.extend(parts_of(layout, symbolic, group).map(part));
        layout.common_width(group)
    }

    /// Unites the parts that overlap or meet in one block; each segment takes `depth` rows of the coupling from `start` on.
    fn place_segments(&mut self, symbolic: &Symbolic, home: usize, depth: usize, start: usize) -> usize {
        self.segments.clear();
        if self.parts.is_empty() {
            return start;
        }
        let mut coupling = start;
        for (position, unknowns) in
            united(self.parts.iter().map(|part| (part.position, part.unknowns.clone())))
        {
            let row = symbolic.panel_row(home, position).unwrap_or_default() + unknowns.start;
            let width = unknowns.len();
            self.segments.push(Segment {
                position,
                unknowns,
                row,
                coupling,
                runs: SmallVec::new(),
                plain: false,
            });
            coupling += depth * width;
        }
        for part in &mut self.parts {
            let key = (part.position, part.unknowns.start);
            let after =
                self.segments.partition_point(|segment| (segment.position, segment.unknowns.start) <= key);
            part.segment = after.saturating_sub(1);
            part.shift = part.unknowns.start - self.segments[part.segment].unknowns.start;
        }
        self.find_runs();
        coupling
    }

    /// Finds the groups whose coefficients in a segment stand one below the other.
    fn find_runs(&mut self) {
        let single = self.slots.iter().filter(|slot| slot.groups.len() == 1).map(|slot| slot.groups.start);
        for p in single {
            let place = &self.places[p];
            for &Part { segment, column, ref unknowns, .. } in &self.parts[place.parts.clone()] {
                let Segment { unknowns: all, runs, .. } = &mut self.segments[segment];
                if unknowns.len() < all.len() {
                    continue;
                }
                let goes_on = |run: &&mut Run| {
                    let width = self.places[run.places.start].width;
                    run.places.end == p && run.column == column && width == place.width
                };
                match runs.last_mut().filter(goes_on) {
                    Some(run) => run.places.end += 1,
                    None => runs.push(Run { places: p..p + 1, column }),
                }
            }
        }
        for (index, segment) in self.segments.iter_mut().enumerate() {
            let touching = self.parts.iter().filter(|part| part.segment == index).count();
            segment.plain = segment.runs.iter().map(|run| run.places.len()).sum::<usize>() == touching;
        }
    }
}

/// The parts of what a group has in common with others: the position of a block, some of its unknowns, and the first of their columns
/// among those that the group has in common.
pub(in crate::normals) fn parts_of<'a>(
    layout: &'a Layout,
    symbolic: &'a Symbolic,
    group: usize,
) -> impl Iterator<Item = (usize, Range<usize>, usize)> + 'a {
    let blocks = layout.further_of(group).iter().scan(0, |width, &block| {
        let block = block as usize;
        let first = std::mem::replace(width, *width + layout.kept_dim(block));
        Some((block, first))
    });
    let further = blocks.flat_map(move |(block, first)| {
        let position = symbolic.position(block);
        layout.free_of(block).map(move |free| (position, free.clone(), first + free.start))
    });
    // The border is the last block.
    let border = layout.border_of(group);
    let own = (!border.is_empty()).then(|| {
        let column = layout.common_width(group) - border.len();
        (symbolic.blocks() - 1, border, column)
    });
    further.chain(own)
}

/// Groups less those that have the same in common with others as one before: the cameras of a flight are few.
pub(in crate::normals) fn unlike(layout: &Layout, groups: &[u32]) -> SmallVec<[usize; 4]> {
    let mut found: SmallVec<[usize; 4]> = SmallVec::new();
    let common = |group: usize| (layout.further_of(group), layout.border_of(group));
    for group in groups.iter().map(|&group| group as usize) {
        if !found.iter().take(4).any(|&other| common(other) == common(group)) {
            found.push(group);
        }
    }
    found
}

/// Unites ranges of the unknowns of blocks that overlap or meet, in the order of their positions.
pub(in crate::normals) fn united(
    parts: impl Iterator<Item = (usize, Range<usize>)>,
) -> SmallVec<[(usize, Range<usize>); 4]> {
    let mut sorted: SmallVec<[(usize, Range<usize>); 4]> = SmallVec::new();
    // Most groups have the same in common as one of the few before: the cameras of a flight are few.
    parts.for_each(|part| {
        if !sorted.iter().rev().take(4).any(|other| *other == part) {
            sorted.push(part);
        }
    });
    sorted.sort_unstable_by_key(|(position, unknowns)| (*position, unknowns.start));
    let mut found: SmallVec<[(usize, Range<usize>); 4]> = SmallVec::new();
    for (position, unknowns) in sorted {
        match found.last_mut() {
            Some((at, last)) if position == *at && unknowns.start <= last.end => {
                last.end = last.end.max(unknowns.end);
            }
            _ => found.push((position, unknowns)),
        }
    }
    found
}

struct Gather<'a, E> {
    stack: &'a mut Stack,
    system: &'a System,
    equations: &'a E,
}

impl<E: Equations> Kernel for Gather<'_, E> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        self.stack.write(self.system, self.equations);
    }
}
