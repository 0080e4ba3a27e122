//! Ordered systems, ready for repeated formation.
//!
//! Assembly nodes of terms and contributions.
//!
//! Sizes of vectors and of cached local eliminations.

use std::sync::Arc;

use thiserror::Error;

use super::incidence::Incidence;
use super::layout::{Layout, LayoutError};
use super::ordering::Ordering;
use super::symbolic::Symbolic;
use super::tree::Tree;
use super::triangle::Triangle;
use super::workspace::Workspace;
use crate::Stopped;
use crate::context::Control;

/// Error of a phase of a system.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SystemError {
    /// The work was stopped by the progress callback or for lack of memory.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The input contradicts the layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Layout with its elimination order and factor pattern, which are computed once and reused by every formation.
#[derive(Debug)]
pub struct System {
    pub(super) layout: Layout,
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) incidence: Incidence,
    pub(super) terms: Nodes,
    pub(super) contributions: Nodes,
    pub(super) tree: Tree,
    pub(super) workspace: Workspace,
    /// Whether the local eliminations are cached for the solution.
    pub(super) caches: bool,
    /// Upper bounds of the cached values per supernode; last, of local blocks without equations. Empty without a cache.
    pub(super) cached: Vec<usize>,
}

impl System {
    /// Orders a layout and computes its factor pattern.
    ///
    /// # Errors
    /// [`LayoutError::Pattern`] if the order contradicts the layout, [`LayoutError::Ordering`] if the layout is too large for the ordering.
    pub fn new(layout: Layout, ordering: Ordering) -> Result<Arc<Self>, LayoutError> {
        let symbolic = Symbolic::new(&layout, ordering)?;
        Self::with_pattern(layout, symbolic).map(Arc::new)
    }

    pub(super) fn with_pattern(layout: Layout, symbolic: Symbolic) -> Result<Self, LayoutError> {
        let symbolic = Arc::new(symbolic);
        let incidence = Incidence::new(&layout, &symbolic);
        let terms = Nodes::new(layout.terms().iter().map(|term| &term.retained), &symbolic);
        let contributions = Nodes::new(layout.contributions().iter(), &symbolic);
        let work = |(index, supernode): (usize, &super::symbolic::Supernode)| {
            let factored = if symbolic.open() == Some(index) { 0.0 } else { supernode.operations() };
            factored + formation_work(&incidence, &layout, index)
        };
        let tree = Tree::new(&symbolic, symbolic.supernodes().iter().enumerate().map(work).collect());
        let cached: Vec<usize> =
            (0..=symbolic.supernode_count()).map(|index| numbers_at(&incidence, &layout, index)).collect();
        let caches = cached.iter().sum::<usize>() <= made_of_results(&layout);
        let system = Self {
            layout,
            symbolic,
            incidence,
            terms,
            contributions,
            tree,
            workspace: Workspace::default(),
            caches,
            cached: if caches { cached } else { Vec::new() },
        };
        system.check_pattern()?;
        Ok(system)
    }

    /// Returns the layout.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the elimination order and the factor pattern.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Adds the local blocks of a finished batch to the progress count.
    pub(super) fn count(&self, units: &[u32], control: &Control) {
        control.count(units.iter().filter(|&&unit| !self.layout.is_uncoupled(unit as usize)).count());
    }

    /// Returns the maximum number of values in a factor: panels and cached local eliminations.
    pub fn numbers_in_factor(&self) -> usize {
        self.symbolic.values() + self.cached.iter().sum::<usize>()
    }
}

/// Estimates the cost of forming and eliminating the units of a supernode, in multiply-adds of a factorisation. The estimate includes the
/// evaluation of the equations.
fn formation_work(incidence: &Incidence, layout: &Layout, index: usize) -> f64 {
    let of_batch = |run: &[u32]| {
        let first = run.first().map_or(0, |&first| first as usize);
        let width = layout.reduced_width(first);
        run.len() * (2 * width * width * layout.local_dim() + 500 * layout.groups_of_unit(first).len())
    };
    incidence.batches_at(index).iter().map(of_batch).sum::<usize>() as f64
}

/// Lists of retained blocks (of terms or contributions), grouped by *assembly node*: the supernode of the block that is eliminated first.
/// All other blocks of a list are in the pattern of the node.
#[derive(Debug)]
pub(super) struct Nodes {
    by_node: Vec<u32>,
    /// Start of each supernode's lists, and the end of the last.
    node_ptr: Vec<usize>,
}

impl Nodes {
    pub fn new<'a>(lists: impl Iterator<Item = &'a Vec<u32>>, symbolic: &Symbolic) -> Self {
        let node = |blocks: &Vec<u32>| {
            let positions = blocks.iter().map(|&block| symbolic.position(block as usize));
            positions.min().map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
        };
        let node: Vec<usize> = lists.map(node).collect();
        let mut by_node: Vec<usize> = (0..node.len()).collect();
        by_node.sort_by_key(|&list| node[list]);
        let start = |supernode| by_node.partition_point(|&list| node[list] < supernode);
        let node_ptr = (0..=symbolic.supernode_count()).map(start).collect();
        Self { by_node: by_node.into_iter().map(|list| list as u32).collect(), node_ptr }
    }

    /// Returns the lists whose assembly node is the supernode.
    pub fn at(&self, supernode: usize) -> &[u32] {
        match self.node_ptr.get(supernode..supernode + 2) {
            Some(ends) => &self.by_node[ends[0]..ends[1]],
            None => &[],
        }
    }
}

/// Vector elements per unknown: values, steps, priors and copies, cofactors and results for the caller.
const PER_UNKNOWN: usize = 38;
/// Vector elements per equation, without coefficients: observed value, standard deviation, residual, redundancy number and test value. Each
/// is stored as given, in the order of the adjustment and as returned.
const PER_EQUATION: usize = 18;
/// Fraction of the vectors that is allocated after the last solution; the cache may use this memory before.
const LATER: f64 = 0.65;

/// Returns the number of elements in all vectors, including the problem and its results.
pub(super) fn vectors(layout: &Layout) -> usize {
    PER_UNKNOWN * layout.unknowns() + PER_EQUATION * layout.equations()
}

/// Returns the number of elements in vectors that only contain results.
pub(super) fn made_of_results(layout: &Layout) -> usize {
    (LATER * vectors(layout) as f64) as usize
}

/// Returns the maximum number of cached values for `count` local blocks of one pattern.
fn numbers_of(layout: &Layout, first: usize, count: usize) -> usize {
    let l = layout.local_dim();
    count * (l * (layout.reduced_width(first) + 1) + Triangle::numbers(l))
}

/// Returns the maximum number of cached values for all local blocks of a supernode.
pub(super) fn numbers_at(incidence: &Incidence, layout: &Layout, index: usize) -> usize {
    let of_batch =
        |run: &[u32]| run.first().map_or(0, |&first| numbers_of(layout, first as usize, run.len()));
    incidence.batches_of_locals_at(index).iter().map(of_batch).sum()
}
