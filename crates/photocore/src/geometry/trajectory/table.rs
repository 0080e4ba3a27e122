//! A-priori trajectory: records of positions and of attitudes, each at times of their own.
//!
//! Lagrange interpolation uses the polynomial through neighbouring records.

use smallvec::SmallVec;

use crate::geometry::angle_axis::{
    angle_axis_rotation, quaternion, quaternion_rotation, rotation_angle_axis,
};
use crate::geometry::{Matrix3, Vector3};

/// Interpolation between neighbouring records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// Linear; attitudes rotate uniformly about one axis (slerp).
    #[default]
    Linear,
    /// Cubic with the velocities of the records.
    Hermite,
    /// Polynomial through eight neighbours; attitudes by the normalised polynomial of their quaternions.
    Lagrange,
}

/// Position records.
#[derive(Debug, Clone, PartialEq)]
pub struct Positions {
    times: Vec<f64>,
    places: Vec<Vector3>,
    velocities: Vec<Vector3>,
    interpolation: Interpolation,
}

/// Attitude records.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitudes {
    times: Vec<f64>,
    attitudes: Vec<Matrix3>,
    /// Rotation vector from each record to the next, about its own axes.
    turns: Vec<Vector3>,
    /// Quaternions with continuous signs; empty unless the interpolation is [`Interpolation::Lagrange`].
    quaternions: Vec<[f64; 4]>,
}

/// Returns whether records exist and times increase.
fn increase(times: &[f64], records: usize) -> bool {
    !times.is_empty()
        && times.len() == records
        && times.iter().all(|time| time.is_finite())
        && times.windows(2).all(|pair| pair[0] < pair[1])
}

/// Returns the interval of a time, clamped to the first and last.
fn interval(times: &[f64], time: f64) -> usize {
    times.partition_point(|&own| own <= time).saturating_sub(1).min(times.len().saturating_sub(2))
}

