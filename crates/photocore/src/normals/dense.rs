//! Dense kernels on the fronts of the factorisation. Each fixed-size tile is computed by one thread with `faer`, so that results are
//! bitwise independent of the number of threads.

use std::hint::black_box;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use pulp::Simd;

use super::triangle::PIVOT_TOLERANCE;
use super::vectorised::{Kernel, run_unsized};
use super::workspace::Workspace;
use crate::context::Control;
use crate::parallel;

/// Number of columns per factorisation step.
const STEP: usize = 48;
/// Tile size of products and solutions.
const TILE: usize = 192;
/// Minimum number of multiply-adds of a tile loop for several threads.
const WORTH_SHARING: f64 = 2e6;

/// Minimum order of matrices whose product allocates buffers.
const BUFFERED: usize = 32;

/// Allocates the product buffers of the current thread, twice the size of its last cache. The library reuses them. Otherwise the first
/// large product of a thread would allocate them, and abort the process if memory is insufficient.
pub fn preallocate_product_buffers() {
    let ones = vec![1.0; BUFFERED * BUFFERED];
    let ones = MatRef::from_column_major_slice(&ones, BUFFERED, BUFFERED);
    let mut product = vec![0.0; BUFFERED * BUFFERED];
    let into = MatMut::from_column_major_slice_mut(&mut product, BUFFERED, BUFFERED);
    matmul(into, Accum::Replace, ones, ones, 1.0, Par::Seq);
    black_box(&product);
}

/// Irregular pivots, as columns of a front, ascending.
#[derive(Debug, Default)]
pub(super) struct Pivots {
    /// Pivots that are lost in rounding errors: set to one, with zeros below.
    pub lost: Vec<usize>,
    /// Pivots so small compared with the diagonal that they may be rounding errors, each behind its ratio to the diagonal.
    pub doubtful: Vec<(f64, usize)>,
}

/// Ratio of a pivot to its initial diagonal element below which it is doubtful.
const DOUBTFUL: f64 = 1e-8;

/// Factors the leading `width` columns of a symmetric front (lower triangle, stored in `panel`). Subtracts their product from `update`, the
/// rest of the front. `diagonal` is the initial diagonal of the columns. Pivots of the columns `given_up` always count as lost.
pub(super) fn factor_front(
    mut panel: MatMut<'_, f64>,
    mut update: MatMut<'_, f64>,
    diagonal: &[f64],
    given_up: &[usize],
    control: &Control,
) -> Pivots {
    let (height, width) = (panel.nrows(), panel.ncols());
    let mut pivots = Pivots::default();
    eliminate(panel.rb_mut(), diagonal, given_up, 0, &mut pivots, control);
    subtract_square(update.rb_mut(), panel.rb().subrows(width, height - width), control);
    pivots
}

/// Eliminates columns by recursive bisection, so that most of the work is in large products. The columns are those of the front from
/// `first`, and start at their diagonal row.
fn eliminate(
    columns: MatMut<'_, f64>,
    diagonal: &[f64],
    given_up: &[usize],
    first: usize,
    pivots: &mut Pivots,
    control: &Control,
) {
    let (height, width) = (columns.nrows(), columns.ncols());
    if width <= STEP {
        return eliminate_step(columns, diagonal, given_up, first, pivots, control);
    }
    let half = (width / 2).next_multiple_of(STEP);
    let (mut left, right) = columns.split_at_col_mut(half);
    let mut right = right.subrows_mut(half, height - half);
    eliminate(left.rb_mut(), &diagonal[..half], given_up, first, pivots, control);
    subtract_square(right.rb_mut(), left.rb().subrows(half, height - half), control);
    eliminate(right, &diagonal[half..], given_up, first + half, pivots, control);
}

/// Eliminates a few columns one by one.
fn eliminate_step(
    columns: MatMut<'_, f64>,
    diagonal: &[f64],
    given_up: &[usize],
    first: usize,
    pivots: &mut Pivots,
    control: &Control,
) {
    let (height, width) = (columns.nrows(), columns.ncols());
    let (mut top, mut below) = columns.split_at_row_mut(width);
    let mut own = vec![0.0; width * width];
    MatMut::from_column_major_slice_mut(&mut own, width, width).copy_from(top.rb());
    let before = pivots.lost.len();
    run_unsized(Cholesky { a: &mut own, width, diagonal, given_up, first, pivots });
    top.copy_from(MatRef::from_column_major_slice(&own, width, width));
    let factor = top.rb();
    for_tiles(control, row_tiles(below.rb_mut()), width * width * height, &|_, tile| {
        solve_lower_triangular_in_place(factor, tile.transpose_mut(), Par::Seq);
    });
    for &column in &pivots.lost[before..] {
        below.rb_mut().col_mut(column - first).fill(0.0);
    }
}

/// target -= x x_top^T on and below the diagonal; x_top contains as many leading rows of x as the target has columns.
fn subtract_square(target: MatMut<'_, f64>, x: MatRef<'_, f64>, control: &Control) {
    let work = target.nrows() * target.ncols() * x.ncols() / 2;
    for_tiles(control, column_tiles(target), work, &|first, tile| {
        let columns = tile.ncols();
        let rows = tile.nrows();
        let lower = tile.subrows_mut(first, rows - first);
        let left = x.subrows(first, rows - first);
        let right = x.subrows(first, columns).transpose();
        matmul(lower, Accum::Add, left, right, -1.0, Par::Seq);
    });
}

