//! The datum of networks that are free: how they move as a whole, and what carries their datum.

use std::collections::HashMap;

use nalgebra::Vector6;

use super::commons::Motion;
use super::model::Bundle;
use super::problem::Assembled;
use crate::adjustment::{Datum, Motions};
use crate::geometry::{
    AttitudeNumbers, Matrix3, ObjectSpace, Point, PoseNumbers, Vector3, angle_axis::rotation_angle_axis,
    angle_axis_rotation, local_vertical,
};

/// Inner constraints: the datum in which chosen points and photos, taken together, are as near as they come to their given places
/// (where a point has none, to where it started from).
#[derive(Debug, Clone, Default)]
pub struct InnerConstraints {
    /// Indices of points.
    pub points: Vec<usize>,
    /// Indices of photos, whose positions count.
    pub photos: Vec<usize>,
    /// Whether scale is taken from them, too; otherwise it stays as it is held.
    pub scale: bool,
}

/// Shifts along, rotations about the axes of cartesian space, and scale.
const MOTIONS: usize = 7;
const SCALE: usize = 6;

/// How motion `k` moves a place, `from` its origin, by a unit.
fn displacement(k: usize, from: &Vector3) -> Vector3 {
    match k {
        0..3 => Vector3::ith(k, 1.0),
        3..6 => Vector3::ith(k - 3, 1.0).cross(from),
        _ => *from,
    }
}

impl Bundle {
    /// The photo that the user has placed or, where there is none, that with most images among those of the largest part, photos hanging
    /// together by their points; and its part. None without images.
    /// A frame has the images of all photos on it.
    fn central_photo(&self) -> Option<(usize, Vec<usize>)> {
        let mut part: Vec<usize> = (0..self.images_on.len()).collect();
        fn root(part: &mut [usize], mut photo: usize) -> usize {
            while part[photo] != photo {
                part[photo] = part[part[photo]];
                photo = part[photo];
            }
            photo
        }
        for point in 0..self.points.len() {
            for pair in self.images_of(point).windows(2) {
                let [a, b] = [0, 1].map(|k| root(&mut part, self.carrier(pair[k].photo)));
                part[a.max(b)] = a.min(b);
            }
        }
        let mut images_on = vec![0; part.len()];
        self.images_on.iter().enumerate().for_each(|(photo, n)| images_on[self.carrier(photo)] += n);
        let mut photos = vec![vec![]; part.len()];
        for photo in (0..part.len()).filter(|&photo| images_on[photo] > 0) {
            photos[root(&mut part, photo)].push(photo);
        }
        let first_longest =
            |best: Vec<usize>, next: Vec<usize>| if next.len() > best.len() { next } else { best };
        if let Some(anchor) = self.anchor {
            let part = photos.into_iter().find(|part| part.contains(&anchor))?;
            return Some((anchor, part));
        }
        let largest = photos.into_iter().reduce(first_longest)?;
        let central = largest
            .iter()
            .copied()
            .reduce(|best, next| if images_on[next] > images_on[best] { next } else { best })?;
        Some((central, largest))
    }

    /// The motions of a free network about the central photo, whose pose is held first, and for the scale the coordinate of another
    /// in which the two are farthest apart.
    pub(super) fn rigid_motions(&self, unknowns: &[f64]) -> Option<Motions> {
        let placed = self.placed(&unknowns[self.of_stations()]);
        let photos = &placed.photos;
        let (central, part) = self.central_photo()?;
        let origin = photos[central].orientation.centre();
        let mut vectors = vec![vec![0.0; unknowns.len()]; MOTIONS];
        for (point, &at) in self.coordinates(unknowns).enumerate() {
            let point_at = Point::new(self.space, at);
            let inverse = match self.space {
                ObjectSpace::Rectangular => Matrix3::identity(),
                ObjectSpace::Geographic(_) => point_at.partials().try_inverse()?,
            };
            let from = point_at.position() - origin;
            for (k, vector) in vectors.iter_mut().enumerate() {
                let moved = inverse * displacement(k, &from);
                vector[self.of_point(point)].copy_from_slice(moved.as_slice());
            }
        }
        for (photo, station) in photos.iter().enumerate().filter(|&(photo, _)| self.mount(photo).is_none()) {
            let by_step = station.orientation.unknowns_by_step()?;
            let pose = station.orientation.pose();
            for (k, vector) in vectors.iter_mut().enumerate() {
                let shift = displacement(k, &(pose.position - origin));
                let turn = if (3..6).contains(&k) { Vector3::ith(k - 3, 1.0) } else { Vector3::zeros() };
                let rho = pose.attitude.tr_mul(&turn);
                let moved = by_step * Vector6::new(shift.x, shift.y, shift.z, rho.x, rho.y, rho.z);
                vector[self.of_block(photo)][..6].copy_from_slice(moved.as_slice());
            }
        }
        for (k, vector) in vectors.iter_mut().enumerate() {
            let turn = if (3..6).contains(&k) { Vector3::ith(k - 3, 1.0) } else { Vector3::zeros() };
            let scale = if k == SCALE { 2.0 } else { 1.0 };
            let displacement = |place: &Vector3| displacement(k, &(place - origin));
            let motion = Motion { displacement: &displacement, turn, scale };
            self.move_commons(&placed, &motion, |common, state| common.change(state, &motion), vector);
        }
        let shifts = part.iter().filter(|&&photo| photo != central).flat_map(|&photo| {
            let shift = photos[photo].orientation.shifts_along(&origin);
            shift.map(|(number, change)| (change.abs(), self.of_block(photo).start + number))
        });
        let mut shifts: Vec<(f64, usize)> = shifts.collect();
        shifts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let pose = self.of_block(central).take(6);
        let preferred = pose.chain(shifts.into_iter().map(|(_, unknown)| unknown)).collect();
        Some(Motions { vectors, preferred })
    }

