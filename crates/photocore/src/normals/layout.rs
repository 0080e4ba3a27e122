//! Which unknowns there are, and which group of equations touches which of them.

use std::ops::Range;

use thiserror::Error;

/// The unknowns and the groups of equations of a system.
///
/// The vector of unknowns is `[local blocks | kept blocks | border]`. A group of `rows` equations touches one local
/// block, one kept block and a (possibly empty) range of the border; the groups of a local block are consecutive.
#[derive(Debug, Clone)]
pub struct Layout {
    rows: usize,
    local_dim: usize,
    locals: usize,
    kept_offset: Vec<usize>,
    common_kept_dim: Option<usize>,
    border_dim: usize,
    group_ptr: Vec<usize>,
    group_kept: Vec<u32>,
    group_border: Vec<Range<u32>>,
    places: Option<Vec<[f64; 3]>>,
}

/// A layout that contradicts itself.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LayoutError {
    /// A local block has no size or more than three unknowns.
    #[error("local blocks have {0} unknowns; 1, 2 or 3 are possible")]
    LocalDimension(usize),
    /// The group pointers do not run from zero to the number of groups without falling.
    #[error("the group pointers must rise from 0 to the number of groups, {0}")]
    GroupPointers(usize),
    /// A group names a kept block that does not exist.
    #[error("group {group} touches kept block {kept} of {blocks}")]
    Kept {
        /// The group.
        group: usize,
        /// The block it names.
        kept: usize,
        /// How many there are.
        blocks: usize,
    },
    /// There is not one place for each kept block.
    #[error("{places} places for {blocks} kept blocks")]
    Places {
        /// How many places were given.
        places: usize,
        /// How many blocks there are.
        blocks: usize,
    },
    /// A group touches unknowns beyond the end of the border.
    #[error("group {group} touches the border up to {end} of {border}")]
    Border {
        /// The group.
        group: usize,
        /// End of its range.
        end: usize,
        /// Size of the border.
        border: usize,
    },
}

impl Layout {
    /// Describes a system without border.
    ///
    /// * `rows`: equations in each group (2 for an image point);
    /// * `local_dim`: unknowns of a local block, 1 to 3;
    /// * `kept_dims`: unknowns of each kept block;
    /// * `group_ptr`: the groups of local block `i` are `group_ptr[i]..group_ptr[i + 1]`;
    /// * `group_kept`: the kept block of each group.
    pub fn new(
        rows: usize,
        local_dim: usize,
        kept_dims: &[usize],
        group_ptr: Vec<usize>,
        group_kept: Vec<u32>,
    ) -> Result<Self, LayoutError> {
        if !(1..=3).contains(&local_dim) {
            return Err(LayoutError::LocalDimension(local_dim));
        }
        let rising = group_ptr.is_sorted() && group_ptr.first() == Some(&0);
        if !rising || group_ptr.last() != Some(&group_kept.len()) {
            return Err(LayoutError::GroupPointers(group_kept.len()));
        }
        if let Some(group) = group_kept.iter().position(|&kept| kept as usize >= kept_dims.len()) {
            let kept = group_kept[group] as usize;
            return Err(LayoutError::Kept { group, kept, blocks: kept_dims.len() });
        }
        let mut kept_offset = Vec::with_capacity(kept_dims.len() + 1);
        let mut offset = (group_ptr.len() - 1) * local_dim;
        for dim in kept_dims {
            kept_offset.push(offset);
            offset += dim;
        }
        kept_offset.push(offset);
        let locals = group_ptr.len() - 1;
        let group_border = Vec::new();
        Ok(Self {
            rows,
            local_dim,
            locals,
            kept_offset,
            common_kept_dim: kept_dims
                .first()
                .copied()
                .filter(|first| kept_dims.iter().all(|dim| dim == first)),
            border_dim: 0,
            group_ptr,
            group_kept,
            group_border,
            places: None,
        })
    }

    /// Adds the place of each kept block in some cartesian space: nested dissection cuts across it.
    pub fn with_places(mut self, places: Vec<[f64; 3]>) -> Result<Self, LayoutError> {
        if places.len() != self.kept() {
            return Err(LayoutError::Places { places: places.len(), blocks: self.kept() });
        }
        self.places = Some(places);
        Ok(self)
    }

    /// Adds a border of `dim` common unknowns; `ranges` says which of them each group touches.
    pub fn with_border(mut self, dim: usize, ranges: Vec<Range<u32>>) -> Result<Self, LayoutError> {
        if ranges.len() != self.groups() {
            return Err(LayoutError::GroupPointers(self.groups()));
        }
        if let Some(group) =
            ranges.iter().position(|range| range.end as usize > dim || range.start > range.end)
        {
            return Err(LayoutError::Border { group, end: ranges[group].end as usize, border: dim });
        }
        self.border_dim = dim;
        self.group_border = ranges;
        Ok(self)
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

    /// The places of the kept blocks, where they are known.
    pub fn places(&self) -> Option<&[[f64; 3]]> {
        self.places.as_deref()
    }

    /// Number of kept blocks.
    pub fn kept(&self) -> usize {
        self.kept_offset.len() - 1
    }

    /// Unknowns of kept block `j`.
    pub fn kept_dim(&self, j: usize) -> usize {
        self.kept_offset[j + 1] - self.kept_offset[j]
    }

    /// Unknowns of every kept block, where all have the same number.
    pub(super) fn common_kept_dim(&self) -> Option<usize> {
        self.common_kept_dim
    }

    /// Size of the border.
    pub fn border_dim(&self) -> usize {
        self.border_dim
    }

    /// Number of groups of equations.
    pub fn groups(&self) -> usize {
        self.group_kept.len()
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.kept_offset[self.kept()] + self.border_dim
    }

    /// The groups of local block `i`.
    pub fn groups_of(&self, i: usize) -> Range<usize> {
        self.group_ptr[i]..self.group_ptr[i + 1]
    }

    /// The kept block that a group touches.
    pub fn kept_of(&self, group: usize) -> usize {
        self.group_kept[group] as usize
    }

    /// The part of the border that a group touches, counted from the start of the border.
    pub fn border_of(&self, group: usize) -> Range<usize> {
        match self.group_border.get(group) {
            Some(range) => range.start as usize..range.end as usize,
            None => 0..0,
        }
    }

    /// Where local block `i` stands in the vector of unknowns.
    pub fn local_range(&self, i: usize) -> Range<usize> {
        i * self.local_dim..(i + 1) * self.local_dim
    }

    /// Where all local blocks stand in the vector of unknowns.
    pub fn all_locals(&self) -> Range<usize> {
        0..self.locals * self.local_dim
    }

    /// Where kept block `j` stands in the vector of unknowns.
    pub fn kept_range(&self, j: usize) -> Range<usize> {
        self.kept_offset[j]..self.kept_offset[j + 1]
    }

    /// Where all kept blocks stand in the vector of unknowns.
    pub fn all_kept(&self) -> Range<usize> {
        self.kept_offset[0]..self.kept_offset[self.kept()]
    }

    /// Where the border stands in the vector of unknowns.
    pub fn border_range(&self) -> Range<usize> {
        self.kept_offset[self.kept()]..self.unknowns()
    }
}
