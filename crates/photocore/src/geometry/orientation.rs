//! A photo's pose with what each of its six unknowns does to it: position and rotation step, or the numbers of a file.

use nalgebra::Matrix6;

use super::attitude::{AttitudeNumbers, RotationSense};
use super::ellipsoid::{local_vertical, local_vertical_turns};
use super::space::{Lift, ObjectSpace, Point};
use super::{Matrix3, Pose, Vector3, angle_axis_with_jacobian};

/// What the six unknowns of a photo's pose are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseNumbers {
    /// Position in the coordinates of the object space, then omega, phi, kappa; in geographic space the angles refer to the local
    /// vertical frame of the photo.
    Angles(RotationSense),
    /// The rotation vector of A^T, then t of u = A^T P + t, so that C = -A t: BAL, Bundler.
    Vectors,
}

/// A pose with its partials: `du = [w]x (u - s) dq + S dq`, where every unknown may turn (w) about a pivot s, and three of them
/// shift (S), all in the photo's axes.
#[derive(Debug, Clone, Copy)]
pub struct Orientation {
    pose: Pose,
    /// w of the six unknowns.
    turns: [Vector3; 6],
    /// s.
    pivot: Vector3,
    /// S: columns of the three unknowns from `shifting` on.
    shifts: Matrix3,
    shifting: usize,
}

impl Orientation {
    /// The orientation of the given six unknowns. Of vectors the object space may only be cartesian.
    pub fn new(numbers: PoseNumbers, space: ObjectSpace, values: &[f64; 6]) -> Self {
        let [a, b, c, d, e, f] = *values;
        match numbers {
            PoseNumbers::Angles(sense) => Self::from_angles(space, sense, [a, b, c], [d, e, f]),
            PoseNumbers::Vectors => Self::from_vectors([a, b, c].into(), [d, e, f].into()),
        }
    }

    /// The orientation at `position` (coordinates of the object space) with `attitude` omega, phi, kappa, in these numbers: their K is
    /// singular where phi is 90 degrees.
    pub fn from_angles(
        space: ObjectSpace,
        sense: RotationSense,
        position: [f64; 3],
        attitude: [f64; 3],
    ) -> Self {
        let numbers = AttitudeNumbers::OmegaPhiKappa(sense);
        let stepping = Self::stepping(space, position, &numbers.attitude(attitude));
        // A step rho turns the photo, and what it sees the other way.
        let rates = -numbers.rates(attitude);
        let [omega, phi, kappa] = [0, 1, 2].map(|k| rates.column(k).into());
        let [longitude, latitude, height, ..] = stepping.turns;
        Self { turns: [longitude, latitude, height, omega, phi, kappa], ..stepping }
    }

    /// The orientation at `position` (coordinates of the object space) with the attitude A, in geographic space that in the local
    /// vertical frame; its last three unknowns are the rotation vector rho of a step A <- A Exp(rho), about the photo's own axes: no
    /// attitude is singular.
    ///
    /// du = u x rho, so that the partials of an image coordinate with respect to rho are g x u.
    pub fn stepping(space: ObjectSpace, position: [f64; 3], local: &Matrix3) -> Self {
        let (centre, centre_partials) = space.cartesian_with_partials(position);
        let (attitude, longitude, latitude) = match space {
            ObjectSpace::Rectangular => (*local, Vector3::zeros(), Vector3::zeros()),
            ObjectSpace::Geographic(_) => {
                let vertical = local_vertical(position[0], position[1]);
                let [longitude, latitude] = local_vertical_turns(position[1]).map(|w| local.tr_mul(&w));
                (vertical.tr_mul(local), longitude, latitude)
            }
        };
        let [x, y, z] = [-Vector3::x(), -Vector3::y(), -Vector3::z()];
        Self {
            pose: Pose { position: centre, attitude },
            turns: [longitude, latitude, Vector3::zeros(), x, y, z],
            pivot: Vector3::zeros(),
            shifts: -attitude.tr_mul(&centre_partials),
            shifting: 0,
        }
    }

