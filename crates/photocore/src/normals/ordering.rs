//! The order in which retained blocks are eliminated.

use super::dissection::minimum_degree;
use super::dissection::nested_dissection;
use super::graph::{Graph, NOWHERE};
use super::layout::Layout;
use crate::sorting::sort_by;

/// How the retained blocks are ordered for elimination.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// The cheapest of the others, by predicted operations.
    #[default]
    Auto,
    /// As they stand in the input.
    Input,
    /// Reverse Cuthill-McKee: a narrow band, the 1987 program's way (GIANT guide, Appendix A).
    ReverseCuthillMckee,
    /// Approximate minimum degree: for blocks that hang together without any shape.
    MinimumDegree,
    /// Nested dissection across the places of the retained blocks; by the graph alone where the layout has none.
    DissectionByPlace,
    /// Nested dissection by the graph alone.
    DissectionByGraph,
}

impl Ordering {
    /// The orderings to try: itself, or all of them for [`Ordering::Auto`].
    pub fn candidates(self) -> &'static [Ordering] {
        match self {
            Ordering::Auto => &[
                Ordering::Input,
                Ordering::ReverseCuthillMckee,
                Ordering::MinimumDegree,
                Ordering::DissectionByPlace,
                Ordering::DissectionByGraph,
            ],
            Ordering::Input => &[Ordering::Input],
            Ordering::ReverseCuthillMckee => &[Ordering::ReverseCuthillMckee],
            Ordering::MinimumDegree => &[Ordering::MinimumDegree],
            Ordering::DissectionByPlace => &[Ordering::DissectionByPlace],
            Ordering::DissectionByGraph => &[Ordering::DissectionByGraph],
        }
    }

    /// The name under which reports and options know it.
    pub fn name(self) -> &'static str {
        match self {
            Ordering::Auto => "auto",
            Ordering::Input => "input",
            Ordering::ReverseCuthillMckee => "rcm",
            Ordering::MinimumDegree => "amd",
            Ordering::DissectionByPlace => "dissection",
            Ordering::DissectionByGraph => "graph-dissection",
        }
    }

    /// The ordering with a name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = std::iter::once(&Ordering::Auto).chain(Ordering::Auto.candidates());
        all.find(|ordering| ordering.name() == name).copied()
    }

    /// The blocks of a graph in the order of their elimination.
    ///
    /// What nearly all others are joined to (the camera of a whole block) goes last, and is taken out of the graph before: a search
    /// through it reaches everything in two steps, and there is no shape left to follow.
    /// Outer blocks come after all others, in their own order. None if the graph is too large for the ordering.
    pub(crate) fn order(self, graph: &Graph, layout: &Layout) -> Option<Vec<usize>> {
        let mut last = if self == Ordering::Input { Vec::new() } else { dense_blocks(graph, layout) };
        last.retain(|&block| !layout.outer().contains(&(block as u32)));
        last.extend(layout.outer().iter().map(|&block| block as usize));
        if last.is_empty() {
            return self.order_all(graph, layout.places());
        }
        let mut is_last = vec![false; graph.len()];
        last.iter().for_each(|&block| is_last[block] = true);
        let others: Vec<usize> = (0..graph.len()).filter(|&block| !is_last[block]).collect();
        let places: Option<Vec<[f64; 3]>> =
            layout.places().map(|places| others.iter().map(|&block| places[block]).collect());
        let order =
            self.order_all(&graph.subgraph(&others, &mut vec![NOWHERE; graph.len()]), places.as_deref())?;
        Some(order.into_iter().map(|block| others[block]).chain(last).collect())
    }

    fn order_all(self, graph: &Graph, places: Option<&[[f64; 3]]>) -> Option<Vec<usize>> {
        match self {
            Ordering::Auto | Ordering::Input => Some((0..graph.len()).collect()),
            Ordering::ReverseCuthillMckee => Some(graph.breadth_first_line().into_iter().rev().collect()),
            Ordering::MinimumDegree => minimum_degree(graph),
            Ordering::DissectionByPlace => nested_dissection(graph, places),
            Ordering::DissectionByGraph => nested_dissection(graph, None),
        }
    }
}

/// The blocks, none of them the main one of a group, that are joined to more than ten times the root of the number of all, as the
/// dense rows of minimum degree (Amestoy, Davis and Duff 1996), in a small graph to more than half of them; by rising degree.
fn dense_blocks(graph: &Graph, layout: &Layout) -> Vec<usize> {
    let count = graph.len() as f64;
    let most = (10.0 * count.sqrt()).min(0.5 * count);
    let main = layout.are_main();
    let is_dense = |&block: &usize| !main[block] && graph.degree(block) as f64 > most;
    let mut dense: Vec<usize> = (0..graph.len()).filter(is_dense).collect();
    sort_by(&mut dense, &|&a, &b| graph.degree(a).cmp(&graph.degree(b)));
    dense
}
