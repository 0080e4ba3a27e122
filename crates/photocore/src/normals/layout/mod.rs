//! Which unknowns there are, and which equations touch which of them.

mod build;
mod units;

use std::ops::Range;

use thiserror::Error;

/// The unknowns and the equations of a system.
///
/// The vector of unknowns is `[local blocks | retained blocks]`. A group of `rows` equations touches one local block, its main retained block and
/// what it has in common with others: *shared* blocks (the camera of several photographs, the comparator of all), possibly none.
/// The groups of a local block are consecutive. A [`Tie`] touches any retained blocks, but no local block.
///
/// Kernels are made for the main blocks, so what nearly every group touches belongs among the shared ones: a block that is further
/// in any group is the main one of none.
///
/// Of blocks, groups, ties and unknowns there are fewer than `u32::MAX` each: it is checked here, and whoever numbers them keeps 32 bits.
#[derive(Debug, Clone)]
pub struct Layout {
    rows: usize,
    local_dim: usize,
    locals: usize,
    retained_offset: Vec<usize>,
    group_ptr: Vec<usize>,
    group_retained: Vec<u32>,
    /// The shared blocks of group `g` are `shared[shared_ptr[g]..shared_ptr[g + 1]]`; both are empty where no group has any.
    shared_ptr: Vec<usize>,
    shared: Vec<u32>,
    ties: Vec<Tie>,
    /// Where the equations of each tie start among those of all ties; one more at the end.
    tie_ptr: Vec<usize>,
    /// Where the square block of the equations of each tie starts; one more at the end.
    block_ptr: Vec<usize>,
    places: Option<Vec<[f64; 3]>>,
    /// The unknowns of each retained block that are not held, as ranges; empty where none is held anywhere.
    free: Vec<Vec<Range<usize>>>,
    /// The groups of local blocks that are held, with these.
    apart: Vec<[u32; 2]>,
    /// Pairs of retained blocks, ascending, and where the block of each starts among those of all; one more at the end.
    pairs: Vec<[u32; 2]>,
    pair_ptr: Vec<usize>,
    /// Kept blocks that a system above eliminates, and those that each system below leaves something for.
    outer: Vec<u32>,
    contributions: Vec<Vec<u32>>,
}

/// Equations among retained blocks: a distance between two points that are kept, a relative pose of two photographs, an observation of
/// unknowns of one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tie {
    /// How many equations.
    pub rows: usize,
    /// The retained blocks that they touch, each once, in any order.
    pub retained: Vec<u32>,
}

