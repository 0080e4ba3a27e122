//! What is known of a trajectory beforehand: records of positions and of attitudes, each at times of their own.
//!
//! Interpolation by the polynomial through neighbouring records.

use smallvec::SmallVec;

use crate::geometry::angle_axis::{
    angle_axis_rotation, quaternion, quaternion_rotation, rotation_angle_axis,
};
use crate::geometry::{Matrix3, Vector3};

/// How the records between which a time lies are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// Straight; attitudes turn uniformly about one axis (slerp).
    #[default]
    Linear,
    /// By cubics with the velocities of the records.
    Hermite,
    /// By a polynomial through eight neighbours; attitudes by those of the components of their quaternions, normalised.
    Lagrange,
}

/// Records of positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Positions {
    times: Vec<f64>,
    places: Vec<Vector3>,
    velocities: Vec<Vector3>,
    interpolation: Interpolation,
}

/// Records of attitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitudes {
    times: Vec<f64>,
    attitudes: Vec<Matrix3>,
    /// From each record to the next, about its own axes.
    turns: Vec<Vector3>,
    /// Each the shorter way from the one before; none where they are joined by turns.
    quaternions: Vec<[f64; 4]>,
}

/// Whether there are records, and times increase.
fn increase(times: &[f64], records: usize) -> bool {
    !times.is_empty()
        && times.len() == records
        && times.iter().all(|time| time.is_finite())
        && times.windows(2).all(|pair| pair[0] < pair[1])
}

/// The interval that a time is in, the first or the last for all beyond.
fn interval(times: &[f64], time: f64) -> usize {
    times.partition_point(|&own| own <= time).saturating_sub(1).min(times.len().saturating_sub(2))
}

/// The times of records, and half an interval beyond; all times where there is one alone.
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
    /// From records at times that increase. `velocities`, in a second, are those of [`Interpolation::Hermite`]. None where there are no
    /// records, or not as many of one as of another.
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

    /// The same counted from an origin.
    #[must_use]
    pub fn counted_from(&self, origin: [f64; 3]) -> Self {
        let places = self.places.iter().map(|place| place - Vector3::from(origin)).collect();
        Self { places, ..self.clone() }
    }

    /// The position at a time, and its velocity.
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

    /// The times that it may be asked for.
    pub fn span(&self) -> (f64, f64) {
        reaching(&self.times)
    }
}

impl Attitudes {
    /// From records, photo to object, at times that increase; None where there are no records, or not as many of one as of the other.
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

    /// The attitude at a time, and its rate about its own axes.
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
        // The vector of 2 conj(q) q' / |q|^2.
        let rate = 2.0 * (q[0] * dv - d[0] * v - v.cross(&dv)) / square;
        (quaternion_rotation(q.map(|value| value / square.sqrt())), rate)
    }

    /// The times that it may be asked for.
    pub fn span(&self) -> (f64, f64) {
        reaching(&self.times)
    }
}

/// Records on each side where there are so many.
const EACH_SIDE: usize = 4;

/// For the records about an interval, from the first on: what each counts at a time, and how that changes in a second. There are as many
/// on either side: near the ends 6, 4 and 2 (Community Sensor Model).
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
