//! What the steps so far say of the next full one: the same rules for a problem in one process and for one in parts.

use super::method::{NEGLIGIBLE, leaves_cofactors};
use super::options::Iteration;

/// So many full steps, the last of which is longer than this part of the first, do not fall any more.
const ALIKE: usize = 5;
const ALIKE_FALL: f64 = 0.9;
/// Steps that change the unknowns by less than this multiple of their standard deviations leave the normal equations as they are, to much
/// less than what a chord gains.
const CLOSE: f64 = 30.0;
/// And by more than this one: after a shorter step the next one is the last.
const NOT_YET: f64 = 10.0 * NEGLIGIBLE;
/// A step so small a part of the one before is on the way to the end, and so is a chord after it.
const FALLING: f64 = 0.1;

/// The steps of an adjustment so far.
#[derive(Debug, Clone, Copy)]
pub struct History<'a> {
    /// One after the other.
    pub iterations: &'a [Iteration],
    /// The length of the chord that followed the last step, where one did.
    pub chord: Option<f64>,
    /// How many unknowns there are.
    pub unknowns: usize,
}

impl History<'_> {
    /// Whether a full step leaves cofactors as they are and, the steps falling at the rate of the last two, chords counted, all further ones
    /// together would not exceed a limit (Hairer and Wanner 1996, section IV.8).
    pub fn leaves_less_than(&self, limit: f64, change: f64) -> bool {
        let rate = self.before().map_or(1.0, |before| change / self.chord.unwrap_or(before.largest_change));
        leaves_cofactors(change, self.unknowns) && rate < 1.0 && rate / (1.0 - rate) * change <= limit
    }

    /// Whether full steps are negligible and have long been as long as this one: what still moves, the observations do not determine
    /// beyond the rounding of its equations.
    pub fn falls_no_more(&self, change: f64) -> bool {
        let last = self.iterations.len().checked_sub(ALIKE).map(|first| &self.iterations[first..]);
        last.is_some_and(|last| {
            let negligible = |step: &Iteration| step.damping == 0.0 && step.largest_change <= NEGLIGIBLE;
            change <= NEGLIGIBLE
                && last.iter().all(negligible)
                && change > ALIKE_FALL * last[0].largest_change
        })
    }

    /// Whether a chord pays after a full step.
    pub fn is_for_chord(&self, change: f64) -> bool {
        (NOT_YET..CLOSE).contains(&change)
            && self.before().is_some_and(|before| change <= FALLING * before.largest_change)
    }

    /// Whether a chord after a full step is taken: what is not a number does not fall.
    pub fn is_chord(chord: f64, change: f64) -> bool {
        chord <= FALLING * change
    }

    /// The last step, where it was a full one.
    fn before(&self) -> Option<&Iteration> {
        self.iterations.last().filter(|iteration| iteration.damping == 0.0)
    }
}
