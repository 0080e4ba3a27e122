//! The observation equations of one photo.

use super::{ControlPoint, Partials, Pose};
use crate::adjustment::{Evaluated, Model};
use crate::geometry::{ObjectSpace, Point, Projection, RotationSense, View};
use crate::normals::GroupRows;

/// One photo of control points: the collinearity equations. The local blocks are the points, the retained block is the photo.
#[derive(Debug)]
pub struct SinglePhoto {
    pub space: ObjectSpace,
    pub sense: RotationSense,
    /// In millimetres, signed.
    pub principal_distance: f64,
    pub partials: Partials,
    /// Coordinates counted from the local origin.
    pub points: Vec<ControlPoint>,
}

impl SinglePhoto {
    /// The image of a point with its partials.
    #[inline]
    pub fn linearize(&self, photo: &View, point: &Point, index: usize) -> Projection {
        match self.partials {
            Partials::AtComputed => photo.linearize(point),
            Partials::AtMeasured => photo.linearize_at_measured(point, self.points[index].xy),
        }
    }

    /// The points that stand behind the camera, ascending; the equations hold for them as well.
    pub fn behind(&self, unknowns: &[f64]) -> Vec<usize> {
        let At { photo, .. } = self.evaluated(unknowns);
        let points = unknowns[..3 * self.points.len()].as_chunks().0.iter().enumerate();
        points
            .filter(|&(_, &coordinates)| photo.depth(&self.space.cartesian(coordinates)) < 0.0)
            .map(|(point, _)| point)
            .collect()
    }
}

/// Photo and points at given values of the unknowns.
pub struct At<'a> {
    model: &'a SinglePhoto,
    pub photo: View,
    pub points: Vec<Point>,
}

impl SinglePhoto {
    /// Photo and points at given values of the unknowns.
    pub fn evaluated(&self, unknowns: &[f64]) -> At<'_> {
        let (points, photo) = unknowns.split_at(3 * self.points.len());
        let points = points.as_chunks().0.iter().map(|&coordinates| Point::new(self.space, coordinates));
        let Pose { position, attitude } = Pose::from_unknowns(photo);
        let photo = View::new(self.space, self.sense, position, attitude, self.principal_distance);
        At { model: self, photo, points: points.collect() }
    }
}

impl Model for SinglePhoto {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(self.evaluated(unknowns))
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, _: usize, rows: &mut GroupRows<'_>) {
        let measured = self.model.points[local].xy;
        let projection = self.model.linearize(&self.photo, &self.points[local], local);
        for row in 0..2 {
            rows.constant[row] = measured[row] - projection.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&projection.point[row]);
            rows.retained[6 * row..][..6].copy_from_slice(&projection.photo[row]);
        }
    }
}
