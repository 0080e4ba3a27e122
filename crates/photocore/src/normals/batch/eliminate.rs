//! Elimination of the local blocks of a batch.

use std::ops::Range;

use pulp::Simd;
use smallvec::SmallVec;

use super::{Batch, Place};
use crate::normals::equations::Prior;
use crate::normals::layout::Layout;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::{Kernel, LANES, copy_vectors, run, size};

impl Batch {
    /// Eliminates the unknowns of the local blocks. `damping` is the fraction of the diagonal that is added to it.
    pub fn eliminate(&mut self, layout: &Layout, prior: &Prior, damping: f64) {
        if self.uncoupled {
            return self.skip_elimination(layout);
        }
        run(layout, self.retained_dim(), Eliminate { batch: self, layout, prior, damping });
    }

    /// Factors the normal matrices of the local blocks and reduces their right-hand sides: L and v.
    #[inline(always)]
    pub(super) fn factor<S: Simd, const L: usize>(
        &mut self,
        simd: S,
        rows: usize,
        prior: (&Layout, &Prior),
        damping: f64,
    ) {
        (self.sum_of_squares, self.decrease) = (0.0, 0.0);
        self.deficient.clear();
        let count = self.locals.len();
        for first in (0..count).step_by(LANES) {
            self.factor_some::<S, L>(simd, first..count.min(first + LANES), rows, prior, damping);
        }
    }

    /// Factors and reduces at most [`LANES`] local blocks in parallel lanes.
    #[inline(always)]
    fn factor_some<S: Simd, const L: usize>(
        &mut self,
        simd: S,
        locals: Range<usize>,
        rows: usize,
        (layout, prior): (&Layout, &Prior),
        damping: f64,
    ) {
        let (mut normals, mut rights) = ([[[0.0; LANES]; L]; L], [[0.0; L]; LANES]);
        for (lane, t) in locals.clone().enumerate() {
            let (mut normal, mut right) = prior.of_local::<L>(layout, self.locals[t] as usize);
            self.add_equations(t, rows, &mut normal, &mut right);
            if let Some(own) = self.own.get(t) {
                for a in 0..L {
                    right[a] += own.right[a];
                    (0..=a).for_each(|b| normal[a][b] += own.normal[a][b]);
                }
                self.sum_of_squares += own.sum_of_squares;
            }
            for a in 0..L {
                normal[a][a] *= 1.0 + damping;
                for b in 0..a + 1 {
                    normals[a][b][lane] = normal[a][b];
                }
            }
            rights[lane] = right;
        }
        // Results in lanes without a local block are ignored.
        let (triangles, regular) = Triangle::factor_lanes::<S, L>(simd, &normals);
        for (lane, t) in locals.enumerate() {
            if regular[lane] == 0.0 {
                self.deficient.push(self.locals[t] as usize);
            }
            let (triangle, right) = (Triangle::in_lane(&triangles, lane), &mut rights[lane]);
            triangle.forward::<L>(right, 1);
            self.decrease += right.iter().map(|v| v * v).sum::<f64>();
            self.reduced[t * L..][..L].copy_from_slice(right);
            self.triangles[t] = triangle;
        }
    }

