//! The order in which kept blocks are eliminated.

use super::dissection::nested_dissection;
use super::graph::Graph;
use super::layout::Layout;
use super::minimum_degree::minimum_degree;

/// How the kept blocks are ordered for elimination.
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
    /// Nested dissection across the places of the kept blocks; by the graph alone where the layout has none.
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
    pub(crate) fn order(self, graph: &Graph, layout: &Layout) -> Vec<usize> {
        match self {
            Ordering::Auto | Ordering::Input => (0..graph.len()).collect(),
            Ordering::ReverseCuthillMckee => graph.breadth_first_line().into_iter().rev().collect(),
            Ordering::MinimumDegree => minimum_degree(graph),
            Ordering::DissectionByPlace => nested_dissection(graph, layout.places()),
            Ordering::DissectionByGraph => nested_dissection(graph, None),
        }
    }
}
