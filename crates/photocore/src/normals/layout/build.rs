//! Construction and validation of layouts.

use std::ops::Range;

use super::{Layout, LayoutError, Term};

impl Layout {
    /// Describes a system without shared blocks.
    ///
    /// * `rows`: equations in each group (2 for an image point);
    /// * `local_dim`: unknowns of a local block, 1 to 3;
    /// * `retained_dims`: unknowns of each retained block;
    /// * `group_ptr`: the groups of local block `i` are `group_ptr[i]..group_ptr[i + 1]`;
    /// * `group_retained`: the retained block of each group.
    pub fn new(
        rows: usize,
        local_dim: usize,
        retained_dims: &[usize],
        group_ptr: Vec<usize>,
        group_retained: Vec<u32>,
    ) -> Result<Self, LayoutError> {
        if !(1..=3).contains(&local_dim) {
            return Err(LayoutError::LocalDimension(local_dim));
        }
        let in_retained = retained_dims.iter().fold(0, |sum: usize, &dim| sum.saturating_add(dim));
        let unknowns = group_ptr.len().saturating_mul(local_dim).saturating_add(in_retained);
        [retained_dims.len(), group_retained.len(), unknowns].into_iter().try_for_each(numbered)?;
        let rising = group_ptr.is_sorted() && group_ptr.first() == Some(&0);
        if !rising || group_ptr.last() != Some(&group_retained.len()) {
            return Err(LayoutError::GroupPointers(group_retained.len()));
        }
        if let Some(group) =
            group_retained.iter().position(|&retained| retained as usize >= retained_dims.len())
        {
            let retained = group_retained[group] as usize;
            return Err(LayoutError::Retained { group, retained, blocks: retained_dims.len() });
        }
        let mut retained_offset = Vec::with_capacity(retained_dims.len() + 1);
        let mut offset = (group_ptr.len() - 1) * local_dim;
        for dim in retained_dims {
            retained_offset.push(offset);
            offset += dim;
        }
        retained_offset.push(offset);
        let locals = group_ptr.len() - 1;
        Ok(Self {
            rows,
            local_dim,
            locals,
            retained_offset,
            group_ptr,
            group_retained,
            shared_ptr: Vec::new(),
            shared: Vec::new(),
            terms: Vec::new(),
            term_ptr: vec![0],
            block_ptr: vec![0],
            local_term_ptr: Vec::new(),
            local_terms: Vec::new(),
            places: None,
            free: Vec::new(),
            uncoupled: Vec::new(),
            pairs: Vec::new(),
            pair_ptr: vec![0],
            outer: Vec::new(),
            contributions: Vec::new(),
        })
    }

    /// Adds the position of each retained block in a cartesian frame, for nested dissection.
    pub fn with_places(mut self, places: Vec<[f64; 3]>) -> Result<Self, LayoutError> {
        if places.len() != self.retained() {
            return Err(LayoutError::Places { places: places.len(), blocks: self.retained() });
        }
        self.places = Some(places);
        Ok(self)
    }

    /// Adds shared blocks: group `g` has `blocks[ptr[g]..ptr[g + 1]]` besides its main block, in the order of its coefficients.
    pub fn with_shared(mut self, ptr: Vec<usize>, blocks: Vec<u32>) -> Result<Self, LayoutError> {
        let rising = ptr.is_sorted() && ptr.first() == Some(&0) && ptr.last() == Some(&blocks.len());
        if !rising || ptr.len() != self.groups() + 1 {
            return Err(LayoutError::SharedPointers(blocks.len()));
        }
        let mut possible = vec![true; self.retained()];
        self.group_retained.iter().for_each(|&main| possible[main as usize] = false);
        for group in 0..self.groups() {
            let own = &blocks[ptr[group]..ptr[group + 1]];
            for (k, &retained) in own.iter().enumerate() {
                if possible.get(retained as usize) != Some(&true) || own[..k].contains(&retained) {
                    return Err(LayoutError::Shared { group, retained: retained as usize });
                }
            }
        }
        if !blocks.is_empty() {
            (self.shared_ptr, self.shared) = (ptr, blocks);
        }
        Ok(self)
    }

