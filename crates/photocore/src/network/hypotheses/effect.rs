//! External reliability: what an undetected error changes of the points.

use nalgebra::Vector3;

use super::super::suspects::Home;
use super::super::trial::Trial;
use crate::adjustment::Leverages;
use crate::geometry::ObjectSpace;

/// What an error changes of the points, by the coordinate of each that changes by most standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Points that change by more standard deviations than the limit.
    pub points: usize,
    /// The same without the points that the error belongs to.
    pub others: usize,
    /// The largest change in standard deviations.
    pub ratio: f64,
    /// The point and the coordinate of this change; None if nothing changes.
    pub at: Option<(usize, usize)>,
    /// The largest change of a coordinate, in the unit of the object space (heights only if that is geographic).
    pub change: f64,
}

/// Standard deviations (a priori unit weight) of the coordinates of all points that take part.
pub(super) struct PointPrecision {
    /// The point of the network, its first unknown, the standard deviations.
    points: Vec<(usize, usize, Vector3<f64>)>,
    is_geographic: bool,
}

impl PointPrecision {
    pub fn new(trial: &Trial, found: &Leverages) -> Self {
        let model = &trial.assembled.problem.model;
        let of = |(place, &point): (usize, &usize)| {
            let q = trial.cofactors_at(found, Home::Point(place));
            let sd = Vector3::from_fn(|k, _| q[(k, k)].max(0.0).sqrt());
            (point, model.of_point(place).start, sd)
        };
        Self {
            points: trial.assembled.points.iter().enumerate().map(of).collect(),
            is_geographic: matches!(model.space, ObjectSpace::Geographic(_)),
        }
    }
}

impl Effect {
    /// Of changes of all unknowns; `own` are points that the error belongs to.
    pub(super) fn new(precision: &PointPrecision, change: &[f64], own: &[usize], limit: f64) -> Self {
        let mut effect = Self { points: 0, others: 0, ratio: 0.0, at: None, change: 0.0 };
        for &(point, first, sd) in &precision.points {
            let mut largest = 0.0;
            for axis in 0..3 {
                let size = change[first + axis].abs();
                let ratio = if sd[axis] > 0.0 { size / sd[axis] } else { 0.0 };
                if ratio > effect.ratio {
                    (effect.ratio, effect.at) = (ratio, Some((point, axis)));
                }
                largest = f64::max(largest, ratio);
                if axis == 2 || !precision.is_geographic {
                    effect.change = effect.change.max(size);
                }
            }
            if largest > limit {
                effect.points += 1;
                effect.others += usize::from(!own.contains(&point));
            }
        }
        effect
    }
}
