//! The selected inverse: the blocks of the inverse inside the pattern of the factor (Takahashi et al. 1973).

use std::sync::Arc;

use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::dense::invert_front;
use super::factor::Factor;
use super::floors::Floors;
use super::panels::Panels;
use super::symbolic::Symbolic;

/// The blocks of N^-1 inside the pattern of the factor: every kept block's own, and those of every two kept blocks that
/// share a local block.
#[derive(Debug)]
pub struct SelectedInverse {
    panels: Panels,
}

impl SelectedInverse {
    /// Block (row, column) of the inverse, row by row; None outside the pattern. Kept blocks are counted as in the layout, the
    /// border is the block after the last.
    pub fn block(&self, row: usize, column: usize) -> Option<Vec<f64>> {
        let symbolic = &*self.panels.symbolic;
        let (p, q) = (symbolic.position(row), symbolic.position(column));
        let (first, last) = (p.min(q), p.max(q));
        symbolic.panel_row(symbolic.supernode_of(first), last)?;
        let mut positions = vec![first, last];
        positions.dedup();
        let start = [0, symbolic.dim(first), symbolic.dim(first) + symbolic.dim(last)];
        let width = start[positions.len()];
        let mut both = vec![0.0; width * width];
        self.gather(&positions, &start, &mut both);
        let (top, left) = (start[usize::from(p > q)], start[usize::from(q > p)]);
        let rows = both.chunks_exact(width).skip(top).take(symbolic.dim(p));
        Some(rows.flat_map(|values| &values[left..][..symbolic.dim(q)]).copied().collect())
    }

    /// Writes the inverse over blocks at ascending positions, all coupled to each other, into a full square matrix in which
    /// they begin at `start` (one more at the end, its width).
    #[inline(always)]
    pub(crate) fn gather(&self, positions: &[usize], start: &[usize], target: &mut [f64]) {
        let symbolic = &*self.panels.symbolic;
        let width = start[positions.len()];
        for (column, &position) in positions.iter().enumerate() {
            let supernode = symbolic.supernode_of(position);
            let s = &symbolic.supernodes()[supernode];
            let panel = &self.panels.values[s.panel.clone()];
            let first = symbolic.range(position).start - symbolic.first_unknown(supernode);
            for row in column..positions.len() {
                // Every pair that shares a local block is in the pattern.
                let Some(from) = symbolic.panel_row(supernode, positions[row]) else { continue };
                for j in 0..start[column + 1] - start[column] {
                    let values = &panel[(first + j) * s.height() + from..][..start[row + 1] - start[row]];
                    let skip = if row == column { j } else { 0 };
                    for (i, &value) in values.iter().enumerate().skip(skip) {
                        let (low, high) = (start[row] + i, start[column] + j);
                        target[low * width + high] = value;
                        target[high * width + low] = value;
                    }
                }
            }
        }
    }
}

impl Factor {
    /// Replaces the factor by the selected inverse of the reduced normal equations.
    pub fn into_selected_inverse(self, pool: &ThreadPool) -> SelectedInverse {
        let mut panels = self.panels;
        let symbolic = Arc::clone(&panels.symbolic);
        pool.install(|| invert_panels(&symbolic, &mut panels.values));
        panels.scale(&self.scale);
        SelectedInverse { panels }
    }
}

/// The inverse over the rows of one front (own blocks, then coupled blocks), full square.
type Front = Arc<Mat<f64>>;

fn invert_panels(symbolic: &Symbolic, values: &mut [f64]) {
    let floors = Floors::new(symbolic);
    // The front of its parent for each supernode still to be done; a front lives until the last child has taken it.
    let mut above: Vec<Option<Front>> = vec![None; symbolic.supernode_count()];
    for &index in floors.top.iter().rev() {
        let panel = &mut values[symbolic.supernodes()[index].panel.clone()];
        invert_supernode(symbolic, index, panel, &mut above, 0);
    }
    floors.divide(symbolic, values, &mut above).into_par_iter().for_each(|mut subtree| {
        let first = subtree.supernodes.start;
        for index in subtree.supernodes.clone().rev() {
            let (panel, above) = subtree.parts(symbolic, index);
            invert_supernode(symbolic, index, panel, above, first);
        }
    });
}

/// Inverts one panel, given the front of its parent in `above[index - first]`, and hands its own front to its children.
fn invert_supernode(
    symbolic: &Symbolic,
    index: usize,
    panel: &mut [f64],
    above: &mut [Option<Front>],
    first: usize,
) {
    let s = &symbolic.supernodes()[index];
    let mut front = Mat::<f64>::zeros(s.height(), s.height());
    if let Some(parent) = above[index - first].take() {
        take_coupled_rows(&parent, &symbolic.rows_in_parent(index), front.as_mut(), s.width);
    }
    let mut panel = MatMut::from_column_major_slice_mut(panel, s.height(), s.width);
    let below = front.as_ref().submatrix(s.width, s.width, s.below(), s.below());
    invert_front(panel.rb_mut(), below);
    if s.children.is_empty() {
        return;
    }
    for j in 0..s.width {
        for i in j..s.height() {
            front[(i, j)] = panel[(i, j)];
            front[(j, i)] = panel[(i, j)];
        }
    }
    let front = Arc::new(front);
    for &child in &s.children {
        above[child - first] = Some(Arc::clone(&front));
    }
}

/// Copies the inverse over the coupled rows of a supernode from the front of its parent.
fn take_coupled_rows(
    parent: &Mat<f64>,
    runs: &[(usize, usize, usize)],
    mut front: MatMut<'_, f64>,
    width: usize,
) {
    for &(to_column, from_column, columns) in runs {
        for k in 0..columns {
            let source = parent.col(from_column + k);
            let mut target = front.rb_mut().col_mut(width + to_column + k);
            for &(to_row, from_row, rows) in runs {
                for i in 0..rows {
                    target[width + to_row + i] = source[from_row + i];
                }
            }
        }
    }
}