/// Returns the time range of the records and half an interval beyond; unlimited for a single record.
fn reaching(times: &[f64]) -> (f64, f64) {
    match times {
        [first, second, ..] => {
            let (before, last) = (times[times.len() - 2], times[times.len() - 1]);
            (first - 0.5 * (second - first), last + 0.5 * (last - before))
        }
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

impl Positions {
    /// Creates positions from records at increasing times. `velocities`, per second, belong to [`Interpolation::Hermite`]. None without
    /// records or with different numbers of them.
    pub fn new(
        times: Vec<f64>,
        places: Vec<Vector3>,
        velocities: Vec<Vector3>,
        interpolation: Interpolation,
    ) -> Option<Self> {
        let needed = if interpolation == Interpolation::Hermite { places.len() } else { velocities.len() };
        let sound = increase(&times, places.len()) && velocities.len() == needed;
        sound.then_some(Self { times, places, velocities, interpolation })
    }

    /// Returns the positions relative to an origin.
    #[must_use]
    pub fn counted_from(&self, origin: [f64; 3]) -> Self {
        let places = self.places.iter().map(|place| place - Vector3::from(origin)).collect();
        Self { places, ..self.clone() }
    }

    /// Returns the position at a time, and its velocity.
    pub fn at(&self, time: f64) -> (Vector3, Vector3) {
        let [_, _, ..] = self.times[..] else { return (self.places[0], Vector3::zeros()) };
        let i = interval(&self.times, time);
        let h = self.times[i + 1] - self.times[i];
        let s = (time - self.times[i]) / h;
        let (from, to) = (self.places[i], self.places[i + 1]);
        match self.interpolation {
            Interpolation::Linear => (from + s * (to - from), (to - from) / h),
            Interpolation::Hermite => {
                let (out, arriving) = (h * self.velocities[i], h * self.velocities[i + 1]);
                let (s2, s3) = (s * s, s * s * s);
                let place = (2.0 * s3 - 3.0 * s2 + 1.0) * from
                    + (s3 - 2.0 * s2 + s) * out
                    + (3.0 * s2 - 2.0 * s3) * to
                    + (s3 - s2) * arriving;
                let speed = (6.0 * s2 - 6.0 * s) * (from - to)
                    + (3.0 * s2 - 4.0 * s + 1.0) * out
                    + (3.0 * s2 - 2.0 * s) * arriving;
                (place, speed / h)
            }
            Interpolation::Lagrange => {
                let (first, all) = weights(&self.times, i, time);
                let sum = |of: &dyn Fn(&(f64, f64)) -> f64| {
                    all.iter().zip(&self.places[first..]).map(|(own, place)| of(own) * place).sum()
                };
                (sum(&|own| own.0), sum(&|own| own.1))
            }
        }
    }

    /// Returns the valid time range.
    pub fn span(&self) -> (f64, f64) {
        reaching(&self.times)
    }
}

impl Attitudes {
    /// Creates attitudes from records, photo to object, at increasing times; None without records or with different numbers of them.
    pub fn new(times: Vec<f64>, attitudes: Vec<Matrix3>, interpolation: Interpolation) -> Option<Self> {
        if !increase(&times, attitudes.len()) {
            return None;
        }
        let turn = |pair: &[Matrix3]| rotation_angle_axis(&pair[0].tr_mul(&pair[1]));
        let turns = attitudes.windows(2).map(turn).collect();
        let mut quaternions: Vec<[f64; 4]> = vec![];
        if interpolation == Interpolation::Lagrange {
            for attitude in &attitudes {
                let own = quaternion(attitude);
                let along = quaternions.last().map_or(1.0, |last| (0..4).map(|k| last[k] * own[k]).sum());
                quaternions.push(if along < 0.0 { own.map(|value| -value) } else { own });
            }
        }
        Some(Self { times, attitudes, turns, quaternions })
    }

    /// Returns the attitude at a time, and its rate about its own axes.
    pub fn at(&self, time: f64) -> (Matrix3, Vector3) {
        let [_, _, ..] = self.times[..] else { return (self.attitudes[0], Vector3::zeros()) };
        let i = interval(&self.times, time);
        if !self.quaternions.is_empty() {
            return self.through_quaternions(i, time);
        }
        let h = self.times[i + 1] - self.times[i];
        let turn = self.turns[i];
        (self.attitudes[i] * angle_axis_rotation(&((time - self.times[i]) / h * turn)), turn / h)
    }

    fn through_quaternions(&self, interval: usize, time: f64) -> (Matrix3, Vector3) {
        let (first, all) = weights(&self.times, interval, time);
        let (mut q, mut d) = ([0.0; 4], [0.0; 4]);
        for ((value, rate), own) in all.iter().zip(&self.quaternions[first..]) {
            (0..4).for_each(|k| {
                q[k] += value * own[k];
                d[k] += rate * own[k];
            });
        }
        let square: f64 = q.iter().map(|value| value * value).sum();
        let (v, dv) = (Vector3::new(q[1], q[2], q[3]), Vector3::new(d[1], d[2], d[3]));
        // Vector part of 2 conj(q) q' / |q|^2.
        let rate = 2.0 * (q[0] * dv - d[0] * v - v.cross(&dv)) / square;
        (quaternion_rotation(q.map(|value| value / square.sqrt())), rate)
    }

    /// Returns the valid time range.
    pub fn span(&self) -> (f64, f64) {
        reaching(&self.times)
    }
}

/// Maximum number of records on each side.
const EACH_SIDE: usize = 4;

/// Returns the first record about an interval and, per record, its weight at a time and the rate of the weight per second. Both sides have
/// equally many records: near the ends 6, 4 and 2 in total (Community Sensor Model).
pub fn weights(times: &[f64], interval: usize, time: f64) -> (usize, SmallVec<[(f64, f64); 8]>) {
    let side = EACH_SIDE.min(interval + 1).min(times.len() - 1 - interval);
    let first = interval + 1 - side;
    let nodes = &times[first..interval + 1 + side];
    let of = |j: usize| {
        let others = || (0..nodes.len()).filter(move |&m| m != j);
        let ratio = |m: usize| (time - nodes[m]) / (nodes[j] - nodes[m]);
        let without = |left: usize| others().filter(|&m| m != left).map(ratio).product::<f64>();
        (others().map(ratio).product(), others().map(|m| without(m) / (nodes[j] - nodes[m])).sum())
    };
    (first, (0..nodes.len()).map(of).collect())
}

/// Axes in which position corrections are expressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Axes {
    /// The axes of the table.
    #[default]
    Table,
    /// Orbit about a centre: radial points outward, along is the velocity component perpendicular to it, across points left.
    Orbit(Vector3),
    /// Flight: the same axes, with the third axis of the table (up) as radial.
    Flight,
}

/// Step, in seconds, of the fourth-order differences of axes.
const STEP: f64 = 5e-4;

impl Axes {
    /// Returns the directions of the axes as columns, in the axes of the table, and their derivatives per second.
    pub(super) fn at(&self, positions: &Positions, time: f64) -> (Matrix3, Matrix3) {
        if *self == Self::Table {
            return (Matrix3::identity(), Matrix3::zeros());
        }
        let of = |time: f64| self.of(positions.at(time));
        let difference = |steps: f64| of(time + steps * STEP) - of(time - steps * STEP);
        (of(time), (8.0 * difference(1.0) - difference(2.0)) / (12.0 * STEP))
    }

    fn of(&self, (place, velocity): (Vector3, Vector3)) -> Matrix3 {
        let radial = match self {
            Self::Orbit(centre) => (place - centre).normalize(),
            Self::Table | Self::Flight => Vector3::z(),
        };
        let along = (velocity - radial * radial.dot(&velocity)).normalize();
        Matrix3::from_columns(&[along, radial.cross(&along), radial])
    }

    /// Returns the axes with coordinates relative to an origin.
    pub(super) fn counted_from(self, origin: [f64; 3]) -> Self {
        match self {
            Self::Orbit(centre) => Self::Orbit(centre - Vector3::from(origin)),
            other => other,
        }
    }
}