/// A layout that contradicts itself.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// More blocks, groups, ties or unknowns than 32 bits number.
    #[error("{0} blocks, equations or unknowns are more than can be numbered")]
    TooMany(usize),
    /// A local block has no size or more than three unknowns.
    #[error("local blocks have {0} unknowns; 1, 2 or 3 are possible")]
    LocalDimension(usize),
    /// The group pointers do not run from zero to the number of groups without falling.
    #[error("the group pointers must rise from 0 to the number of groups, {0}")]
    GroupPointers(usize),
    /// A group names a retained block that does not exist.
    #[error("group {group} touches retained block {retained} of {blocks}")]
    Retained {
        /// The group.
        group: usize,
        /// The block it names.
        retained: usize,
        /// How many there are.
        blocks: usize,
    },
    /// There is not one place for each retained block.
    #[error("{places} places for {blocks} retained blocks")]
    Places {
        /// How many places were given.
        places: usize,
        /// How many blocks there are.
        blocks: usize,
    },
    /// The pointers to the shared blocks do not run from zero to their number without falling, one for each group and one more.
    #[error(
        "the pointers to shared blocks must rise from 0 to their number, {0}, one for each group and one more"
    )]
    SharedPointers(usize),
    /// A group names a shared block that does not exist, that it names already, or that is the main block of a group.
    #[error(
        "group {group} has retained block {retained} among its shared ones, which does not exist, is named twice or is the main one of a group"
    )]
    Shared {
        /// The group.
        group: usize,
        /// The block it names.
        retained: usize,
    },
    /// A pair names a retained block that does not exist.
    #[error("a pair of retained blocks names one that does not exist: {0:?}")]
    Pair([usize; 2]),
    /// A block of the inverse that was asked for is outside the pattern of the factor.
    #[error(
        "block ({row}, {column}) of the inverse is outside the pattern of the factor: ask for it by Layout::with_pairs"
    )]
    Block {
        /// The retained block of its rows.
        row: usize,
        /// The retained block of its columns.
        column: usize,
    },
    /// A slice is longer or shorter than the layout requires.
    #[error("{field} has {length} elements, and the layout requires {required}")]
    Length {
        /// The type and the field, such as `Problem::sd`.
        field: &'static str,
        /// Its length.
        length: usize,
        /// The length that the layout requires.
        required: usize,
    },
    /// A slice of right-hand sides has a length that is not a multiple of the number of unknowns.
    #[error("{field} has {length} elements, and the layout requires a multiple of {unknowns}")]
    Columns {
        /// The type and the field, such as `SolveOptions::rights`.
        field: &'static str,
        /// Its length.
        length: usize,
        /// The number of unknowns.
        unknowns: usize,
    },
    /// The graph of the blocks is too large for the ordering that was asked for.
    #[error("the graph of the retained blocks is too large for the ordering {0}: use input or rcm")]
    Ordering(&'static str),
    /// A list of outer or contributed blocks with one that does not exist or is there twice.
    #[error("outer or contributed blocks do not exist or are named twice")]
    Outer,
    /// The pattern of the factor lacks a block that equations touch: the order of elimination contradicts the layout.
    #[error("the pattern of the factor lacks blocks that go to its front {front}")]
    Pattern {
        /// The supernode whose front it is.
        front: usize,
    },
    /// A tie without equations or unknowns, or one that names a block twice or unknowns that do not exist.
    #[error("tie {tie} has no equations or unknowns, or names a block twice or one that does not exist")]
    Tie {
        /// The tie.
        tie: usize,
    },
}

impl LayoutError {
    /// An error unless a field has the length that the layout requires.
    pub(crate) fn unless_of_length(field: &'static str, length: usize, required: usize) -> Result<(), Self> {
        if length == required { Ok(()) } else { Err(Self::Length { field, length, required }) }
    }
}

impl Layout {
    /// The unknowns of a retained block that are not held, counted from its first, as ranges.
    pub(super) fn free_of(&self, block: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let known = self.free.get(block);
        let all = known.is_none().then(|| 0..self.retained_dim(block));
        known.into_iter().flatten().cloned().chain(all)
    }

    /// The pairs of retained blocks whose cofactors are asked for.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// An error unless a field holds columns over all unknowns.
    pub(super) fn check_columns(&self, field: &'static str, length: usize) -> Result<(), LayoutError> {
        let unknowns = self.unknowns();
        let fits = length.checked_rem(unknowns).unwrap_or(length) == 0;
        if fits { Ok(()) } else { Err(LayoutError::Columns { field, length, unknowns }) }
    }

    /// Where the cofactors of a pair of retained blocks stand among those of all pairs; None where they were not asked for.
    pub fn pair(&self, pair: [u32; 2]) -> Option<Range<usize>> {
        let index = self.pairs.binary_search(&pair).ok()?;
        Some(self.pair_ptr[index]..self.pair_ptr[index + 1])
    }

    /// The retained blocks that a system above eliminates.
    pub fn outer(&self) -> &[u32] {
        &self.outer
    }

    /// The retained blocks that each system below leaves something for.
    pub fn contributions(&self) -> &[Vec<u32>] {
        &self.contributions
    }

