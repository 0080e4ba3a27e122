//! The local blocks of a stack, eliminated.

use std::ops::Range;

use pulp::Simd;

use super::{Place, Stack};
use crate::normals::equations::Prior;
use crate::normals::layout::Layout;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::{Kernel, run, size};

impl Stack {
    /// Eliminates the unknowns of the local blocks. `damping` is added to the diagonal of each as a fraction of it.
    pub fn eliminate(&mut self, layout: &Layout, prior: &Prior, damping: f64) {
        (self.sum_of_squares, self.decrease) = (0.0, 0.0);
        self.deficient.clear();
        run(layout, self.kept_dim(), Eliminate { stack: self, layout, prior, damping });
    }

    #[inline(always)]
    fn eliminate_one<const L: usize, const D: usize>(
        &mut self,
        t: usize,
        rows: usize,
        mut normal: [[f64; L]; L],
        mut right: [f64; L],
        damping: f64,
    ) {
        for slot in &self.slots {
            for (k, p) in slot.groups.clone().enumerate() {
                let constants =
                    &self.constants[slot.constants + (t * slot.groups.len() + k) * rows..][..rows];
                let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
                for (row, constant) in own.as_chunks::<L>().0.iter().zip(constants) {
                    for a in 0..L {
                        right[a] += row[a] * constant;
                        for b in 0..=a {
                            normal[a][b] += row[a] * row[b];
                        }
                    }
                    self.sum_of_squares += constant * constant;
                }
            }
        }
        (0..L).for_each(|d| normal[d][d] *= 1.0 + damping);
        let mut triangle = Triangle::default();
        if !triangle.factor(&normal) {
            self.deficient.push(self.locals[t] as usize);
        }
        triangle.forward::<L>(&mut right, 1);
        self.decrease += right.iter().map(|v| v * v).sum::<f64>();
        self.reduced[t * L..][..L].copy_from_slice(&right);
        self.couple::<L, D>(t, rows, &triangle);
        self.triangles[t] = triangle;
    }

    /// Computes the coupling V of local block `t` of the stack to everything else.
    #[inline(always)]
    fn couple<const L: usize, const D: usize>(&mut self, t: usize, rows: usize, triangle: &Triangle) {
        for slot in &self.slots {
            let dim = size::<D>(slot.dim);
            let coupling = &mut self.coupling[slot.coupling + t * L * dim..][..L * dim];
            coupling.fill(0.0);
            for (k, p) in slot.groups.clone().enumerate() {
                let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
                let at = slot.kept + (t * slot.groups.len() + k) * rows * dim;
                add_product::<L>(coupling, dim, own, &self.kept_rows[at..][..rows * dim], dim, 0..dim);
            }
            triangle.forward::<L>(coupling, dim);
        }
        if !self.segments.is_empty() {
            self.couple_segments::<L>(t, rows, triangle);
        }
    }

    #[inline(always)]
    fn couple_segments<const L: usize>(&mut self, t: usize, rows: usize, triangle: &Triangle) {
        for segment in &self.segments {
            let width = segment.unknowns.len();
            self.coupling[segment.coupling + t * L * width..][..L * width].fill(0.0);
        }
        for (p, &Place { ref parts, width, rows: start }) in self.places.iter().enumerate() {
            let own = &self.local_rows[(t * self.places.len() + p) * rows * L..][..rows * L];
            let common = &self.common_rows[start + t * rows * width..][..rows * width];
            for part in &self.parts[parts.clone()] {
                let segment = &self.segments[part.segment];
                let stride = segment.unknowns.len();
                let coupling = &mut self.coupling[segment.coupling + t * L * stride..][..L * stride];
                let columns = part.column..part.column + part.width();
                add_product::<L>(&mut coupling[part.shift..], stride, own, common, width, columns);
            }
        }
        for segment in &self.segments {
            let width = segment.unknowns.len();
            triangle.forward::<L>(&mut self.coupling[segment.coupling + t * L * width..][..L * width], width);
        }
    }
}

struct Eliminate<'a> {
    stack: &'a mut Stack,
    layout: &'a Layout,
    prior: &'a Prior,
    damping: f64,
}

impl Kernel for Eliminate<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        for t in 0..self.stack.locals.len() {
            let (normal, right) = self.prior.of_local::<L>(self.layout, self.stack.locals[t] as usize);
            self.stack.eliminate_one::<L, D>(t, size::<R>(self.layout.rows()), normal, right, self.damping);
        }
    }
}

/// target[d][c] += sum over rows of local[row][d] * other[row][columns[c]]; `stride` and `width` are those of target and other.
#[inline(always)]
fn add_product<const L: usize>(
    target: &mut [f64],
    stride: usize,
    local: &[f64],
    other: &[f64],
    width: usize,
    columns: Range<usize>,
) {
    for (row, values) in local.chunks_exact(L).zip(other.chunks_exact(width.max(1))) {
        let values = &values[columns.clone()];
        for d in 0..L {
            for (sum, value) in target[d * stride..][..values.len()].iter_mut().zip(values) {
                *sum += row[d] * value;
            }
        }
    }
}
