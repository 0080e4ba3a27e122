//! Similarity transformations of the connected components of a network.

use nalgebra::{Matrix4, Vector6};

use super::commons::SimilarityMotion;
use super::linearization_point::{LinearizationPoint, PhotoState};
use super::model::{Bundle, Component, Components, MOST_PARTS, MOTIONS};
use crate::adjustment::Motions;
use crate::adjustment::median;
use crate::geometry::{
    AttitudeNumbers, Matrix3, ObjectSpace, Point, Pose, PoseNumbers, Vector3,
    angle_axis::rotation_angle_axis, angle_axis_rotation, local_vertical,
};

/// Index of the scale, the last of the [`MOTIONS`].
pub(super) const SCALE: usize = 6;
/// Ratio to the median distance from the central photo above which a photo counts as diverged.
const LEFT: f64 = 10.0;

/// Returns the displacement of a position per unit of transformation `k`, for `from` relative to its origin.
fn displacement(k: usize, from: &Vector3) -> Vector3 {
    match k {
        0..3 => Vector3::ith(k, 1.0),
        3..6 => Vector3::ith(k - 3, 1.0).cross(from),
        _ => *from,
    }
}

/// Returns V e, the displacement of the origin under exp of the rates: the last column of exp [s + [w]x, e; 0, 0].
fn along(shift: Vector3, rotation: &Vector3, scale: f64) -> Vector3 {
    let mut rates = Matrix4::zeros();
    let turning = rotation.cross_matrix() + Matrix3::from_diagonal_element(scale);
    rates.fixed_view_mut::<3, 3>(0, 0).copy_from(&turning);
    rates.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
    rates.exp().fixed_view::<3, 1>(0, 3).into_owned()
}

impl Bundle {
    /// Returns the connected components of the network, computed at first use.
    pub(super) fn parts(&self) -> &Components {
        self.parts.get_or_init(|| self.find_parts())
    }

    /// Finds the connected components; a frame counts the images of all photos on it.
    fn find_parts(&self) -> Components {
        let (photos, points) = (self.images_on.len(), self.points.len());
        let of_point = |point: usize| photos + point;
        let of_common = |common: usize| photos + points + common;
        let mut joined = Joined((0..photos + points + self.commons.len()).collect());
        for point in 0..points {
            for image in self.images_of(point) {
                joined.join([of_point(point), self.carrier(image.photo)]);
            }
        }
        let moves =
            |common: &usize| self.commons[*common].moves() && self.blocks.of_common[*common].is_some();
        for touches in self.observations.iter().map(|active| &active.touches) {
            let commons = touches.commons.iter().map(|&(common, _)| common).filter(moves).map(of_common);
            let own = touches.photos.iter().map(|&photo| self.carrier(photo));
            joined.join(own.chain(touches.points.iter().map(|&point| of_point(point))).chain(commons));
        }
        let mut on_trajectories = vec![];
        for own in self.mounts.trajectories() {
            let nodes: Vec<usize> = own.coefficients().filter(moves).map(of_common).collect();
            on_trajectories.push(nodes.first().copied());
            joined.join(nodes);
        }
        for photo in 0..photos {
            let commons = self.mounts.always(photo).filter(moves).map(of_common);
            let flown = self.mounts.trajectory_of(photo).and_then(|own| on_trajectories[own]);
            joined.join(std::iter::once(self.carrier(photo)).chain(commons).chain(flown));
        }
        let mut images_on = vec![0; photos];
        self.images_on.iter().enumerate().for_each(|(photo, n)| images_on[self.carrier(photo)] += n);
        let mut by_root = vec![vec![]; joined.0.len()];
        for photo in (0..photos).filter(|&photo| images_on[photo] > 0) {
            by_root[joined.root(photo)].push(photo);
        }
        let asked = self.datum.minimum.map(|minimum| self.carrier(minimum.photo)).or(self.datum.anchor);
        let mut found: Vec<(usize, Vec<usize>)> =
            by_root.into_iter().enumerate().filter(|(_, photos)| !photos.is_empty()).collect();
        let has_asked = |photos: &[usize]| asked.is_some_and(|asked| photos.contains(&asked));
        found.sort_by(|(_, a), (_, b)| has_asked(b).cmp(&has_asked(a)).then(b.len().cmp(&a.len())));
        found.truncate(MOST_PARTS);
        let mut number = vec![None; joined.0.len()];
        found.iter().enumerate().for_each(|(part, (root, _))| number[*root] = Some(part));
        let mut of = |node: usize| number[joined.root(node)];
        let of_photo = (0..photos).map(|photo| of(self.carrier(photo))).collect();
        let of_point = (0..points).map(|point| of(of_point(point))).collect();
        let of_common = (0..self.commons.len()).map(|common| of(of_common(common))).collect();
        let most = |best: usize, &next: &usize| if images_on[next] > images_on[best] { next } else { best };
        let part = |(_, photos): (usize, Vec<usize>)| {
            let central = asked.filter(|_| has_asked(&photos));
            Component { central: central.unwrap_or_else(|| photos.iter().fold(photos[0], most)), photos }
        };
        Components { all: found.into_iter().map(part).collect(), of_photo, of_point, of_common }
    }

