//! A system ready to be formed and solved again and again.

use std::sync::Arc;

use super::homes::Homes;
use super::incidence::Incidence;
use super::layout::Layout;
use super::ordering::Ordering;
use super::symbolic::Symbolic;
use super::tree::Tree;
use super::workspace::Workspace;

/// A system ready to be formed again and again: the pattern and the order are found once.
#[derive(Debug)]
pub struct System {
    pub(super) layout: Layout,
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) incidence: Incidence,
    pub(super) ties: Homes,
    pub(super) contributions: Homes,
    pub(super) tree: Tree,
    pub(super) workspace: Workspace,
}

impl System {
    /// Orders a layout.
    pub fn new(layout: Layout, ordering: Ordering) -> Self {
        let symbolic = Arc::new(Symbolic::new(&layout, ordering));
        let incidence = Incidence::new(&layout, &symbolic);
        let ties = Homes::new(layout.ties().iter().map(|tie| &tie.kept), &symbolic);
        let contributions = Homes::new(layout.contributions().iter(), &symbolic);
        let work = |(index, supernode): (usize, &super::symbolic::Supernode)| {
            let formation =
                incidence.locals_at(index).iter().map(|&local| formation_work(&layout, local as usize));
            let factored = if symbolic.open() == Some(index) { 0.0 } else { supernode.operations() };
            factored + formation.sum::<f64>()
        };
        let tree = Tree::new(&symbolic, symbolic.supernodes().iter().enumerate().map(work).collect());
        Self { layout, symbolic, incidence, ties, contributions, tree, workspace: Workspace::default() }
    }

    /// The unknowns and groups.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The order and the pattern.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// First row of the border in the front of a supernode.
    pub(super) fn border_row(&self, supernode: usize) -> usize {
        self.symbolic.supernodes().get(supernode).map_or(0, |s| s.height() - self.layout.border_dim())
    }
}

/// Time for forming and eliminating a local block, in multiply-adds of a factorisation: those of its own, which run at a lower rate,
/// and its equations.
fn formation_work(layout: &Layout, local: usize) -> f64 {
    let width = layout.reduced_width(local);
    (2 * width * width * layout.local_dim() + 500 * layout.groups_of(local).len()) as f64
}
