//! How trajectories move with a network as a whole.
//!
//! A motion displaces C(t) and turns A(t). The coefficients follow it as far as the functions of their bases do, by least squares over the
//! times of images and records. What a basis does not contain is left over, and tells the motion from those that observations leave open
//! ([`crate::adjustment::Motions`]).

use super::commons::CommonState;
use super::model::Bundle;
use super::mounts::{AT_PHOTO, Trajectory};
use super::parts::Parts;
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::trajectory::{Active, Flight};
use crate::geometry::{Matrix3, Pose, Vector3};
use crate::sorting::sort_by;

/// Times that are looked at for each function of a basis, at the most: those in between say the same.
const TIMES: usize = 8;
/// The weight of times at which nothing is observed: they tell where the functions go that nothing shows, without a part in the others.
const UNSEEN: f64 = 1e-8;
/// A function is not told by so small a part of its square.
const SEPARABLE: f64 = 1e-13;
/// Turns that need not be small are followed by so many small ones, which converge quadratically, at the most;
const MOST_TURNS: usize = 20;
/// until none is larger, in radians.
const TURNED: f64 = 1e-13;

/// How coefficients change: those of positions, those of rotations.
pub(super) type Changes = [Vec<Vector3>; 2];

/// The normal matrix of functions of time, a few of which are not zero at any time, factored: the rows of L as far as its band reaches.
struct Band {
    width: usize,
    rows: Vec<f64>,
}

impl Band {
    /// Of so many functions at times with weights.
    fn new<'a>(count: usize, at: impl Iterator<Item = (f64, &'a Active)> + Clone) -> Self {
        let width = at.clone().map(|(_, own)| own.values.len()).max().unwrap_or(0);
        let mut own = Self { width, rows: vec![0.0; count * width] };
        for (weight, Active { first, values, .. }) in at {
            for (i, value) in values.iter().enumerate() {
                (0..=i).for_each(|j| *own.entry(first + i, first + j) += weight * value * values[j]);
            }
        }
        own.factor(count);
        own
    }

    fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.rows[i * self.width + self.width - 1 + j - i]
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = (i + 1).saturating_sub(self.width);
        (first..=i).zip(self.rows[(i + 1) * self.width - (i + 1 - first)..].iter().copied())
    }

    /// Cholesky. What is not told gets an infinite pivot: it stays zero.
    fn factor(&mut self, count: usize) {
        for i in 0..count {
            let first = (i + 1).saturating_sub(self.width);
            let square = *self.entry(i, i);
            for j in first..=i {
                let before = first.max((j + 1).saturating_sub(self.width))..j;
                let done: f64 = before.map(|k| *self.entry(i, k) * *self.entry(j, k)).sum();
                let left = *self.entry(i, j) - done;
                *self.entry(i, j) = match i == j {
                    false => left / *self.entry(j, j),
                    true if left > SEPARABLE * square => left.sqrt(),
                    true => f64::INFINITY,
                };
            }
        }
    }

    fn solve(&self, mut right: Vec<Vector3>) -> Vec<Vector3> {
        for i in 0..right.len() {
            let mut left = right[i];
            for (j, l) in self.row(i) {
                if j < i { left -= l * right[j] } else { left /= l }
            }
            right[i] = left;
        }
        for i in (0..right.len()).rev() {
            for (j, l) in self.row(i).collect::<Vec<_>>().into_iter().rev() {
                if j < i {
                    let own = right[i];
                    right[j] -= l * own;
                } else {
                    right[i] /= l;
                }
            }
        }
        right
    }

    /// The coefficients with which functions come nearest to what is wanted at each time; once more for what rounding has left.
    fn nearest<'a>(
        &self,
        count: usize,
        wanted: impl Iterator<Item = (f64, &'a Active, Vector3)> + Clone,
    ) -> Vec<Vector3> {
        let mut found = vec![Vector3::zeros(); count];
        for _ in 0..2 {
            let mut right = vec![Vector3::zeros(); count];
            for (weight, active, wanted) in wanted.clone() {
                let left = wanted - active.sums(&|k| found[k]).0;
                let own = right[active.first..].iter_mut().zip(&active.values);
                own.for_each(|(sum, value)| *sum += weight * *value * left);
            }
            found.iter_mut().zip(self.solve(right)).for_each(|(sum, more)| *sum += more);
        }
        found
    }
}

