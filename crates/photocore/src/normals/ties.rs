//! Which front each tie goes to.

use super::layout::Layout;
use super::symbolic::Symbolic;

/// The ties by their *home*: the supernode of the first of their blocks in the order of elimination. All other blocks of a tie are in
/// the pattern of its home.
#[derive(Debug)]
pub(super) struct Ties {
    by_home: Vec<u32>,
    /// Where those of each supernode start; one more at the end.
    home_ptr: Vec<usize>,
}

impl Ties {
    pub fn new(layout: &Layout, symbolic: &Symbolic) -> Self {
        let home = |tie: u32| {
            let blocks =
                layout.ties()[tie as usize].kept.iter().map(|&block| symbolic.position(block as usize));
            // A tie that touches no kept block touches the border, the last position.
            symbolic.supernode_of(blocks.min().unwrap_or(symbolic.blocks() - 1))
        };
        let mut by_home: Vec<u32> = (0..layout.ties().len() as u32).collect();
        by_home.sort_by_key(|&tie| home(tie));
        let start = |supernode| by_home.partition_point(|&tie| home(tie) < supernode);
        let home_ptr = (0..=symbolic.supernode_count()).map(start).collect();
        Self { by_home, home_ptr }
    }

    /// The ties whose home is a supernode.
    pub fn at(&self, supernode: usize) -> &[u32] {
        match self.home_ptr.get(supernode..supernode + 2) {
            Some(ends) => &self.by_home[ends[0]..ends[1]],
            None => &[],
        }
    }
}
