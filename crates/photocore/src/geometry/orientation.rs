//! A photo's pose with what each of its six unknowns does to it: position and rotation step, or the numbers of a file.

use nalgebra::Matrix6;

use super::angle_axis::angle_axis_with_jacobian;
use super::angle_axis::rotation_angle_axis;
use super::attitude::{AttitudeNumbers, RotationSense};
use super::axes::{Matrix3, Vector3};
use super::ellipsoid::{local_vertical, local_vertical_turns};
use super::pose::Pose;
use super::pose::{POSE, column};
use super::space::{Lift, ObjectSpace, Point};

/// What the six unknowns of a photo's pose are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseNumbers {
    /// Position in the coordinates of the object space, then omega, phi, kappa; in geographic space the angles refer to the local
    /// vertical frame of the photo.
    Angles(RotationSense),
    /// The rotation vector of A^T, then t of u = A^T P + t, so that C = -A t: BAL, Bundler.
    Vectors,
}

/// A pose with what its unknowns do to it.
#[derive(Debug, Clone, Copy)]
pub struct Orientation {
    pose: Pose,
    unknowns: Unknowns,
}

/// What the six unknowns are. A turn w of the photo's axes brings about du = w x (u - s), s being the pivot.
#[derive(Debug, Clone, Copy)]
enum Unknowns {
    /// The coordinates of the position, then three of the attitude.
    Position {
        /// By what a point seems to move in cartesian axes when the coordinates change, as columns; None in rectangular space: -I.
        shifts: Option<Matrix3>,
        /// w of longitude and latitude, which turn the local vertical frame; None in rectangular space.
        turns: Option<[Vector3; 2]>,
        /// K of the angles; None where they are a rotation step.
        rates: Option<Matrix3>,
    },
    /// The rotation vector of A^T, then t, which is the pivot: the rotation turns P, not P - C.
    Vectors {
        /// w of the rotation vector, as columns.
        turns: Matrix3,
        translation: Vector3,
    },
}

impl Orientation {
    /// The orientation of the given six unknowns. Of vectors the object space may only be cartesian.
    pub fn new(numbers: PoseNumbers, space: ObjectSpace, values: &[f64; POSE]) -> Self {
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
        let mut orientation = Self::stepping(space, position, &numbers.attitude(attitude));
        if let Unknowns::Position { rates, .. } = &mut orientation.unknowns {
            *rates = Some(numbers.rates(attitude));
        }
        orientation
    }

    /// The orientation at `position` (coordinates of the object space) with the attitude A, in geographic space that in the local
    /// vertical frame; its last three unknowns are the rotation vector rho of a step A <- A Exp(rho), about the photo's own axes: no
    /// attitude is singular.
    ///
    /// du = u x rho, so that the partials of an image coordinate with respect to rho are g x u.
    pub fn stepping(space: ObjectSpace, position: [f64; 3], local: &Matrix3) -> Self {
        let (centre, centre_partials) = space.cartesian_with_partials(position);
        let (attitude, shifts, turns) = match space {
            ObjectSpace::Rectangular => (*local, None, None),
            ObjectSpace::Geographic(_) => {
                let vertical = local_vertical(position[0], position[1]);
                let turns = local_vertical_turns(position[1]).map(|w| local.tr_mul(&w));
                (vertical.tr_mul(local), Some(-centre_partials), Some(turns))
            }
        };
        let unknowns = Unknowns::Position { shifts, turns, rates: None };
        Self { pose: Pose { position: centre, attitude }, unknowns }
    }

    /// The orientation of a pose that is known: its unknowns are its coordinates and a rotation step.
    pub fn of_pose(space: ObjectSpace, pose: &Pose) -> Self {
        let (coordinates, local) = local(space, pose);
        Self::stepping(space, coordinates, &local)
    }

    /// The orientation with the rotation vector of A^T and the translation t.
    pub fn from_vectors(rotation: Vector3, translation: Vector3) -> Self {
        let (to_photo, turns) = angle_axis_with_jacobian(&rotation);
        Self {
            pose: Pose { position: -to_photo.tr_mul(&translation), attitude: to_photo.transpose() },
            unknowns: Unknowns::Vectors { turns, translation },
        }
    }

    /// The pose.
    #[inline]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The pose, where its unknowns are those of a step of it ([`Pose::step`]) with cartesian coordinates.
    #[inline(always)]
    pub fn stepping_pose(&self) -> Option<&Pose> {
        let plain = matches!(self.unknowns, Unknowns::Position { shifts: None, turns: None, rates: None });
        plain.then_some(&self.pose)
    }

    /// The cartesian position of the projection centre.
    #[inline]
    pub fn centre(&self) -> Vector3 {
        self.pose.position
    }

    /// Partials of the projection centre with respect to the three coordinates of the position, as columns; the identity where these are
    /// cartesian.
    pub fn centre_partials(&self) -> Matrix3 {
        match self.unknowns {
            Unknowns::Position { shifts: Some(shifts), .. } => -shifts,
            Unknowns::Position { .. } | Unknowns::Vectors { .. } => Matrix3::identity(),
        }
    }

