//! Prior terms: observations of the unknowns of one block.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

/// Prior of consecutive unknowns of one block: one equation of unit weight per unknown.
#[derive(Debug, Clone)]
pub struct Term {
    /// Index of the first unknown.
    pub first: usize,
    /// Observed minus computed, one element per unknown. Stored on the stack, because a photo may have several terms.
    pub constant: SmallVec<[f64; 3]>,
    /// Partials of the computed values by the step, square, row by row; zero rows are unobserved.
    pub coefficients: SmallVec<[f64; 9]>,
}

impl Term {
    /// Range of the unknowns.
    pub fn unknowns(&self) -> Range<usize> {
        self.first..self.first + self.constant.len()
    }

    /// Returns the rows of partials.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.coefficients.chunks_exact(self.constant.len())
    }

    /// Creates the term of a single unknown from its difference to the prior.
    pub(super) fn single(unknown: usize, apart: f64, sd: f64) -> Self {
        let weight = sd.recip();
        Self { first: unknown, constant: smallvec![weight * apart], coefficients: smallvec![weight] }
    }
}

/// Whether an unknown with this standard deviation is weighted: neither free nor fixed.
pub(super) fn is_weighted(sd: f64) -> bool {
    sd > 0.0 && sd.is_finite()
}
