//! Screens: each checks the final state of an adjustment and lists points and photos to exclude.

mod leaving;
mod near_station;
mod not_determined;
mod ran_into_station;
mod ran_off;

use self::leaving::{Leaves, Leaving};
use self::near_station::NearStation;
use super::input::Screens;
use super::selection::LeftOut;

pub(super) use leaving::{Begin, Ended};

/// Switch and function of a screen, and the start of the adjustment after its exclusions.
type Screen = (fn(&Screens) -> bool, fn(&Ended<'_>) -> Leaves, Begin);

/// Causes of a failed adjustment, the most certain first.
const GONE_WRONG: [Screen; 3] = [
    (|on| on.not_determined, not_determined::look, Begin::AsBefore),
    (|on| on.ran_off, ran_off::look, Begin::FromStart),
    (|on| on.at_station, near_station::at_station, Begin::FromStart),
];
/// Cause of a stopped adjustment. Points that ran off and points at a station are distinguished only at the end.
const STOPPED: Screen = (|on| on.ran_into_station || on.ran_off, ran_into_station::look, Begin::FromHere);

/// All screens, and the exclusions so far.
#[derive(Debug)]
pub(super) struct Screening {
    pub leaving: Leaving,
    near_station: NearStation,
}

impl Screening {
    pub fn new(left_out: LeftOut) -> Self {
        let leaving = Leaving { left_out, harmful: vec![] };
        Self { near_station: NearStation::Untried(leaving.clone()), leaving }
    }

    /// Excludes harmful points and photos; returns None if all remain.
    pub fn look(&mut self, ended: &Ended<'_>) -> Option<Begin> {
        if self.near_station.is_untried() && self.near_station.tries(ended, &mut self.leaving) {
            return Some(Begin::FromStart);
        }
        let gone_wrong = GONE_WRONG.iter().find_map(|screen| self.leave(screen, ended));
        if gone_wrong.is_some() {
            return gone_wrong;
        }
        // The improvement without points near stations is judged after all other causes.
        if !self.near_station.is_untried() && self.near_station.tries(ended, &mut self.leaving) {
            return Some(Begin::FromStart);
        }
        self.leave(&STOPPED, ended)
    }

    fn leave(&mut self, (is_on, look, begin): &Screen, ended: &Ended<'_>) -> Option<Begin> {
        if !is_on(&ended.options.screens) {
            return None;
        }
        let Leaves { points, photos } = look(ended);
        let some = !(points.is_empty() && photos.is_empty());
        points.iter().for_each(|dropped| self.leaving.left_out.points[dropped.point] = true);
        photos.iter().for_each(|&photo| self.leaving.left_out.photos[photo] = true);
        self.leaving.harmful.extend(points);
        some.then_some(*begin)
    }
}
