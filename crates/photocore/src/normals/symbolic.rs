//! Symbolic phase: elimination order and pattern of the factor.

use std::ops::Range;

use super::graph::{Graph, MANY};
use super::layout::{Layout, LayoutError};
use super::ordering::Ordering;
use super::supernodes::{Merged, merge_columns, offsets, places, sort_commons};
use crate::parallel;

/// Accepted ratio of predicted operations to the minimum.
const AS_GOOD: f64 = 1.05;

/// Elimination order and factor pattern of the reduced normal equations.
///
/// The *position* of a block is its index in the elimination order. Blocks of nearly equal pattern form one supernode, whose columns form
/// one dense panel. Outer blocks form the last supernode, which is *open*: its front is assembled but not factored.
#[derive(Debug, Clone)]
pub struct Symbolic {
    ordering: Ordering,
    predictions: Vec<(Ordering, Option<f64>)>,
    position_of: Vec<usize>,
    block_at: Vec<usize>,
    offset: Vec<usize>,
    supernode_of: Vec<usize>,
    supernodes: Vec<Supernode>,
    values: usize,
    /// Supernode of the outer blocks.
    open: Option<usize>,
}

/// Adjacent blocks that are eliminated together, with their coupled blocks below.
#[derive(Debug, Clone)]
pub(crate) struct Supernode {
    /// Positions of the eliminated blocks.
    pub blocks: Range<usize>,
    /// Positions of the coupled blocks below, ascending.
    pub rows: Vec<usize>,
    /// Panel row of the start of each element of `rows`, and the height.
    pub row_offset: Vec<usize>,
    /// Number of columns of the panel.
    pub width: usize,
    /// Supernode of the first element of `rows`.
    pub parent: Option<usize>,
    /// Supernodes whose parent is this one.
    pub children: Vec<usize>,
    /// Range of the panel, column by column, in the values of the factor.
    pub panel: Range<usize>,
}

impl Supernode {
    /// Number of panel rows: eliminated blocks, then coupled blocks.
    pub fn height(&self) -> usize {
        self.row_offset[self.rows.len()]
    }

    /// Number of rows below the eliminated blocks.
    pub fn below(&self) -> usize {
        self.height() - self.width
    }

    /// Predicted multiply-adds of its part of the factorisation.
    pub fn operations(&self) -> f64 {
        multiply_adds(self.width, self.below())
    }
}

/// Predicted numbers of multiply-adds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Operations {
    /// Reduction of the local blocks, per formation.
    pub reduction: f64,
    /// Factorisation of the reduced normal equations.
    pub factor: f64,
    /// Selected inversion.
    pub inverse: f64,
}

impl Symbolic {
    /// Orders the retained blocks of a layout and computes the pattern of the factor.
    ///
    /// # Errors
    /// [`LayoutError::Ordering`] if the layout is too large for the ordering. [`Ordering::Auto`] skips orderings for which the layout is
    /// too large (see [`Symbolic::predictions`]).
    pub fn new(layout: &Layout, ordering: Ordering) -> Result<Self, LayoutError> {
        let graph = Graph::new(layout);
        let try_out = |&candidate: &Ordering| {
            let order = candidate.order(&graph, layout);
            (candidate, order.map(|order| (predicted_operations(layout, &graph, &order), order)))
        };
        let orderings = ordering.candidates();
        let candidates: Vec<Candidate> = if graph.len() < MANY {
            orderings.iter().map(try_out).collect()
        } else {
            parallel::map_each(orderings.iter().collect(), &try_out)
        };
        let predictions = predictions_of(&candidates);
        // The input order, the first candidate, has photos before shared blocks: fronts are small and independent.
        let enough = if layout.has_shared() { AS_GOOD } else { 1.0 };
        let (ordering, order) = cheapest(candidates, enough).ok_or(LayoutError::Ordering(ordering.name()))?;
        Ok(Self { predictions, ..Self::with_order(layout, &graph, ordering, &order) })
    }

    fn with_order(layout: &Layout, graph: &Graph, ordering: Ordering, order: &[usize]) -> Self {
        let inner = order.len() - layout.outer().len();
        let mut block_at = postorder(graph, order, inner);
        let mut columns = column_patterns(graph, &block_at, &places(&block_at));
        columns.truncate(inner);
        let mut merged = merge_columns(columns, &offsets(layout, &block_at));
        sort_commons(layout, &mut block_at, &mut merged);
        let mut symbolic = Self {
            ordering,
            predictions: Vec::new(),
            position_of: places(&block_at),
            offset: offsets(layout, &block_at),
            supernode_of: vec![0; block_at.len()],
            block_at,
            supernodes: Vec::new(),
            values: 0,
            open: None,
        };
        symbolic.gather_supernodes(merged, inner);
        symbolic
    }

