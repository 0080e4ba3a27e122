//! Evaluation of the equations of a batch.

use smallvec::{SmallVec, smallvec};

use super::{Batch, Place, TermSums};
use crate::normals::equations::{Equations, GroupRows, RowBuffer};
use crate::normals::layout::Layout;
use crate::normals::system::System;

impl Batch {
    /// Evaluates the equations of units of one pattern.
    pub fn gather(&mut self, equations: &dyn Equations, system: &System, units: &[u32]) {
        self.place(system, units);
        self.own.clear();
        if system.layout.has_local_terms() && !self.uncoupled {
            let mut buffer = RowBuffer::default();
            let of = |&local: &u32| TermSums::of(equations, &system.layout, local as usize, &mut buffer);
            self.own.extend(self.locals.iter().map(of));
        }
        let (rows, l) = (system.layout.rows(), system.layout.local_dim());
        let (depth, incidence) = (self.locals.len(), &system.incidence);
        let mut groups: SmallVec<[u32; 32]> = smallvec![0; depth];
        for main in &self.main_blocks {
            // With one group per local block on the main block, the groups of all local blocks are contiguous.
            let together = if main.groups.len() == 1 { depth } else { 1 };
            let count = together * rows;
            for (k, p) in main.groups.clone().enumerate() {
                let Place { width, rows: shared, .. } = self.places[p];
                for t in (0..depth).step_by(together) {
                    let at = (t * main.groups.len() + k) * rows;
                    let mut part = GroupRows {
                        constant: &mut self.constants[main.constants + at..][..count],
                        local: &mut self.local_rows[(p * depth + t) * rows * l..][..count * l],
                        retained: &mut self.retained_rows[main.retained + at * main.dim..]
                            [..count * main.dim],
                        shared: &mut self.shared_rows[shared + t * rows * width..][..count * width],
                    };
                    for (group, &unit) in groups.iter_mut().zip(&units[t..t + together]) {
                        *group = incidence.groups_of(&system.layout, unit as usize)[p];
                    }
                    equations.write_batch(&self.locals[t..t + together], &groups[..together], &mut part);
                }
            }
        }
    }
}

impl TermSums {
    /// Forms the normal equations of the terms of a local block.
    pub fn of(equations: &dyn Equations, layout: &Layout, local: usize, buffer: &mut RowBuffer) -> Self {
        let mut own = Self::default();
        for &term in layout.terms_of(local) {
            let mut rows = buffer.term(layout, term as usize);
            equations.write_term(term as usize, &mut rows);
            for (row, constant) in rows.local.chunks_exact(layout.local_dim()).zip(&*rows.constant) {
                for (a, value) in row.iter().enumerate() {
                    own.right[a] += value * constant;
                    own.normal[a].iter_mut().zip(&row[..=a]).for_each(|(sum, other)| *sum += value * other);
                }
                own.sum_of_squares += constant * constant;
            }
        }
        own
    }
}
