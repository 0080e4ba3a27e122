//! Buffer layout of a batch: offsets of equations and coupled blocks.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

use super::{Batch, Common, MainBlock, Part, Place, Run, SharedSpan};
use crate::normals::layout::Layout;
use crate::normals::symbolic::Symbolic;
use crate::normals::system::System;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::LANES;

/// Number of previous parts that are compared for equality: a flight has few cameras.
const FEW: usize = 4;

impl Batch {
    /// Assigns buffers for units of one pattern.
    pub(super) fn place(&mut self, system: &System, units: &[u32]) {
        let (layout, symbolic) = (&system.layout, &*system.symbolic);
        let (rows, l, depth) = (layout.rows(), layout.local_dim(), units.len());
        self.locals.clear();
        self.locals.extend(units.iter().map(|&unit| layout.local_of(unit as usize) as u32));
        self.main_blocks.clear();
        self.places.clear();
        let Some(&first) = units.first() else { return };
        self.uncoupled = layout.is_uncoupled(first as usize);
        let groups = system.incidence.groups_of(layout, first as usize);
        let positions = system.incidence.positions_of(layout, first as usize);
        self.place_main_blocks(symbolic, positions);
        let shared = self.place_commons(system, first as usize);
        let (mut retained, mut coupling, coupled) = (0, self.start, self.coupled_locals());
        for main in &mut self.main_blocks {
            main.row = symbolic.row_of(self.node, main.position);
            main.constants = main.groups.start * rows * depth;
            (main.retained, main.coupling) = (retained, coupling);
            retained += main.groups.len() * rows * depth * main.dim;
            coupling += l * coupled * main.dim;
        }
        for span in &mut self.spans {
            span.coupling = coupling;
            coupling += l * coupled * span.unknowns.len();
        }
        self.find_runs();
        self.end = coupling;
        make_room(&mut self.constants, groups.len() * rows * depth);
        make_room(&mut self.local_rows, groups.len() * rows * depth * l);
        // Vector loads read beyond the end.
        make_room(&mut self.retained_rows, retained + LANES);
        make_room(&mut self.shared_rows, shared + LANES);
        let behind = self.numbers_beside(layout).max(LANES);
        make_room(&mut self.coupling, coupling + behind);
        self.reduced.resize(l * depth, 0.0);
        self.triangles.resize(depth, Triangle::default());
    }

    /// Finds the main blocks.
    fn place_main_blocks(&mut self, symbolic: &Symbolic, positions: &[u32]) {
        for (p, &position) in positions.iter().enumerate() {
            match self.main_blocks.last_mut() {
                Some(main) if main.position == position as usize => main.groups.end += 1,
                _ => self.main_blocks.push(MainBlock {
                    position: position as usize,
                    row: 0,
                    dim: symbolic.dim(position as usize),
                    groups: p..p + 1,
                    constants: 0,
                    retained: 0,
                    coupling: 0,
                }),
            }
        }
    }

    /// Determines the shared parts of each group and the segments; returns the number of shared coefficients. The segments of the previous
    /// batch are reused if it has the same front and the same set of shared block lists.
    fn place_commons(&mut self, system: &System, unit: usize) -> usize {
        let (layout, incidence, symbolic) = (&system.layout, &system.incidence, &*system.symbolic);
        let set = incidence.set_of(unit);
        let are_other = self.set.replace(set) != Some(set);
        if are_other {
            self.commons.clear();
            self.commons.extend(incidence.members(set).iter().map(|&number| Common::of(system, number)));
        }
        let positions = incidence.positions_of(layout, unit);
        let main = positions.first().map(|&main| main as usize);
        let first = self.commons.iter().map(|shared| shared.first).chain(main).min();
        let node = first.map_or(0, |first| symbolic.supernode_of(first));
        if node != std::mem::replace(&mut self.node, node) || are_other {
            self.place_parts(layout, symbolic);
        }
        let of_groups = incidence.commons_of(layout, unit);
        let mut end = 0;
        for p in 0..positions.len() {
            let shared = of_groups.get(p).map(|number| {
                let place = self.commons.partition_point(|shared| shared.number < *number);
                &self.commons[place]
            });
            let (parts, width) = shared.map_or((0..0, 0), |shared| (shared.parts.clone(), shared.width));
            self.places.push(Place { parts, width, rows: end });
            end += self.locals.len() * layout.rows() * width;
        }
        end
    }