    /// The step of the pose, dC and rho (see [`Pose::step`]), that a unit of each unknown takes to first order.
    pub fn steps(&self) -> [(Vector3, Vector3); POSE] {
        let none = Vector3::zeros();
        match &self.unknowns {
            Unknowns::Position { turns, rates, .. } => {
                let (centre, rates) = (self.centre_partials(), rates.unwrap_or_else(Matrix3::identity));
                let [longitude, latitude] = turns.unwrap_or([none; 2]);
                let turned = [-longitude, -latitude, none];
                let by_position = |k: usize| (centre.column(k).into(), turned[k]);
                let by_attitude = |k: usize| (none, rates.column(k).into());
                std::array::from_fn(|k| if k < 3 { by_position(k) } else { by_attitude(k - 3) })
            }
            // du = -A^T dC + u x rho = w x (u - t) holds for every u, so that rho = -w, and at u = 0 dC = A (w x t).
            Unknowns::Vectors { turns, translation } => std::array::from_fn(|k| {
                if k < 3 {
                    let turn: Vector3 = turns.column(k).into();
                    (self.pose.attitude * turn.cross(translation), -turn)
                } else {
                    (-self.pose.attitude.column(k - 3), none)
                }
            }),
        }
    }

    /// By how much each of the three unknowns that shift would have to change, about, to move the photo to a place: the index of the
    /// unknown among the six, and the change in units of length.
    pub fn shifts_along(&self, place: &Vector3) -> [(usize, f64); 3] {
        match self.unknowns {
            Unknowns::Position { .. } => {
                let (columns, way) = (self.centre_partials(), place - self.centre());
                [0, 1, 2].map(|k| (k, columns.column(k).normalize().dot(&way)))
            }
            Unknowns::Vectors { .. } => {
                let u = self.pose.sight(place);
                [0, 1, 2].map(|k| (3 + k, u[k]))
            }
        }
    }

    /// The steps of [`Orientation::steps`] as columns, dC, then rho.
    pub fn step_matrix(&self) -> Matrix6<f64> {
        Matrix6::from_columns(&self.steps().map(|(shift, rho)| column(&shift, &rho)))
    }

    /// How the six unknowns move with a step of the pose, dC, then rho: the inverse of [`Orientation::steps`]. None where angles are
    /// singular.
    pub fn unknowns_by_step(&self) -> Option<Matrix6<f64>> {
        self.step_matrix().try_inverse()
    }

    /// The six numbers of the pose (see [`PoseNumbers`]).
    pub fn numbers(&self, numbers: PoseNumbers, space: ObjectSpace) -> [f64; POSE] {
        let Pose { position, attitude } = self.pose;
        match numbers {
            PoseNumbers::Angles(sense) => {
                let ([x, y, z], local) = local(space, &self.pose);
                let [omega, phi, kappa] = AttitudeNumbers::OmegaPhiKappa(sense).numbers(&local);
                [x, y, z, omega, phi, kappa]
            }
            PoseNumbers::Vectors => {
                let to_photo = attitude.transpose();
                let ([a, b, c], [x, y, z]): ([f64; 3], [f64; 3]) =
                    (rotation_angle_axis(&to_photo).into(), (-(to_photo * position)).into());
                [a, b, c, x, y, z]
            }
        }
    }

    /// u, the point in the photo's axes.
    #[inline(always)]
    pub fn sight(&self, point: &Point) -> Vector3 {
        self.pose.sight(&point.position())
    }

    /// The same orientation for a lifted point: what the photo's position does to the lift is added to its shifts. Of positions.
    pub fn under(&self, lift: &Lift) -> Self {
        let mut lifted = *self;
        if let Unknowns::Position { shifts, .. } = &mut lifted.unknowns {
            *shifts = Some(lift.by_photo - self.centre_partials());
        }
        lifted
    }

    /// Partials of one image coordinate with respect to the six unknowns and to the coordinates of the point, given its gradient g
    /// with respect to u: `g . (w x u) = (u x g) . w`, and du/dP = A^T.
    #[inline(always)]
    pub fn chain(&self, u: &Vector3, g: &Vector3, point: &Point) -> ([f64; POSE], [f64; 3]) {
        let by_place = self.pose.attitude * g;
        let by_photo = match &self.unknowns {
            Unknowns::Position { shifts, turns, rates } => {
                let moment = u.cross(g);
                let mut shift = match shifts {
                    None => -by_place,
                    Some(shifts) => shifts.tr_mul(&by_place),
                };
                if let Some([longitude, latitude]) = turns {
                    shift.x += moment.dot(longitude);
                    shift.y += moment.dot(latitude);
                }
                // A step turns the photo, and what it sees the other way.
                let turn = match rates {
                    None => -moment,
                    Some(rates) => -rates.tr_mul(&moment),
                };
                [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
            }
            Unknowns::Vectors { turns, translation } => {
                let turn = turns.tr_mul(&(u - translation).cross(g));
                [turn.x, turn.y, turn.z, g.x, g.y, g.z]
            }
        };
        (by_photo, point.by_coordinates(&by_place).into())
    }
}

/// The coordinates of a pose, and its attitude in the axes that its angles refer to: those of the space or, where it is geographic, east,
/// north and up there.
fn local(space: ObjectSpace, pose: &Pose) -> ([f64; 3], Matrix3) {
    let coordinates = space.coordinates(pose.position);
    let local = match space {
        ObjectSpace::Rectangular => pose.attitude,
        ObjectSpace::Geographic(_) => local_vertical(coordinates[0], coordinates[1]) * pose.attitude,
    };
    (coordinates, local)
}
