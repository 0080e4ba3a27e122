//! Structure of a system: unknowns, equations and the blocks that they involve.

mod build;
mod units;

use std::ops::Range;

use thiserror::Error;

/// Unknowns and equations of a system.
///
/// The vector of unknowns is `[local blocks | retained blocks]`. A group of `rows` equations involves one local block, one main retained
/// block and optional *shared* retained blocks, such as the camera of several photos. The groups of a local block are consecutive. A
/// [`Term`] involves any retained blocks, or one local block.
///
/// Kernels are specialised for main blocks. A retained block is either main or shared, never both; blocks that most groups involve should
/// be shared.
///
/// The numbers of blocks, groups, terms and unknowns are less than `u32::MAX` each, which is checked here. Indices have 32 bits.
#[derive(Debug, Clone)]
pub struct Layout {
    rows: usize,
    local_dim: usize,
    locals: usize,
    retained_offset: Vec<usize>,
    group_ptr: Vec<usize>,
    group_retained: Vec<u32>,
    /// The shared blocks of group `g` are `shared[shared_ptr[g]..shared_ptr[g + 1]]`; both vectors are empty if no group has any.
    shared_ptr: Vec<usize>,
    shared: Vec<u32>,
    terms: Vec<Term>,
    /// Index of the first equation of each term among all terms, and the end of the last.
    term_ptr: Vec<usize>,
    /// Offset of the square matrix of each term, and the end of the last.
    block_ptr: Vec<usize>,
    /// The terms of local block `i` are `local_terms[local_term_ptr[i]..local_term_ptr[i + 1]]`; both vectors are empty if no term is local.
    local_term_ptr: Vec<usize>,
    local_terms: Vec<u32>,
    places: Option<Vec<[f64; 3]>>,
    /// Index ranges of the free unknowns of each retained block; empty if every unknown is free.
    free: Vec<Vec<Range<usize>>>,
    /// Groups of fixed local blocks, with their blocks.
    uncoupled: Vec<[u32; 2]>,
    /// Requested pairs of retained blocks, ascending; `pair_ptr` contains the offset of each block, and the end of the last.
    pairs: Vec<[u32; 2]>,
    pair_ptr: Vec<usize>,
    /// Retained blocks that the parent system eliminates, and the blocks of each child system's contribution.
    outer: Vec<u32>,
    contributions: Vec<Vec<u32>>,
}

/// Equations among retained blocks, such as a distance between two retained points or a relative pose of two photos; or equations of one
/// local block, such as a height of a point. The latter are part of the elimination of the block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Term {
    /// Number of equations.
    pub rows: usize,
    /// The local block of equations without retained blocks.
    pub local: Option<u32>,
    /// The retained blocks, each once, in any order.
    pub retained: Vec<u32>,
}

