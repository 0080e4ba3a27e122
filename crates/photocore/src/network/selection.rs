//! Which points take part in the adjustment.

use super::state::State;
use super::surroundings::Surroundings;
use super::{Network, NetworkError};
use crate::parallel;
use crate::sorting::sort_by;

/// Points that a thread takes at least.
pub(super) const TOGETHER: usize = 1024;

/// A point that was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dropped {
    /// Index of the point.
    pub point: usize,
    /// Why.
    pub reason: Reason,
}

/// Why a point was left out: the first three before the adjustment (GIANT guide, sections 6 and 11), the others because of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It has no image.
    NotPhotographed,
    /// A pass point on one photo only.
    PassPointOnOnePhoto,
    /// A control point on one photo only, with more than one component not held.
    ControlPointOnOnePhoto,
    /// The iterations have led it to the station of a photo that sees it, where it would harm all others.
    RanIntoStation,
    /// Its rays do not determine it: they are parallel, or one and the same.
    NotDetermined,
    /// Its rays do not meet before the cameras: iterations that have not converged have led it out of the network.
    RanOff,
    /// It was given at the place of a station that sees it: no ray leads there.
    AtStation,
    /// It is held beside a station that sees it, and one of its images is wrong: the adjustment goes wrong with it, and not without.
    NearStation,
}

impl Reason {
    /// The name under which results know it.
    pub fn name(self) -> &'static str {
        match self {
            Reason::NotPhotographed => "not photographed",
            Reason::PassPointOnOnePhoto => "pass point on one photo",
            Reason::ControlPointOnOnePhoto => "control point on one photo",
            Reason::RanIntoStation => "ran into the station of a photo",
            Reason::NotDetermined => "its rays do not determine it",
            Reason::RanOff => "its rays do not meet: it ran off",
            Reason::AtStation => "given at the place of a station that sees it",
            Reason::NearStation => "given beside a station that sees it, and its images do not fit",
        }
    }
}

/// What an adjustment does without, by point and by photo.
#[derive(Debug, Clone)]
pub(super) struct LeftOut {
    pub points: Vec<bool>,
    pub photos: Vec<bool>,
}

impl Network {
    /// What does not take part: photos, and all that an adjustment has gone on without.
    ///
    /// # Errors
    /// A state that is not of this network.
    pub(super) fn left_out(&self, photos: Vec<bool>, state: Option<&State>) -> Result<LeftOut, NetworkError> {
        let mut all = LeftOut { points: vec![false; self.points.len()], photos };
        if let Some(state) = state {
            for (own, left) in [(&mut all.points, &state.collapsed), (&mut all.photos, &state.loose)] {
                for &index in left {
                    *own.get_mut(index).ok_or(NetworkError::State)? = true;
                }
            }
        }
        Ok(all)
    }

    /// Leaves out points that their images and held components cannot determine, and those that are `left_out` already.
    ///
    /// A point on one photo stays when at most one of its components is not held: then there are at least four equations for
    /// three unknowns (specification, open point 21). Points that other nodes of a larger network have unknowns of stay whatever is
    /// seen of them here.
    ///
    /// Points that observations touch stand behind all others. Images on photos that are left out do not take part.
    pub(super) fn select(&self, left_out: &LeftOut, surroundings: Surroundings) -> Selected {
        let loose = &left_out.photos;
        let named = surroundings.points();
        let all = self.point_images(loose);
        let (mut points, mut dropped) = (Vec::new(), Vec::new());
        let along = self.along_curve(&all);
        let reason = |place: usize| self.reason(along[place], all.of(along[place]));
        let reasons: Vec<Option<Reason>> = parallel::map(along.len(), TOGETHER, reason);
        for (point, reason) in along.into_iter().zip(reasons).filter(|&(point, _)| !left_out.points[point]) {
            match reason.filter(|_| !named.contains(&point)) {
                Some(reason) => dropped.push(Dropped { point, reason }),
                None => points.push(point),
            }
        }
        sort_by(&mut dropped, &|a, b| a.point.cmp(&b.point));
        let observations = self.observations_of(&points);
        let mut tied = Vec::new();
        if !(observations.is_empty() && named.is_empty()) {
            let mut touched = vec![false; self.points.len()];
            let touches = observations.iter().flat_map(|&i| self.observations[i].touches().points);
            touches.chain(named).for_each(|point| touched[point] = true);
            (tied, points) = points.into_iter().partition(|&point| touched[point]);
        }
        let locals = points.len();
        points.extend(tied);
        let mut images = PointImages { start: vec![0], order: Vec::with_capacity(self.images.len()) };
        for &point in &points {
            images.order.extend(all.of(point));
            images.start.push(images.order.len());
        }
        let loose = (0..loose.len()).filter(|&photo| loose[photo]).collect();
        Selected { points, locals, images, observations, dropped, loose, surroundings }
    }

