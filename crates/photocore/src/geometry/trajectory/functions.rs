//! Functions of time.

use std::ops::Range;

use smallvec::SmallVec;

use crate::geometry::Vector3;

/// All times.
pub const ALWAYS: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Functions of time, of which few are not zero at any time.
pub trait BasisModel: Sized {
    /// The name under which callers know the basis.
    const NAME: &'static str;

    /// From a degree and numbers, as callers have them that know a basis by its name; None where there are more or fewer than it has.
    fn from_numbers(degree: usize, numbers: &[f64]) -> Option<Self>;

    /// How many functions there are.
    fn count(&self) -> usize;

    /// Puts those that are not zero at a time, and how they change, in the place of others.
    fn put(&self, time: f64, all: &mut Active);

    /// The numbers of those.
    fn active(&self, _time: f64) -> Range<usize> {
        0..self.count()
    }

    /// Whether it is a basis at all: numbers that can be taken, knots that do not decrease.
    fn is_sound(&self) -> bool;

    /// The times that it may be asked for.
    fn span(&self) -> (f64, f64) {
        ALWAYS
    }

    /// The time that a function is about; None where it is not zero at any time.
    fn middle(&self, _k: usize) -> Option<f64> {
        None
    }

    /// How far a time may be from another whose functions are at hand as well; None where they are the same at all times.
    fn reach(&self) -> Option<f64> {
        None
    }
}

/// The functions that are not zero at a time: from the first on, their values and their rates in a second.
#[derive(Debug, Clone, Default)]
pub struct Active {
    /// The number of the first.
    pub first: usize,
    /// B_k.
    pub values: SmallVec<[f64; 6]>,
    /// B_k'.
    pub rates: SmallVec<[f64; 6]>,
}

impl Active {
    /// B_k.
    pub fn value(&self, k: usize) -> f64 {
        k.checked_sub(self.first).and_then(|k| self.values.get(k)).copied().unwrap_or(0.0)
    }

    /// B_k'.
    pub fn rate(&self, k: usize) -> f64 {
        k.checked_sub(self.first).and_then(|k| self.rates.get(k)).copied().unwrap_or(0.0)
    }

    /// Sums of B_k and of B_k' times coefficients.
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
