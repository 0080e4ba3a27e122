//! Pose of a photo with its six unknowns: position and rotation step, or the numbers of a file.

use nalgebra::Matrix6;

use super::angle_axis::{angle_axis_with_jacobian, rotation_angle_axis};
use super::attitude::{AttitudeNumbers, RotationSense};
use super::ellipsoid::{local_vertical, local_vertical_turns};
use super::pose::{POSE, Pose, column};
use super::rotation::{Matrix3, Vector3};
use super::space::{ObjectSpace, Point, RefractionOffset};

/// Parametrization of the six unknowns of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseNumbers {
    /// Position in the coordinates of the object space, then omega, phi, kappa. In geographic space the angles refer to the local vertical
    /// frame of the photo.
    Angles(RotationSense),
    /// Rotation vector of A^T, then t of u = A^T P + t, so that C = -A t: used by BAL and Bundler.
    Vectors,
}

impl Default for PoseNumbers {
    fn default() -> Self {
        Self::Angles(RotationSense::GroundToPhoto)
    }
}

/// Pose with the derivatives with respect to its unknowns.
#[derive(Debug, Clone, Copy)]
pub struct Orientation {
    pose: Pose,
    unknowns: Unknowns,
}

/// Unknowns of a pose. A rotation w of the photo's axes gives du = w x (u - s) with the pivot s.
#[derive(Debug, Clone, Copy)]
enum Unknowns {
    /// Coordinates of the position, then three numbers of the attitude.
    Position {
        /// Apparent motion of a point, in cartesian axes, per unit of each coordinate, as columns; None in rectangular space: -I.
        shifts: Option<Matrix3>,
        /// Rotation w of the local vertical frame per longitude and latitude; None in rectangular space.
        turns: Option<[Vector3; 2]>,
        /// K of the angles; None for a rotation step.
        rates: Option<Matrix3>,
    },
    /// Rotation vector of A^T, then t, which is the pivot: the rotation acts on P, not on P - C.
    Vectors {
        /// w per component of the rotation vector, as columns.
        turns: Matrix3,
        translation: Vector3,
    },
}

impl Orientation {
    /// Returns the orientation of the given six unknowns. Vectors require a cartesian object space.
    pub fn new(numbers: PoseNumbers, space: ObjectSpace, values: &[f64; POSE]) -> Self {
        let [a, b, c, d, e, f] = *values;
        match numbers {
            PoseNumbers::Angles(sense) => Self::from_angles(space, sense, [a, b, c], [d, e, f]),
            PoseNumbers::Vectors => Self::from_vectors([a, b, c].into(), [d, e, f].into()),
        }
    }

    /// Returns the orientation at `position` (coordinates of the object space) with `attitude` omega, phi, kappa, with these angles as
    /// unknowns. Their K is singular if phi is 90 degrees.
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

    /// Returns the orientation at `position` (coordinates of the object space) with the attitude A, in the local vertical frame if the
    /// space is geographic. The last three unknowns are the rotation vector rho of a step A <- A Exp(rho) about the photo's own axes. Every
    /// attitude is regular.
    ///
    /// du = u x rho: the partials of an image coordinate with respect to rho are g x u.
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

    /// Returns the orientation of a pose; its unknowns are its coordinates and a rotation step.
    pub fn of_pose(space: ObjectSpace, pose: &Pose) -> Self {
        let (coordinates, local) = local(space, pose);
        Self::stepping(space, coordinates, &local)
    }

    /// Returns the orientation with the rotation vector of A^T and the translation t.
    pub fn from_vectors(rotation: Vector3, translation: Vector3) -> Self {
        let (to_photo, turns) = angle_axis_with_jacobian(&rotation);
        Self {
            pose: Pose { position: -to_photo.tr_mul(&translation), attitude: to_photo.transpose() },
            unknowns: Unknowns::Vectors { turns, translation },
        }
    }

    /// Returns the pose.
    #[inline]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns the pose if the unknowns are a cartesian step ([`Pose::step`]), else None.
    #[inline(always)]
    pub fn stepping_pose(&self) -> Option<&Pose> {
        let plain = matches!(self.unknowns, Unknowns::Position { shifts: None, turns: None, rates: None });
        plain.then_some(&self.pose)
    }

    /// Returns the cartesian position of the projection centre.
    #[inline]
    pub fn centre(&self) -> Vector3 {
        self.pose.position
    }

    /// Returns the partials of the projection centre with respect to the three coordinates of the position, as columns: the identity for
    /// cartesian coordinates.
    pub fn centre_partials(&self) -> Matrix3 {
        match self.unknowns {
            Unknowns::Position { shifts: Some(shifts), .. } => -shifts,
            Unknowns::Position { .. } | Unknowns::Vectors { .. } => Matrix3::identity(),
        }
    }

    /// Returns the step of the pose (dC and rho, see [`Pose::step`]) per unit of each unknown, to first order.
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
            // du = -A^T dC + u x rho = w x (u - t) for every u: rho = -w, and at u = 0 dC = A (w x t).
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

    /// Returns the approximate changes of the three translation unknowns that move the photo to a position: the index among the six
    /// unknowns, and the change as a length.
    pub fn shifts_along(&self, place: &Vector3) -> [(usize, f64); 3] {
        match self.unknowns {
            Unknowns::Position { .. } => {
                let (columns, way) = (self.centre_partials(), place - self.centre());
                [0, 1, 2].map(|k| (k, columns.column(k).normalize().dot(&way)))
            }
            Unknowns::Vectors { .. } => {
                let u = self.pose.to_camera_frame(place);
                [0, 1, 2].map(|k| (3 + k, u[k]))
            }
        }
    }

    /// Returns [`Orientation::steps`] as columns of dC and rho.
    pub fn step_matrix(&self) -> Matrix6<f64> {
        Matrix6::from_columns(&self.steps().map(|(shift, rho)| column(&shift, &rho)))
    }

    /// Returns the partials of the six unknowns with respect to a step of the pose (dC, then rho): the inverse of [`Orientation::steps`].
    /// None if the angles are singular.
    pub fn unknowns_by_step(&self) -> Option<Matrix6<f64>> {
        self.step_matrix().try_inverse()
    }

    /// Returns the six numbers of the pose (see [`PoseNumbers`]).
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

    /// Returns u, the point in the photo's axes.
    #[inline(always)]
    pub fn to_camera_frame(&self, point: &Point) -> Vector3 {
        self.pose.to_camera_frame(&point.position())
    }

    /// Returns the orientation for a lifted point: the partials of the lift by the photo's position are added. Only for positions.
    pub fn with_offset(&self, offset: &RefractionOffset) -> Self {
        let mut with_offset = *self;
        if let Unknowns::Position { shifts, .. } = &mut with_offset.unknowns {
            *shifts = Some(offset.by_photo - self.centre_partials());
        }
        with_offset
    }

    /// Returns the partials of one image coordinate with respect to the six unknowns and to the coordinates of the point. g is its gradient
    /// with respect to u: `g . (w x u) = (u x g) . w` and du/dP = A^T.
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
                // A step rotates the photo, and the image in the opposite direction.
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

/// Returns the coordinates of a pose and its attitude in the reference axes of its angles: the axes of the space, or east, north and up in
/// geographic space.
fn local(space: ObjectSpace, pose: &Pose) -> ([f64; 3], Matrix3) {
    let coordinates = space.coordinates(pose.position);
    let local = match space {
        ObjectSpace::Rectangular => pose.attitude,
        ObjectSpace::Geographic(_) => local_vertical(coordinates[0], coordinates[1]) * pose.attitude,
    };
    (coordinates, local)
}
