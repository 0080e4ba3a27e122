//! Which points take part in the adjustment.

use super::Network;

/// A point that was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dropped {
    /// Index of the point.
    pub point: usize,
    /// Why.
    pub reason: Reason,
}

/// Why a point was left out (GIANT guide, sections 6 and 11).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It has no image.
    NotPhotographed,
    /// A pass point on one photo only.
    PassPointOnOnePhoto,
    /// A control point on one photo only, with more than one component not held.
    ControlPointOnOnePhoto,
}

impl Reason {
    /// The name under which results know it.
    pub fn name(self) -> &'static str {
        match self {
            Reason::NotPhotographed => "not photographed",
            Reason::PassPointOnOnePhoto => "pass point on one photo",
            Reason::ControlPointOnOnePhoto => "control point on one photo",
        }
    }
}

impl Network {
    /// Leaves out points that their images and held components cannot determine, and those `left_out` already.
    ///
    /// A point on one photo stays when at most one of its components is not held: then there are at least four equations for
    /// three unknowns (specification, open point 21).
    pub(super) fn screen(&self, left_out: &[bool]) -> Screened {
        let all = self.point_images();
        let (mut points, mut dropped) = (Vec::new(), Vec::new());
        let mut images = PointImages { start: vec![0], order: Vec::with_capacity(self.images.len()) };
        for point in self.along_curve(&all).into_iter().filter(|&point| !left_out[point]) {
            let own = all.of(point);
            let first_photo = own.first().map(|&image| self.images[image].photo);
            let one_photo = own.iter().all(|&image| Some(self.images[image].photo) == first_photo);
            let held = self.points[point].held().into_iter().filter(|&held| held).count();
            let reason = match (first_photo, held) {
                (None, _) => Some(Reason::NotPhotographed),
                (_, 0) if one_photo => Some(Reason::PassPointOnOnePhoto),
                (_, 1) if one_photo => Some(Reason::ControlPointOnOnePhoto),
                _ => None,
            };
            if let Some(reason) = reason {
                dropped.push(Dropped { point, reason });
            } else {
                points.push(point);
                images.order.extend(own);
                images.start.push(images.order.len());
            }
        }
        dropped.sort_unstable_by_key(|dropped| dropped.point);
        Screened { points, images, dropped }
    }

    /// The images of every point.
    fn point_images(&self) -> PointImages {
        let mut start = vec![0; self.points.len() + 1];
        self.images.iter().for_each(|image| start[image.point + 1] += 1);
        for point in 0..self.points.len() {
            start[point + 1] += start[point];
        }
        let (mut next, mut order) = (start.clone(), vec![0; self.images.len()]);
        for (index, image) in self.images.iter().enumerate() {
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

/// The points that take part, neighbours together, and what was left out.
pub(super) struct Screened {
    pub points: Vec<usize>,
    pub images: PointImages,
    pub dropped: Vec<Dropped>,
}

/// The images of the points that take part, point by point: those of the i-th are `order[start[i]..start[i + 1]]`.
pub(super) struct PointImages {
    pub start: Vec<usize>,
    pub order: Vec<usize>,
}
