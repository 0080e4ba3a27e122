//! Input and output of the screens.

use crate::adjustment::{AdjustError, Adjustment};
use crate::network::input::Options;
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, LeftOut};

/// Minimum ratio of all objects to excluded ones, for which these count as few.
pub(super) const FEW: usize = 10;

/// Final state of an adjustment.
pub(in crate::network) struct Ended<'a> {
    pub adjusted: &'a Result<Adjustment, AdjustError>,
    pub assembled: &'a Assembled,
    pub options: &'a Options,
}

/// Initial values of the adjustment after an exclusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::network) enum Begin {
    /// Initial values: the excluded objects have corrupted all others.
    FromStart,
    /// Start of the preceding adjustment.
    AsBefore,
    /// End of the preceding adjustment.
    FromHere,
}

/// Detected objects: indices into the network.
#[derive(Debug, Default)]
pub(super) struct Leaves {
    pub points: Vec<Dropped>,
    pub photos: Vec<usize>,
}

#[derive(Debug, Clone)]
pub(in crate::network) struct Leaving {
    pub left_out: LeftOut,
    /// Excluded points that harm the others.
    pub harmful: Vec<Dropped>,
}
