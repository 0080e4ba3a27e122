//! A system ready to be formed and solved again and again.
//!
//! Which front what touches several retained blocks goes to.
//!
//! Numbers that there is room for: in vectors, and in what the elimination of local blocks leaves.

use std::sync::Arc;

use super::incidence::Incidence;
use super::layout::{Layout, LayoutError};
use super::ordering::Ordering;
use super::symbolic::Symbolic;
use super::tree::Tree;
use super::triangle::Triangle;
use super::watch::Control;
use super::workspace::Workspace;
use crate::sorting::order;

/// A system ready to be formed again and again: the pattern and the order are found once.
#[derive(Debug)]
pub struct System {
    pub(super) layout: Layout,
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) incidence: Incidence,
    pub(super) ties: Nodes,
    pub(super) contributions: Nodes,
    pub(super) tree: Tree,
    pub(super) workspace: Workspace,
    /// Whether what the elimination of local blocks leaves is cached for the solution.
    pub(super) caches: bool,
    /// Numbers in what is cached of it at each supernode, and last of the local blocks without equations, at the most; none where it is not.
    pub(super) cached: Vec<usize>,
}

impl System {
    /// Orders a layout.
    ///
    /// # Errors
    /// [`LayoutError::Pattern`] if the order contradicts the layout, [`LayoutError::Ordering`] if the layout is too large for the ordering.
    pub fn new(layout: Layout, ordering: Ordering) -> Result<Self, LayoutError> {
        let symbolic = Symbolic::new(&layout, ordering)?;
        Self::with_pattern(layout, symbolic)
    }

    pub(super) fn with_pattern(layout: Layout, symbolic: Symbolic) -> Result<Self, LayoutError> {
        let symbolic = Arc::new(symbolic);
        let incidence = Incidence::new(&layout, &symbolic);
        let ties = Nodes::new(layout.ties().iter().map(|tie| &tie.retained), &symbolic);
        let contributions = Nodes::new(layout.contributions().iter(), &symbolic);
        let work = |(index, supernode): (usize, &super::symbolic::Supernode)| {
            let factored = if symbolic.open() == Some(index) { 0.0 } else { supernode.operations() };
            factored + formation_work(&incidence, &layout, index)
        };
        let tree = Tree::new(&symbolic, symbolic.supernodes().iter().enumerate().map(work).collect());
        let cached: Vec<usize> =
            (0..=symbolic.supernode_count()).map(|index| numbers_at(&incidence, &layout, index)).collect();
        let is_part = symbolic.open().is_some() || !layout.contributions().is_empty();
        let workspace = if is_part { Workspace::frugal() } else { Workspace::default() };
        let caches = cached.iter().sum::<usize>() <= made_of_results(&layout);
        let system = Self {
            layout,
            symbolic,
            incidence,
            ties,
            contributions,
            tree,
            workspace,
            caches,
            cached: if caches { cached } else { Vec::new() },
        };
        system.check_pattern()?;
        Ok(system)
    }

    /// The unknowns and groups.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The order and the pattern.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Counts the local blocks of a batch that is done.
    pub(super) fn count(&self, units: &[u32], control: &Control) {
        control.count(units.iter().filter(|&&unit| !self.layout.is_apart(unit as usize)).count());
    }

    /// Numbers that a factor holds at the most: the panels, and what the elimination of local blocks has left for the solution.
    pub fn numbers_in_factor(&self) -> usize {
        self.symbolic.values() + self.cached.iter().sum::<usize>()
    }
}

/// Time for forming and eliminating the units assembled in a supernode, in multiply-adds of a factorisation: those of their own,
/// which run at a lower rate, and their equations.
fn formation_work(incidence: &Incidence, layout: &Layout, index: usize) -> f64 {
    let of_batch = |run: &[u32]| {
        let first = run.first().map_or(0, |&first| first as usize);
        let width = layout.reduced_width(first);
        run.len() * (2 * width * width * layout.local_dim() + 500 * layout.groups_of_unit(first).len())
    };
    incidence.batches_at(index).iter().map(of_batch).sum::<usize>() as f64
}

/// Lists of retained blocks, those of ties or of what systems below leave, by their *assembly node*: the supernode of the first of their blocks in
/// the order of elimination. All other blocks of a list are in the pattern of its node.
#[derive(Debug)]
pub(super) struct Nodes {
    by_node: Vec<u32>,
    /// Where those of each supernode start; one more at the end.
    node_ptr: Vec<usize>,
}

impl Nodes {
    pub fn new<'a>(lists: impl Iterator<Item = &'a Vec<u32>>, symbolic: &Symbolic) -> Self {
        let node = |blocks: &Vec<u32>| {
            let positions = blocks.iter().map(|&block| symbolic.position(block as usize));
            positions.min().map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
        };
        let node: Vec<usize> = lists.map(node).collect();
        let by_node = order(node.len(), &|a, b| node[a].cmp(&node[b]));
        let start = |supernode| by_node.partition_point(|&list| node[list] < supernode);
        let node_ptr = (0..=symbolic.supernode_count()).map(start).collect();
        Self { by_node: by_node.into_iter().map(|list| list as u32).collect(), node_ptr }
    }

    /// The lists whose node is a supernode.
    pub fn at(&self, supernode: usize) -> &[u32] {
        match self.node_ptr.get(supernode..supernode + 2) {
            Some(ends) => &self.by_node[ends[0]..ends[1]],
            None => &[],
        }
    }
}

/// Numbers for each unknown: values, steps, priors and their copies, cofactors, what is made of them for the caller.
const PER_UNKNOWN: usize = 38;
/// Numbers for each equation beside its coefficients: observed value, standard deviation, residual, redundancy number and test value,
/// as given, as ordered for the adjustment and as handed back.
const PER_EQUATION: usize = 18;
/// Of these, the part that is made of the results after the last solution: what is cached from the formation to the solution may take it.
const LATER: f64 = 0.65;

/// Numbers in vectors, the problem itself and its results counted.
pub(super) fn vectors(layout: &Layout) -> usize {
    PER_UNKNOWN * layout.unknowns() + PER_EQUATION * layout.equations()
}

/// Numbers in what is made of results only.
pub(super) fn made_of_results(layout: &Layout) -> usize {
    (LATER * vectors(layout) as f64) as usize
}

/// Numbers that are cached of so many local blocks of one pattern, at the most.
fn numbers_of(layout: &Layout, first: usize, count: usize) -> usize {
    let l = layout.local_dim();
    count * (l * (layout.reduced_width(first) + 1) + Triangle::numbers(l))
}

/// The same of all local blocks assembled in a supernode.
pub(super) fn numbers_at(incidence: &Incidence, layout: &Layout, index: usize) -> usize {
    let of_batch =
        |run: &[u32]| run.first().map_or(0, |&first| numbers_of(layout, first as usize, run.len()));
    incidence.batches_of_locals_at(index).iter().map(of_batch).sum()
}