    /// Why a point with the given images does not take part; None where it does.
    fn reason(&self, point: usize, images: &[usize]) -> Option<Reason> {
        let first_photo = images.first().map(|&image| self.images[image].photo);
        let one_photo = images.iter().all(|&image| Some(self.images[image].photo) == first_photo);
        let held = self.points[point].held().into_iter().filter(|&held| held).count();
        match (first_photo, held) {
            (None, _) => Some(Reason::NotPhotographed),
            (_, 0) if one_photo => Some(Reason::PassPointOnOnePhoto),
            (_, 1) if one_photo => Some(Reason::ControlPointOnOnePhoto),
            _ => None,
        }
    }

    /// Photos with unknowns that nothing touches, no image and no observation: there is nothing to find of them.
    pub(super) fn untouched_photos(&self) -> Vec<bool> {
        let mut untouched: Vec<bool> =
            self.photos.iter().map(|photo| photo.sd.iter().any(|sd| sd.is_infinite())).collect();
        self.images.iter().for_each(|image| untouched[image.photo] = false);
        for mount in &self.mounts {
            let on_frame = mount.frame().into_iter().flat_map(|frame| [frame, mount.photo()]);
            on_frame.for_each(|photo| untouched[photo] = false);
        }
        let touched = self.observations.iter().flat_map(|each| each.touches().photos);
        touched.for_each(|photo| untouched[photo] = false);
        untouched
    }

    /// The observations whose points are all among the given ones.
    fn observations_of(&self, points: &[usize]) -> Vec<usize> {
        if self.observations.is_empty() {
            return vec![];
        }
        let mut takes_part = vec![false; self.points.len()];
        points.iter().for_each(|&point| takes_part[point] = true);
        let all_there =
            |&index: &usize| self.observations[index].touches().points.iter().all(|&point| takes_part[point]);
        (0..self.observations.len()).filter(all_there).collect()
    }

    /// The images of every point, but for those on loose photos.
    fn point_images(&self, loose: &[bool]) -> PointImages {
        let mut start = vec![0; self.points.len() + 1];
        let taken = |image: &super::Image| !loose[image.photo];
        self.images.iter().filter(|image| taken(image)).for_each(|image| start[image.point + 1] += 1);
        for point in 0..self.points.len() {
            start[point + 1] += start[point];
        }
        let (mut next, mut order) = (start.clone(), vec![0; start[self.points.len()]]);
        for (index, image) in self.images.iter().enumerate().filter(|(_, image)| taken(image)) {
            order[next[image.point]] = index;
            next[image.point] += 1;
        }
        PointImages { start, order }
    }
}

impl PointImages {
    /// The images of the i-th point.
    pub fn of(&self, i: usize) -> &[usize] {
        &self.order[self.start[i]..self.start[i + 1]]
    }
}

/// What takes part, points neighbours together, and what was left out.
pub(super) struct Selected {
    pub points: Vec<usize>,
    /// How many of them, the first, no observation touches.
    pub locals: usize,
    pub images: PointImages,
    pub observations: Vec<usize>,
    pub dropped: Vec<Dropped>,
    /// The photos whose images do not take part, ascending: they stay where they are.
    pub loose: Vec<usize>,
    /// Where the network stands in a larger one.
    pub surroundings: Surroundings,
}

/// The images of the points that take part, point by point: those of the i-th are `order[start[i]..start[i + 1]]`.
#[derive(Debug, Default)]
pub(super) struct PointImages {
    pub start: Vec<usize>,
    pub order: Vec<usize>,
}
