//! Effect of similarity transformations of the network on shared parameters and trajectories.
//!
//! A transformation displaces the position C(t) of a trajectory and rotates its attitude A(t). The coefficients follow by least squares
//! over the times of images and records, as far as their basis functions allow. The remainder distinguishes the transformation from datum
//! defects ([`crate::adjustment::Motions`]).

use std::collections::BTreeMap;

use super::commons::{CartesianCommon, CommonState, SimilarityMotion};
use super::linearization_point::LinearizationPoint;
use super::model::{Bundle, Components};
use super::mounts::{AT_PHOTO, Trajectory};
use super::observations::Observation;
use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::trajectory::{Active, Flight};
use crate::geometry::{Matrix3, Pose, Vector3};

/// Maximum number of sampled times per basis function; further times add no information.
const TIMES: usize = 8;
/// Weight of times without observations: it defines coefficients that no observation determines, and hardly affects the others.
const UNSEEN: f64 = 1e-8;
/// Relative pivot below which a function is not determined.
const SEPARABLE: f64 = 1e-13;
/// Maximum number of small rotations, which converge quadratically, to follow a finite one.
const MOST_TURNS: usize = 20;
/// Convergence limit of these rotations, in radians.
const TURNED: f64 = 1e-13;

/// Changes of the coefficients of positions, and of rotations.
pub(super) type CoefficientChanges = [Vec<Vector3>; 2];

/// Factored band normal matrix of functions with local support: rows of L within the band.
struct Band {
    width: usize,
    rows: Vec<f64>,
}

impl Band {
    /// Returns the factored matrix of `count` functions at weighted times.
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

    /// Cholesky factorization. Undetermined coefficients have an infinite pivot and remain zero.
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

    /// Returns the least-squares coefficients for wanted values at each time, with one iterative refinement.
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

/// A trajectory linearized at given coefficients, to follow transformations.
pub(super) struct Following<'a> {
    own: &'a Trajectory,
    /// Poses at the sampled times, with their weights.
    flights: Vec<(f64, Flight)>,
    /// Inverse partials of the rotation of the photo by corrections of the attitude.
    to_corrections: Vec<Matrix3>,
    position: Band,
    rotation: Band,
}

impl<'a> Following<'a> {
    fn new(own: &'a Trajectory, times: &[(f64, f64)], [c, r]: &CoefficientChanges) -> Self {
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

    /// Returns the changes of the coefficients for small displacements and rotations (about the own axes) at each time.
    pub fn changes(&self, motion: &dyn Fn(usize, &Pose) -> [Vector3; 2]) -> CoefficientChanges {
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
    /// Returns the trajectories, each with its connected component.
    fn trajectories_in<'a>(
        &'a self,
        parts: &'a Components,
    ) -> impl Iterator<Item = (usize, usize, &'a Trajectory)> {
        let of = |(number, own): (usize, &'a Trajectory)| {
            let part = own.coefficients().find_map(|common| parts.of_common[common]);
            Some((number, part?, own))
        };
        self.mounts.trajectories().iter().enumerate().filter_map(of)
    }

    /// Returns the component of each active trajectory, and its linearization at the current coefficients.
    pub(super) fn following<'a>(
        &'a self,
        parts: &'a Components,
        commons: &[CommonState],
    ) -> Vec<(usize, Following<'a>)> {
        let times = self.times_of_trajectories();
        let own = |(number, part, own): (usize, usize, &'a Trajectory)| {
            (part, Following::new(own, &times[number], &coefficients(own, commons)))
        };
        self.trajectories_in(parts).map(own).collect()
    }

    /// Writes the changes of the free coefficients.
    pub(super) fn put_changes(
        &self,
        following: &Following<'_>,
        changes: &CoefficientChanges,
        unknowns: &mut [f64],
    ) {
        for (common, change) in following.own.coefficients().zip(changes.iter().flatten()) {
            if let Some(range) = self.of_common(common) {
                unknowns[range].copy_from_slice(change.as_slice());
            }
        }
    }