    /// The orientation with the rotation vector of A^T and the translation t.
    pub fn from_vectors(rotation: Vector3, translation: Vector3) -> Self {
        let (to_photo, jacobian) = angle_axis_with_jacobian(&rotation);
        let none = Vector3::zeros();
        let [x, y, z] = [0, 1, 2].map(|k| jacobian.column(k).into());
        Self {
            pose: Pose { position: -to_photo.tr_mul(&translation), attitude: to_photo.transpose() },
            turns: [x, y, z, none, none, none],
            // The rotation turns P, not P - C.
            pivot: translation,
            shifts: Matrix3::identity(),
            shifting: 3,
        }
    }

    /// The pose.
    #[inline]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The cartesian position of the projection centre.
    #[inline]
    pub fn centre(&self) -> Vector3 {
        self.pose.position
    }

    /// Partials of the projection centre with respect to the three coordinates of the position, as columns; those of angles.
    pub fn centre_partials(&self) -> Matrix3 {
        -(self.pose.attitude * self.shifts)
    }

    /// By how much each of the three unknowns that shift would have to change, about, to move the photo to a place: the index of the
    /// unknown among the six, and the change in units of length.
    pub fn shifts_along(&self, place: &Vector3) -> [(usize, f64); 3] {
        let u = self.pose.sight(place);
        [0, 1, 2].map(|k| (self.shifting + k, self.shifts.column(k).normalize().dot(&u)))
    }

    /// How the six unknowns move with a step of the pose, dC in object axes, then rho; None where angles are singular.
    ///
    /// The projection centre itself is seen at u = 0 before the step and at -A^T dC after it, and the axes turn by rho:
    /// sum of -(w x s) dq + S dq = -A^T dC, sum of w dq = -rho.
    pub fn unknowns_by_step(&self) -> Option<Matrix6<f64>> {
        let mut by_unknowns = Matrix6::zeros();
        for (k, w) in self.turns.iter().enumerate() {
            by_unknowns.fixed_view_mut::<3, 1>(0, k).copy_from(&-w.cross(&self.pivot));
            by_unknowns.fixed_view_mut::<3, 1>(3, k).copy_from(w);
        }
        let mut shifting = by_unknowns.fixed_view_mut::<3, 3>(0, self.shifting);
        shifting += self.shifts;
        let mut step = Matrix6::zeros();
        step.fixed_view_mut::<3, 3>(0, 0).copy_from(&-self.pose.attitude.transpose());
        step.fixed_view_mut::<3, 3>(3, 3).copy_from(&-Matrix3::identity());
        by_unknowns.try_inverse().map(|inverse| inverse * step)
    }

    /// u, the point in the photo's axes.
    #[inline(always)]
    pub fn sight(&self, point: &Point) -> Vector3 {
        self.pose.sight(&point.position())
    }

    /// The same orientation for a lifted point: what the photo's position does to the lift is added to its shifts. Of angles.
    pub fn under(&self, lift: &Lift) -> Self {
        Self { shifts: self.shifts + self.pose.attitude.tr_mul(&lift.by_photo), ..*self }
    }

    /// Partials of one image coordinate with respect to the six unknowns and to the coordinates of the point, given its gradient g
    /// with respect to u: `g . ([w]x u) = (u x g) . w`, and du/dP = A^T.
    #[inline(always)]
    pub fn chain(&self, u: &Vector3, g: &Vector3, point: &Point) -> ([f64; 6], [f64; 3]) {
        let by_point = point.partials().tr_mul(&(self.pose.attitude * g));
        let moment = (u - self.pivot).cross(g);
        let [a, b, c, d, e, f] = self.turns.map(|w| moment.dot(&w));
        let [p, q, r] = self.shifts.tr_mul(g).into();
        // Not by an index: the partials would have to go through memory.
        let by_photo =
            if self.shifting == 0 { [a + p, b + q, c + r, d, e, f] } else { [a, b, c, d + p, e + q, f + r] };
        (by_photo, by_point.into())
    }
}
