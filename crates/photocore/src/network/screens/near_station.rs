//! Points at a station, and points that are held near one that sees them: a wrong image of one turns photos as no other can.

use super::leaving::{Ended, FEW, Leaves, Leaving};
use crate::adjustment::{AdjustError, Adjustment, Method, Status};
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, Reason};

/// A point so many times as near to the nearest station as others stands near to it, first values of stations being coarse.
const NEAR: f64 = 10.0;
/// Variance of unit weight of an adjustment that has gone wrong,
const WRONG: f64 = 25.0;
/// and by what it must fall for points to be the reason.
const FALLS: f64 = 4.0;
/// Points that must be held besides.
const HELD: usize = 3;

/// Whether an adjustment that goes wrong goes better without such points, which is tried once.
#[derive(Debug)]
pub(super) enum NearStation {
    /// What the adjustment does without in any case.
    Untried(Leaving),
    /// They are out. With them the variance of unit weight was this, infinite without convergence, and this was left out.
    Out {
        points: Vec<usize>,
        variance: f64,
        with: Leaving,
    },
    Decided,
}

impl NearStation {
    pub fn is_untried(&self) -> bool {
        matches!(self, Self::Untried(_))
    }

    /// Whether an adjustment has to begin again, with or without them, and what it then does without.
    ///
    /// Only where a variance tells: by least squares, and not under the rules of a program of its time.
    pub fn tries(&mut self, ended: &Ended<'_>, leaving: &mut Leaving) -> bool {
        let options = &ended.options.adjustment;
        let tells = options.loss.is_none() && !matches!(options.method, Method::Full(_));
        if !(tells && ended.options.screens.near_station) {
            return false;
        }
        let Some(now) = variance(ended.adjusted) else { return false };
        match std::mem::replace(self, Self::Decided) {
            Self::Untried(least) => {
                let points = if now > WRONG { ended.assembled.held_near_stations() } else { vec![] };
                if points.is_empty() {
                    *self = Self::Untried(least);
                    return false;
                }
                let with = std::mem::replace(leaving, least);
                points.iter().for_each(|&point| leaving.left_out.points[point] = true);
                *self = Self::Out { points, variance: now, with };
                true
            }
            Self::Out { points, variance, .. } if FALLS * now < variance => {
                let reason = Reason::NearStation;
                leaving.harmful.extend(points.into_iter().map(|point| Dropped { point, reason }));
                false
            }
            Self::Out { with, .. } => {
                *leaving = with;
                true
            }
            Self::Decided => false,
        }
    }
}

/// Of unit weight: infinite where an adjustment has not converged, or determines not all; None where that is not asked yet.
fn variance(ended: &Result<Adjustment, AdjustError>) -> Option<f64> {
    match ended {
        Ok(ended) if !ended.collapsed.is_empty() => None,
        Ok(ended) if ended.status == Status::Converged && ended.undetermined.is_none() => {
            let last = ended.iterations.last();
            let sum = last.map_or(ended.initial_sum_of_squares, |last| last.sum_of_squares);
            Some(sum / ended.counts.degrees_of_freedom().max(1) as f64)
        }
        Ok(_) | Err(AdjustError::Undetermined(_) | AdjustError::UndeterminedLocals(_)) => Some(f64::INFINITY),
        Err(_) => None,
    }
}

impl Assembled {
    /// Points with held coordinates whose first values are near a station that sees them, where they are few and others are held.
    fn held_near_stations(&self) -> Vec<usize> {
        let model = &self.problem.model;
        let is_held = |&local: &usize| model.points[local].held() != [false; 3];
        let held: Vec<usize> = (0..model.locals).filter(is_held).collect();
        if held.is_empty() {
            return vec![];
        }
        let Some((squares, middle)) = self.first_distances() else { return vec![] };
        let near: Vec<usize> =
            held.iter().copied().filter(|&local| squares[local] * NEAR * NEAR < middle).collect();
        let few = FEW * near.len() <= model.locals && near.len() + HELD <= held.len();
        if few { near.into_iter().map(|local| self.points[local]).collect() } else { vec![] }
    }
}

/// Points given at the place of a station that sees them: nothing can be computed of them.
pub(super) fn at_station(ended: &Ended<'_>) -> Leaves {
    let Err(AdjustError::NotFinite) = ended.adjusted else { return Leaves::default() };
    let squares = ended.assembled.nearest_stations(&ended.assembled.problem.initial);
    let at_station = ended.assembled.points.iter().zip(&squares).filter(|(_, square)| **square == 0.0);
    let dropped = |(&point, _): (&usize, &f64)| Dropped { point, reason: Reason::AtStation };
    Leaves { points: at_station.map(dropped).collect(), photos: vec![] }
}
