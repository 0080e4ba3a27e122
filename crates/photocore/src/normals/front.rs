//! One front of the multifrontal method while it is assembled.

use std::ops::Range;

use pulp::Simd;

use super::panels::skip;
use super::vectorised::{Rows, add_difference, add_product, add_products, add_right};

/// A front: the columns of a supernode, and what their elimination will leave for the parent. Rows and columns are those of the
/// supernode's panel, its own blocks before the coupled ones. Lower triangles; what stands above carries no meaning.
pub(super) struct Front<'a> {
    /// Own columns.
    pub width: usize,
    /// Own and coupled rows.
    pub height: usize,
    /// Own columns, column by column.
    pub panel: &'a mut [f64],
    /// Coupled rows and columns, column by column.
    pub update: Vec<f64>,
    /// Right-hand side.
    pub right: Vec<f64>,
    /// Diagonal of the normal equations before any elimination.
    pub diagonal: Vec<f64>,
}

impl<'a> Front<'a> {
    /// A front of zeros, but for the panel; `update` must hold zeros on and below its diagonal.
    pub fn new(width: usize, height: usize, panel: &'a mut [f64], update: Vec<f64>) -> Self {
        let (right, diagonal) = (vec![0.0; height], vec![0.0; height]);
        Self { width, height, panel, update, right, diagonal }
    }

    /// Adds one equation: coefficients in some rows and columns of the front, ascending, and the right-hand side.
    pub fn add_equation(&mut self, columns: &[usize], coefficients: &[f64], constant: f64) {
        let below = self.height - self.width;
        for (k, (&column, &value)) in columns.iter().zip(coefficients).enumerate() {
            self.right[column] += value * constant;
            self.diagonal[column] += value * value;
            let (target, shift) = if column < self.width {
                (&mut self.panel[column * self.height..][..self.height], 0)
            } else {
                (&mut self.update[(column - self.width) * below..][..below], self.width)
            };
            for (&row, other) in columns[k..].iter().zip(&coefficients[k..]) {
                target[row - shift] += value * other;
            }
        }
    }

    /// All columns.
    pub fn columns(&mut self) -> Columns<'_> {
        Columns {
            width: self.width,
            height: self.height,
            columns: 0..self.height,
            panel: self.panel,
            update: &mut self.update,
            right: &mut self.right,
            diagonal: &mut self.diagonal,
        }
    }

    /// The columns in parts that begin at 0 and at the given columns, ascending.
    pub fn parts(&mut self, starts: &[usize]) -> Vec<Columns<'_>> {
        let (width, height) = (self.width, self.height);
        let (mut panel, mut update) = (&mut *self.panel, &mut self.update[..]);
        let (mut right, mut diagonal) = (&mut self.right[..], &mut self.diagonal[..]);
        let mut first = 0;
        let ends = starts.iter().copied().filter(|&start| start > 0).chain([height]);
        let part = |end: usize| {
            let own = end.min(width) - first.min(width);
            let columns = Columns {
                width,
                height,
                columns: first..end,
                panel: skip(&mut panel, own * height),
                update: skip(&mut update, (end - first - own) * (height - width)),
                right: skip(&mut right, end - first),
                diagonal: skip(&mut diagonal, end - first),
            };
            first = end;
            columns
        };
        ends.map(part).collect()
    }
}

/// Some columns of a front.
pub(super) struct Columns<'a> {
    width: usize,
    height: usize,
    columns: Range<usize>,
    panel: &'a mut [f64],
    update: &'a mut [f64],
    right: &'a mut [f64],
    diagonal: &'a mut [f64],
}

/// A matrix whose columns belong to consecutive rows and columns of the front.
#[derive(Clone, Copy)]
pub(super) struct Strip<'a> {
    /// The first of them.
    pub at: usize,
    /// The matrix.
    pub rows: Rows<'a>,
}

impl Strip<'_> {
    /// The same without rows: its products are zero.
    #[inline(always)]
    pub fn emptied(self) -> Self {
        Self { rows: Rows { count: 0, ..self.rows }, ..self }
    }
}

