//! Observations of photos: GNSS positions, inertial attitudes, relative poses, ranges from a photo to a point.

use nalgebra::{DMatrix, SMatrix};

use super::{
    CommonKind, Fault, Named, ObservationInputs, ObservationModel, Precision, Quantity, Rows, Touches,
    deviation, length, nine, rotates, rows_of, three,
};
use crate::geometry::angle_axis::{right_jacobian_inverse, rotation_angle_axis};
use crate::geometry::{Matrix3, Pose, Vector3};

/// Position of the antenna of a photo.
///
/// `C + A l + s + d dt`, with the partials `I` by C, `-A [l]x` by rho, `A` by l, `I` by s and `dt I` by d (Ackermann and Schade 1993). In
/// geographic space, positions and errors refer to east, north and up at the observed position.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Photo.
    pub photo: usize,
    /// Observed coordinates of the antenna in the object space.
    pub coordinates: [f64; 3],
    /// Lever arm l from the projection centre to the antenna in the axes of the photo (x right, y up, z back), in object units.
    pub lever_arm: Quantity<Vector3>,
    /// Shared parameter of the shift s, if any.
    pub shift: Option<usize>,
    /// Shared parameter of the drift d, if any.
    pub drift: Option<usize>,
    /// Time dt in seconds since the reference time of the drift.
    pub time: f64,
    /// Precision of X, Y, Z or, in geographic space, of east, north and up, in units of length.
    pub precision: Precision,
}

impl Position {
    /// Returns a position with a fixed lever arm, without shift and drift.
    pub fn new(photo: usize, coordinates: [f64; 3], lever_arm: Vector3, precision: Precision) -> Self {
        let lever_arm = Quantity::Known(lever_arm);
        Self { photo, coordinates, lever_arm, shift: None, drift: None, time: 0.0, precision }
    }
}

impl ObservationModel for Position {
    const ROWS: usize = 3;

    /// Values: coordinates, l if fixed, dt; shared parameters: lever arm, shift, drift.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[lever_arm, shift, drift]) = (of.photos, of.commons) else { return None };
        Some(Self {
            photo,
            coordinates: three(values, 0)?,
            lever_arm: Quantity::new(lever_arm, three(values, 3)?.into()),
            shift,
            drift,
            time: *values.get(6)?,
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo])
            .and(self.lever_arm.common(), CommonKind::LeverArm)
            .and(self.shift, CommonKind::Shift)
            .and(self.drift, CommonKind::Drift)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let pose = inputs.pose(0);
        let (observed, axes) = inputs.observed(self.coordinates);
        let lever_arm = self.lever_arm.value(|_| inputs.common(0).vector());
        let mut computed = pose.position + pose.attitude * lever_arm;
        rows.by_centre(0, 0, &axes);
        rows.by_rotation(0, 0, &(-axes * pose.attitude * lever_arm.cross_matrix()));
        let mut place = 0;
        if self.lever_arm.common().is_some() {
            rows.by_offset(0, 0, &(axes * pose.attitude));
            place = 1;
        }
        for factor in [self.shift.map(|_| 1.0), self.drift.map(|_| self.time)].into_iter().flatten() {
            let own = inputs.common(place);
            computed += factor * own.attitude() * own.vector();
            rows.by_offset(0, place, &(factor * axes * own.attitude()));
            place += 1;
        }
        rows.residual(0, (axes * (observed - computed)).as_slice());
    }

    /// The displacement absorbed by a drift depends on the positions of all antennas.
    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        self.drift.is_none().then(|| inputs.observed(self.coordinates).1).and_then(|axes| rows_of(&axes))
    }
}

/// Attitude of the body of a camera.
///
/// The computed value is A B, body to object. The residual is v = Log((A B)^T A_obs), a rotation about the axes of the body. With Jl =
/// Jr^-1(-v), its partials are -Jl B^T by rho and -Jl by a rotation of B about these axes (Sola, Deray and Atchuthan 2018).
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    /// Photo.
    pub photo: usize,
    /// Rotation A_obs from body to object. Its columns are the axes of the body in object axes or, in geographic space, in east, north and
    /// up at the photo.
    pub attitude: Matrix3,
    /// Rotation B from body to photo: the identity if the attitude of the photo itself is observed.
    pub boresight: Quantity<Matrix3>,
    /// Precision of rotations about the axes of the body, in radians.
    pub precision: Precision,
}

impl ObservationModel for Attitude {
    const ROWS: usize = 3;