    /// Adds terms.
    pub fn with_terms(mut self, terms: Vec<Term>) -> Result<Self, LayoutError> {
        numbered(terms.len())?;
        let sound = |term: &Term| {
            let mut retained = term.retained.clone();
            retained.sort_unstable();
            let exist = match (term.local, retained.last()) {
                (None, Some(&last)) => (last as usize) < self.retained(),
                (Some(local), None) => (local as usize) < self.locals,
                _ => false,
            };
            let once = retained.windows(2).all(|pair| pair[0] < pair[1]);
            term.rows > 0 && exist && once
        };
        if let Some(term) = terms.iter().position(|term| !sound(term)) {
            return Err(LayoutError::Term { term });
        }
        self.term_ptr.truncate(1);
        self.block_ptr.truncate(1);
        for term in &terms {
            self.term_ptr.push(self.term_ptr[self.term_ptr.len() - 1] + term.rows);
            self.block_ptr.push(self.block_ptr[self.block_ptr.len() - 1] + term.rows.pow(2));
        }
        let of_locals =
            || terms.iter().zip(0..).filter_map(|(term, index)| Some((term.local? as usize, index)));
        (self.local_term_ptr, self.local_terms) = (Vec::new(), Vec::new());
        if of_locals().next().is_some() {
            let mut ptr = vec![0; self.locals + 1];
            of_locals().for_each(|(local, _)| ptr[local + 1] += 1);
            (0..self.locals).for_each(|local| ptr[local + 1] += ptr[local]);
            let (mut next, mut sorted) = (ptr.clone(), vec![0; ptr[self.locals]]);
            for (local, term) in of_locals() {
                sorted[next[local]] = term;
                next[local] += 1;
            }
            (self.local_term_ptr, self.local_terms) = (ptr, sorted);
        }
        self.terms = terms;
        Ok(self)
    }

    /// Marks fixed unknowns, one flag per unknown. Their coefficients must be zero and are omitted from products of shared blocks. Groups
    /// of a completely fixed local block become independent units.
    pub fn with_held(mut self, held: &[bool]) -> Self {
        let of_locals = held.get(self.all_locals()).unwrap_or_default().chunks_exact(self.local_dim);
        let known = of_locals.enumerate().filter(|(_, own)| !own.contains(&false)).map(|(local, _)| local);
        let uncoupled =
            known.flat_map(|local| self.groups_of(local).map(move |group| [group as u32, local as u32]));
        self.uncoupled = uncoupled.collect();
        let of_retained = held.get(self.all_retained()).unwrap_or_default();
        if of_retained.contains(&true) {
            self.free =
                (0..self.retained()).map(|block| free_ranges(&held[self.retained_range(block)])).collect();
        }
        self
    }

    /// Requests the cofactors of pairs of retained blocks (row block, column block). The pattern of the factor includes all pairs.
    pub fn with_pairs(mut self, mut pairs: Vec<[u32; 2]>) -> Result<Self, LayoutError> {
        pairs.sort_unstable();
        pairs.dedup();
        self.pair_ptr.truncate(1);
        for (index, pair) in pairs.iter().enumerate() {
            let [rows, columns] = pair.map(|block| block as usize);
            if rows.max(columns) >= self.retained() {
                return Err(LayoutError::Pair(pair.map(|block| block as usize)));
            }
            let size = self.retained_dim(rows) * self.retained_dim(columns);
            self.pair_ptr.push(self.pair_ptr[index] + size);
        }
        self.pairs = pairs;
        Ok(self)
    }

    /// Makes the system part of a larger one: a node of its elimination tree.
    ///
    /// * `outer`: retained blocks that the parent system eliminates, in any order;
    /// * `contributions`: the retained blocks of each child system's contribution, in its order.
    pub fn as_part(mut self, outer: Vec<u32>, contributions: Vec<Vec<u32>>) -> Result<Self, LayoutError> {
        numbered(contributions.len())?;
        let sound = |blocks: &[u32]| {
            let mut seen = vec![false; self.retained()];
            let fresh = |&block: &u32| {
                seen.get_mut(block as usize).is_some_and(|seen| !std::mem::replace(seen, true))
            };
            blocks.iter().all(fresh)
        };
        let all_sound = std::iter::once(&outer).chain(&contributions).all(|blocks| sound(blocks));
        if !all_sound {
            return Err(LayoutError::Outer);
        }
        (self.outer, self.contributions) = (outer, contributions);
        Ok(self)
    }
}

/// Rejects counts of `u32::MAX` or more; `u32::MAX` itself means no index.
fn numbered(count: usize) -> Result<(), LayoutError> {
    if count < u32::MAX as usize { Ok(()) } else { Err(LayoutError::TooMany(count)) }
}

/// Returns the ranges of consecutive free unknowns.
fn free_ranges(held: &[bool]) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for k in (0..held.len()).filter(|&k| !held[k]) {
        match ranges.last_mut().filter(|last| last.end == k) {
            Some(last) => last.end += 1,
            None => ranges.push(k..k + 1),
        }
    }
    ranges
}
