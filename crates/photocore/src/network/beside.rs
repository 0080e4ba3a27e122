//! Points that are held beside a station that sees them: a wrong image of one turns photos as no other can.

use super::problem::{Assembled, FEW};
use super::screening::{Dropped, Reason};
use crate::adjustment::{AdjustError, Adjustment, Status};

/// A point so many times as near to the nearest station as others stands beside it, first values of stations being coarse.
pub(super) const NEAR: f64 = 10.0;
/// Variance of unit weight of an adjustment that has gone wrong,
const WRONG: f64 = 25.0;
/// and by what it must fall for points to be the reason.
const FALLS: f64 = 4.0;
/// Points that must be held besides.
const HELD: usize = 3;

/// What an adjustment does without.
#[derive(Debug, Clone)]
pub(super) struct Leaving {
    /// By point, by photo.
    pub points: Vec<bool>,
    pub photos: Vec<bool>,
    /// Those of the points that leave because they harm the others.
    pub harmful: Vec<Dropped>,
}

/// Whether an adjustment that goes wrong goes better without such points, which is tried once.
#[derive(Debug)]
pub(super) enum Beside {
    /// What the adjustment does without in any case.
    Untried(Leaving),
    /// They are out. With them the variance of unit weight was this, infinite without convergence, and this was left out.
    Out {
        points: Vec<usize>,
        variance: f64,
        with: Leaving,
    },
    Settled,
}

impl Beside {
    pub fn is_untried(&self) -> bool {
        matches!(self, Self::Untried(_))
    }

    /// Whether an adjustment has to begin again, with or without them, and what it then does without.
    pub fn tries(
        &mut self,
        ended: &Result<Adjustment, AdjustError>,
        assembled: &Assembled,
        leaving: &mut Leaving,
    ) -> bool {
        let Some(now) = variance(ended) else { return false };
        match std::mem::replace(self, Self::Settled) {
            Self::Untried(least) => {
                let points = if now > WRONG { assembled.held_beside_stations() } else { vec![] };
                if points.is_empty() {
                    *self = Self::Untried(least);
                    return false;
                }
                let with = std::mem::replace(leaving, least);
                points.iter().for_each(|&point| leaving.points[point] = true);
                *self = Self::Out { points, variance: now, with };
                true
            }
            Self::Out { points, variance, .. } if FALLS * now < variance => {
                let reason = Reason::BesideStation;
                leaving.harmful.extend(points.into_iter().map(|point| Dropped { point, reason }));
                false
            }
            Self::Out { with, .. } => {
                *leaving = with;
                true
            }
            Self::Settled => false,
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
    /// Points with held coordinates whose first values are beside a station that sees them, where they are few and others are held.
    fn held_beside_stations(&self) -> Vec<usize> {
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
