//! A system ready to be formed and solved again and again.

use std::sync::Arc;

use super::incidence::Incidence;
use super::layout::{Layout, LayoutError};
use super::nodes::Nodes;
use super::ordering::Ordering;
use super::room::{made_of_results, numbers_at};
use super::symbolic::Symbolic;
use super::tree::Tree;
use super::watch::Control;
use super::workspace::Workspace;

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
    /// [`LayoutError::Pattern`], where the order contradicts the layout.
    pub fn new(layout: Layout, ordering: Ordering) -> Result<Self, LayoutError> {
        let symbolic = Symbolic::new(&layout, ordering);
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
