//! A feature in its place.

use super::Form;
use super::form::{ByMotions, Partials, RADIUS};
use crate::geometry::{Matrix3, Vector3, angle_axis_rotation};

/// A feature in its place.
#[derive(Debug, Clone)]
pub struct Placed {
    /// The origin of its frame.
    pub centre: Vector3,
    /// Unit vectors of the frame, in columns.
    pub axes: Matrix3,
    /// The radius; 0 where there is none.
    pub radius: f64,
}

impl Placed {
    /// The third axis.
    pub fn axis(&self) -> Vector3 {
        self.axes.column(2).into()
    }

    /// A point in the frame.
    pub fn own(&self, point: &Vector3) -> Vector3 {
        self.axes.transpose() * (point - self.centre)
    }

    /// The sum of the squares of all deviations.
    pub fn square_sum(&self, form: Form, points: &[Vector3]) -> f64 {
        let of = |p: &Vector3| {
            let y = self.own(p);
            form.deviations().iter().map(|each| each.value(&y, self.radius).powi(2)).sum::<f64>()
        };
        points.iter().map(of).sum()
    }

    /// The deviations of all points, point by point.
    pub fn linearize(&self, form: Form, points: &[Vector3]) -> Vec<Partials> {
        let of = |p: &Vector3| {
            let y = self.own(p);
            form.deviations().iter().map(move |each| each.linearize(&y, self.radius))
        };
        points.iter().flat_map(of).collect()
    }

    /// After motions of its frame.
    pub(super) fn moved(&self, motions: &ByMotions) -> Self {
        let turn = angle_axis_rotation(&motions.fixed_rows::<3>(3).into());
        Self {
            centre: self.centre + self.axes * motions.fixed_rows::<3>(0),
            axes: self.axes * turn,
            radius: self.radius + motions[RADIUS],
        }
    }

    /// The same feature: the largest component of its axis is positive, and along what does not change it the origin of the frame is at
    /// the foot of the mean of the points, which is 0.
    pub(super) fn oriented(mut self, form: Form) -> Self {
        let axis = self.axis();
        if axis[axis.iamax()] < 0.0 {
            self.axes.fixed_columns_mut::<2>(1).neg_mut();
        }
        let back = self.own(&Vector3::zeros());
        let free = |k: usize| if form.motions().contains(&k) { 0.0 } else { back[k] };
        self.centre += self.axes * Vector3::from_fn(|k, _| free(k));
        self
    }
}
