//! Assembly of an eliminated batch into a front.

use pulp::Simd;

use super::{Batch, Part};
use crate::normals::front::{Columns, PanelView};
use crate::normals::layout::Layout;
use crate::normals::vectorised::{Kernel, Rows, run_for_any_local, run_unsized, size};

impl Batch {
    /// Adds the equations and Schur complement of the batch to columns of its front.
    pub fn add_to(&self, columns: &mut Columns<'_>, layout: &Layout) {
        let (rows, l) = (layout.rows(), layout.local_dim());
        run_for_any_local(layout, self.retained_dim(), AddMainBlocks { batch: self, columns, rows, l });
        if self.has_joint_products() {
            self.add_joint_products(columns);
        } else if !self.spans.is_empty() {
            run_unsized(AddSpans { batch: self, columns, rows, l });
        }
    }

    /// Returns the blocks with products in the Schur complement: all of the given ones, or none.
    #[inline(always)]
    fn coupled_to<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        if self.coupled { all } else { &[] }
    }

    /// Adds products of main blocks only.
    #[inline(always)]
    fn add_main_blocks<S: Simd, const D: usize>(
        &self,
        simd: S,
        columns: &mut Columns<'_>,
        rows: usize,
        l: usize,
    ) {
        for (index, main) in self.main_blocks.iter().enumerate() {
            if !columns.contain(main.row) {
                continue;
            }
            let v = self.main_coupling::<D>(main, l);
            let own = self.main_rows::<D>(main, rows);
            let constants = &self.constants[main.constants..][..main.groups.len() * self.locals.len() * rows];
            columns.add_difference(simd, own, v, self.locals.len());
            columns.add_equations(simd, own, constants);
            if !self.uncoupled {
                columns.subtract_right(simd, v, &self.reduced);
            }
            for other in self.coupled_to(&self.main_blocks[index + 1..]) {
                columns.add_product(simd, -1.0, self.main_coupling::<D>(other, l), v);
            }
        }
    }

    /// Adds products of segments with main blocks above them in the front.
    #[inline(always)]
    fn add_below_main_blocks<S: Simd>(&self, simd: S, columns: &mut Columns<'_>, rows: usize, l: usize) {
        for main in &self.main_blocks {
            if !columns.contain(main.row) {
                continue;
            }
            let (v, own) = (self.main_coupling::<0>(main, l), self.main_rows::<0>(main, rows));
            for span in self.spans.iter().filter(|span| span.row > main.row) {
                let coupling = self.span_coupling(span, l);
                let shared = match span.run_of(main.groups.start) {
                    Some(run) => self.run_rows(span, run, main.groups.clone(), rows),
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
        for main in &self.main_blocks {
            let width = main.dim;
            // With one group per local block on the main block, the equations of all local blocks are contiguous.
            let together = if main.groups.len() == 1 { self.locals.len() } else { 1 };
            let count = together * rows;
            for (k, p) in main.groups.clone().enumerate() {
                let in_run = |part: &Part| self.spans[part.span].run_of(p).is_some();
                if self.parts(p).len() == 1
                    && self.parts(p).iter().all(|part| in_run(part) && self.spans[part.span].row > main.row)
                {
                    continue;
                }
                for t in (0..self.locals.len()).step_by(together) {
                    let at = (t * main.groups.len() + k) * rows;
                    let values = &self.retained_rows[main.retained + at * width..];
                    let retained =
                        PanelView { at: main.row, rows: Rows { values, width, stride: width, count } };
                    let constants = &self.constants[main.constants + at..][..count];
                    for (index, part) in self.parts(p).iter().enumerate() {
                        let equations = t * rows..t * rows + count;
                        let own = self.part_rows(p, part, equations.clone());
                        let in_run = in_run(part);
                        let below = !in_run || self.spans[part.span].row < main.row;
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
    fn add_spans<S: Simd>(&self, simd: S, columns: &mut Columns<'_>, rows: usize, l: usize) {
        for (index, span) in self.spans.iter().enumerate() {
            if !columns.contain(span.row) {
                continue;
            }
            let v = self.span_coupling(span, l);
            for number in 0..span.runs.len().max(1) {
                let own = match span.runs.get(number) {
                    Some(run) => {
                        let own = self.run_rows(span, run, run.places.clone(), rows);
                        let first = run.places.start * self.locals.len() * rows;
                        columns.add_equations(simd, own, &self.constants[first..]);
                        own
                    }
                    None => v.emptied(),
                };
                let taken = if number == 0 { v } else { v.emptied() };
                columns.add_products(simd, [(1.0, own, own), (-1.0, taken, taken)]);
            }
            if !self.uncoupled {
                columns.subtract_right(simd, v, &self.reduced);
            }
            let spans = self.coupled_to(&self.spans[index + 1..]).iter();
            let main_blocks = self.coupled_to(&self.main_blocks).iter().filter(|main| main.row > span.row);
            let main_blocks = main_blocks.map(|main| self.main_coupling::<0>(main, l));
            for other in spans.map(|other| self.span_coupling(other, l)).chain(main_blocks) {
                columns.add_product(simd, -1.0, other, v);
            }
        }
    }
}

/// Adds A^T B or its transpose, so that the lower strip in the front gives the rows.
#[inline(always)]
fn add_below<S: Simd>(simd: S, columns: &mut Columns<'_>, a: PanelView<'_>, b: PanelView<'_>) {
    let (lower, upper) = if a.at > b.at { (a, b) } else { (b, a) };
    if columns.contain(upper.at) {
        columns.add_product(simd, 1.0, lower, upper);
    }
}

struct AddMainBlocks<'a, 'b> {
    batch: &'a Batch,
    columns: &'a mut Columns<'b>,
    rows: usize,
    l: usize,
}

impl Kernel for AddMainBlocks<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        self.batch.add_main_blocks::<S, D>(simd, self.columns, size::<R>(self.rows), size::<L>(self.l));
    }
}

/// Kernel of shared blocks, which have any size. The product is compiled for all widths at each call, so it has few calls.
struct AddSpans<'a, 'b> {
    batch: &'a Batch,
    columns: &'a mut Columns<'b>,
    rows: usize,
    l: usize,
}

impl Kernel for AddSpans<'_, '_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, columns, rows, l } = self;
        batch.add_below_main_blocks(simd, columns, rows, l);
        batch.add_parts(simd, columns, rows);
        batch.add_spans(simd, columns, rows, l);
    }
}
