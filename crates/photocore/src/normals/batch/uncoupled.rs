//! Independent groups: only the products of their equations are assembled.
//!
//! The shared part of such a group may consist of many narrow pieces (spline knots near an image point). Their products are computed as one
//! matrix product in lanes, and then distributed over the front.

use pulp::Simd;

use super::{Batch, ColumnRun, JointProducts};
use crate::normals::front::Columns;
use crate::normals::layout::Layout;
use crate::normals::triangle::Triangle;
use crate::normals::vectorised::{Kernel, LANES, Rows, add_products, add_right, dot, run_unsized};

/// Mean width of parts below which they are multiplied jointly.
const NARROW: usize = LANES;

impl Batch {
    /// Sets the elimination results of independent groups to zero.
    pub(super) fn skip_elimination(&mut self, layout: &Layout) {
        let constants = &self.constants[..self.places.len() * self.locals.len() * layout.rows()];
        self.sum_of_squares = dot(constants, constants);
        (self.decrease, self.coupled) = (0.0, false);
        self.deficient.clear();
        self.reduced.fill(0.0);
        self.triangles.fill(Triangle::default());
        self.together.products.clear();
        if self.places.first().is_some_and(|own| own.width < NARROW * own.parts.len()) {
            self.find_columns();
            run_unsized(Multiply { batch: self, rows: layout.rows() });
        }
    }

    /// Whether the shared parts of the groups are multiplied jointly.
    pub(super) fn has_joint_products(&self) -> bool {
        self.uncoupled && !self.together.products.is_empty()
    }

    /// Adds the joint products of shared parts of independent groups.
    pub(super) fn add_joint_products(&self, columns: &mut Columns<'_>) {
        let (Some(main), Some(place)) = (self.main_blocks.first(), self.places.first()) else { return };
        let (width, JointProducts { products, right, runs }) = (place.width, &self.together);
        let of_main = &products[width * width..];
        for (index, &ColumnRun { at, column, width: size }) in runs.iter().enumerate() {
            for other in &runs[..=index] {
                let block = &products[other.column * width + column..];
                columns.add_block((at, size), (other.at, other.width), (block, width));
            }
            columns.add_block((at, size), (main.row, main.dim), (&of_main[column..], width));
            columns.add_to_right(at, &right[column..column + size], |i| products[(column + i) * (width + 1)]);
        }
    }

    /// Finds the columns that are contiguous in the front.
    fn find_columns(&mut self) {
        let mut runs = std::mem::take(&mut self.together.runs);
        runs.clear();
        for part in self.parts(0) {
            let at = self.spans[part.span].row + part.shift;
            match runs.last_mut() {
                Some(last) if (last.at + last.width, last.column + last.width) == (at, part.column) => {
                    last.width += part.width();
                }
                _ => runs.push(ColumnRun { at, column: part.column, width: part.width() }),
            }
        }
        self.together.runs = runs;
    }

    #[inline(always)]
    fn multiply<S: Simd>(&mut self, simd: S, rows: usize) {
        let JointProducts { mut products, mut right, runs } = std::mem::take(&mut self.together);
        let (Some(main), Some(place)) = (self.main_blocks.first(), self.places.first()) else { return };
        let (width, count) = (place.width, self.locals.len() * rows);
        let shared = |first: usize, end: usize| {
            let values = &self.shared_rows[place.rows + first..];
            Rows { values, width: end - first, stride: width, count }
        };
        let main_rows = self.main_rows::<0>(main, rows).rows;
        products.resize(width * (width + main.dim), 0.0);
        for first in (0..width).step_by(LANES) {
            let target = &mut products[first * (width + 1)..];
            let own = shared(first, width.min(first + LANES));
            add_products(simd, target, width, [(1.0, shared(first, width), own)]);
        }
        add_products(simd, &mut products[width * width..], width, [(1.0, shared(0, width), main_rows)]);
        right.clear();
        right.resize(width, 0.0);
        add_right(simd, &mut right, None, 1.0, shared(0, width), &self.constants[main.constants..]);
        self.together = JointProducts { products, right, runs };
    }
}

struct Multiply<'a> {
    batch: &'a mut Batch,
    rows: usize,
}

impl Kernel for Multiply<'_> {
    #[inline(always)]
    fn run<S: Simd, const R: usize, const L: usize, const D: usize>(self, simd: S) {
        self.batch.multiply(simd, self.rows);
    }
}