    /// Creates the supernodes and their panels. Blocks from position `inner` are outer blocks.
    fn gather_supernodes(&mut self, merged: Vec<Merged>, inner: usize) {
        let count = self.block_at.len();
        let outer = (inner < count).then_some((inner..count, Vec::new()));
        self.open = outer.is_some().then_some(merged.len());
        for (blocks, rows) in merged.into_iter().chain(outer) {
            let width = self.offset[blocks.end] - self.offset[blocks.start];
            let mut row_offset = vec![width];
            for &row in &rows {
                row_offset.push(row_offset[row_offset.len() - 1] + self.dim(row));
            }
            let size = width * row_offset[rows.len()];
            let index = self.supernodes.len();
            self.supernode_of[blocks.clone()].fill(index);
            self.supernodes.push(Supernode {
                blocks,
                rows,
                row_offset,
                width,
                parent: None,
                children: Vec::new(),
                panel: self.values..self.values + size,
            });
            self.values += size;
        }
        for index in 0..self.supernodes.len() {
            if let Some(&first) = self.supernodes[index].rows.first() {
                let parent = self.supernode_of[first];
                self.supernodes[index].parent = Some(parent);
                self.supernodes[parent].children.push(index);
            }
        }
    }

    /// Returns the chosen ordering (never [`Ordering::Auto`]).
    pub fn ordering(&self) -> Ordering {
        self.ordering
    }

    /// Returns the candidate orderings with the predicted multiply-adds of a factorisation; None if the layout is too large for one.
    pub fn predictions(&self) -> &[(Ordering, Option<f64>)] {
        &self.predictions
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.block_at.len()
    }

    /// Number of unknowns in the reduced normal equations.
    pub fn unknowns(&self) -> usize {
        self.offset[self.blocks()]
    }

    /// Number of values in the panels of the factor.
    pub fn values(&self) -> usize {
        self.values
    }

    /// Number of supernodes.
    pub fn supernode_count(&self) -> usize {
        self.supernodes.len()
    }

    /// Returns the predicted multiply-adds of each phase.
    pub fn operations(&self, layout: &Layout) -> Operations {
        let reduction = (0..layout.locals())
            .map(|local| {
                let width = layout.reduced_width(local);
                (width * (width + 6) / 2 * layout.local_dim()) as f64
            })
            .sum();
        let inverse = self.closed().iter().map(|s| {
            let (w, r) = (s.width as f64, s.below() as f64);
            r * r * w + 1.5 * r * w * w + w * w * w / 2.0
        });
        Operations { reduction, factor: self.factor_operations(), inverse: inverse.sum() }
    }

    fn factor_operations(&self) -> f64 {
        self.closed().iter().map(Supernode::operations).sum()
    }

    /// Returns the supernode of the outer blocks, the last one, whose front is not factored.
    pub(crate) fn open(&self) -> Option<usize> {
        self.open
    }

    /// Number of unknowns in the outer blocks.
    pub fn outer_unknowns(&self) -> usize {
        self.open.map_or(0, |open| self.supernodes[open].width)
    }

    /// Returns the factored supernodes: all except the open one.
    pub(crate) fn closed(&self) -> &[Supernode] {
        &self.supernodes[..self.open.unwrap_or(self.supernodes.len())]
    }

    pub(crate) fn supernodes(&self) -> &[Supernode] {
        &self.supernodes
    }

    /// Returns the position of a retained block in the elimination order.
    pub(crate) fn position(&self, block: usize) -> usize {
        self.position_of[block]
    }

    /// Returns the retained block at a position.
    pub(crate) fn block(&self, position: usize) -> usize {
        self.block_at[position]
    }

    /// Returns all blocks in their elimination order.
    pub fn order(&self) -> &[usize] {
        &self.block_at
    }

    pub(crate) fn dim(&self, position: usize) -> usize {
        self.offset[position + 1] - self.offset[position]
    }

    /// Returns the unknowns of a position, as indices in the elimination order.
    pub(crate) fn range(&self, position: usize) -> Range<usize> {
        self.offset[position]..self.offset[position + 1]
    }

