//! What corrections are made of: functions of time of any kind.

use super::functions::{ALWAYS, Active, BasisModel};
use super::{Polynomial, Spline};

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
