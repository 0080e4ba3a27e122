//! Contribution of a partial system to the unknowns that it shares with other parts (Helmert blocking).
//!
//! With eliminated unknowns i and outer unknowns s, U = A_ss - A_si A_ii^-1 A_is and u = b_s - A_si A_ii^-1 b_i. They are the assembled,
//! unfactored front of the outer blocks.

use std::borrow::Cow;
use std::ops::Range;

use super::front::Front;
use super::layout::{Layout, LayoutError};
use super::panels::SelectedInverse;
use super::system::System;

/// Schur complement of a partial system on its outer unknowns, block by block.
#[derive(Debug, Clone, Default)]
pub struct Contribution<'a> {
    /// U, lower triangle, column by column.
    pub matrix: Cow<'a, [f64]>,
    /// u.
    pub right: Cow<'a, [f64]>,
    /// Diagonal of the normal equations before any elimination.
    pub diagonal: Cow<'a, [f64]>,
}

/// Number of elements in the lower triangle of a symmetric matrix.
pub const fn packed(order: usize) -> usize {
    order * (order + 1) / 2
}

/// Returns the range of column `j` of a packed lower triangle, from its diagonal.
pub(super) fn column(order: usize, j: usize) -> Range<usize> {
    let start = j * order - j * j.saturating_sub(1) / 2;
    start..start + order - j
}

impl Contribution<'_> {
    /// Whether all arrays fit this number of unknowns.
    pub fn is_over(&self, unknowns: usize) -> bool {
        let Self { matrix, right, diagonal } = self;
        [matrix.len(), right.len(), diagonal.len()] == [packed(unknowns), unknowns, unknowns]
    }
}

impl Front<'_> {
    /// Adds a contribution to the given rows and columns of the front, lower triangle only.
    pub fn add_contribution(&mut self, given: &Contribution<'_>, rows: &[usize]) {
        let (width, height) = (self.width, self.height);
        for (j, &at) in rows.iter().enumerate() {
            self.right[at] += given.right[j];
            self.diagonal[at] += given.diagonal[j];
            for (&value, &other) in given.matrix[column(rows.len(), j)].iter().zip(&rows[j..]) {
                let (row, column) = (at.max(other), at.min(other));
                if column < width {
                    self.panel[column * height + row] += value;
                } else {
                    self.update[(column - width) * (height - width) + row - width] += value;
                }
            }
        }
    }
}

impl System {
    /// Returns the rows of some retained blocks in the front of a supernode; all must be in its pattern.
    pub(super) fn rows_of(&self, supernode: usize, blocks: &[u32]) -> Vec<usize> {
        let rows = |&block: &u32| {
            let position = self.symbolic.position(block as usize);
            let row = self.symbolic.row_of(supernode, position);
            row..row + self.symbolic.dim(position)
        };
        blocks.iter().flat_map(rows).collect()
    }
}

/// Expands a packed lower triangle to a full symmetric matrix.
pub(super) fn unpack(order: usize, triangle: &[f64], square: &mut [f64]) {
    for j in 0..order {
        for (i, &value) in (j..order).zip(&triangle[column(order, j)]) {
            (square[j * order + i], square[i * order + j]) = (value, value);
        }
    }
}

impl SelectedInverse {
    /// Returns the inverse over retained blocks that are coupled in the pattern, in order: a lower triangle, column by column.
    ///
    /// # Errors
    /// [`LayoutError::Block`] if a pair of the blocks is outside the pattern.
    pub fn triangle(&self, layout: &Layout, blocks: &[u32]) -> Result<Vec<f64>, LayoutError> {
        let starts = blocks.iter().scan(0, |next, &block| {
            let start = *next;
            *next += layout.retained_dim(block as usize);
            Some(start)
        });
        let starts: Vec<usize> = starts.collect();
        let order = layout.unknowns_of(blocks).count();
        let mut triangle = vec![0.0; packed(order)];
        for (a, (&block, &left)) in blocks.iter().zip(&starts).enumerate() {
            let width = layout.retained_dim(block as usize);
            for (&other, &top) in blocks[a..].iter().zip(&starts[a..]) {
                let values = self.block(other as usize, block as usize)?;
                for (i, row) in values.chunks_exact(width.max(1)).enumerate() {
                    for (j, &value) in row.iter().enumerate().filter(|(j, _)| left + j <= top + i) {
                        triangle[column(order, left + j).start + top + i - left - j] = value;
                    }
                }
            }
        }
        Ok(triangle)
    }
}
