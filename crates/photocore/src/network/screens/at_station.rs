//! Points whose first values are those of a station that sees them, so that no image can be computed.

use super::leaving::{Ended, Leaves};
use crate::adjustment::AdjustError;
use crate::network::selection::{Dropped, Reason};

pub(super) fn look(ended: &Ended<'_>) -> Leaves {
    let Err(AdjustError::NotFinite) = ended.adjusted else { return Leaves::default() };
    let squares = ended.assembled.nearest_stations(&ended.assembled.problem.initial);
    let at_station = ended.assembled.points.iter().zip(&squares).filter(|(_, square)| **square == 0.0);
    let dropped = |(&point, _): (&usize, &f64)| Dropped { point, reason: Reason::AtStation };
    Leaves { points: at_station.map(dropped).collect(), photos: vec![] }
}
