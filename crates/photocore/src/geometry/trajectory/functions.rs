//! Functions of time: the interface of all bases.

use std::ops::Range;

use smallvec::SmallVec;

use crate::geometry::Vector3;

/// Unlimited time range.
pub const ALWAYS: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Basis functions of time, few of which are nonzero at any time.
pub trait BasisModel: Sized {
    /// Name of the basis for callers.
    const NAME: &'static str;

    /// Returns the basis of a degree and its numbers, for callers that select it by name; None for a wrong number of values.
    fn from_numbers(degree: usize, numbers: &[f64]) -> Option<Self>;

    /// Returns the number of functions.
    fn count(&self) -> usize;

    /// Replaces the contents by the functions that are nonzero at a time, with their rates.
    fn put(&self, time: f64, all: &mut Active);

    /// Returns the indices of the nonzero functions.
    fn active(&self, _time: f64) -> Range<usize> {
        0..self.count()
    }

    /// Returns whether the basis is valid: finite numbers, nondecreasing knots.
    fn is_sound(&self) -> bool;

    /// Returns the valid time range.
    fn span(&self) -> (f64, f64) {
        ALWAYS
    }

    /// Returns the centre of a function in time; None for functions that are nonzero at all times.
    fn middle(&self, _k: usize) -> Option<f64> {
        None
    }

    /// Returns the time offset up to which `Basis::near` includes functions; None if all functions are always active.
    fn reach(&self) -> Option<f64> {
        None
    }
}

/// Functions that are nonzero at a time: consecutive from the first, with values and rates per second.
#[derive(Debug, Clone, Default)]
pub struct Active {
    /// Index of the first function.
    pub first: usize,
    /// B_k.
    pub values: SmallVec<[f64; 6]>,
    /// B_k'.
    pub rates: SmallVec<[f64; 6]>,
}

impl Active {
    /// Returns B_k.
    pub fn value(&self, k: usize) -> f64 {
        k.checked_sub(self.first).and_then(|k| self.values.get(k)).copied().unwrap_or(0.0)
    }

    /// Returns B_k'.
    pub fn rate(&self, k: usize) -> f64 {
        k.checked_sub(self.first).and_then(|k| self.rates.get(k)).copied().unwrap_or(0.0)
    }

    /// Returns the sums of B_k and of B_k' times coefficients.
    pub fn sums(&self, coefficient: &dyn Fn(usize) -> Vector3) -> (Vector3, Vector3) {
        let (mut value, mut rate) = (Vector3::zeros(), Vector3::zeros());
        for (k, (b, d)) in self.values.iter().zip(&self.rates).enumerate() {
            let own = coefficient(self.first + k);
            value += *b * own;
            rate += *d * own;
        }
        (value, rate)
    }
}
