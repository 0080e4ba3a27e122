//! Which front what touches several kept blocks goes to.

use super::symbolic::Symbolic;

/// Lists of kept blocks, those of ties or of what systems below leave, by their *home*: the supernode of the first of their blocks in
/// the order of elimination. All other blocks of a list are in the pattern of its home.
#[derive(Debug)]
pub(super) struct Homes {
    by_home: Vec<u32>,
    /// Where those of each supernode start; one more at the end.
    home_ptr: Vec<usize>,
}

impl Homes {
    pub fn new<'a>(lists: impl Iterator<Item = &'a Vec<u32>>, symbolic: &Symbolic) -> Self {
        let home = |blocks: &Vec<u32>| {
            let positions = blocks.iter().map(|&block| symbolic.position(block as usize));
            positions.min().map_or(symbolic.supernode_count(), |first| symbolic.supernode_of(first))
        };
        let home: Vec<usize> = lists.map(home).collect();
        let mut by_home: Vec<u32> = (0..home.len() as u32).collect();
        by_home.sort_by_key(|&list| home[list as usize]);
        let start = |supernode| by_home.partition_point(|&list| home[list as usize] < supernode);
        let home_ptr = (0..=symbolic.supernode_count()).map(start).collect();
        Self { by_home, home_ptr }
    }

    /// The lists whose home is a supernode.
    pub fn at(&self, supernode: usize) -> &[u32] {
        match self.home_ptr.get(supernode..supernode + 2) {
            Some(ends) => &self.by_home[ends[0]..ends[1]],
            None => &[],
        }
    }
}