    /// Moves the network as a whole, exactly: P -> o + e^s Exp(w) (P - o) + e, o being the centre of the central photo.
    pub(super) fn move_rigidly(&self, unknowns: &mut [f64], amounts: &[f64]) {
        let placed = self.placed(&unknowns[self.of_stations()]);
        let photos = &placed.photos;
        let Some((central, _)) = self.central_photo() else { return };
        let origin = photos[central].orientation.centre();
        let shift = Vector3::new(amounts[0], amounts[1], amounts[2]);
        let turn = angle_axis_rotation(&Vector3::new(amounts[3], amounts[4], amounts[5]));
        let scale = amounts[SCALE].exp();
        let moved = |place: Vector3| origin + scale * (turn * (place - origin)) + shift;
        let displacement = |place: &Vector3| moved(*place) - place;
        let rotation = Vector3::new(amounts[3], amounts[4], amounts[5]);
        let motion = Motion { displacement: &displacement, turn: rotation, scale };
        self.move_commons(&placed, &motion, |common, state| common.moved(state, &motion), unknowns);
        let places =
            self.coordinates(unknowns).map(|&at| self.space.coordinates(moved(self.space.cartesian(at))));
        for (point, at) in places.collect::<Vec<[f64; 3]>>().into_iter().enumerate() {
            unknowns[self.of_point(point)].copy_from_slice(&at);
        }
        for (photo, station) in photos.iter().enumerate().filter(|&(photo, _)| self.mount(photo).is_none()) {
            let pose = &mut unknowns[self.of_block(photo)][..6];
            let (centre, attitude) =
                (moved(station.orientation.centre()), turn * station.orientation.pose().attitude);
            match self.poses {
                PoseNumbers::Angles(sense) => {
                    let position = self.space.coordinates(centre);
                    let local = match self.space {
                        ObjectSpace::Rectangular => attitude,
                        ObjectSpace::Geographic(_) => local_vertical(position[0], position[1]) * attitude,
                    };
                    let angles = [pose[3], pose[4], pose[5]];
                    let before = AttitudeNumbers::OmegaPhiKappa(sense).attitude(angles);
                    let angles = sense.stepped(angles, &rotation_angle_axis(&before.tr_mul(&local)));
                    pose[..3].copy_from_slice(&position);
                    pose[3..].copy_from_slice(&angles);
                }
                PoseNumbers::Vectors => {
                    let to_photo = attitude.transpose();
                    pose[..3].copy_from_slice(rotation_angle_axis(&to_photo).as_slice());
                    pose[3..].copy_from_slice((-(to_photo * centre)).as_slice());
                }
            }
        }
    }
}

impl Assembled {
    /// The unknowns that carry a datum, and the values that they stay near to.
    pub(super) fn datum(&self, inner: &InnerConstraints) -> (Datum, Vec<f64>) {
        let model = &self.problem.model;
        let mut reference = self.problem.initial.clone();
        for (point, given) in model.points.iter().enumerate() {
            let places = reference[model.of_point(point)].iter_mut().zip(given.coordinates);
            places.filter(|(_, given)| !given.is_nan()).for_each(|(x, given)| *x = given);
        }
        let of = self.points.iter().enumerate();
        let first: HashMap<usize, usize> =
            of.map(|(index, &point)| (point, model.of_point(index).start)).collect();
        let points = inner.points.iter().filter_map(|point| first.get(point).copied());
        let photos = inner.photos.iter().filter(|&&photo| photo < model.cameras.len());
        let photos = photos.map(|&photo| model.of_block(photo).start);
        let lengths = |first: usize| {
            let at = std::array::from_fn(|k| self.problem.initial[first + k]);
            let partials = Point::new(model.space, at).partials();
            [0, 1, 2].map(|k| (first + k, partials.column(k).norm()))
        };
        let carriers = points.chain(photos).flat_map(lengths).collect();
        let left = if inner.scale { vec![] } else { vec![SCALE] };
        (Datum { carriers, left, relative: false }, reference)
    }

    /// The datum in which cofactors are relative to some unknowns, scale staying as it is.
    pub(super) fn relative(&self, carriers: Vec<(usize, f64)>) -> Datum {
        Datum { carriers, left: vec![SCALE], relative: true }
    }
}