/// Inconsistent layout.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// More blocks, groups, terms or unknowns than 32-bit indices.
    #[error("{0} blocks, equations or unknowns are more than can be numbered")]
    TooMany(usize),
    /// A local block must have 1 to 3 unknowns.
    #[error("local blocks have {0} unknowns; 1, 2 or 3 are possible")]
    LocalDimension(usize),
    /// The group pointers must rise from zero to the number of groups.
    #[error("the group pointers must rise from 0 to the number of groups, {0}")]
    GroupPointers(usize),
    /// A group refers to a retained block that does not exist.
    #[error("group {group} touches retained block {retained} of {blocks}")]
    Retained {
        /// The group.
        group: usize,
        /// Index of the missing block.
        retained: usize,
        /// Number of retained blocks.
        blocks: usize,
    },
    /// The number of positions differs from the number of retained blocks.
    #[error("{places} places for {blocks} retained blocks")]
    Places {
        /// Number of positions.
        places: usize,
        /// Number of blocks.
        blocks: usize,
    },
    /// The pointers to the shared blocks must rise from zero to their number: one per group and one more.
    #[error(
        "the pointers to shared blocks must rise from 0 to their number, {0}, one for each group and one more"
    )]
    SharedPointers(usize),
    /// A shared block of a group does not exist, is duplicated, or is a main block.
    #[error(
        "group {group} has retained block {retained} among its shared ones, which does not exist, is named twice or is the main one of a group"
    )]
    Shared {
        /// Index of the group.
        group: usize,
        /// Index of the shared block.
        retained: usize,
    },
    /// A pair refers to a retained block that does not exist.
    #[error("a pair of retained blocks names one that does not exist: {0:?}")]
    Pair([usize; 2]),
    /// A requested block of the inverse is outside the pattern of the factor.
    #[error(
        "block ({row}, {column}) of the inverse is outside the pattern of the factor: ask for it by Layout::with_pairs"
    )]
    Block {
        /// Retained block of the rows.
        row: usize,
        /// Retained block of the columns.
        column: usize,
    },
    /// The length of a slice differs from the layout.
    #[error("{field} has {length} elements, and the layout requires {required}")]
    Length {
        /// The type and the field, such as `Problem::sd`.
        field: &'static str,
        /// Length of the slice.
        length: usize,
        /// Required length.
        required: usize,
    },
    /// The length of right-hand sides is not a multiple of the number of unknowns.
    #[error("{field} has {length} elements, and the layout requires a multiple of {unknowns}")]
    Columns {
        /// The type and the field, such as `SolveOptions::rights`.
        field: &'static str,
        /// Length of the slice.
        length: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The graph of the blocks is too large for the requested ordering.
    #[error("the graph of the retained blocks is too large for the ordering {0}: use input or rcm")]
    Ordering(&'static str),
    /// A list of outer or contributed blocks has a missing or duplicate block.
    #[error("outer or contributed blocks do not exist or are named twice")]
    Outer,
    /// The pattern of the factor lacks a block of the equations: the elimination order contradicts the layout.
    #[error("the pattern of the factor lacks blocks that go to its front {front}")]
    Pattern {
        /// Supernode of the front.
        front: usize,
    },
    /// A term has zero equations or unknowns, refers to a missing or duplicate block, or to a local block and others.
    #[error(
        "tie {term} has no equations or unknowns, or names a block twice or one that does not exist, or has a local block and others"
    )]
    Term {
        /// Index of the term.
        term: usize,
    },
}

impl LayoutError {
    /// Returns an error if `length` differs from `required`.
    pub(crate) fn unless_of_length(field: &'static str, length: usize, required: usize) -> Result<(), Self> {
        if length == required { Ok(()) } else { Err(Self::Length { field, length, required }) }
    }
}

impl Layout {
    /// Returns the index ranges of the free unknowns of a retained block, relative to its first unknown.
    pub(super) fn free_of(&self, block: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let known = self.free.get(block);
        let all = known.is_none().then(|| 0..self.retained_dim(block));
        known.into_iter().flatten().cloned().chain(all)
    }

    /// Returns the pairs of retained blocks with requested cofactors.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// Returns an error if the length is not a multiple of the number of unknowns.
    pub(super) fn check_columns(&self, field: &'static str, length: usize) -> Result<(), LayoutError> {
        let unknowns = self.unknowns();
        let fits = length.checked_rem(unknowns).unwrap_or(length) == 0;
        if fits { Ok(()) } else { Err(LayoutError::Columns { field, length, unknowns }) }
    }

    /// Returns the range of a pair among the cofactors of all pairs; None if it was not requested.
    pub fn pair(&self, pair: [u32; 2]) -> Option<Range<usize>> {
        let index = self.pairs.binary_search(&pair).ok()?;
        Some(self.pair_ptr[index]..self.pair_ptr[index + 1])
    }

    /// Returns the retained blocks that the parent system eliminates.
    pub fn outer(&self) -> &[u32] {
        &self.outer
    }

    /// Returns the retained blocks of each child system's contribution.
    pub fn contributions(&self) -> &[Vec<u32>] {
        &self.contributions
    }