    /// Values: A_obs, then B if fixed, row by row; shared parameter: boresight.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[boresight]) = (of.photos, of.commons) else { return None };
        let boresight = Quantity::new(boresight, nine(values, 9)?);
        Some(Self {
            photo,
            attitude: nine(values, 0)?,
            boresight,
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo]).and(self.boresight.common(), CommonKind::Boresight)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let boresight = self.boresight.value(|_| *inputs.common(0).attitude());
        let computed = inputs.local_attitude(0) * boresight;
        let (residual, jacobian) = misalignment(&computed, &self.attitude);
        rows.residual(0, residual.as_slice());
        rows.by_local_rotation(0, 0, &(jacobian * boresight.transpose()));
        if self.boresight.common().is_some() {
            rows.by_turn(0, 0, &jacobian);
        }
    }

    fn check(&self) -> Result<(), Fault> {
        rotates(&self.attitude)?;
        self.boresight.known().map_or(Ok(()), rotates)
    }
}

/// Returns v = Log(computed^T observed), and Jl: a small rotation rho of the computed attitude about its own axes changes v by -Jl rho.
pub(in super::super) fn misalignment(computed: &Matrix3, observed: &Matrix3) -> (Vector3, Matrix3) {
    let residual = rotation_angle_axis(&computed.tr_mul(observed));
    (residual, right_jacobian_inverse(&-residual))
}

/// Relative pose of two photos: odometry, a calibrated stereo rig.
///
/// t = Ai^T (Cj - Ci) and R = Ai^T Aj. The residuals are t_obs - t in the axes of photo i and v = Log(R^T R_obs) about the axes of photo j.
/// With Jl = Jr^-1(-v), the partials by Ci, rho_i, Cj, rho_j are: t -Ai^T, `[t]x`, Ai^T, 0; v 0, Jl R^T, 0, -Jl.
#[derive(Debug, Clone, PartialEq)]
pub struct Relative {
    /// Photos i and j.
    pub photos: [usize; 2],
    /// Pose of photo j in the axes of photo i: t_obs in the unit of the object space, and R_obs.
    pub pose: Pose,
    /// Precision of the three components of t, in units of length, and of the three rotations, in radians.
    pub precision: Precision,
}

impl ObservationModel for Relative {
    const ROWS: usize = 6;

    /// Values: t_obs, then R_obs row by row.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[i, j] = of.photos else { return None };
        let pose = Pose { position: three(values, 0)?.into(), attitude: nine(values, 3)? };
        Some(Self { photos: [i, j], pose, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&self.photos)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let (first, second) = (inputs.pose(0), inputs.pose(1));
        let to_first: Matrix3 = first.attitude.transpose();
        let translation = first.to_camera_frame(&second.position);
        rows.residual(0, (self.pose.position - translation).as_slice());
        rows.by_centre(0, 0, &-to_first);
        rows.by_rotation(0, 0, &translation.cross_matrix());
        rows.by_centre(0, 1, &to_first);
        let rotation = to_first * second.attitude;
        let (residual, jacobian): (_, SMatrix<f64, 3, 3>) = misalignment(&rotation, &self.pose.attitude);
        rows.residual(3, residual.as_slice());
        rows.by_rotation(3, 0, &(-jacobian * rotation.transpose()));
        rows.by_rotation(3, 1, &jacobian);
    }

    fn check(&self) -> Result<(), Fault> {
        rotates(&self.pose.attitude)
    }
}

/// Distance between a point and a rangefinder that moves with a photo.
///
/// s = |P - C - A l|, with the partials e by P, -e by C and e A \[l\]x by rho, e = (P - C - A l)^T/s. For an instrument with scale m and
/// constant k, m s + k: the partials are m e, -m e, m e A \[l\]x, and s and 1 by m and k.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// Photo.
    pub photo: usize,
    /// Point P.
    pub point: usize,
    /// Observed length in the unit of the object space.
    pub length: f64,
    /// Standard deviation of the length.
    pub sd: f64,
    /// Lever arm l from the projection centre to the rangefinder in the axes of the photo (x right, y up, z back), in object units.
    pub lever_arm: Vector3,
    /// Instrument, if its scale and constant apply.
    pub instrument: Option<usize>,
}

impl ObservationModel for Range {
    /// Values: length, l.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[point], &[instrument]) = (of.photos, of.points, of.commons) else { return None };
        let (length, lever_arm) = (*values.first()?, three(values, 1)?.into());
        Some(Self { photo, point, length, sd: deviation(&covariance), lever_arm, instrument })
    }

    fn touches(&self) -> Touches {
        let photos = vec![self.photo];
        Touches { photos, ..Touches::points(&[self.point]) }.and(self.instrument, CommonKind::Instrument)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let pose = inputs.pose(0);
        let ray = inputs.position(0) - pose.position - pose.attitude * self.lever_arm;
        let direction = length(inputs, rows, &ray, (self.length, self.instrument));
        rows.by_position(0, 0, &direction);
        rows.by_centre(0, 0, &-direction);
        rows.by_rotation(0, 0, &(direction * pose.attitude * self.lever_arm.cross_matrix()));
    }
}
