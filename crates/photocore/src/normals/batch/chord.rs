//! Contributions of a batch to right-hand sides, without the coupling matrix.

use pulp::Simd;
use smallvec::SmallVec;

use super::Batch;
use crate::normals::equations::Prior;
use crate::normals::layout::Layout;
use crate::normals::vectorised::{Kernel, add_right, dot, run, size};

impl Batch {
    /// Eliminates the local unknowns from the right-hand sides only. Computes v and replaces l by l - A N^-1 A^T l, including priors. A^T
    /// of it is the contribution to the other unknowns.
    pub fn eliminate_from_rights(&mut self, layout: &Layout, prior: &Prior) {
        run(layout, self.retained_dim(), FromRights { batch: self, layout, prior });
    }

    /// Adds A^T l for all coupled blocks: main blocks before segments.
    pub fn add_rights_of_others(&self, layout: &Layout, rights: &mut [f64]) {
        run(layout, self.retained_dim(), OfOthers { batch: self, rows: layout.rows(), rights });
    }

    /// Adds A^T l for shared blocks; the unknowns of each segment start at `starts`.
    #[inline(always)]
    fn add_rights_of_common<S: Simd>(&self, simd: S, rows: usize, starts: &[usize], rights: &mut [f64]) {
        for main in &self.main_blocks {
            // With one group per local block on the main block, the equations of all local blocks are contiguous.
            let together = if main.groups.len() == 1 { self.locals.len() } else { 1 };
            let count = together * rows;
            for (k, p) in main.groups.clone().enumerate() {
                for t in (0..self.locals.len()).step_by(together) {
                    let constants = &self.constants[main.constants + (t * main.groups.len() + k) * rows..];
                    for part in self.parts(p) {
                        let own = self.part_rows(p, part, t * rows..t * rows + count).rows;
                        let target = &mut rights[starts[part.span] + part.shift..];
                        add_right(simd, target, None, 1.0, own, &constants[..count]);
                    }
                }
            }
        }
    }
}

struct FromRights<'a> {
    batch: &'a mut Batch,
    layout: &'a Layout,
    prior: &'a Prior,
}

impl Kernel for FromRights<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, layout, prior } = self;
        let rows = size::<R>(layout.rows());
        if batch.uncoupled {
            return;
        }
        batch.factor::<S, L>(simd, rows, (layout, prior), 0.0);
        let depth = batch.locals.len();
        for (t, triangle) in batch.triangles.iter().enumerate() {
            let mut x: [f64; L] = std::array::from_fn(|d| batch.reduced[t * L + d]);
            triangle.backward::<L>(&mut x, 1);
            for main in &batch.main_blocks {
                for (k, p) in main.groups.clone().enumerate() {
                    let constants =
                        &mut batch.constants[main.constants + (t * main.groups.len() + k) * rows..];
                    let own = batch.local_rows[(p * depth + t) * rows * L..][..rows * L].as_chunks::<L>().0;
                    constants.iter_mut().zip(own).for_each(|(constant, row)| *constant -= dot(row, &x));
                }
            }
        }
    }
}

struct OfOthers<'a> {
    batch: &'a Batch,
    rows: usize,
    rights: &'a mut [f64],
}

impl Kernel for OfOthers<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, rights, .. } = self;
        let rows = size::<R>(self.rows);
        let mut end = 0;
        for main in &batch.main_blocks {
            let own = batch.main_rows::<D>(main, rows).rows;
            add_right(simd, &mut rights[end..], None, 1.0, own, &batch.constants[main.constants..]);
            end += own.width;
        }
        let mut starts = SmallVec::<[usize; 4]>::new();
        for span in &batch.spans {
            starts.push(end);
            end += span.unknowns.len();
        }
        batch.add_rights_of_common(simd, rows, &starts, rights);
    }
}
