//! Dense kernels on the fronts of the factorisation: tiles of fixed size, each computed by one thread with `faer`, so that
//! the bits do not depend on the number of threads.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::triangle::PIVOT_TOLERANCE;

/// Columns factored at a time.
const STEP: usize = 48;
/// Side of the tiles of products and solutions.
const TILE: usize = 192;
/// Multiply-adds below which a tile loop stays on one thread.
const WORTH_SHARING: f64 = 2e6;

/// Factors the leading `width` columns of a symmetric front (lower triangle, `panel` = those columns) in place and
/// subtracts their product from the `update`, the rest of the front. `diagonal` is that of the columns before any elimination. Returns the columns whose pivot was lost in rounding:
/// their pivot is set to one and nothing below it.
pub(super) fn factor_front(
    mut panel: MatMut<'_, f64>,
    mut update: MatMut<'_, f64>,
    diagonal: &[f64],
) -> Vec<usize> {
    let (height, width) = (panel.nrows(), panel.ncols());
    let mut lost = Vec::new();
    for start in (0..width).step_by(STEP) {
        let step = STEP.min(width - start);
        let (left, right) = panel.rb_mut().split_at_col_mut(start + step);
        let (mut top, mut below) =
            left.subcols_mut(start, step).subrows_mut(start, height - start).split_at_row_mut(step);
        lost.extend(cholesky(top.rb_mut(), &diagonal[start..]).into_iter().map(|column| start + column));
        let factor = top.rb();
        for_tiles(row_tiles(below.rb_mut()), step * step * (height - start), |_, tile| {
            solve_lower_triangular_in_place(factor, tile.transpose_mut(), Par::Seq);
        });
        for column in lost.iter().filter(|&&column| column >= start) {
            below.rb_mut().col_mut(column - start).fill(0.0);
        }
        let rest = right.subrows_mut(start + step, height - start - step);
        subtract_square(rest, below.rb());
    }
    let below = panel.rb().subrows(width, height - width);
    subtract_square(update.rb_mut(), below);
    lost
}

/// target -= x x_top^T on and below the diagonal, x_top being the first rows of x, as many as the target has columns.
fn subtract_square(target: MatMut<'_, f64>, x: MatRef<'_, f64>) {
    let work = target.nrows() * target.ncols() * x.ncols() / 2;
    for_tiles(column_tiles(target), work, |first, tile| {
        let columns = tile.ncols();
        let rows = tile.nrows();
        let lower = tile.subrows_mut(first, rows - first);
        let left = x.subrows(first, rows - first);
        let right = x.subrows(first, columns).transpose();
        matmul(lower, Accum::Add, left, right, -1.0, Par::Seq);
    });
}

/// Cholesky factor of the lower triangle, in place; returns the columns whose pivot was lost in rounding.
/// A pivot is compared with the diagonal before any elimination.
fn cholesky(mut a: MatMut<'_, f64>, diagonal: &[f64]) -> Vec<usize> {
    let mut lost = Vec::new();
    for j in 0..a.ncols() {
        // Written so that a NaN counts as lost.
        let regular = a[(j, j)] > PIVOT_TOLERANCE * diagonal[j];
        if !regular {
            lost.push(j);
        }
        let pivot = if regular { a[(j, j)].sqrt() } else { 1.0 };
        a[(j, j)] = pivot;
        for i in j + 1..a.nrows() {
            a[(i, j)] = if regular { a[(i, j)] / pivot } else { 0.0 };
        }
        for k in j + 1..a.ncols() {
            let factor = a[(k, j)];
            for i in k..a.nrows() {
                a[(i, k)] -= a[(i, j)] * factor;
            }
        }
    }
    lost
}

/// One step of the selected inversion (Takahashi et al. 1973). From the panel `[L_J; L_R]` of the factor and the inverse
/// `z` of the coupled rows (full square), replaces the panel by that of the inverse:
///
/// Y = L_R L_J^-1, Z_RJ = -Z_RR Y, Z_JJ = (L_J L_J^T)^-1 - Y^T Z_RJ.
pub(super) fn invert_front(mut panel: MatMut<'_, f64>, z: MatRef<'_, f64>) {
    let (height, width) = (panel.nrows(), panel.ncols());
    let below_rows = height - width;
    let (mut own, mut below) = panel.rb_mut().split_at_row_mut(width);
    let mut y = below.rb().to_owned();
    let factor = own.rb();
    for_tiles(row_tiles(y.as_mut()), width * width * below_rows / 2, |_, tile| {
        solve_upper_triangular_in_place(factor.transpose(), tile.transpose_mut(), Par::Seq);
    });
    for_tiles(row_tiles(below.rb_mut()), width * below_rows * below_rows, |first, tile| {
        let rows = z.subrows(first, tile.nrows());
        matmul(tile, Accum::Replace, rows, y.as_ref(), -1.0, Par::Seq);
    });
    let mut inverse = Mat::<f64>::zeros(width, width);
    invert_lower_triangular(inverse.as_mut(), factor, Par::Seq);
    let (inverse, below) = (inverse.as_ref(), below.rb());
    for_tiles(column_tiles(own.rb_mut()), width * width * height, |first, mut tile| {
        let columns = tile.ncols();
        // Rows of L_J^-1 above its diagonal are zero: the product over them is left out.
        let right = inverse.subcols(first, columns).subrows(first, width - first);
        let left = inverse.subrows(first, width - first).transpose();
        matmul(tile.rb_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
        matmul(tile, Accum::Add, y.as_ref().transpose(), below.subcols(first, columns), -1.0, Par::Seq);
    });
}

fn row_tiles(matrix: MatMut<'_, f64>) -> Vec<(usize, MatMut<'_, f64>)> {
    tiles(matrix, MatMut::nrows, MatMut::split_at_row_mut)
}

fn column_tiles(matrix: MatMut<'_, f64>) -> Vec<(usize, MatMut<'_, f64>)> {
    tiles(matrix, MatMut::ncols, MatMut::split_at_col_mut)
}

/// Cuts a matrix into tiles, each with the index of its first row or column.
fn tiles<'a>(
    mut rest: MatMut<'a, f64>,
    length: impl Fn(&MatMut<'a, f64>) -> usize,
    split: impl Fn(MatMut<'a, f64>, usize) -> (MatMut<'a, f64>, MatMut<'a, f64>),
) -> Vec<(usize, MatMut<'a, f64>)> {
    let mut tiles = Vec::new();
    let mut first = 0;
    while length(&rest) > 0 {
        let size = TILE.min(length(&rest));
        let (tile, tail) = split(rest, size);
        tiles.push((first, tile));
        (rest, first) = (tail, first + size);
    }
    tiles
}

/// Does the work on every tile, on several threads when it is worth it.
fn for_tiles(
    tiles: Vec<(usize, MatMut<'_, f64>)>,
    work: usize,
    each: impl Fn(usize, MatMut<'_, f64>) + Sync,
) {
    if tiles.len() > 1 && work as f64 > WORTH_SHARING {
        tiles.into_par_iter().for_each(|(first, tile)| each(first, tile));
    } else {
        tiles.into_iter().for_each(|(first, tile)| each(first, tile));
    }
}
