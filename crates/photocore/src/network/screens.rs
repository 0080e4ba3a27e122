//! Screens: each checks the final state of an adjustment and lists points and photos to exclude.

use super::input::{Options, Screens};
use super::problem::Assembled;
use super::selection::{Dropped, FEW, LeftOut, Reason};
use crate::adjustment::median;
use crate::adjustment::{AdjustError, Adjustment, Method, Status};

/// Minimum ratio of all photos to undetermined ones, for which these count as few.
const HALF: usize = 2;
/// Ratio of median to own station distance above which a point counts as near, for approximate initial values.
const NEAR: f64 = 10.0;
/// Variance of unit weight of a failed adjustment.
const WRONG: f64 = 25.0;
/// Required decrease factor of the variance if the points are the cause.
const FALLS: f64 = 4.0;
/// Minimum number of other fixed or weighted points.
const HELD: usize = 3;
/// Ratio to the median station distance above which (or below its reciprocal) a point has diverged.
const ASTRAY: f64 = 1e3;

/// Final state of an adjustment.
pub(super) struct ScreenInput<'a> {
    pub adjusted: &'a Result<Adjustment, AdjustError>,
    pub assembled: &'a Assembled,
    pub options: &'a Options,
}

/// Initial values of the adjustment after an exclusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Restart {
    /// Initial values: the excluded objects have corrupted all others.
    FromStart,
    /// Start of the preceding adjustment.
    AsBefore,
    /// End of the preceding adjustment.
    FromHere,
}

/// Detected objects: indices into the network.
#[derive(Debug, Default)]
struct Detected {
    pub points: Vec<Dropped>,
    pub photos: Vec<usize>,
}

#[derive(Debug, Clone)]
pub(super) struct Exclusions {
    pub left_out: LeftOut,
    /// Excluded points that harm the others.
    pub harmful: Vec<Dropped>,
}

