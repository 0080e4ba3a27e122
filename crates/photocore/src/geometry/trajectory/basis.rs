//! What corrections are made of: functions of time.

use smallvec::SmallVec;

use super::{Polynomial, Spline};
use crate::geometry::Vector3;

/// All times.
const ALWAYS: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Functions of time, of which few are not zero at any time.
pub trait BasisModel {
    /// How many functions there are.
    fn count(&self) -> usize;

    /// Those that are not zero at a time, and how they change.
    fn at(&self, time: f64) -> Active;

    /// Whether it is a basis at all: numbers that can be taken, knots that do not decrease.
    fn is_sound(&self) -> bool;

    /// The times that it may be asked for.
    fn span(&self) -> (f64, f64) {
        ALWAYS
    }

    /// How far a time may be from another whose functions are at hand as well; zero where they are the same at all times.
    fn reach(&self) -> f64 {
        0.0
    }
}

/// Corrections in a basis of any kind; none at all.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Basis {
    /// No corrections.
    #[default]
    None,
    /// See [`Polynomial`].
    Polynomial(Polynomial),
    /// See [`Spline`].
    Spline(Spline),
}

impl Basis {
    fn model(&self) -> Option<&dyn BasisModel> {
        match self {
            Self::None => None,
            Self::Polynomial(own) => Some(own),
            Self::Spline(own) => Some(own),
        }
    }

    /// How many functions there are.
    pub fn count(&self) -> usize {
        self.model().map_or(0, BasisModel::count)
    }

    /// See [`BasisModel::at`].
    pub fn at(&self, time: f64) -> Active {
        self.model().map(|own| own.at(time)).unwrap_or_default()
    }

    /// See [`BasisModel::is_sound`].
    pub fn is_sound(&self) -> bool {
        self.model().is_none_or(BasisModel::is_sound)
    }

    /// See [`BasisModel::span`].
    pub fn span(&self) -> (f64, f64) {
        self.model().map_or(ALWAYS, BasisModel::span)
    }

    /// The numbers of the functions that are not zero at a time or, where that is not known exactly, near it.
    pub fn near(&self, time: f64, exactly: bool) -> std::ops::Range<usize> {
        let of = |time: f64| {
            let found = self.at(time);
            found.first..found.first + found.values.len()
        };
        let reach = if exactly { 0.0 } else { self.model().map_or(0.0, BasisModel::reach) };
        of(time - reach).start..of(time + reach).end
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