/// A trajectory at given coefficients, to find how these follow motions.
pub(super) struct Following<'a> {
    own: &'a Trajectory,
    /// At the times that are looked at, with their weights.
    flights: Vec<(f64, Flight)>,
    /// The inverse of what corrections of the attitude turn the photo by.
    to_corrections: Vec<Matrix3>,
    position: Band,
    rotation: Band,
}

impl<'a> Following<'a> {
    fn new(own: &'a Trajectory, times: &[(f64, f64)], [c, r]: &Changes) -> Self {
        let at = |&(weight, time): &(f64, f64)| (weight, own.course.at(time, &|k| c[k], &|k| r[k]));
        let flights: Vec<(f64, Flight)> = times.iter().map(at).collect();
        let inverse = |(_, flight): &(f64, Flight)| flight.jacobian.try_inverse().unwrap_or_default();
        Self {
            to_corrections: flights.iter().map(inverse).collect(),
            position: Band::new(c.len(), flights.iter().map(|(weight, flight)| (*weight, &flight.position))),
            rotation: Band::new(r.len(), flights.iter().map(|(weight, flight)| (*weight, &flight.rotation))),
            flights,
            own,
        }
    }

    /// The coefficients that follow what displaces the pose of each time, and turns it about its own axes, by a small amount.
    pub fn changes(&self, motion: &dyn Fn(usize, &Pose) -> [Vector3; 2]) -> Changes {
        let moved = |(k, (_, flight)): (usize, &(f64, Flight))| motion(k, &flight.motion.pose);
        let moved: Vec<[Vector3; 2]> = self.flights.iter().enumerate().map(moved).collect();
        let all = self.flights.iter().zip(&moved);
        let places = all
            .clone()
            .map(|((weight, flight), [shift, _])| (*weight, &flight.position, flight.axes.tr_mul(shift)));
        let turns = all
            .zip(&self.to_corrections)
            .map(|(((weight, flight), [_, turn]), to)| (*weight, &flight.rotation, to * turn));
        let Trajectory { position, rotation, .. } = self.own;
        [self.position.nearest(position.len(), places), self.rotation.nearest(rotation.len(), turns)]
    }
}

