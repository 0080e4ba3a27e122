//! Kernels compiled for the vector instructions of the current machine, and for common block sizes.

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::layout::Layout;

/// Computation compiled for several sizes: rows R of a group, unknowns L of a local block and D of a retained block. Zero means known at
/// run time only.
///
/// Implementations and all functions that they call must be `#[inline(always)]`, except iterators with long closures. Only inlined code is
/// compiled for the vector instructions.
pub(super) trait Kernel {
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S);
}

/// Runs a kernel for the sizes of a layout; `retained_dim` is the size of all retained blocks concerned, if it is equal.
pub(super) fn run(layout: &Layout, retained_dim: Option<usize>, kernel: impl Kernel) {
    Arch::new().dispatch(Sized::<_, false> { layout, retained_dim, kernel });
}

/// Runs a kernel whose general version is independent of the local block size.
pub(super) fn run_for_any_local(layout: &Layout, retained_dim: Option<usize>, kernel: impl Kernel) {
    Arch::new().dispatch(Sized::<_, true> { layout, retained_dim, kernel });
}

/// Runs a kernel that does not depend on sizes.
pub(super) fn run_unsized(kernel: impl Kernel) {
    Arch::new().dispatch(Unsized { kernel });
}

/// Returns the compile-time size, or the run-time size if it is zero.
#[inline(always)]
pub(super) fn size<const N: usize>(at_run_time: usize) -> usize {
    if N > 0 { N } else { at_run_time }
}

/// `ANY`: whether one general kernel for all local block sizes is used if the sizes are uncommon.
struct Sized<'a, K, const ANY: bool> {
    layout: &'a Layout,
    retained_dim: Option<usize>,
    kernel: K,
}

impl<K: Kernel, const ANY: bool> WithSimd for Sized<'_, K, ANY> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // Machines without vectors use general kernels, because specialised ones, unrolled by lanes, would dominate the library size.
        match (self.layout.rows(), self.layout.local_dim(), self.retained_dim) {
            (2, 3, Some(6)) if const { S::F64_LANES > 1 } => self.kernel.run::<S, 2, 3, 6>(simd),
            (2, 3, Some(9)) if const { S::F64_LANES > 1 } => self.kernel.run::<S, 2, 3, 9>(simd),
            (2, 3, Some(12)) if const { S::F64_LANES > 1 } => self.kernel.run::<S, 2, 3, 12>(simd),
            _ if const { ANY } => self.kernel.run::<S, 0, 0, 0>(simd),
            (_, 3, _) => self.kernel.run::<S, 0, 3, 0>(simd),
            (_, 2, _) => self.kernel.run::<S, 0, 2, 0>(simd),
            _ => self.kernel.run::<S, 0, 1, 0>(simd),
        }
    }
}

struct Unsized<K> {
    kernel: K,
}

impl<K: Kernel> WithSimd for Unsized<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.kernel.run::<S, 0, 0, 0>(simd);
    }
}

/// Number of columns of a product with sums in registers.
const TOGETHER: usize = 6;
/// Number of rows of a product with sums in registers; matrices must be followed by as many readable elements.
pub(crate) const LANES: usize = 8;

/// Matrix stored row by row, in a buffer with at least [`LANES`] more elements.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub values: &'a [f64],
    pub width: usize,
    /// Distance between the starts of successive rows.
    pub stride: usize,
    pub count: usize,
}

/// target[i, j] += sign times the sum over rows of a[row][i] b[row][j]; the target is stored by columns with the given stride.
#[inline(always)]
pub(super) fn add_product<S: Simd>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    sign: f64,
    a: Rows<'_>,
    b: Rows<'_>,
) {
    add_products(simd, target, stride, [(sign, a, b)]);
}

/// Adds several products, which are summed before the target is accessed; all a have equal widths, and all b.
#[inline(always)]
pub(super) fn add_products<S: Simd, const N: usize>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    products: [(f64, Rows<'_>, Rows<'_>); N],
) {
    let Some(&(_, Rows { width: height, .. }, Rows { width, .. })) = products.first() else { return };
    for i in (0..height).step_by(LANES) {
        let target = &mut target[i..];
        let mut j = 0;
        while j < width {
            let target = &mut target[j * stride..];
            // Eight columns are processed together if their sums fit into registers, otherwise as twice four, not as six and two, for
            // independent operations. Without vectors, unrolled columns would be a large part of the library.
            j += match width - j {
                _ if const { S::F64_LANES == 1 } => {
                    add_columns::<S, N, 1>(simd, target, stride, &products, i, j)
                }
                LANES if S::F64_LANES == LANES => {
                    add_columns::<S, N, LANES>(simd, target, stride, &products, i, j)
                }
                8 | 4 | 5 => add_columns::<S, N, 4>(simd, target, stride, &products, i, j),
                3 => add_columns::<S, N, 3>(simd, target, stride, &products, i, j),
                2 => add_columns::<S, N, 2>(simd, target, stride, &products, i, j),
                1 => add_columns::<S, N, 1>(simd, target, stride, &products, i, j),
                _ => add_columns::<S, N, TOGETHER>(simd, target, stride, &products, i, j),
            };
        }
    }
}