    /// Returns the unknowns of a position, as indices in the vector of unknowns.
    pub(crate) fn unknowns_at(&self, layout: &Layout, position: usize) -> Range<usize> {
        layout.retained_range(self.block_at[position])
    }

    pub(crate) fn supernode_of(&self, position: usize) -> usize {
        self.supernode_of[position]
    }

    /// Returns the first unknown of a supernode in the elimination order.
    pub(crate) fn first_unknown(&self, supernode: usize) -> usize {
        self.offset[self.supernodes[supernode].blocks.start]
    }

    /// Returns the panel row of the block at `position` in a supernode; None if it is outside the pattern.
    pub(crate) fn panel_row(&self, supernode: usize, position: usize) -> Option<usize> {
        let s = &self.supernodes[supernode];
        let is_in_it = s.blocks.contains(&position) || s.rows.binary_search(&position).is_ok();
        is_in_it.then(|| self.row_of(supernode, position))
    }

    /// Returns the panel row of a block in the pattern, which [`System`](super::System) has checked.
    pub(crate) fn row_of(&self, supernode: usize, position: usize) -> usize {
        let s = &self.supernodes[supernode];
        if s.blocks.contains(&position) {
            return self.offset[position] - self.offset[s.blocks.start];
        }
        s.row_offset[s.rows.partition_point(|&row| row < position)]
    }

    /// Maps the coupled rows of a supernode to the front of its parent (eliminated blocks, then coupled blocks). Each run is `(row below
    /// the eliminated blocks, row in the parent's front, length)`.
    pub(crate) fn rows_in_parent(&self, supernode: usize) -> Vec<(usize, usize, usize)> {
        let s = &self.supernodes[supernode];
        let Some(parent) = s.parent else { return Vec::new() };
        let mut runs: Vec<(usize, usize, usize)> = Vec::with_capacity(s.rows.len());
        for (index, &row) in s.rows.iter().enumerate() {
            let (to, from, count) = (self.row_of(parent, row), s.row_offset[index] - s.width, self.dim(row));
            match runs.last_mut() {
                Some(last) if last.0 + last.2 == from && last.1 + last.2 == to => last.2 += count,
                _ => runs.push((from, to, count)),
            }
        }
        runs
    }
}

/// Ordering with predicted multiply-adds and order; None if the graph is too large.
type Candidate = (Ordering, Option<(f64, Vec<usize>)>);

fn predictions_of(candidates: &[Candidate]) -> Vec<(Ordering, Option<f64>)> {
    candidates.iter().map(|(ordering, order)| (*ordering, order.as_ref().map(|(count, _)| *count))).collect()
}

/// Returns the cheapest candidate, or the input order if its operations are within `enough` times the minimum. None without candidates.
fn cheapest(candidates: Vec<Candidate>, enough: f64) -> Option<(Ordering, Vec<usize>)> {
    let mut orders: Vec<(Ordering, f64, Vec<usize>)> = candidates
        .into_iter()
        .filter_map(|(ordering, order)| order.map(|(operations, order)| (ordering, operations, order)))
        .collect();
    let least = orders.iter().map(|&(_, operations, _)| operations).fold(f64::INFINITY, f64::min);
    let is_as_good = |(ordering, operations, _): &(Ordering, f64, _)| {
        *operations <= if *ordering == Ordering::Input { enough * least } else { least }
    };
    let best = orders.iter().position(is_as_good)?;
    let (ordering, _, order) = orders.swap_remove(best);
    Some((ordering, order))
}

/// Computes the elimination tree of a graph in a given order (Liu 1990, algorithm 4.2): the parent of each position.
fn elimination_tree(graph: &Graph, order: &[usize], place: &[usize]) -> Vec<Option<usize>> {
    let mut parent = vec![None; order.len()];
    let mut ancestor: Vec<Option<usize>> = vec![None; order.len()];
    for (k, &block) in order.iter().enumerate() {
        for other in graph.neighbours(block) {
            let mut i = place[other];
            while i < k {
                let next = ancestor[i].replace(k);
                match next {
                    None => {
                        parent[i] = Some(k);
                        break;
                    }
                    Some(above) => i = above,
                }
            }
        }
    }
    parent
}

