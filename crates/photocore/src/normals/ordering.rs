//! Elimination order of the retained blocks.

use super::dissection::{minimum_degree, nested_dissection};
use super::graph::{Graph, NOWHERE};
use super::layout::Layout;

/// Ordering method for the retained blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// The cheapest of the other methods, by predicted operations.
    #[default]
    Auto,
    /// Order of the input.
    Input,
    /// Reverse Cuthill-McKee: small bandwidth, as in the program of 1987 (GIANT guide, Appendix A).
    ReverseCuthillMckee,
    /// Approximate minimum degree: for irregular networks.
    MinimumDegree,
    /// Nested dissection by the positions of the retained blocks; by the graph if the layout has none.
    DissectionByPlace,
    /// Nested dissection by the graph.
    DissectionByGraph,
}

impl Ordering {
    /// Returns the methods to try: all for [`Ordering::Auto`], otherwise only itself.
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

    /// Name in options and reports.
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

    /// Returns the ordering of a name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = std::iter::once(&Ordering::Auto).chain(Ordering::Auto.candidates());
        all.find(|ordering| ordering.name() == name).copied()
    }

    /// Returns the blocks of a graph in their elimination order.
    ///
    /// Dense blocks, which are coupled to nearly all others (a camera of all photos), are ordered last. They are removed from the graph
    /// before, because they would reduce all distances to two steps. Outer blocks follow all others, in their own order. None if the graph
    /// is too large for the method.
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

/// Returns the dense blocks that are not main, by rising degree. Dense: degree above ten times the root of the block count (Amestoy, Davis
/// and Duff 1996), or above one half of a small graph.
fn dense_blocks(graph: &Graph, layout: &Layout) -> Vec<usize> {
    let count = graph.len() as f64;
    let most = (10.0 * count.sqrt()).min(0.5 * count);
    let main = layout.are_main();
    let is_dense = |&block: &usize| !main[block] && graph.degree(block) as f64 > most;
    let mut dense: Vec<usize> = (0..graph.len()).filter(is_dense).collect();
    dense.sort_by_key(|&block| graph.degree(block));
    dense
}