    /// The unknowns of some retained blocks, block by block.
    pub fn unknowns_of<'a>(&'a self, blocks: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
        blocks.iter().flat_map(|&block| self.retained_range(block as usize))
    }

    /// Equations in each group.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Unknowns of each local block.
    pub fn local_dim(&self) -> usize {
        self.local_dim
    }

    /// Number of local blocks.
    pub fn locals(&self) -> usize {
        self.locals
    }

    /// The places of the retained blocks, where they are known.
    pub fn places(&self) -> Option<&[[f64; 3]]> {
        self.places.as_deref()
    }

    /// Number of retained blocks.
    pub fn retained(&self) -> usize {
        self.retained_offset.len() - 1
    }

    /// Unknowns of retained block `j`.
    pub fn retained_dim(&self, j: usize) -> usize {
        self.retained_offset[j + 1] - self.retained_offset[j]
    }

    /// Number of groups of equations.
    pub fn groups(&self) -> usize {
        self.group_retained.len()
    }

    /// The ties.
    pub fn ties(&self) -> &[Tie] {
        &self.ties
    }

    /// The equations of a tie, counted from the first of all ties.
    pub fn tie_rows(&self, tie: usize) -> Range<usize> {
        self.tie_ptr[tie]..self.tie_ptr[tie + 1]
    }

    /// Where the square block of the equations of a tie stands among the blocks of all ties.
    pub fn tie_block(&self, tie: usize) -> Range<usize> {
        self.block_ptr[tie]..self.block_ptr[tie + 1]
    }

    /// Where the square blocks of all ties stand.
    pub fn tie_blocks(&self) -> Range<usize> {
        0..self.block_ptr[self.ties.len()]
    }

    /// Number of equations: those of all groups, then those of all ties.
    pub fn equations(&self) -> usize {
        self.groups() * self.rows + self.tie_ptr[self.ties.len()]
    }

    /// The unknowns that a tie touches, block by block in its order: the columns of its coefficients.
    pub fn tie_columns(&self, tie: usize) -> impl Iterator<Item = usize> + '_ {
        self.unknowns_of(&self.ties[tie].retained)
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.retained_offset[self.retained()]
    }

    /// The groups of local block `i`.
    pub fn groups_of(&self, i: usize) -> Range<usize> {
        self.group_ptr[i]..self.group_ptr[i + 1]
    }

    /// The main retained block that a group touches.
    pub fn retained_of(&self, group: usize) -> usize {
        self.group_retained[group] as usize
    }

    /// Whether any group touches shared blocks.
    pub fn has_shared(&self) -> bool {
        !self.shared.is_empty()
    }

    /// Whether each retained block is the main one of a group.
    pub(super) fn are_main(&self) -> Vec<bool> {
        let mut main = vec![false; self.retained()];
        self.group_retained.iter().for_each(|&block| main[block as usize] = true);
        main
    }

    /// The shared blocks that a group touches, in its order.
    pub fn shared_of(&self, group: usize) -> &[u32] {
        match self.shared_ptr.get(group..group + 2) {
            Some(ends) => &self.shared[ends[0]..ends[1]],
            None => &[],
        }
    }

    /// All retained blocks that a group touches, the main one first.
    pub fn blocks_of(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.retained_of(group))
            .chain(self.shared_of(group).iter().map(|&block| block as usize))
    }

    /// The unknowns that a group touches in its shared blocks, block by block in its order: the columns of what its equations have in
    /// common with others.
    pub fn shared_columns(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        self.unknowns_of(self.shared_of(group))
    }

    /// How many they are.
    pub fn shared_width(&self, group: usize) -> usize {
        self.shared_of(group).iter().map(|&block| self.retained_dim(block as usize)).sum()
    }

    /// Where local block `i` stands in the vector of unknowns.
    pub fn local_range(&self, i: usize) -> Range<usize> {
        i * self.local_dim..(i + 1) * self.local_dim
    }

    /// Where all local blocks stand in the vector of unknowns.
    pub fn all_locals(&self) -> Range<usize> {
        0..self.locals * self.local_dim
    }

    /// Where retained block `j` stands in the vector of unknowns.
    pub fn retained_range(&self, j: usize) -> Range<usize> {
        self.retained_offset[j]..self.retained_offset[j + 1]
    }

    /// Where all retained blocks stand in the vector of unknowns.
    pub fn all_retained(&self) -> Range<usize> {
        self.retained_offset[0]..self.retained_offset[self.retained()]
    }
}
