//! Assembly of an eliminated batch into a front.

use pulp::Simd;

use super::{Batch, Part};
use crate::normals::front::{Columns, Strip};
use crate::normals::layout::Layout;
use crate::normals::vectorised::{Kernel, Rows, run_for_any_local, run_unsized, size};

impl Batch {
    /// Adds the equations and Schur complement of the batch to columns of its front.
    pub fn add_to(&self, columns: &mut Columns<'_>, layout: &Layout) {
        let (rows, l) = (layout.rows(), layout.local_dim());
        run_for_any_local(layout, self.retained_dim(), AddSlots { batch: self, columns, rows, l });
        if self.is_together() {
            self.add_together(columns);
        } else if !self.segments.is_empty() {
            run_unsized(AddSegments { batch: self, columns, rows, l });
        }
    }

    /// Returns the blocks with products in the Schur complement: all of the given ones, or none.
    #[inline(always)]
    fn coupled_to<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        if self.coupled { all } else { &[] }
    }

    /// Adds products of main blocks only.
    #[inline(always)]
    fn add_slots<S: Simd, const D: usize>(&self, simd: S, columns: &mut Columns<'_>, rows: usize, l: usize) {
        for (index, slot) in self.slots.iter().enumerate() {
            if !columns.contain(slot.row) {
                continue;
            }
            let v = self.slot_coupling::<D>(slot, l);
            let own = self.slot_rows::<D>(slot, rows);
            let constants = &self.constants[slot.constants..][..slot.groups.len() * self.locals.len() * rows];
            columns.add_difference(simd, own, v, self.locals.len());
            columns.add_equations(simd, own, constants);
            if !self.apart {
                columns.subtract_right(simd, v, &self.reduced);
            }
            for other in self.coupled_to(&self.slots[index + 1..]) {
                columns.add_product(simd, -1.0, self.slot_coupling::<D>(other, l), v);
            }
        }
    }

    /// Adds products of segments with main blocks above them in the front.
    #[inline(always)]
    fn add_below_slots<S: Simd>(&self, simd: S, columns: &mut Columns<'_>, rows: usize, l: usize) {
        for slot in &self.slots {
            if !columns.contain(slot.row) {
                continue;
            }
            let (v, own) = (self.slot_coupling::<0>(slot, l), self.slot_rows::<0>(slot, rows));
            for segment in self.segments.iter().filter(|segment| segment.row > slot.row) {
                let coupling = self.segment_coupling(segment, l);
                let shared = match segment.run_of(slot.groups.start) {
                    Some(run) => self.run_rows(segment, run, slot.groups.clone(), rows),
                    None if self.coupled => coupling.emptied(),
                    None => continue,
                };
                columns.add_products(simd, [(1.0, shared, own), (-1.0, coupling, v)]);
            }
        }
    }

    /// Adds products of shared blocks with themselves and with main blocks that are not part of a run.
    #[inline(always)]
    fn add_parts<S: Simd>(&self, simd: S, columns: &mut Columns<'_>, rows: usize) {
        for slot in &self.slots {
            let width = slot.dim;
            // With one group per local block on the main block, the equations of all local blocks are contiguous.
            let together = if slot.groups.len() == 1 { self.locals.len() } else { 1 };
            let count = together * rows;
            for (k, p) in slot.groups.clone().enumerate() {
                let in_run = |part: &Part| self.segments[part.segment].run_of(p).is_some();
                if self.parts(p).len() == 1
                    && self
                        .parts(p)
                        .iter()
                        .all(|part| in_run(part) && self.segments[part.segment].row > slot.row)
                {
                    continue;
                }
                for t in (0..self.locals.len()).step_by(together) {
                    let at = (t * slot.groups.len() + k) * rows;
                    let values = &self.retained_rows[slot.retained + at * width..];
                    let retained = Strip { at: slot.row, rows: Rows { values, width, stride: width, count } };
                    let constants = &self.constants[slot.constants + at..][..count];
                    for (index, part) in self.parts(p).iter().enumerate() {
                        let equations = t * rows..t * rows + count;
                        let own = self.part_rows(p, part, equations.clone());
                        let in_run = in_run(part);
                        let below = !in_run || self.segments[part.segment].row < slot.row;
                        let others = self.parts(p)[..index].iter();
                        let others = others.map(|other| self.part_rows(p, other, equations.clone()));
                        let retained = below.then_some(retained);
                        for other in others.chain(retained).chain((!in_run).then_some(own)) {
                            add_below(simd, columns, own, other);
                        }
                        if !in_run && columns.contain(own.at) {
                            columns.add_equations(simd, own, constants);
                        }
                    }
                }
            }
        }
    }

    /// Adds products of runs in the columns of segments, and subtracts the Schur complement there.
    #[inline(always)]
    fn add_segments<S: Simd>(&self, simd: S, columns: &mut Columns<'_>, rows: usize, l: usize) {
        for (index, segment) in self.segments.iter().enumerate() {
            if !columns.contain(segment.row) {
                continue;
            }
            let v = self.segment_coupling(segment, l);
            for number in 0..segment.runs.len().max(1) {
                let own = match segment.runs.get(number) {
                    Some(run) => {
                        let own = self.run_rows(segment, run, run.places.clone(), rows);
                        let first = run.places.start * self.locals.len() * rows;
                        columns.add_equations(simd, own, &self.constants[first..]);
                        own
                    }
                    None => v.emptied(),
                };
                let taken = if number == 0 { v } else { v.emptied() };
                columns.add_products(simd, [(1.0, own, own), (-1.0, taken, taken)]);
            }
            if !self.apart {
                columns.subtract_right(simd, v, &self.reduced);
            }
            let segments = self.coupled_to(&self.segments[index + 1..]).iter();
            let slots = self.coupled_to(&self.slots).iter().filter(|slot| slot.row > segment.row);
            let slots = slots.map(|slot| self.slot_coupling::<0>(slot, l));
            for other in segments.map(|other| self.segment_coupling(other, l)).chain(slots) {
                columns.add_product(simd, -1.0, other, v);
            }
        }
    }
}

/// Adds A^T B or its transpose, so that the lower strip in the front gives the rows.
#[inline(always)]
fn add_below<S: Simd>(simd: S, columns: &mut Columns<'_>, a: Strip<'_>, b: Strip<'_>) {
    let (lower, upper) = if a.at > b.at { (a, b) } else { (b, a) };
    if columns.contain(upper.at) {
        columns.add_product(simd, 1.0, lower, upper);
    }
}

struct AddSlots<'a, 'b> {
    batch: &'a Batch,
    columns: &'a mut Columns<'b>,
    rows: usize,
    l: usize,
}

impl Kernel for AddSlots<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        self.batch.add_slots::<S, D>(simd, self.columns, size::<R>(self.rows), size::<L>(self.l));
    }
}

/// Kernel of shared blocks, which have any size. The product is compiled for all widths at each call, so it has few calls.
struct AddSegments<'a, 'b> {
    batch: &'a Batch,
    columns: &'a mut Columns<'b>,
    rows: usize,
    l: usize,
}

impl Kernel for AddSegments<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, columns, rows, l } = self;
        batch.add_below_slots(simd, columns, rows, l);
        batch.add_parts(simd, columns, rows);
        batch.add_segments(simd, columns, rows, l);
    }
}