impl Columns<'_> {
    /// Whether a column of the front is among these.
    #[inline(always)]
    pub fn contain(&self, column: usize) -> bool {
        self.columns.start <= column && column < self.columns.end
    }

    /// Adds `sign` A^T B in the rows of A and the columns of B.
    #[inline(always)]
    pub fn add_product<S: Simd>(&mut self, simd: S, sign: f64, a: Strip<'_>, b: Strip<'_>) {
        let (target, stride) = self.target(a.at, b.at);
        add_product(simd, target, stride, sign, a.rows, b.rows);
    }

    /// Adds A^T A - V^T V in the rows and columns of both, in so many parts.
    #[inline(always)]
    pub fn add_difference<S: Simd>(&mut self, simd: S, a: Strip<'_>, v: Strip<'_>, parts: usize) {
        let (target, stride) = self.target(a.at, a.at);
        add_difference(simd, target, stride, a.rows, v.rows, parts);
    }

    /// What begins at a row and column of the front, and by how much its columns lie apart.
    #[inline(always)]
    fn target(&mut self, row: usize, column: usize) -> (&mut [f64], usize) {
        if column < self.width {
            (&mut self.panel[(column - self.columns.start) * self.height + row..], self.height)
        } else {
            let (stride, first) = (self.height - self.width, self.columns.start.max(self.width));
            (&mut self.update[(column - first) * stride + row - self.width..], stride)
        }
    }

    /// Adds several products, each with its sign, in the rows of their A and the columns of their B: those of the first.
    #[inline(always)]
    pub fn add_products<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        products: [(f64, Strip<'_>, Strip<'_>); N],
    ) {
        let Some(&(_, a, b)) = products.first() else { return };
        let (target, stride) = self.target(a.at, b.at);
        add_products(simd, target, stride, products.map(|(sign, a, b)| (sign, a.rows, b.rows)));
    }

    /// Adds A^T b to the right-hand side, and the squares of the elements of A to the diagonal before elimination.
    #[inline(always)]
    pub fn add_equations<S: Simd>(&mut self, simd: S, a: Strip<'_>, b: &[f64]) {
        let own = a.at - self.columns.start..a.at - self.columns.start + a.rows.width;
        let diagonal = Some(&mut self.diagonal[own.clone()]);
        add_right(simd, &mut self.right[own], diagonal, 1.0, a.rows, b);
    }

    /// Adds a block, column by column with its stride: its rows and its columns belong to so many of the front from one on, and it is transposed
    /// there where it would stand above the diagonal. On the diagonal it is its lower triangle. What goes to other columns is left out.
    #[inline]
    pub fn add_block(
        &mut self,
        (row, height): (usize, usize),
        (column, width): (usize, usize),
        (block, stride): (&[f64], usize),
    ) {
        if row < column {
            for i in self.own(row, height) {
                let own = self.target(column, row + i).0[..width].iter_mut();
                own.zip(block[i..].iter().step_by(stride)).for_each(|(sum, value)| *sum += value);
            }
            return;
        }
        for j in self.own(column, width) {
            let above = if row == column { j } else { 0 };
            let own = self.target(row + above, column + j).0[..height - above].iter_mut();
            own.zip(&block[j * stride + above..]).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Adds to the right-hand side from a row of the front on, and to the diagonal before elimination, where these columns are.
    #[inline]
    pub fn add_to_right(&mut self, row: usize, values: &[f64], square: impl Fn(usize) -> f64) {
        for i in self.own(row, values.len()) {
            self.right[row + i - self.columns.start] += values[i];
            self.diagonal[row + i - self.columns.start] += square(i);
        }
    }

    /// Which of so many columns of the front from one on are among these.
    fn own(&self, first: usize, count: usize) -> Range<usize> {
        let place = |column: usize| column.saturating_sub(first).min(count);
        place(self.columns.start)..place(self.columns.end)
    }

    /// Takes A^T b off the right-hand side.
    #[inline(always)]
    pub fn subtract_right<S: Simd>(&mut self, simd: S, a: Strip<'_>, b: &[f64]) {
        let own = a.at - self.columns.start..a.at - self.columns.start + a.rows.width;
        add_right(simd, &mut self.right[own], None, -1.0, a.rows, b);
    }
}
