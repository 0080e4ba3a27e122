//! What leaves a network for the good of the rest: screens, each of which looks at how an adjustment has ended and names what leaves.

mod leaving;
mod near_station;
mod not_determined;
mod ran_into_station;
mod ran_off;

use self::leaving::{Leaves, Leaving};
use self::near_station::NearStation;
use super::Screens;
use super::selection::LeftOut;

pub(super) use leaving::{Begin, Ended};

/// Whether it is on, what it does, and where an adjustment begins without what it names.
type Screen = (fn(&Screens) -> bool, fn(&Ended<'_>) -> Leaves, Begin);

/// What makes an adjustment go wrong as a whole, the surest first.
const GONE_WRONG: [Screen; 3] = [
    (|on| on.not_determined, not_determined::look, Begin::AsBefore),
    (|on| on.ran_off, ran_off::look, Begin::FromStart),
    (|on| on.at_station, near_station::at_station, Begin::FromStart),
];
/// What an adjustment has stopped for. Points that ran off are told from those that ran into a station at the end only.
const STOPPED: Screen = (|on| on.ran_into_station || on.ran_off, ran_into_station::look, Begin::FromHere);

/// All screens, and what has left so far.
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

    /// Takes out what has to leave; None where all may stay.
    pub fn look(&mut self, ended: &Ended<'_>) -> Option<Begin> {
        if self.near_station.is_untried() && self.near_station.tries(ended, &mut self.leaving) {
            return Some(Begin::FromStart);
        }
        let gone_wrong = GONE_WRONG.iter().find_map(|screen| self.leave(screen, ended));
        if gone_wrong.is_some() {
            return gone_wrong;
        }
        // Whether it has gone better without is known when nothing else was wrong.
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