/// Predicts the multiply-adds of a factorisation from the column heights of the factor. Each row of the factor is a subtree of the
/// elimination tree with neighbours as leaves (Liu 1990, section 4.1). The rows are traversed, not stored.
fn predicted_operations(layout: &Layout, graph: &Graph, order: &[usize]) -> f64 {
    let place = places(order);
    let parent = elimination_tree(graph, order, &place);
    let mut below = vec![0; order.len()];
    let mut seen_by = vec![usize::MAX; order.len()];
    for (k, &block) in order.iter().enumerate() {
        seen_by[k] = k;
        for other in graph.neighbours(block).filter(|&other| place[other] < k) {
            let mut i = place[other];
            while seen_by[i] != k {
                seen_by[i] = k;
                below[i] += layout.retained_dim(block);
                // The traversal ends at k, the root of the subtree.
                i = parent[i].unwrap_or(k);
            }
        }
    }
    let inner = &order[..order.len() - layout.outer().len()];
    inner.iter().zip(below).map(|(&block, below)| multiply_adds(layout.retained_dim(block), below)).sum()
}

/// Returns the multiply-adds of eliminating `width` unknowns that are coupled to `below` others.
fn multiply_adds(width: usize, below: usize) -> f64 {
    let (w, r) = (width as f64, below as f64);
    w * w * w / 6.0 + w * w * r / 2.0 + w * r * r / 2.0
}

/// Reorders the blocks so that each subtree of the elimination tree of the first `inner` blocks is contiguous. The other blocks follow as
/// one front; the fill is unchanged.
fn postorder(graph: &Graph, order: &[usize], inner: usize) -> Vec<usize> {
    let mut parent = elimination_tree(graph, order, &places(order));
    parent.truncate(inner);
    let is_uncoupled: Vec<bool> = parent.iter().map(Option::is_none).collect();
    parent.iter_mut().for_each(|above| *above = above.filter(|&above| above < inner));
    let mut children = vec![Vec::new(); inner];
    for (k, above) in parent.iter().enumerate() {
        if let Some(above) = above {
            children[*above].push(k);
        }
    }
    let mut result = Vec::with_capacity(order.len());
    let roots = || (0..inner).filter(|&k| parent[k].is_none());
    for root in roots().filter(|&k| is_uncoupled[k]).chain(roots().filter(|&k| !is_uncoupled[k])) {
        // Depth first with an explicit stack, parents before children; the subtree is then reversed.
        let start = result.len();
        let mut stack = vec![root];
        while let Some(k) = stack.pop() {
            result.push(order[k]);
            stack.extend(&children[k]);
        }
        result[start..].reverse();
    }
    result.extend_from_slice(&order[inner..]);
    result
}

/// Returns the positions below the diagonal in each block column of the factor: neighbours and fill from its children.
fn column_patterns(graph: &Graph, block_at: &[usize], position_of: &[usize]) -> Vec<Vec<usize>> {
    let count = block_at.len();
    let mut columns: Vec<Vec<usize>> = Vec::with_capacity(count);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut seen_by = vec![usize::MAX; count];
    for position in 0..count {
        let mut pattern = Vec::new();
        let mut add = |row: usize| {
            if row > position && seen_by[row] != position {
                seen_by[row] = position;
                pattern.push(row);
            }
        };
        graph.neighbours(block_at[position]).for_each(|block| add(position_of[block]));
        for &child in &children[position] {
            columns[child].iter().for_each(|&row| add(row));
        }
        pattern.sort_unstable();
        if let Some(&parent) = pattern.first() {
            children[parent].push(position);
        }
        columns.push(pattern);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orderings_that_fail_are_reported_and_not_taken() {
        let order = |operations: f64, first: usize| Some((operations, vec![first, 1 - first]));
        let candidates = vec![
            (Ordering::Input, order(30.0, 0)),
            (Ordering::MinimumDegree, None),
            (Ordering::DissectionByGraph, order(20.0, 1)),
        ];
        let expected = [
            (Ordering::Input, Some(30.0)),
            (Ordering::MinimumDegree, None),
            (Ordering::DissectionByGraph, Some(20.0)),
        ];
        assert_eq!(predictions_of(&candidates), expected);
        assert_eq!(cheapest(candidates.clone(), 1.0), Some((Ordering::DissectionByGraph, vec![1, 0])));
        assert_eq!(cheapest(candidates, 1.5), Some((Ordering::Input, vec![0, 1])));
        assert_eq!(cheapest(vec![(Ordering::MinimumDegree, None)], 1.0), None);
    }
}
