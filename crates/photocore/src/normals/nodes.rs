//! Which front what touches several retained blocks goes to.

use super::symbolic::Symbolic;

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
        let mut by_node: Vec<u32> = (0..node.len() as u32).collect();
        by_node.sort_by_key(|&list| node[list as usize]);
        let start = |supernode| by_node.partition_point(|&list| node[list as usize] < supernode);
        let node_ptr = (0..=symbolic.supernode_count()).map(start).collect();
        Self { by_node, node_ptr }
    }

    /// The lists whose node is a supernode.
    pub fn at(&self, supernode: usize) -> &[u32] {
        match self.node_ptr.get(supernode..supernode + 2) {
            Some(ends) => &self.by_node[ends[0]..ends[1]],
            None => &[],
        }
    }
}