    /// Adds the equations of local block `t` of the batch to its normal equations, and to the sum of squares.
    #[inline(always)]
    fn add_equations<const L: usize>(
        &mut self,
        t: usize,
        rows: usize,
        normal: &mut [[f64; L]; L],
        right: &mut [f64; L],
    ) {
        for main in &self.main_blocks {
            for (k, p) in main.groups.clone().enumerate() {
                let constants =
                    &self.constants[main.constants + (t * main.groups.len() + k) * rows..][..rows];
                let own = &self.local_rows[(p * self.locals.len() + t) * rows * L..][..rows * L];
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
    }

    /// Computes the coupling V of all local blocks to the other blocks.
    #[inline(always)]
    fn couple<S: Simd, const L: usize, const D: usize>(&mut self, simd: S, rows: usize) {
        let own = self.places.len() * self.locals.len() * rows * L;
        self.coupled = self.local_rows[..own].iter().any(|&value| value != 0.0);
        self.couple_main_blocks::<S, L, D>(simd, rows);
        self.couple_runs::<S, L>(simd, rows);
        if !self.spans.iter().all(|span| span.plain) {
            (0..self.locals.len()).for_each(|t| self.couple_spans::<L>(t, rows));
        }
    }

    /// Computes the coupling to main blocks.
    #[inline(always)]
    fn couple_main_blocks<S: Simd, const L: usize, const D: usize>(&mut self, simd: S, rows: usize) {
        let depth = self.locals.len();
        for main in &self.main_blocks {
            let dim = size::<D>(main.dim);
            // An explicit loop: zipped iterators would cause a call per main block.
            for (t, triangle) in self.triangles.iter().enumerate() {
                let coupling = &mut self.coupling[main.coupling + t * L * dim..][..L * dim];
                for first in (0..dim).step_by(LANES) {
                    let mut sums = [[simd.splat_f64s(0.0); LANES]; L];
                    for (k, p) in main.groups.clone().enumerate() {
                        let own = &self.local_rows[(p * depth + t) * rows * L..][..rows * L];
                        let at = main.retained + (t * main.groups.len() + k) * rows * dim;
                        add_rows::<S, L>(simd, &mut sums, own, &self.retained_rows[at + first..], dim);
                    }
                    triangle.forward_vectors::<S, L>(simd, &mut sums);
                    write_sums::<S, L>(simd, &sums, coupling, dim, first);
                }
            }
        }
    }

    /// Computes the coupling to segments that consist of complete runs.
    #[inline(always)]
    fn couple_runs<S: Simd, const L: usize>(&mut self, simd: S, rows: usize) {
        let depth = self.locals.len();
        for span in self.spans.iter().filter(|span| span.plain) {
            let width = span.unknowns.len();
            let groups = span.runs.iter().flat_map(|run| {
                let group = |p: usize| {
                    let Place { width, rows: start, .. } = self.places[p];
                    Group { local: p * depth * rows * L, shared: start + run.column, stride: width }
                };
                run.places.clone().map(group)
            });
            let groups: SmallVec<[Group; 8]> = groups.collect();
            for (t, triangle) in self.triangles.iter().enumerate() {
                let coupling = &mut self.coupling[span.coupling + t * L * width..][..L * width];
                for first in (0..width).step_by(LANES) {
                    let mut sums = [[simd.splat_f64s(0.0); LANES]; L];
                    for &Group { local, shared, stride } in &groups {
                        let own = &self.local_rows[local + t * rows * L..][..rows * L];
                        let others = &self.shared_rows[shared + t * rows * stride + first..];
                        add_rows::<S, L>(simd, &mut sums, own, others, stride);
                    }
                    triangle.forward_vectors::<S, L>(simd, &mut sums);
                    write_sums::<S, L>(simd, &sums, coupling, width, first);
                }
            }
        }
    }

    /// Computes the coupling of local block `t` of the batch to the other segments.
    #[inline(always)]
    fn couple_spans<const L: usize>(&mut self, t: usize, rows: usize) {
        let triangle = self.triangles[t];
        for span in self.spans.iter().filter(|span| !span.plain) {
            let width = span.unknowns.len();
            self.coupling[span.coupling + t * L * width..][..L * width].fill(0.0);
        }
        for (p, &Place { ref parts, width, rows: start }) in self.places.iter().enumerate() {
            let own = &self.local_rows[(p * self.locals.len() + t) * rows * L..][..rows * L];
            let shared = &self.shared_rows[start + t * rows * width..][..rows * width];
            for part in &self.parts[parts.clone()] {
                let span = &self.spans[part.span];
                if span.plain {
                    continue;
                }
                let stride = span.unknowns.len();
                let coupling = &mut self.coupling[span.coupling + t * L * stride..][..L * stride];
                let columns = part.column..part.column + part.width();
                add_product::<L>(&mut coupling[part.shift..], stride, own, shared, width, columns);
            }
        }
        for span in self.spans.iter().filter(|span| !span.plain) {
            let width = span.unknowns.len();
            triangle.forward::<L>(&mut self.coupling[span.coupling + t * L * width..][..L * width], width);
        }
    }
}

/// Group that involves a complete segment: offsets of its coefficients for the first local block, and stride of the shared rows.
struct Group {
    local: usize,
    shared: usize,
    stride: usize,
}

struct Eliminate<'a> {
    batch: &'a mut Batch,
    layout: &'a Layout,
    prior: &'a Prior,
    damping: f64,
}

impl Kernel for Eliminate<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        let Self { batch, layout, prior, damping } = self;
        let rows = size::<R>(layout.rows());
        batch.factor::<S, L>(simd, rows, (layout, prior), damping);
        batch.couple::<S, L, D>(simd, rows);
    }
}

/// Adds to row d of the sums, over some equations, the local coefficient d times one vector of other coefficients, whose rows have the
/// given `stride`.
#[inline(always)]
fn add_rows<S: Simd, const L: usize>(
    simd: S,
    sums: &mut [[S::f64s; LANES]; L],
    local: &[f64],
    others: &[f64],
    stride: usize,
) {
    for (row, local) in local.as_chunks::<L>().0.iter().enumerate() {
        let vectors = S::as_simd_f64s(&others[row * stride..][..LANES]).0;
        for d in 0..L {
            let factor = simd.splat_f64s(local[d]);
            for k in 0..LANES / S::F64_LANES {
                sums[d][k] = simd.mul_add_f64s(vectors[k], factor, sums[d][k]);
            }
        }
    }
}

/// Writes sums to the columns of a coupling matrix of `width` columns, from column `first`.
#[inline(always)]
fn write_sums<S: Simd, const L: usize>(
    simd: S,
    sums: &[[S::f64s; LANES]; L],
    coupling: &mut [f64],
    width: usize,
    first: usize,
) {
    let height = LANES.min(width - first);
    for d in 0..L {
        copy_vectors::<S>(simd, &sums[d], &mut coupling[d * width + first..][..height]);
    }
}

/// target[d][c] += sum over rows of local[row][d] * other[row][columns[c]], with `stride` of the target and `width` of other.
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
