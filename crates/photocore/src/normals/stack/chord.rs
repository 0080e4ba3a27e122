//! The right-hand sides that the equations of a stack make by themselves.

use pulp::Simd;
use smallvec::SmallVec;

use super::Stack;
use crate::normals::equations::Prior;
use crate::normals::layout::Layout;
use crate::normals::vectorised::{Kernel, add_right, run, size};

impl Stack {
    /// Appends the right-hand sides A^T l of the local blocks, with what their priors add.
    pub fn rights_of_locals(&self, layout: &Layout, prior: &Prior, found: &mut Vec<f64>) {
        run(layout, self.kept_dim(), OfLocals { stack: self, layout, prior, found });
    }

    /// Adds A^T l of all that the local blocks are tied to: main blocks before segments.
    pub fn add_rights_of_others(&self, layout: &Layout, rights: &mut [f64]) {
        run(layout, self.kept_dim(), OfOthers { stack: self, rows: layout.rows(), rights });
    }

    /// Adds A^T l of what groups have in common with others; the unknowns of each segment start at `starts`.
    #[inline(always)]
    fn add_rights_of_common<S: Simd>(&self, simd: S, rows: usize, starts: &[usize], rights: &mut [f64]) {
        for slot in &self.slots {
            // Where each local block has one group on the main block, the equations of all of them stand one after the other.
            let together = if slot.groups.len() == 1 { self.locals.len() } else { 1 };
            let count = together * rows;
            for (k, p) in slot.groups.clone().enumerate() {
                for t in (0..self.locals.len()).step_by(together) {
                    let constants = &self.constants[slot.constants + (t * slot.groups.len() + k) * rows..];
                    for part in self.parts(p) {
                        let own = self.part_rows(p, part, t * rows..t * rows + count).rows;
                        let target = &mut rights[starts[part.segment] + part.shift..];
                        add_right(simd, target, None, 1.0, own, &constants[..count]);
                    }
                }
            }
        }
    }
}

struct OfLocals<'a> {
    stack: &'a Stack,
    layout: &'a Layout,
    prior: &'a Prior,
    found: &'a mut Vec<f64>,
}

impl Kernel for OfLocals<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let (stack, rows) = (self.stack, size::<R>(self.layout.rows()));
        for (t, &local) in stack.locals.iter().enumerate() {
            let (_, mut right) = self.prior.of_local::<L>(self.layout, local as usize);
            for slot in &stack.slots {
                for (k, p) in slot.groups.clone().enumerate() {
                    let constants = &stack.constants[slot.constants + (t * slot.groups.len() + k) * rows..];
                    for (row, constant) in stack.local_rows::<L>(t, p, rows).iter().zip(constants) {
                        (0..L).for_each(|d| right[d] += row[d] * constant);
                    }
                }
            }
            self.found.extend_from_slice(&right);
        }
    }
}

struct OfOthers<'a> {
    stack: &'a Stack,
    rows: usize,
    rights: &'a mut [f64],
}

impl Kernel for OfOthers<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { stack, rights, .. } = self;
        let rows = size::<R>(self.rows);
        let mut end = 0;
        for slot in &stack.slots {
            let own = stack.slot_rows::<D>(slot, rows).rows;
            add_right(simd, &mut rights[end..], None, 1.0, own, &stack.constants[slot.constants..]);
            end += own.width;
        }
        let mut starts = SmallVec::<[usize; 4]>::new();
        for segment in &stack.segments {
            starts.push(end);
            end += segment.unknowns.len();
        }
        stack.add_rights_of_common(simd, rows, &starts, rights);
    }
}
