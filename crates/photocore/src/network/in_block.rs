//! Where unknowns are among the retained ones.

/// Where unknowns are: in a block, from one of its unknowns on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InBlock {
    /// The block.
    pub block: usize,
    /// The first of them.
    pub first: usize,
    /// How many unknowns the block has.
    pub width: usize,
}

impl InBlock {
    /// All unknowns of a block.
    pub fn whole(block: usize, width: usize) -> Self {
        Self { block, first: 0, width }
    }
}
