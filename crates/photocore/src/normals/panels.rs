//! Block-sparse symmetric matrices, stored as dense panels in a [`Symbolic`] pattern.
//!
//! Selected inverse: blocks of the inverse inside the pattern of the factor.

use std::sync::{Arc, Mutex, PoisonError};

use faer::Mat;

use super::layout::LayoutError;
use super::symbolic::Symbolic;
use crate::parallel::{each_chunk, lock};

/// Number of values that a thread copies at once.
const COPIED: usize = 1 << 18;

/// Lower triangle of a symmetric matrix in the pattern of a factor: one column-major panel per supernode. The strict upper triangle of the
/// eliminated blocks in a panel is undefined.
#[derive(Debug)]
pub(super) struct Panels {
    pub symbolic: Arc<Symbolic>,
    pub values: Vec<f64>,
}

impl Clone for Panels {
    /// Copies the values by all threads of the pool.
    fn clone(&self) -> Self {
        let mut values = vec![0.0; self.values.len()];
        let copy = |k: usize, own: &mut [f64]| own.copy_from_slice(&self.values[k * COPIED..][..own.len()]);
        each_chunk(&mut values, COPIED, &copy);
        Self { symbolic: Arc::clone(&self.symbolic), values }
    }
}

impl Panels {
    /// Returns the panel of a supernode.
    pub fn panel(&self, supernode: usize) -> &[f64] {
        &self.values[self.symbolic.supernodes()[supernode].panel.clone()]
    }

    /// Splits the values into panels, so that threads can write to them independently.
    pub fn divide(&mut self) -> Vec<Mutex<&mut [f64]>> {
        let mut rest = &mut self.values[..];
        let supernodes = self.symbolic.supernodes().iter();
        supernodes.map(|supernode| Mutex::new(skip(&mut rest, supernode.panel.len()))).collect()
    }
}

/// Splits `count` elements off the front of a mutable slice.
pub(super) fn skip<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (head, tail) = std::mem::take(rest).split_at_mut(count);
    *rest = tail;
    head
}

/// Splits `count` elements off the front of a slice.
pub(super) fn skip_ref<'a, T>(rest: &mut &'a [T], count: usize) -> &'a [T] {
    let (head, tail) = rest.split_at(count);
    *rest = tail;
    head
}

/// One value per supernode, passed between the threads that visit the supernodes.
pub(super) struct PerSupernode<T>(Vec<Mutex<Option<T>>>);

impl<T> PerSupernode<T> {
    pub fn new(count: usize) -> Self {
        Self((0..count).map(|_| Mutex::new(None)).collect())
    }

    pub fn put(&self, index: usize, value: T) {
        *lock(&self.0[index]) = Some(value);
    }

    pub fn take(&self, index: usize) -> Option<T> {
        lock(&self.0[index]).take()
    }

    /// Returns the remaining values, in order.
    pub fn into_values(self) -> impl Iterator<Item = Option<T>> {
        self.0.into_iter().map(|value| value.into_inner().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Blocks of N^-1 inside the pattern of the factor. They include diagonal blocks, and blocks of retained blocks that share a local block, a
/// term, a contribution or a pair of the layout.
#[derive(Debug)]
pub struct SelectedInverse {
    pub(super) panels: Panels,
}

impl SelectedInverse {
    /// Returns block (row, column) of the inverse, row by row. Blocks are numbered as in the layout.
    ///
    /// # Errors
    /// [`LayoutError::Block`] if the block is outside the pattern.
    pub fn block(&self, row: usize, column: usize) -> Result<Vec<f64>, LayoutError> {
        let symbolic = &*self.panels.symbolic;
        let (p, q) = (symbolic.position(row), symbolic.position(column));
        let (first, last) = (p.min(q), p.max(q));
        let supernode = symbolic.supernode_of(first);
        let at = symbolic.panel_row(supernode, last).ok_or(LayoutError::Block { row, column })?;
        let height = symbolic.supernodes()[supernode].height();
        let left = symbolic.range(first).start - symbolic.first_unknown(supernode);
        let panel = self.panels.panel(supernode);
        // Values are in the lower triangle: the row is later in elimination order.
        let value = |i: usize, j: usize| {
            let (high, low) = if p > q { (at + i, left + j) } else { (at + j, left + i) };
            if first == last {
                panel[low.min(high) * height + low.max(high)]
            } else {
                panel[low * height + high]
            }
        };
        let columns = symbolic.dim(q);
        Ok((0..symbolic.dim(p) * columns).map(|k| value(k / columns, k % columns)).collect())
    }

    /// Returns the inverse over some blocks, one after the other.
    ///
    /// # Errors
    /// [`LayoutError::Block`] if a pair of them is outside the pattern.
    pub fn over(&self, blocks: impl Iterator<Item = usize> + Clone) -> Result<Mat<f64>, LayoutError> {
        let width = |block: usize| self.panels.symbolic.dim(self.panels.symbolic.position(block));
        let order = blocks.clone().map(width).sum();
        let (mut q, mut first) = (Mat::<f64>::zeros(order, order), 0);
        let mut others = blocks.clone();
        for row in blocks {
            let mut left = first;
            for column in others.clone() {
                for (k, value) in self.block(row, column)?.into_iter().enumerate() {
                    let (i, j) = (first + k / width(column), left + k % width(column));
                    (q[(i, j)], q[(j, i)]) = (value, value);
                }
                left += width(column);
            }
            others.next();
            first += width(row);
        }
        Ok(q)
    }
}