/// Cholesky factorisation of the lower triangle of a matrix, column by column, in place. A pivot is compared with the initial diagonal;
/// column indices are relative to `first`.
struct Cholesky<'a> {
    a: &'a mut [f64],
    width: usize,
    diagonal: &'a [f64],
    given_up: &'a [usize],
    first: usize,
    pivots: &'a mut Pivots,
}

impl Kernel for Cholesky<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, _: S) {
        let width = self.width;
        for j in 0..width {
            let (left, right) = self.a.split_at_mut(j * width);
            let column = &mut right[j..width];
            for k in 0..j {
                let other = &left[k * width + j..][..width - j];
                let factor = other[0];
                for i in 0..width - j {
                    column[i] -= factor * other[i];
                }
            }
            // With this comparison a NaN is regarded as lost.
            let given_up = self.given_up.contains(&(self.first + j));
            let regular = column[0] > PIVOT_TOLERANCE * self.diagonal[j] && !given_up;
            let pivot = if regular { column[0].sqrt() } else { 1.0 };
            let scale = if regular { pivot.recip() } else { 0.0 };
            column[0] = pivot;
            for i in 1..width - j {
                // A lost column may not be finite.
                column[i] = if regular { column[i] * scale } else { 0.0 };
            }
            if !regular {
                self.pivots.lost.push(self.first + j);
            } else if pivot * pivot < DOUBTFUL * self.diagonal[j] {
                self.pivots.doubtful.push((pivot * pivot / self.diagonal[j], self.first + j));
            }
        }
    }
}

/// Performs one step of the selected inversion (Takahashi et al. 1973). From the panel `[L_J; L_R]` of the factor and the inverse `z` over
/// the coupled rows (full square), it computes the panel of the inverse in place:
///
/// Y = L_R L_J^-1, Z_RJ = -Z_RR Y, Z_JJ = (L_J L_J^T)^-1 - Y^T Z_RJ.
///
/// None if memory is insufficient.
pub(super) fn invert_front(
    mut panel: MatMut<'_, f64>,
    z: MatRef<'_, f64>,
    workspace: &Workspace,
    control: &Control,
) -> Option<()> {
    let (height, width) = (panel.nrows(), panel.ncols());
    let below_rows = height - width;
    let (mut own, mut below) = panel.rb_mut().split_at_row_mut(width);
    let mut y_values = control.allocated(workspace.any(below_rows * width))?;
    let mut y = MatMut::from_column_major_slice_mut(&mut y_values, below_rows, width);
    y.copy_from(below.rb());
    let factor = own.rb();
    for_tiles(control, row_tiles(y.rb_mut()), width * width * below_rows / 2, &|_, tile| {
        solve_upper_triangular_in_place(factor.transpose(), tile.transpose_mut(), Par::Seq);
    });
    for_tiles(control, row_tiles(below.rb_mut()), width * below_rows * below_rows, &|first, tile| {
        let rows = z.subrows(first, tile.nrows());
        matmul(tile, Accum::Replace, rows, y.rb(), -1.0, Par::Seq);
    });
    let mut inverse_values = control.allocated(workspace.zeros(width * width))?;
    let mut inverse = MatMut::from_column_major_slice_mut(&mut inverse_values, width, width);
    invert_lower_triangular(inverse.rb_mut(), factor, Par::Seq);
    let (inverse, below) = (inverse.rb(), below.rb());
    for_tiles(control, column_tiles(own.rb_mut()), width * width * height, &|first, mut tile| {
        let columns = tile.ncols();
        // Rows of L_J^-1 above its diagonal are zero and are skipped.
        let right = inverse.subcols(first, columns).subrows(first, width - first);
        let left = inverse.subrows(first, width - first).transpose();
        matmul(tile.rb_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
        matmul(tile, Accum::Add, y.rb().transpose(), below.subcols(first, columns), -1.0, Par::Seq);
    });
    workspace.put_back(y_values);
    workspace.put_back(inverse_values);
    Some(())
}

fn row_tiles(matrix: MatMut<'_, f64>) -> Vec<(usize, MatMut<'_, f64>)> {
    tiles(matrix, MatMut::nrows, MatMut::split_at_row_mut)
}

fn column_tiles(matrix: MatMut<'_, f64>) -> Vec<(usize, MatMut<'_, f64>)> {
    tiles(matrix, MatMut::ncols, MatMut::split_at_col_mut)
}

/// Splits a matrix into tiles, each with the index of its first row or column.
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

/// Processes every tile, with several threads for large work; skips the remaining tiles after a stop.
fn for_tiles(
    control: &Control,
    tiles: Vec<(usize, MatMut<'_, f64>)>,
    work: usize,
    each: &(dyn Fn(usize, MatMut<'_, f64>) + Sync),
) {
    let each = |(first, tile): (usize, MatMut<'_, f64>)| {
        if !control.stopped() {
            each(first, tile);
        }
    };
    if tiles.len() > 1 && work as f64 > WORTH_SHARING {
        parallel::each_of(tiles, &|_, tile| each(tile));
    } else {
        tiles.into_iter().for_each(each);
    }
}
