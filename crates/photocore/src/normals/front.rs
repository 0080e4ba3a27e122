//! Front of the multifrontal method during its assembly.

use std::ops::Range;

use pulp::Simd;

use super::panels::skip;
use super::vectorised::{Rows, add_difference, add_product, add_products, add_right};

/// Front: columns of a supernode and its update matrix. Rows and columns are in the order of the supernode's panel, eliminated blocks
/// before coupled ones. Only lower triangles are used; upper ones are undefined.
pub(super) struct Front<'a> {
    /// Number of eliminated columns.
    pub width: usize,
    /// Number of eliminated and coupled rows.
    pub height: usize,
    /// Eliminated columns, column by column.
    pub panel: &'a mut [f64],
    /// Update matrix over coupled rows and columns, column by column.
    pub update: Vec<f64>,
    /// Right-hand side.
    pub right: Vec<f64>,
    /// Diagonal of the normal equations before any elimination.
    pub diagonal: Vec<f64>,
}

impl<'a> Front<'a> {
    /// Creates a front with zero right-hand side and diagonal; `update` must be zero on and below its diagonal.
    pub fn new(width: usize, height: usize, panel: &'a mut [f64], update: Vec<f64>) -> Self {
        let (right, diagonal) = (vec![0.0; height], vec![0.0; height]);
        Self { width, height, panel, update, right, diagonal }
    }

    /// Adds one equation: coefficients for some columns of the front, ascending, and the right-hand side.
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

    /// Returns a view of all columns.
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

    /// Splits the columns into parts that start at 0 and at the given columns, ascending.
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

/// View of some columns of a front.
pub(super) struct Columns<'a> {
    width: usize,
    height: usize,
    columns: Range<usize>,
    panel: &'a mut [f64],
    update: &'a mut [f64],
    right: &'a mut [f64],
    diagonal: &'a mut [f64],
}

/// Matrix with consecutive columns of the front.
#[derive(Clone, Copy)]
pub(super) struct PanelView<'a> {
    /// First column in the front.
    pub at: usize,
    /// The matrix.
    pub rows: Rows<'a>,
}

impl PanelView<'_> {
    /// Returns the strip without rows, so that its products are zero.
    #[inline(always)]
    pub fn emptied(self) -> Self {
        Self { rows: Rows { count: 0, ..self.rows }, ..self }
    }
}

impl Columns<'_> {
    /// Whether a column of the front is in this view.
    #[inline(always)]
    pub fn contain(&self, column: usize) -> bool {
        self.columns.start <= column && column < self.columns.end
    }

    /// Adds `sign` A^T B in the rows of A and the columns of B.
    #[inline(always)]
    pub fn add_product<S: Simd>(&mut self, simd: S, sign: f64, a: PanelView<'_>, b: PanelView<'_>) {
        let (target, stride) = self.target(a.at, b.at);
        add_product(simd, target, stride, sign, a.rows, b.rows);
    }

    /// Adds A^T A - V^T V in the rows and columns of both, in the given number of parts.
    #[inline(always)]
    pub fn add_difference<S: Simd>(&mut self, simd: S, a: PanelView<'_>, v: PanelView<'_>, parts: usize) {
        let (target, stride) = self.target(a.at, a.at);
        add_difference(simd, target, stride, a.rows, v.rows, parts);
    }

    /// Returns the storage from a row and column of the front, with its column stride.
    #[inline(always)]
    fn target(&mut self, row: usize, column: usize) -> (&mut [f64], usize) {
        if column < self.width {
            (&mut self.panel[(column - self.columns.start) * self.height + row..], self.height)
        } else {
            let (stride, first) = (self.height - self.width, self.columns.start.max(self.width));
            (&mut self.update[(column - first) * stride + row - self.width..], stride)
        }
    }

    /// Adds several products with signs, all in the rows of the first A and the columns of the first B.
    #[inline(always)]
    pub fn add_products<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        products: [(f64, PanelView<'_>, PanelView<'_>); N],
    ) {
        let Some(&(_, a, b)) = products.first() else { return };
        let (target, stride) = self.target(a.at, b.at);
        add_products(simd, target, stride, products.map(|(sign, a, b)| (sign, a.rows, b.rows)));
    }

    /// Adds A^T b to the right-hand side, and the squares of the elements of A to the initial diagonal.
    #[inline(always)]
    pub fn add_equations<S: Simd>(&mut self, simd: S, a: PanelView<'_>, b: &[f64]) {
        let own = a.at - self.columns.start..a.at - self.columns.start + a.rows.width;
        let diagonal = Some(&mut self.diagonal[own.clone()]);
        add_right(simd, &mut self.right[own], diagonal, 1.0, a.rows, b);
    }

    /// Adds a block, stored by columns with a stride, at the given rows and columns of the front. It is transposed if it would be above the
    /// diagonal; on the diagonal only its lower triangle is added. Columns outside this view are skipped.
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

    /// Adds to the right-hand side from a row of the front, and to the initial diagonal, for the columns of this view.
    #[inline]
    pub fn add_to_right(&mut self, row: usize, values: &[f64], square: impl Fn(usize) -> f64) {
        for i in self.own(row, values.len()) {
            self.right[row + i - self.columns.start] += values[i];
            self.diagonal[row + i - self.columns.start] += square(i);
        }
    }

    /// Returns the part of a column range of the front that is in this view.
    fn own(&self, first: usize, count: usize) -> Range<usize> {
        let place = |column: usize| column.saturating_sub(first).min(count);
        place(self.columns.start)..place(self.columns.end)
    }

    /// Subtracts A^T b from the right-hand side.
    #[inline(always)]
    pub fn subtract_right<S: Simd>(&mut self, simd: S, a: PanelView<'_>, b: &[f64]) {
        let own = a.at - self.columns.start..a.at - self.columns.start + a.rows.width;
        add_right(simd, &mut self.right[own], None, -1.0, a.rows, b);
    }
}
