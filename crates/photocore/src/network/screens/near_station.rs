//! Points at a station, and fixed or weighted points near a station: a single wrong image of one rotates its photo strongly.

use super::leaving::{Ended, FEW, Leaves, Leaving};
use crate::adjustment::{AdjustError, Adjustment, Method, Status};
use crate::network::problem::Assembled;
use crate::network::selection::{Dropped, Reason};

/// Ratio of median to own station distance above which a point counts as near, for approximate initial values.
const NEAR: f64 = 10.0;
/// Variance of unit weight of a failed adjustment.
const WRONG: f64 = 25.0;
/// Required decrease factor of the variance if the points are the cause.
const FALLS: f64 = 4.0;
/// Minimum number of other fixed or weighted points.
const HELD: usize = 3;

/// State of the single trial without points near stations.
#[derive(Debug)]
pub(super) enum NearStation {
    /// Exclusions that apply in any case.
    Untried(Leaving),
    /// Trial without the points; `variance` (infinite without convergence) and the exclusions `with` belong to the state before.
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

    /// Returns true if the adjustment must be repeated with or without the points, and sets its exclusions.
    ///
    /// The variance is significant only for least squares without the rules of historic programs.
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

/// Returns the variance of unit weight: infinite without convergence or with undetermined parameters; None if it is not yet required.
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
    /// Returns the fixed or weighted points with initial values near a station, if they are few and enough others are given.
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

/// Returns points at the position of a station that observes them: their images are undefined.
pub(super) fn at_station(ended: &Ended<'_>) -> Leaves {
    let Err(AdjustError::NotFinite) = ended.adjusted else { return Leaves::default() };
    let squares = ended.assembled.nearest_stations(&ended.assembled.problem.initial);
    let at_station = ended.assembled.points.iter().zip(&squares).filter(|(_, square)| **square == 0.0);
    let dropped = |(&point, _): (&usize, &f64)| Dropped { point, reason: Reason::AtStation };
    Leaves { points: at_station.map(dropped).collect(), photos: vec![] }
}