/// right += sign times the sum over rows of a[row] b[row]; diagonal, if given, += the sum of squares of a.
#[inline(always)]
pub(super) fn add_right<S: Simd>(
    simd: S,
    right: &mut [f64],
    diagonal: Option<&mut [f64]>,
    sign: f64,
    a: Rows<'_>,
    b: &[f64],
) {
    let mut diagonal = diagonal;
    for i in (0..a.width).step_by(LANES) {
        let height = LANES.min(a.width - i);
        let mut sums = [[simd.splat_f64s(0.0); LANES]; 2];
        for row in 0..a.count {
            let vectors = S::as_simd_f64s(&a.values[row * a.stride + i..][..LANES]).0;
            let factor = simd.splat_f64s(b[row]);
            for k in 0..LANES / S::F64_LANES {
                sums[0][k] = simd.mul_add_f64s(vectors[k], factor, sums[0][k]);
                sums[1][k] = simd.mul_add_f64s(vectors[k], vectors[k], sums[1][k]);
            }
        }
        add_sums::<S, 1>(simd, &mut right[i..], 0, sign, &[sums[0]], height);
        if let Some(diagonal) = &mut diagonal {
            add_sums::<S, 1>(simd, &mut diagonal[i..], 0, 1.0, &[sums[1]], height);
        }
    }
}

/// Adds the sum over rows of x[row] times the first elements of the row, for each of two x.
#[inline(always)]
pub(super) fn add_rows<S: Simd>(
    simd: S,
    sums: &mut [[S::f64s; LANES]; 2],
    rows: &[f64],
    stride: usize,
    x: [&[f64]; 2],
) {
    for (i, row) in rows.windows(LANES).step_by(stride).take(x[0].len()).enumerate() {
        let vectors = S::as_simd_f64s(row).0;
        for c in 0..2 {
            let factor = simd.splat_f64s(x[c][i]);
            for k in 0..LANES / S::F64_LANES {
                sums[c][k] = simd.mul_add_f64s(vectors[k], factor, sums[c][k]);
            }
        }
    }
}

/// Copies a row of a block; common sizes without a call.
#[inline(always)]
pub(super) fn copy_few(from: &[f64], to: &mut [f64]) {
    match from.len() {
        6 => to[..6].copy_from_slice(&from[..6]),
        8 => to[..8].copy_from_slice(&from[..8]),
        9 => to[..9].copy_from_slice(&from[..9]),
        _ => to.copy_from_slice(from),
    }
}

/// Returns the scalar product of two vectors.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Returns the scalar product of two vectors, with one partial sum per lane.
#[inline(always)]
pub(super) fn dot_in_lanes(a: &[f64], b: &[f64]) -> f64 {
    let ((a, last), (b, end)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + last.iter().zip(end).map(|(a, b)| a * b).sum::<f64>()
}

/// Returns the scalar products of a vector with C others, stored by rows.
#[inline(always)]
pub(super) fn dot_columns<const C: usize>(a: &[f64], b: &[[f64; C]]) -> [f64; C] {
    let mut sums = [0.0; C];
    for (a, b) in a.iter().zip(b) {
        for c in 0..C {
            sums[c] += a * b[c];
        }
    }
    sums
}

/// Returns the scalar products of short vectors, with four independent partial sums.
#[inline(always)]
pub(super) fn dot_by_fours<const C: usize>(a: &[f64], b: &[[f64; C]]) -> [f64; C] {
    let ((a, last), (b, end)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [[0.0; C]; 4];
    for (a, b) in a.iter().zip(b) {
        for k in 0..4 {
            for c in 0..C {
                sums[k][c] += a[k] * b[k][c];
            }
        }
    }
    let rest = dot_columns(last, end);
    let [first, second, third, fourth] = sums;
    std::array::from_fn(|c| (first[c] + second[c]) + (third[c] + fourth[c]) + rest[c])
}

/// rights -= the sum over rows of a[row] b[row], for C right-hand sides.
#[inline(always)]
pub(super) fn subtract_rights<S: Simd, const C: usize>(
    simd: S,
    rights: &mut [[f64; C]],
    a: Rows<'_>,
    b: &[[f64; C]],
) {
    if C == 1 {
        return add_right(simd, rights.as_flattened_mut(), None, -1.0, a, b.as_flattened());
    }
    for (i, right) in rights.iter_mut().enumerate() {
        for (row, b) in b.iter().enumerate() {
            let factor = a.values[row * a.stride + i];
            for c in 0..C {
                right[c] -= factor * b[c];
            }
        }
    }
}

/// target += the sum over `parts` equal parts of a^T a - v^T v. Both products are summed jointly, part by part, so that small differences
/// have small partial sums.
#[inline(always)]
pub(super) fn add_difference<S: Simd>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    a: Rows<'_>,
    v: Rows<'_>,
    parts: usize,
) {
    for i in (0..a.width).step_by(LANES) {
        let target = &mut target[i..];
        let mut j = 0;
        while const { S::F64_LANES > 1 } && j + TOGETHER <= a.width {
            add_difference_columns::<S, TOGETHER>(simd, &mut target[j * stride..], stride, a, v, parts, i, j);
            j += TOGETHER;
        }
        while j < a.width {
            add_difference_columns::<S, 1>(simd, &mut target[j * stride..], stride, a, v, parts, i, j);
            j += 1;
        }
    }
}

/// Adds C columns of the products, and one row per lane; returns C.
#[inline(always)]
fn add_columns<S: Simd, const N: usize, const C: usize>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    products: &[(f64, Rows<'_>, Rows<'_>); N],
    i: usize,
    j: usize,
) -> usize {
    let mut sums = [[simd.splat_f64s(0.0); LANES]; C];
    for &(sign, a, b) in products {
        sum::<S, C>(simd, &mut sums, sign, a, i, b, j, 0..a.count);
    }
    add_sums::<S, C>(simd, target, stride, 1.0, &sums, LANES.min(products[0].1.width - i));
    C
}

