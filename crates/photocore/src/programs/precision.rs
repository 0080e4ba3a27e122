//! Values that double precision holds too coarsely.

use thiserror::Error;

/// The square of a larger coordinate, or the product of its partials, is not a number.
const LARGEST: f64 = 1e100;
/// The weight that belongs to a smaller standard deviation is not one either.
const SMALLEST: f64 = 1e-100;

/// Coordinates or angles that double precision rounds by more than their standard deviations, or than image coordinates show.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{} photos and {} points have coordinates or angles too large for double precision", .photos.len(), .points.len())]
pub struct Coarse {
    /// Photographs that have them.
    pub photos: Vec<usize>,
    /// Points that have them.
    pub points: Vec<usize>,
}

impl Coarse {
    /// Refuses photographs and points that are too coarse.
    ///
    /// # Errors
    /// There are any.
    pub fn refuse(
        photos: impl Iterator<Item = usize>,
        points: impl Iterator<Item = usize>,
    ) -> Result<(), Self> {
        let (photos, points): (Vec<usize>, Vec<usize>) = (photos.collect(), points.collect());
        if photos.is_empty() && points.is_empty() { Ok(()) } else { Err(Self { photos, points }) }
    }
}

/// By how much rounding may have changed a number: half its distance from the next one, and more than would give no weight.
fn rounding(value: f64) -> f64 {
    ((value.abs().next_up() - value.abs()) / 2.0).max(SMALLEST)
}

/// Whether a value cannot be computed with; or counts as an observation, and is rounded by more than its standard deviation.
pub fn is_coarse(value: f64, sd: f64) -> bool {
    value.abs() > LARGEST || sd > 0.0 && sd.is_finite() && rounding(value) > sd
}

/// Whether rounding has changed a value by more than what shows; `shown` may be infinite or NaN where that is not known.
pub fn is_coarser(value: f64, shown: f64) -> bool {
    shown < rounding(value)
}

/// The middle one of some numbers, in order; None where there are none.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
