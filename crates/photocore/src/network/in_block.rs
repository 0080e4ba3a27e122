//! Positions of parameters among the retained ones.

/// Position of consecutive parameters inside a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InBlock {
    pub block: usize,
    /// First parameter inside the block.
    pub first: usize,
    /// Number of parameters of the block.
    pub width: usize,
}

impl InBlock {
    /// Returns the position of a whole block.
    pub fn whole(block: usize, width: usize) -> Self {
        Self { block, first: 0, width }
    }
}
