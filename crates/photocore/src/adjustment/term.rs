//! A term: what was known beforehand of the unknowns of one block.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

/// What was known beforehand of unknowns of one block, one after the other: an equation of unit weight for each of them.
#[derive(Debug, Clone)]
pub struct Term {
    /// The first of the unknowns.
    pub first: usize,
    /// Observed minus computed, as many as unknowns. There may be several of each photo: on the stack.
    pub constant: SmallVec<[f64; 3]>,
    /// The partials of the computed by the step, square, row by row; zero where nothing is observed.
    pub coefficients: SmallVec<[f64; 9]>,
}

impl Term {
    /// Where the unknowns stand.
    pub fn unknowns(&self) -> Range<usize> {
        self.first..self.first + self.constant.len()
    }

    /// The partials, row by row.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.coefficients.chunks_exact(self.constant.len())
    }

    /// Of an unknown that was observed by itself.
    pub(super) fn single(unknown: usize, apart: f64, sd: f64) -> Self {
        let weight = sd.recip();
        Self { first: unknown, constant: smallvec![weight * apart], coefficients: smallvec![weight] }
    }
}

/// Whether an unknown of this standard deviation counts as an observation: neither free nor fixed.
pub(super) fn is_weighted(sd: f64) -> bool {
    sd > 0.0 && sd.is_finite()
}
