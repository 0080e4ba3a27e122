//! Approximate minimum degree (Amestoy, Davis and Duff 1996), as `faer` has it.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::graph::Graph;

/// Orders a graph so that each block in turn leaves few couplings behind; in input order where the graph is too large.
pub(super) fn minimum_degree(graph: &Graph) -> Vec<usize> {
    let (pointers, neighbours) = graph.compressed();
    let count = graph.len();
    let matrix = SymbolicSparseColMatRef::new_checked(count, count, &pointers, None, neighbours);
    let (mut order, mut place) = (vec![0_u32; count], vec![0_u32; count]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(count, neighbours.len()));
    let control = amd::Control::default();
    match amd::order(&mut order, &mut place, matrix, control, MemStack::new(&mut memory)) {
        Ok(_) => order.into_iter().map(|block| block as usize).collect(),
        Err(_) => (0..count).collect(),
    }
}