    /// Transforms the trajectories of a component by a finite transformation.
    pub(super) fn move_trajectories(
        &self,
        (parts, part): (&Components, usize),
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

    /// Returns the weights and sampled times of each trajectory.
    fn times_of_trajectories(&self) -> Vec<Vec<(f64, f64)>> {
        let mut seen = vec![vec![]; self.mounts.trajectories().len()];
        let images = self.images.iter().enumerate().map(|(k, image)| (image.photo, self.time_of(k)));
        let photos = (0..self.cameras.len()).map(|photo| (photo, AT_PHOTO));
        for (trajectory, time) in images.chain(photos).filter_map(|(photo, at)| self.mounts.flight(photo, at))
        {
            seen[trajectory].push(time);
        }
        let times = |(own, mut seen): (&Trajectory, Vec<f64>)| {
            seen.sort_by(f64::total_cmp);
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

    /// Returns the parameters that define the pose of a photo: its six or, on a trajectory, the coefficients nearest to its time.
    pub(super) fn holding(&self, photo: usize) -> Vec<usize> {
        let Some((trajectory, time)) = self.mounts.flight(photo, AT_PHOTO) else {
            return self.of_block(self.carrier(photo)).take(6).collect();
        };
        let Trajectory { course, position, rotation } = self.mounts.trajectory(trajectory);
        let nearest = [(&course.position, position), (&course.rotation, rotation)].map(|(basis, all)| {
            let difference = |&k: &usize| basis.middle(k).map_or(0.0, |middle| (middle - time).abs());
            let nearer = |a: &usize, b: &usize| difference(a).total_cmp(&difference(b));
            (0..all.len()).min_by(nearer).and_then(|k| self.of_common(all[k]))
        });
        nearest.into_iter().flatten().flatten().collect()
    }

    /// Returns the free coefficients of positions in a component.
    pub(super) fn position_coefficients(&self, parts: &Components, part: usize) -> Vec<usize> {
        let all = self.mounts.trajectories().iter().flat_map(|own| &own.position);
        let own = all.filter(|&&common| parts.of_common[common] == Some(part));
        own.filter_map(|&common| self.of_common(common)).flatten().collect()
    }
}

/// Returns the values of the coefficients of a trajectory.
fn coefficients(own: &Trajectory, commons: &[CommonState]) -> CoefficientChanges {
    [&own.position, &own.rotation].map(|all| all.iter().map(|&common| commons[common].vector()).collect())
}

/// Antenna positions and times of observed positions with the same shift and drift.
type Antennas = BTreeMap<[Option<usize>; 2], Vec<(Vector3, f64)>>;

impl Bundle {
    /// Writes the transformed shared parameters into all parameters. Nonabsorbing ones are computed by `each`; shifts and drifts absorb the
    /// mean displacement of their antennas.
    pub(super) fn move_commons(
        &self,
        placed: &LinearizationPoint,
        motion: &SimilarityMotion<'_>,
        each: impl Fn(&CartesianCommon, &CommonState) -> Vec<f64>,
        unknowns: &mut [f64],
    ) {
        let all = self.commons.iter().zip(&placed.commons).enumerate();
        for (number, (common, state)) in all.filter(|(_, (common, _))| !common.moves_against()) {
            if let Some(own) = self.of_common(number) {
                unknowns[own].copy_from_slice(&each(common, state));
            }
        }
        for (pair, antennas) in self.antennas(placed) {
            let displaced = antennas.iter().map(|&(place, time)| ((motion.displacement)(&place), time));
            for (common, moved) in pair.into_iter().zip(line(displaced, pair.map(|own| own.is_some()))) {
                let Some((common, range)) = common.and_then(|own| Some((own, self.of_common(own)?))) else {
                    continue;
                };
                let own = placed.commons[common].attitude().tr_mul(&moved);
                let values = &mut unknowns[range];
                values.iter_mut().zip(own.iter()).for_each(|(value, moved)| *value -= moved);
            }
        }
    }

    /// Returns the antennas of each pair of shift and drift that no other pair shares.
    fn antennas(&self, placed: &LinearizationPoint) -> Antennas {
        let mut all = Antennas::new();
        for active in &self.observations {
            let Observation::Position(own) = &active.observation else { continue };
            if own.shift.is_some() || own.drift.is_some() {
                let pose = placed.photos[own.photo].orientation.pose();
                let arm = own.lever_arm.value(|common| placed.commons[common].vector());
                let antenna = pose.position + pose.attitude * arm;
                all.entry([own.shift, own.drift]).or_default().push((antenna, own.time));
            }
        }
        let of = |common: Option<usize>, k: usize| {
            common.map_or(1, |common| all.keys().filter(|pair| pair[k] == Some(common)).count())
        };
        let alone: Vec<_> =
            all.keys().filter(|pair| of(pair[0], 0) == 1 && of(pair[1], 1) == 1).copied().collect();
        all.retain(|pair, _| alone.contains(pair));
        all
    }
}

/// Returns the least-squares line a + b t through vectors at times t; only a or only b if the other is not requested.
fn line(of: impl Iterator<Item = (Vector3, f64)>, asked: [bool; 2]) -> [Vector3; 2] {
    let (mut n, mut t, mut tt) = (0.0, 0.0, 0.0);
    let (mut sum, mut along) = (Vector3::zeros(), Vector3::zeros());
    for (vector, time) in of {
        (n, t, tt) = (n + 1.0, t + time, tt + time * time);
        (sum, along) = (sum + vector, along + time * vector);
    }
    match asked {
        [true, true] if n * tt - t * t > 1e-12 * n * tt => {
            let b = (n * along - t * sum) / (n * tt - t * t);
            [(sum - t * b) / n, b]
        }
        [false, true] if tt > 0.0 => [Vector3::zeros(), along / tt],
        _ => [sum / n, Vector3::zeros()],
    }
}