    /// Returns the similarity transformations of each component about its central photo. The preferred datum is the pose of this photo and,
    /// for the scale, the coordinate of another photo with the longest distance.
    pub(super) fn rigid_motions(&self, unknowns: &[f64]) -> Option<Motions> {
        let parts = self.parts();
        if parts.all.is_empty() {
            return None;
        }
        let placed = self.without_points(&unknowns[self.parameter_unknowns()]);
        let photos = &placed.photos;
        let origins: Vec<Vector3> =
            parts.all.iter().map(|part| photos[part.central].orientation.centre()).collect();
        let mut vectors = vec![vec![0.0; unknowns.len()]; MOTIONS * origins.len()];
        for (point, &at) in self.coordinates(unknowns).enumerate() {
            let point_at = Point::new(self.space, at);
            let inverse = match self.space {
                ObjectSpace::Rectangular => Matrix3::identity(),
                ObjectSpace::Geographic(_) => point_at.partials().try_inverse()?,
            };
            let Some(part) = parts.of_point[point] else { continue };
            let from = point_at.position() - origins[part];
            for (k, vector) in vectors[MOTIONS * part..][..MOTIONS].iter_mut().enumerate() {
                let moved = inverse * displacement(k, &from);
                vector[self.of_point(point)].copy_from_slice(moved.as_slice());
            }
        }
        for (photo, station) in photos.iter().enumerate().filter(|&(photo, _)| !self.is_carried(photo)) {
            let by_step = station.orientation.unknowns_by_step()?;
            let pose = station.orientation.pose();
            let Some(part) = parts.of_photo[photo] else { continue };
            for (k, vector) in vectors[MOTIONS * part..][..MOTIONS].iter_mut().enumerate() {
                let shift = displacement(k, &(pose.position - origins[part]));
                let turn = if (3..6).contains(&k) { Vector3::ith(k - 3, 1.0) } else { Vector3::zeros() };
                let rho = pose.attitude.tr_mul(&turn);
                let moved = by_step * Vector6::new(shift.x, shift.y, shift.z, rho.x, rho.y, rho.z);
                vector[self.of_block(photo)][..6].copy_from_slice(moved.as_slice());
            }
        }
        for (number, vector) in vectors.iter_mut().enumerate() {
            let (part, k) = (number / MOTIONS, number % MOTIONS);
            let turn = if (3..6).contains(&k) { Vector3::ith(k - 3, 1.0) } else { Vector3::zeros() };
            let scale = if k == SCALE { 2.0 } else { 1.0 };
            let displacement = |place: &Vector3| displacement(k, &(place - origins[part]));
            let motion = SimilarityMotion { displacement: &displacement, turn, scale };
            self.move_commons_of(parts, part, vector, |vector| {
                self.move_commons(&placed, &motion, |common, state| common.change(state, &motion), vector);
            });
        }
        for (part, following) in self.following(parts, &placed.commons) {
            for (k, vector) in vectors[MOTIONS * part..][..MOTIONS].iter_mut().enumerate() {
                let turn = if (3..6).contains(&k) { Vector3::ith(k - 3, 1.0) } else { Vector3::zeros() };
                let changes = following.changes(&|_, pose| {
                    [displacement(k, &(pose.position - origins[part])), pose.attitude.tr_mul(&turn)]
                });
                self.put_changes(&following, &changes, vector);
            }
        }
        let preferred = self.preferred(parts, photos, &origins, &vectors);
        Some(Motions { vectors, preferred })
    }

    /// Returns the preferred datum by component: pose of its central photo, then coordinates of distant photos along their direction.
    fn preferred(
        &self,
        parts: &Components,
        photos: &[PhotoState],
        origins: &[Vector3],
        vectors: &[Vec<f64>],
    ) -> Vec<usize> {
        let mut preferred = vec![];
        for (part, (Component { photos: own, central }, origin)) in parts.all.iter().zip(origins).enumerate()
        {
            preferred.extend(self.holding(*central));
            let asked = self.datum.minimum.filter(|minimum| self.carrier(minimum.photo) == *central);
            let coordinate = asked.and_then(|minimum| minimum.coordinate);
            preferred.extend(coordinate.and_then(|(photo, number)| self.holding(photo).get(number).copied()));
            let others = || own.iter().filter(|&photo| photo != central);
            let away = |&photo: &usize| (photos[photo].orientation.centre() - origin).norm();
            // Weakly determined photos may have diverged and are the last choice.
            let limit = median(others().map(away).collect()).map_or(f64::INFINITY, |middle| LEFT * middle);
            let shifts = others().filter(|&&photo| !self.is_carried(photo)).flat_map(|photo| {
                let (left, block) = (away(photo) > limit, self.of_block(*photo).start);
                let shift = photos[*photo].orientation.shifts_along(origin);
                shift.map(|(number, change)| (left, change.abs(), block + number))
            });
            let scale = &vectors[MOTIONS * part + SCALE];
            let coefficients = self.position_coefficients(parts, part).into_iter();
            let coefficients = coefficients.map(|unknown| (false, scale[unknown].abs(), unknown));
            let mut shifts: Vec<(bool, f64, usize)> = shifts.chain(coefficients).collect();
            shifts.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
            preferred.extend(shifts.into_iter().map(|(_, _, unknown)| unknown));
        }
        preferred
    }