    /// Returns the unknowns of some retained blocks, block by block.
    pub fn unknowns_of<'a>(&'a self, blocks: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
        blocks.iter().flat_map(|&block| self.retained_range(block as usize))
    }

    /// Number of equations per group.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of unknowns per local block.
    pub fn local_dim(&self) -> usize {
        self.local_dim
    }

    /// Number of local blocks.
    pub fn locals(&self) -> usize {
        self.locals
    }

    /// Positions of the retained blocks, if given.
    pub fn places(&self) -> Option<&[[f64; 3]]> {
        self.places.as_deref()
    }

    /// Number of retained blocks.
    pub fn retained(&self) -> usize {
        self.retained_offset.len() - 1
    }

    /// Number of unknowns of retained block `j`.
    pub fn retained_dim(&self, j: usize) -> usize {
        self.retained_offset[j + 1] - self.retained_offset[j]
    }

    /// Number of groups of equations.
    pub fn groups(&self) -> usize {
        self.group_retained.len()
    }

    /// The terms.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Returns the equations of a group.
    pub fn equations_of_group(&self, group: usize) -> Range<usize> {
        group * self.rows..(group + 1) * self.rows
    }

    /// Returns the equations of a term, which follow those of the groups.
    pub fn equations_of_term(&self, term: usize) -> Range<usize> {
        let first = self.groups() * self.rows;
        first + self.term_ptr[term]..first + self.term_ptr[term + 1]
    }

    /// Returns the term of an equation; None for those of groups.
    pub fn term_with(&self, equation: usize) -> Option<usize> {
        let row = equation.checked_sub(self.groups() * self.rows)?;
        Some(self.term_ptr.partition_point(|&first| first <= row) - 1)
    }

    /// Returns the range of the square matrix of a term among the matrices of all terms.
    pub fn term_block(&self, term: usize) -> Range<usize> {
        self.block_ptr[term]..self.block_ptr[term + 1]
    }

    /// Returns the range of the square matrices of all terms.
    pub fn term_blocks(&self) -> Range<usize> {
        0..self.block_ptr[self.terms.len()]
    }

    /// Number of equations: all groups, then all terms.
    pub fn equations(&self) -> usize {
        self.groups() * self.rows + self.term_ptr[self.terms.len()]
    }

    /// Returns the unknowns of a term, block by block: the columns of its coefficients.
    pub fn term_columns(&self, term: usize) -> impl Iterator<Item = usize> + '_ {
        let Term { local, retained, .. } = &self.terms[term];
        local.map_or(0..0, |local| self.local_range(local as usize)).chain(self.unknowns_of(retained))
    }

    /// Returns the terms of a local block.
    pub fn terms_of(&self, local: usize) -> &[u32] {
        match self.local_term_ptr.get(local..local + 2) {
            Some(ends) => &self.local_terms[ends[0]..ends[1]],
            None => &[],
        }
    }

    /// Whether any term belongs to a local block.
    pub(super) fn has_local_terms(&self) -> bool {
        !self.local_terms.is_empty()
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.retained_offset[self.retained()]
    }

    /// Returns the groups of local block `i`.
    pub fn groups_of(&self, i: usize) -> Range<usize> {
        self.group_ptr[i]..self.group_ptr[i + 1]
    }

    /// Returns the main retained block of a group.
    pub fn retained_of(&self, group: usize) -> usize {
        self.group_retained[group] as usize
    }

    /// Whether any group has shared blocks.
    pub fn has_shared(&self) -> bool {
        !self.shared.is_empty()
    }

    /// Returns a flag per retained block: whether it is the main block of a group.
    pub(super) fn are_main(&self) -> Vec<bool> {
        let mut main = vec![false; self.retained()];
        self.group_retained.iter().for_each(|&block| main[block as usize] = true);
        main
    }

    /// Returns the shared blocks of a group, in its order.
    pub fn shared_of(&self, group: usize) -> &[u32] {
        match self.shared_ptr.get(group..group + 2) {
            Some(ends) => &self.shared[ends[0]..ends[1]],
            None => &[],
        }
    }

    /// Returns all retained blocks of a group, the main block first.
    pub fn blocks_of(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.retained_of(group))
            .chain(self.shared_of(group).iter().map(|&block| block as usize))
    }

    /// Returns the unknowns of the shared blocks of a group, block by block: the columns of its shared coefficients.
    pub fn shared_columns(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        self.unknowns_of(self.shared_of(group))
    }

    /// Number of unknowns in the shared blocks of a group.
    pub fn shared_width(&self, group: usize) -> usize {
        self.shared_of(group).iter().map(|&block| self.retained_dim(block as usize)).sum()
    }

    /// Range of local block `i` in the vector of unknowns.
    pub fn local_range(&self, i: usize) -> Range<usize> {
        i * self.local_dim..(i + 1) * self.local_dim
    }

    /// Range of all local blocks in the vector of unknowns.
    pub fn all_locals(&self) -> Range<usize> {
        0..self.locals * self.local_dim
    }

    /// Range of retained block `j` in the vector of unknowns.
    pub fn retained_range(&self, j: usize) -> Range<usize> {
        self.retained_offset[j]..self.retained_offset[j + 1]
    }

    /// Returns the retained block of an unknown.
    pub fn retained_with(&self, unknown: usize) -> usize {
        self.retained_offset.partition_point(|&first| first <= unknown) - 1
    }

    /// Range of all retained blocks in the vector of unknowns.
    pub fn all_retained(&self) -> Range<usize> {
        self.retained_offset[0]..self.retained_offset[self.retained()]
    }
}
