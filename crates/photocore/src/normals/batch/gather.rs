//! The equations of a batch, gathered.

use pulp::Simd;

use super::{Batch, Place};
use crate::normals::equations::{Equations, GroupRows};
use crate::normals::system::System;
use crate::normals::vectorised::{Kernel, run_unsized};

/// Equations of any kind, gathered by one call for a whole batch: nothing else is compiled for each kind.
pub(in crate::normals) trait Gathered: Equations {
    /// Gathers the equations of local blocks of one pattern.
    fn gather(&self, batch: &mut Batch, system: &System, locals: &[u32]);
}

impl<E: Equations> Gathered for E {
    fn gather(&self, batch: &mut Batch, system: &System, locals: &[u32]) {
        batch.place(system, locals);
        run_unsized(Gather { batch, system, equations: self });
    }
}

impl Batch {
    #[inline(always)]
    fn write(&mut self, system: &System, equations: &impl Equations) {
        let (rows, l) = (system.layout.rows(), system.layout.local_dim());
        let (depth, incidence) = (self.locals.len(), &system.incidence);
        for slot in &self.slots {
            // Where each local block has one group on the main block, all of them stand one after the other.
            let together = if slot.groups.len() == 1 { depth } else { 1 };
            let count = together * rows;
            for (k, p) in slot.groups.clone().enumerate() {
                let Place { width, rows: shared, .. } = self.places[p];
                for t in (0..depth).step_by(together) {
                    let at = (t * slot.groups.len() + k) * rows;
                    let mut part = GroupRows {
                        constant: &mut self.constants[slot.constants + at..][..count],
                        local: &mut self.local_rows[(p * depth + t) * rows * l..][..count * l],
                        retained: &mut self.retained_rows[slot.retained + at * slot.dim..]
                            [..count * slot.dim],
                        shared: &mut self.shared_rows[shared + t * rows * width..][..count * width],
                    };
                    let locals = &self.locals[t..t + together];
                    let group =
                        |t: usize| incidence.groups_of(&system.layout, locals[t] as usize)[p] as usize;
                    equations.write_alike(locals, group, &mut part);
                }
            }
        }
    }
}

struct Gather<'a, E> {
    batch: &'a mut Batch,
    system: &'a System,
    equations: &'a E,
}

impl<E: Equations> Kernel for Gather<'_, E> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        self.batch.write(self.system, self.equations);
    }
}
