//! Nested dissection: a separator divides the graph, both halves are dissected recursively, and the separator is eliminated last (George
//! 1973). The halves cause no mutual fill and are independent subtrees of the elimination tree.
//!
//! Approximate minimum degree (Amestoy, Davis and Duff 1996), as implemented in `faer`.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::graph::{Graph, NOWHERE};

/// Maximum number of blocks that are ordered by minimum degree without a cut.
const LEAF: usize = 48;
/// Possible cuts of a sequence of blocks, as fractions of its length.
const CUTS: [f64; 5] = [0.5, 0.44, 0.56, 0.38, 0.62];

/// Orders a graph by nested dissection, across the positions of the blocks or, without positions, the levels of a breadth-first search.
/// None if an uncut part is too large for minimum degree.
pub(super) fn nested_dissection(graph: &Graph, places: Option<&[[f64; 3]]>) -> Option<Vec<usize>> {
    let (part, place) = (vec![0; graph.len()], vec![NOWHERE; graph.len()]);
    let mut dissection = Dissection { graph, places, part, place, parts: 0, order: vec![] };
    dissection.dissect((0..graph.len()).collect())?;
    Some(dissection.order)
}

struct Dissection<'a> {
    graph: &'a Graph,
    places: Option<&'a [[f64; 3]]>,
    /// Number of the last part of each block; numbers are not reused.
    part: Vec<usize>,
    parts: usize,
    /// Scratch memory for the indices of blocks in a part.
    place: Vec<u32>,
    order: Vec<usize>,
}

/// Blocks on both sides of a separator, and the separator.
struct Cut {
    sides: [Vec<usize>; 2],
    separator: Vec<usize>,
}

impl Cut {
    /// Returns the ratio of separator blocks to separated pairs of blocks: the cost of a cut relative to its benefit.
    fn cost(&self) -> f64 {
        let [one, other] = self.sides.each_ref().map(|side| side.len() as f64);
        self.separator.len() as f64 / (one * other)
    }
}

impl Dissection<'_> {
    /// Appends the blocks of a part in their elimination order.
    fn dissect(&mut self, members: Vec<usize>) -> Option<()> {
        let cut = if members.len() > LEAF { self.best_cut(&members) } else { None };
        match cut {
            Some(Cut { sides: [one, other], separator }) => {
                self.dissect(one)?;
                self.dissect(other)?;
                self.order.extend(separator);
            }
            None => {
                let part = self.graph.subgraph(&members, &mut self.place);
                self.order.extend(minimum_degree(&part)?.into_iter().map(|block| members[block]));
            }
        }
        Some(())
    }

    /// Returns the cheapest cut; None if the part is too dense to leave blocks on both sides.
    fn best_cut(&mut self, members: &[usize]) -> Option<Cut> {
        let mut best: Option<Cut> = None;
        for line in self.lines(members) {
            for share in CUTS {
                let cut = self.cut(&line, (share * line.len() as f64) as usize);
                if cut.sides.iter().all(|side| !side.is_empty())
                    && best.as_ref().is_none_or(|best| cut.cost() < best.cost())
                {
                    best = Some(cut);
                }
            }
        }
        best
    }

    /// Cuts a sequence of blocks at an index; the separator is the smaller of the two boundaries.
    fn cut(&mut self, line: &[usize], place: usize) -> Cut {
        let (one, other) = (self.parts + 1, self.parts + 2);
        self.parts += 2;
        line[..place].iter().for_each(|&block| self.part[block] = one);
        line[place..].iter().for_each(|&block| self.part[block] = other);
        let touches = |block: usize, part: usize| self.graph.neighbours(block).any(|n| self.part[n] == part);
        let shores = [(&line[..place], other), (&line[place..], one)]
            .map(|(side, beyond)| side.iter().map(|&block| touches(block, beyond)).collect::<Vec<bool>>());
        let counts = shores.each_ref().map(|shore| shore.iter().filter(|&&on| on).count());
        let chosen = usize::from(counts[1] < counts[0]);
        let mut sides = [line[..place].to_vec(), line[place..].to_vec()];
        let mut on_shore = shores[chosen].iter();
        let (separator, inland) =
            std::mem::take(&mut sides[chosen]).into_iter().partition(|_| on_shore.next() == Some(&true));
        sides[chosen] = inland;
        Cut { sides, separator }
    }

    /// Returns the blocks of a part in the sequences to cut.
    fn lines(&mut self, members: &[usize]) -> Vec<Vec<usize>> {
        let Some(places) = self.places else { return vec![self.breadth_first(members)] };
        principal_axes(members, places)
            .iter()
            .map(|axis| {
                let along = |block: usize| (0..3).map(|k| axis[k] * places[block][k]).sum::<f64>();
                let mut keyed: Vec<(f64, usize)> = members.iter().map(|&b| (along(b), b)).collect();
                keyed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                keyed.into_iter().map(|(_, block)| block).collect()
            })
            .collect()
    }

    /// Returns the blocks of a part by graph distance from a peripheral block, component by component.
    fn breadth_first(&mut self, members: &[usize]) -> Vec<usize> {
        let part = self.graph.subgraph(members, &mut self.place);
        part.breadth_first_line().into_iter().map(|block| members[block]).collect()
    }
}

/// Returns the two directions in which the positions of some blocks vary most.
fn principal_axes(members: &[usize], places: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let count = members.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|k| members.iter().map(|&b| places[b][k]).sum::<f64>() / count);
    let mut spread = faer::Mat::<f64>::zeros(3, 3);
    for &block in members {
        let d: [f64; 3] = std::array::from_fn(|k| places[block][k] - mean[k]);
        for i in 0..3 {
            for j in 0..3 {
                spread[(i, j)] += d[i] * d[j];
            }
        }
    }
    match spread.self_adjoint_eigen(faer::Side::Lower) {
        Ok(eigen) => [2, 1].map(|axis| std::array::from_fn(|k| eigen.U()[(k, axis)])),
        Err(_) => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

/// Orders a graph by approximate minimum degree; None if the graph is too large.
pub(super) fn minimum_degree(graph: &Graph) -> Option<Vec<usize>> {
    let (pointers, neighbours) = graph.compressed()?;
    let count = graph.len();
    let matrix = SymbolicSparseColMatRef::new_checked(count, count, &pointers, None, neighbours);
    let (mut order, mut place) = (vec![0_u32; count], vec![0_u32; count]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(count, neighbours.len()));
    let control = amd::Control::default();
    amd::order(&mut order, &mut place, matrix, control, MemStack::new(&mut memory)).ok()?;
    Some(order.into_iter().map(|block| block as usize).collect())
}