    /// Returns the first transformation of an observation's component, and the effects on its misclosure (see [`Evaluated::carried`]).
    pub(super) fn carried_by_motions(
        &self,
        linearization: &LinearizationPoint,
        observation: usize,
    ) -> Option<(usize, Vec<[f64; MOTIONS]>)> {
        let (own, parts) = (&self.observations[observation], self.parts());
        let of_points = own.touches.points.iter().map(|&point| parts.of_point[point]);
        let of_photos = own.touches.photos.iter().map(|&photo| parts.of_photo[photo]);
        let part = of_points.chain(of_photos).next()??;
        let turned = |missed: &Vector3| {
            std::array::from_fn(|k| if k < 3 { Vector3::zeros() } else { displacement(k, missed) })
        };
        let rows = self.with_model_values(linearization, |model| own.carried(model, turned))?;
        Some((MOTIONS * part, rows))
    }

    /// Calls `moved`, but changes only shared parameters of one component.
    fn move_commons_of(
        &self,
        parts: &Components,
        part: usize,
        unknowns: &mut [f64],
        moved: impl FnOnce(&mut [f64]),
    ) {
        let others = (0..self.commons.len()).filter(|&common| parts.of_common[common] != Some(part));
        let ranges = others.filter_map(|common| self.of_common(common));
        let retained: Vec<_> = ranges.map(|range| (range.clone(), unknowns[range].to_vec())).collect();
        moved(unknowns);
        retained.into_iter().for_each(|(range, values)| unknowns[range].copy_from_slice(&values));
    }

    /// Transforms each component exactly, along the motion with rates e, w and s for unit time: a rotation about any centre fixes this
    /// centre. P -> o + e^s Exp(w) (P - o) + V e, with o the centre of the central photo.
    pub(super) fn move_rigidly(&self, unknowns: &mut [f64], amounts: &[f64]) {
        let (parts, placed) = (self.parts(), self.without_points(&unknowns[self.parameter_unknowns()]));
        for (part, amounts) in amounts.chunks_exact(MOTIONS).take(parts.all.len()).enumerate() {
            self.move_part(parts, &placed, part, unknowns, amounts);
        }
    }

    fn move_part(
        &self,
        parts: &Components,
        placed: &LinearizationPoint,
        part: usize,
        unknowns: &mut [f64],
        amounts: &[f64],
    ) {
        let photos = &placed.photos;
        let origin = photos[parts.all[part].central].orientation.centre();
        let shift = Vector3::new(amounts[0], amounts[1], amounts[2]);
        let rotation = Vector3::new(amounts[3], amounts[4], amounts[5]);
        let (turn, scale) = (angle_axis_rotation(&rotation), amounts[SCALE].exp());
        let shift = along(shift, &rotation, amounts[SCALE]);
        let moved = |place: Vector3| origin + scale * (turn * (place - origin)) + shift;
        let displacement = |place: &Vector3| moved(*place) - place;
        let motion = SimilarityMotion { displacement: &displacement, turn: rotation, scale };
        self.move_commons_of(parts, part, unknowns, |unknowns| {
            self.move_commons(placed, &motion, |common, state| common.moved(state, &motion), unknowns);
        });
        let pose = |pose: &Pose| Pose { position: moved(pose.position), attitude: turn * pose.attitude };
        self.move_trajectories((parts, part), &placed.commons, &pose, unknowns);
        let places =
            self.coordinates(unknowns).map(|&at| self.space.coordinates(moved(self.space.cartesian(at))));
        let places: Vec<[f64; 3]> = places.collect();
        for (point, at) in
            places.into_iter().enumerate().filter(|&(point, _)| parts.of_point[point] == Some(part))
        {
            unknowns[self.of_point(point)].copy_from_slice(&at);
        }
        let own = |photo: usize| !self.is_carried(photo) && parts.of_photo[photo] == Some(part);
        for (photo, station) in photos.iter().enumerate().filter(|&(photo, _)| own(photo)) {
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

/// Disjoint sets of nodes (union-find).
struct Joined(Vec<usize>);

impl Joined {
    fn root(&mut self, mut node: usize) -> usize {
        while self.0[node] != node {
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    fn join(&mut self, nodes: impl IntoIterator<Item = usize>) {
        let mut nodes = nodes.into_iter();
        let Some(first) = nodes.next() else { return };
        for node in nodes {
            let [a, b] = [first, node].map(|node| self.root(node));
            self.0[a.max(b)] = a.min(b);
        }
    }
}