impl Bundle {
    /// The trajectories, each with the part of the network that it is in.
    fn trajectories_in<'a>(
        &'a self,
        parts: &'a Parts,
    ) -> impl Iterator<Item = (usize, usize, &'a Trajectory)> {
        let of = |(number, own): (usize, &'a Trajectory)| {
            let part = own.coefficients().find_map(|common| parts.of_common[common]);
            Some((number, part?, own))
        };
        self.mounts.trajectories().iter().enumerate().filter_map(of)
    }

    /// Of each trajectory that takes part: that part, and how its coefficients follow motions from their values on.
    pub(super) fn following<'a>(
        &'a self,
        parts: &'a Parts,
        commons: &[CommonState],
    ) -> Vec<(usize, Following<'a>)> {
        let times = self.times_of_trajectories();
        let own = |(number, part, own): (usize, usize, &'a Trajectory)| {
            (part, Following::new(own, &times[number], &coefficients(own, commons)))
        };
        self.trajectories_in(parts).map(own).collect()
    }

    /// Writes what becomes of its coefficients, where these are unknown.
    pub(super) fn put_changes(&self, following: &Following<'_>, changes: &Changes, unknowns: &mut [f64]) {
        for (common, change) in following.own.coefficients().zip(changes.iter().flatten()) {
            if let Some(range) = self.of_common(common) {
                unknowns[range].copy_from_slice(change.as_slice());
            }
        }
    }

    /// Moves the trajectories of a part by a motion that need not be small.
    pub(super) fn move_trajectories(
        &self,
        (parts, part): (&Parts, usize),
        commons: &[CommonState],
        motion: &dyn Fn(&Pose) -> Pose,
        unknowns: &mut [f64],
    ) {
        let mut own = self.trajectories_in(parts).filter(|&(_, own, _)| own == part).peekable();
        let times = if own.peek().is_some() { self.times_of_trajectories() } else { vec![] };
        for (number, _, own) in own {
            let mut now = coefficients(own, commons);
            let mut wanted: Option<Vec<Pose>> = None;
            for _ in 0..MOST_TURNS {
                let following = Following::new(own, &times[number], &now);
                let wanted = wanted.get_or_insert_with(|| {
                    following.flights.iter().map(|(_, flight)| motion(&flight.motion.pose)).collect()
                });
                let changes = following.changes(&|k, pose| {
                    let turn = pose.attitude.tr_mul(&wanted[k].attitude);
                    [wanted[k].position - pose.position, rotation_angle_axis(&turn)]
                });
                now.iter_mut().flatten().zip(changes.iter().flatten()).for_each(|(value, own)| *value += own);
                if changes[1].iter().all(|turn| turn.norm() <= TURNED) {
                    break;
                }
            }
            for (common, value) in own.coefficients().zip(now.iter().flatten()) {
                let given = commons[common].given();
                if let Some(range) = self.of_common(common) {
                    unknowns[range].copy_from_slice((value - given).as_slice());
                }
            }
        }
    }

    /// For each trajectory the times that are looked at, each after its weight.
    fn times_of_trajectories(&self) -> Vec<Vec<(f64, f64)>> {
        let mut seen = vec![vec![]; self.mounts.trajectories().len()];
        let images = self.images.iter().enumerate().map(|(k, image)| (image.photo, self.time_of(k)));
        let photos = (0..self.cameras.len()).map(|photo| (photo, AT_PHOTO));
        for (trajectory, time) in images.chain(photos).filter_map(|(photo, at)| self.mounts.flight(photo, at))
        {
            seen[trajectory].push(time);
        }
        let times = |(own, mut seen): (&Trajectory, Vec<f64>)| {
            sort_by(&mut seen, &f64::total_cmp);
            seen.dedup();
            let most = TIMES * own.position.len().max(own.rotation.len()).max(1);
            let (first, last) = own.course.span();
            let between = |k: usize| first + (last - first) * k as f64 / most as f64;
            let unseen = (0..=most).map(between).filter(|time| time.is_finite());
            let every = seen.len().div_ceil(most).max(1);
            let seen = seen.iter().step_by(every).map(|&time| (1.0, time));
            seen.chain(unseen.map(|time| (UNSEEN, time))).collect()
        };
        self.mounts.trajectories().iter().zip(seen).map(times).collect()
    }

    /// The unknowns that hold the pose of a photo: its six or, on a trajectory, those of the coefficients that are about its time.
    pub(super) fn holding(&self, photo: usize) -> Vec<usize> {
        let Some((trajectory, time)) = self.mounts.flight(photo, AT_PHOTO) else {
            return self.of_block(self.carrier(photo)).take(6).collect();
        };
        let Trajectory { course, position, rotation } = self.mounts.trajectory(trajectory);
        let nearest = [(&course.position, position), (&course.rotation, rotation)].map(|(basis, all)| {
            let apart = |&k: &usize| basis.middle(k).map_or(0.0, |middle| (middle - time).abs());
            let nearer = |a: &usize, b: &usize| apart(a).total_cmp(&apart(b));
            (0..all.len()).min_by(nearer).and_then(|k| self.of_common(all[k]))
        });
        nearest.into_iter().flatten().flatten().collect()
    }

    /// The unknown coefficients of positions in a part.
    pub(super) fn position_coefficients(&self, parts: &Parts, part: usize) -> Vec<usize> {
        let all = self.mounts.trajectories().iter().flat_map(|own| &own.position);
        let own = all.filter(|&&common| parts.of_common[common] == Some(part));
        own.filter_map(|&common| self.of_common(common)).flatten().collect()
    }
}

/// The values of the coefficients of a trajectory.
fn coefficients(own: &Trajectory, commons: &[CommonState]) -> Changes {
    [&own.position, &own.rotation].map(|all| all.iter().map(|&common| commons[common].vector()).collect())
}