    /// Determines the parts of all shared block lists, and merges overlapping or adjacent ones in a block.
    fn place_parts(&mut self, layout: &Layout, symbolic: &Symbolic) {
        self.parts.clear();
        for shared in &mut self.commons {
            let start = self.parts.len();
            let part = |(position, unknowns, column)| Part { position, unknowns, span: 0, shift: 0, column };
            self.parts.extend(parts_of(layout, symbolic, shared.group).map(part));
            shared.parts = start..self.parts.len();
        }
        unite(self.parts.iter().map(|part| (part.position, part.unknowns.clone())), &mut self.ranges);
        let node = self.node;
        let span = |(position, unknowns): (usize, Range<usize>)| SharedSpan {
            position,
            row: symbolic.row_of(node, position) + unknowns.start,
            unknowns,
            coupling: 0,
            runs: SmallVec::new(),
            plain: false,
        };
        self.spans.clear();
        self.spans.extend(self.ranges.drain(..).map(span));
        for part in &mut self.parts {
            let key = (part.position, part.unknowns.start);
            let after = self.spans.partition_point(|span| (span.position, span.unknowns.start) <= key);
            part.span = after.saturating_sub(1);
            part.shift = part.unknowns.start - self.spans[part.span].unknowns.start;
        }
    }

    /// Finds the runs: groups whose coefficients in a segment form one matrix.
    fn find_runs(&mut self) {
        self.spans.iter_mut().for_each(|span| span.runs.clear());
        let single =
            self.main_blocks.iter().filter(|main| main.groups.len() == 1).map(|main| main.groups.start);
        for p in single {
            let place = &self.places[p];
            for &Part { span, column, ref unknowns, .. } in &self.parts[place.parts.clone()] {
                let SharedSpan { unknowns: all, runs, .. } = &mut self.spans[span];
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
        let mut touching: SmallVec<[usize; 32]> = smallvec![0; self.spans.len()];
        let parts = self.places.iter().flat_map(|place| &self.parts[place.parts.clone()]);
        parts.for_each(|part| touching[part.span] += 1);
        for (span, touching) in self.spans.iter_mut().zip(touching) {
            span.plain = span.runs.iter().map(|run| run.places.len()).sum::<usize>() == touching;
        }
    }
}

impl Common {
    /// Creates the shared block list with a number.
    fn of(system: &System, number: u32) -> Self {
        let (layout, group) = (&system.layout, system.incidence.group_with(number));
        let shared = layout.shared_of(group).iter();
        let first = shared.map(|&block| system.symbolic.position(block as usize)).min();
        let first = first.unwrap_or(usize::MAX);
        Self { number, group, parts: 0..0, width: layout.shared_width(group), first }
    }
}

/// Extends a buffer to a minimum length; its contents are undefined.
fn make_room(buffer: &mut Vec<f64>, length: usize) {
    if buffer.len() < length {
        buffer.resize(length, 0.0);
    }
}

/// Returns the parts of the shared coefficients of a group: position of a block, range of free unknowns, and first column in the shared
/// coefficients.
pub(in crate::normals) fn parts_of<'a>(
    layout: &'a Layout,
    symbolic: &'a Symbolic,
    group: usize,
) -> impl Iterator<Item = (usize, Range<usize>, usize)> + 'a {
    let blocks = layout.shared_of(group).iter().scan(0, |width, &block| {
        let block = block as usize;
        let first = std::mem::replace(width, *width + layout.retained_dim(block));
        Some((block, first))
    });
    blocks.flat_map(move |(block, first)| {
        let position = symbolic.position(block);
        layout.free_of(block).map(move |free| (position, free.clone(), first + free.start))
    })
}

/// Writes ranges of unknowns of blocks to `spans`, sorted by position, with overlapping or adjacent ranges merged.
pub(in crate::normals) fn unite(
    parts: impl Iterator<Item = (usize, Range<usize>)>,
    spans: &mut Vec<(usize, Range<usize>)>,
) {
    spans.clear();
    // Most groups repeat one of the last few ranges.
    parts.for_each(|part| {
        if !spans.iter().rev().take(FEW).any(|other| *other == part) {
            spans.push(part);
        }
    });
    spans.sort_unstable_by_key(|(position, unknowns)| (*position, unknowns.start));
    spans.dedup_by(|(position, unknowns), (at, last)| {
        let meets = position == at && unknowns.start <= last.end;
        if meets {
            last.end = last.end.max(unknowns.end);
        }
        meets
    });
}