#[inline(always)]
fn add_difference_columns<S: Simd, const C: usize>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    a: Rows<'_>,
    v: Rows<'_>,
    parts: usize,
    i: usize,
    j: usize,
) {
    let mut sums = [[simd.splat_f64s(0.0); LANES]; C];
    let (of_a, of_v) = (a.count / parts, v.count / parts);
    for part in 0..parts {
        sum::<S, C>(simd, &mut sums, 1.0, a, i, a, j, part * of_a..(part + 1) * of_a);
        sum::<S, C>(simd, &mut sums, -1.0, v, i, v, j, part * of_v..(part + 1) * of_v);
    }
    add_sums::<S, C>(simd, target, stride, 1.0, &sums, LANES.min(a.width - i));
}

/// Adds `sign` times the products of elements from i in the rows of a with elements from j in the rows of b. Only as many vectors as the
/// machine needs for [`LANES`] elements are used.
#[inline(always)]
fn sum<S: Simd, const C: usize>(
    simd: S,
    sums: &mut [[S::f64s; LANES]; C],
    sign: f64,
    a: Rows<'_>,
    i: usize,
    b: Rows<'_>,
    j: usize,
    rows: Range<usize>,
) {
    for row in rows {
        let vectors = S::as_simd_f64s(&a.values[row * a.stride + i..][..LANES]).0;
        let factors = &b.values[row * b.stride + j..][..C];
        let mut signed = [simd.splat_f64s(0.0); LANES];
        for k in 0..LANES / S::F64_LANES {
            signed[k] = simd.mul_f64s(vectors[k], simd.splat_f64s(sign));
        }
        for c in 0..C {
            let factor = simd.splat_f64s(factors[c]);
            for k in 0..LANES / S::F64_LANES {
                sums[c][k] = simd.mul_add_f64s(signed[k], factor, sums[c][k]);
            }
        }
    }
}

/// Adds `sign` times the first `height` elements of the sums to columns of the target.
#[inline(always)]
fn add_sums<S: Simd, const C: usize>(
    simd: S,
    target: &mut [f64],
    stride: usize,
    sign: f64,
    sums: &[[S::f64s; LANES]; C],
    height: usize,
) {
    let sign = simd.splat_f64s(sign);
    for c in 0..C {
        let column = &mut target[c * stride..][..height];
        for k in 0..LANES / S::F64_LANES {
            let part = part_in_vector::<S>(column, k);
            let sum = simd.mul_add_f64s(sums[c][k], sign, simd.partial_load_f64s(part));
            simd.partial_store_f64s(part, sum);
        }
    }
}

/// Returns the elements of vector `k` in a slice of at most [`LANES`] elements.
#[inline(always)]
fn part_in_vector<S: Simd>(all: &mut [f64], k: usize) -> &mut [f64] {
    let (first, end) = (k * S::F64_LANES, (k + 1) * S::F64_LANES);
    let count = all.len();
    &mut all[first.min(count)..end.min(count)]
}

/// Copies the first of [`LANES`] elements in vectors.
#[inline(always)]
pub(super) fn copy_vectors<S: Simd>(simd: S, vectors: &[S::f64s; LANES], target: &mut [f64]) {
    for k in 0..LANES / S::F64_LANES {
        simd.partial_store_f64s(part_in_vector::<S>(target, k), vectors[k]);
    }
}