/// Switch and function of a screen, and the start of the adjustment after its exclusions.
type Screen = (fn(&Screens) -> bool, fn(&ScreenInput<'_>) -> Detected, Restart);

/// Causes of a failed adjustment, the most certain first.
const GONE_WRONG: [Screen; 3] = [
    (|on| on.not_determined, not_determined, Restart::AsBefore),
    (|on| on.ran_off, ran_off, Restart::FromStart),
    (|on| on.at_station, at_station, Restart::FromStart),
];
/// Cause of a stopped adjustment. Points that ran off and points at a station are distinguished only at the end.
const STOPPED: Screen = (|on| on.ran_into_station || on.ran_off, collapsed, Restart::FromHere);

/// All screens, and the exclusions so far.
#[derive(Debug)]
pub(super) struct Screening {
    pub leaving: Exclusions,
    near_station: NearStation,
}

impl Screening {
    pub fn new(left_out: LeftOut) -> Self {
        let leaving = Exclusions { left_out, harmful: vec![] };
        Self { near_station: NearStation::Untried(leaving.clone()), leaving }
    }

    /// Excludes harmful points and photos; returns None if all remain.
    pub fn detect(&mut self, ended: &ScreenInput<'_>) -> Option<Restart> {
        if self.near_station.is_untried() && self.near_station.tries(ended, &mut self.leaving) {
            return Some(Restart::FromStart);
        }
        let gone_wrong = GONE_WRONG.iter().find_map(|screen| self.leave(screen, ended));
        if gone_wrong.is_some() {
            return gone_wrong;
        }
        // The improvement without points near stations is judged after all other causes.
        if !self.near_station.is_untried() && self.near_station.tries(ended, &mut self.leaving) {
            return Some(Restart::FromStart);
        }
        self.leave(&STOPPED, ended)
    }

    fn leave(&mut self, (is_on, detect, begin): &Screen, ended: &ScreenInput<'_>) -> Option<Restart> {
        if !is_on(&ended.options.screens) {
            return None;
        }
        let Detected { points, photos } = detect(ended);
        let some = !(points.is_empty() && photos.is_empty());
        points.iter().for_each(|dropped| self.leaving.left_out.points[dropped.point] = true);
        photos.iter().for_each(|&photo| self.leaving.left_out.photos[photo] = true);
        self.leaving.harmful.extend(points);
        some.then_some(*begin)
    }
}

/// State of the single trial without points near stations.
#[derive(Debug)]
enum NearStation {
    /// Exclusions that apply in any case.
    Untried(Exclusions),
    /// Trial without the points; `variance` (infinite without convergence) and the exclusions `with` belong to the state before.
    Out {
        points: Vec<usize>,
        variance: f64,
        with: Exclusions,
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
    pub fn tries(&mut self, ended: &ScreenInput<'_>, leaving: &mut Exclusions) -> bool {
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

/// Returns the undetermined points and photos at which the adjustment has ended.
fn not_determined(ended: &ScreenInput<'_>) -> Detected {
    match ended.adjusted {
        Ok(Adjustment { undetermined: Some(error), .. }) | Err(error) => {
            let points = ended.assembled.few_points(error).into_iter();
            let reason = Reason::NotDetermined;
            Detected {
                points: points.map(|point| Dropped { point, reason }).collect(),
                photos: ended.assembled.few_photos(error),
            }
        }
        Ok(_) => Detected::default(),
    }
}

/// Returns free points that an adjustment without convergence has moved out of the network or to a station, if these are few.
///
/// Diverging rays fit best at infinity, which least squares approaches slowly while photos rotate accordingly.
fn ran_off(ended: &ScreenInput<'_>) -> Detected {
    let Ok(adjusted) = ended.adjusted else { return Detected::default() };
    let damped = matches!(ended.options.adjustment.method, Method::Damped(_));
    if adjusted.status != Status::NotConverged || !damped {
        return Detected::default();
    }
    let squares = ended.assembled.nearest_stations(&adjusted.unknowns);
    let Some(middle) = median(squares.clone()) else { return Detected::default() };
    let model = &ended.assembled.problem.model;
    let is_out = |&local: &usize| {
        let difference = (squares[local] / middle).sqrt();
        model.points[local].held() == [false; 3] && !(ASTRAY.recip()..=ASTRAY).contains(&difference)
    };
    let mut out: Vec<usize> = (0..model.locals).filter(is_out).collect();
    if FEW * out.len() > model.locals {
        out.clear();
    }
    let dropped = |i: usize| Dropped { point: ended.assembled.points[i], reason: Reason::RanOff };
    Detected { points: out.into_iter().map(dropped).collect(), photos: vec![] }
}

/// Returns points at the position of a station that observes them: their images are undefined.
fn at_station(ended: &ScreenInput<'_>) -> Detected {
    let Err(AdjustError::NotFinite) = ended.adjusted else { return Detected::default() };
    let squares = ended.assembled.nearest_stations(&ended.assembled.problem.initial);
    let at_station = ended.assembled.points.iter().zip(&squares).filter(|(_, square)| **square == 0.0);
    let dropped = |(&point, _): (&usize, &f64)| Dropped { point, reason: Reason::AtStation };
    Detected { points: at_station.map(dropped).collect(), photos: vec![] }
}

/// Returns the points for which an adjustment has stopped: they ran into a station or out of the network.
fn collapsed(ended: &ScreenInput<'_>) -> Detected {
    let Ok(adjusted) = ended.adjusted else { return Detected::default() };
    if adjusted.collapsed.is_empty() {
        return Detected::default();
    }
    let squares = ended.assembled.nearest_stations(&adjusted.unknowns);
    let middle = median(squares.clone()).unwrap_or(f64::INFINITY);
    let dropped = |&local: &usize| Dropped {
        point: ended.assembled.points[local],
        reason: if squares[local] > middle { Reason::RanOff } else { Reason::RanIntoStation },
    };
    Detected { points: adjusted.collapsed.iter().map(dropped).collect(), photos: vec![] }
}

impl Assembled {
    /// Returns the points that their rays do not determine, as indices into the network. The list is empty if they are many, or for points
    /// with additional observations.
    fn few_points(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::UndeterminedLocals(locals) = error else { return vec![] };
        let free = |&local: &usize| self.problem.model.points[local].held() == [false; 3];
        let few = FEW * locals.len() <= self.problem.model.locals && locals.iter().all(free);
        if few { locals.iter().map(|&local| self.points[local]).collect() } else { vec![] }
    }

    /// Returns the photos that their images individually do not determine, if these are few.
    fn few_photos(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::Undetermined(combinations) = error else { return vec![] };
        let model = &self.problem.model;
        let alone = |blocks: &Vec<usize>| match blocks[..] {
            [block] => (block < model.cameras.len() && model.images_on[block] > 0).then_some(block),
            _ => None,
        };
        let Some(mut photos) = combinations.iter().map(alone).collect::<Option<Vec<usize>>>() else {
            return vec![];
        };
        photos.sort_unstable();
        photos.dedup();
        let is_frame = |photo: usize| model.mounts.all().any(|mount| mount.frame() == Some(photo));
        let few = HALF * photos.len() <= model.cameras.len() && !photos.iter().any(|&photo| is_frame(photo));
        if few { photos } else { vec![] }
    }

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
