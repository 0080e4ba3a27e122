//! What the screens look at, and what they name.

use crate::adjustment::{AdjustError, Adjustment};
use crate::network::Options;
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, LeftOut};

/// What leaves is few where there are so many times as many.
pub(super) const FEW: usize = 10;

/// How an adjustment has ended.
pub(in crate::network) struct Ended<'a> {
    pub adjusted: &'a Result<Adjustment, AdjustError>,
    pub assembled: &'a Assembled,
    pub options: &'a Options,
}

/// Where an adjustment without what has left begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::network) enum Begin {
    /// At the initial values: what has left has led all others astray.
    FromStart,
    /// Where the one before has.
    AsBefore,
    /// Where that has ended.
    FromHere,
}

/// What a screen names: indices into the network.
#[derive(Debug, Default)]
pub(super) struct Leaves {
    pub points: Vec<Dropped>,
    pub photos: Vec<usize>,
}

/// What an adjustment does without.
#[derive(Debug, Clone)]
pub(in crate::network) struct Leaving {
    pub left_out: LeftOut,
    /// Those of the points that leave because they harm the others.
    pub harmful: Vec<Dropped>,
}
