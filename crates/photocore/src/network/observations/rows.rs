//! Input of observations, and conversion of partials by positions and rotations to partials by parameters.

use nalgebra::{DMatrix, Matrix3xX, SMatrix};

use crate::geometry::{Matrix3, ObjectSpace, Orientation, POSE, Point, Pose, Vector3, local_vertical};
use crate::network::commons::{CommonState, InBlock};
use crate::network::mounts::{Composed, PhotoMotion};

/// Points, photos and shared parameters of an observation at given values, by their index in [`super::Touches`]. Cartesian positions are
/// relative to an origin near the centre of the network.
#[derive(Debug)]
pub struct ObservationInputs<'a> {
    pub(super) space: ObjectSpace,
    pub(super) origin: [f64; 3],
    pub(super) points: Vec<PointSite>,
    pub(super) photos: Vec<PhotoSite<'a>>,
    /// Motion of the photos, if required.
    pub(super) moving: Vec<Option<PhotoMotion>>,
    pub(super) commons: Vec<CommonSite<'a>>,
}

/// A point with its object coordinates, relative to the origin, and its block.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct PointSite {
    pub point: Point,
    pub coordinates: [f64; 3],
    pub block: usize,
}

/// A pose, its block and, if it depends on several blocks, the partials of its six parameters.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct PhotoSite<'a> {
    pub orientation: &'a Orientation,
    pub block: usize,
    pub made_of: Option<&'a Composed>,
}

/// A shared parameter, and its position in the blocks; None if it is fixed.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct CommonSite<'a> {
    pub state: &'a CommonState,
    pub place: Option<InBlock>,
}

impl ObservationInputs<'_> {
    /// Returns the Cartesian position of a point.
    pub fn position(&self, point: usize) -> Vector3 {
        self.points[point].point.position()
    }

    /// Returns the height of a point: Z in rectangular space, the height above the ellipsoid in geographic space.
    pub fn height(&self, point: usize) -> f64 {
        self.points[point].coordinates[2]
    }

    /// Returns the height axis as a row; None in geographic space, because it depends on the position.
    pub(super) fn up(&self) -> Option<DMatrix<f64>> {
        let up = || DMatrix::from_row_slice(1, 3, &[0.0, 0.0, 1.0]);
        matches!(self.space, ObjectSpace::Rectangular).then(up)
    }

    /// Returns the pose of a photo.
    pub fn pose(&self, photo: usize) -> &Pose {
        self.photos[photo].orientation.pose()
    }

    /// Returns the motion of a photo; None without a trajectory.
    pub fn moving(&self, photo: usize) -> Option<&PhotoMotion> {
        self.moving.get(photo)?.as_ref()
    }

    /// Returns a shared parameter.
    pub fn common(&self, common: usize) -> &CommonState {
        self.commons[common].state
    }

    /// Returns the attitude A of a photo in the reference axes of its angles: object axes or, in geographic space, east, north and up at
    /// the photo.
    pub fn local_attitude(&self, photo: usize) -> Matrix3 {
        let Pose { position, attitude } = *self.pose(photo);
        match self.space {
            ObjectSpace::Rectangular => attitude,
            ObjectSpace::Geographic(ellipsoid) => {
                let [longitude, latitude, _] = ellipsoid.geographic(position);
                local_vertical(longitude, latitude) * attitude
            }
        }
    }

    /// Returns the Cartesian position of observed coordinates, and the axes of their errors as rows: X, Y, Z or, in geographic space, east,
    /// north and up.
    pub fn observed(&self, coordinates: [f64; 3]) -> (Vector3, Matrix3) {
        let [longitude, latitude, _] = coordinates;
        let axes = match self.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(_) => local_vertical(longitude, latitude),
        };
        (self.space.cartesian(std::array::from_fn(|k| coordinates[k] - self.origin[k])), axes)
    }
}

/// Equations of an observation, initially zero; partials are accumulated.
#[derive(Debug)]
pub struct Rows<'a> {
    pub(super) inputs: &'a ObservationInputs<'a>,
    /// Blocks of the observation, with the first column of each.
    pub(super) columns: &'a [(usize, usize)],
    /// Total number of columns.
    pub(super) width: usize,
    pub(super) constant: &'a mut [f64],
    pub(super) coefficients: &'a mut [f64],
}

impl Rows<'_> {
    /// Sets observed minus computed of the rows from `row` on.
    pub fn residual(&mut self, row: usize, values: &[f64]) {
        self.constant[row..row + values.len()].copy_from_slice(values);
    }

    /// Adds partials of rows, from `row` on, by the Cartesian position of a point.
    pub fn by_position<const N: usize>(&mut self, row: usize, point: usize, partials: &SMatrix<f64, N, 3>) {
        let PointSite { point, block, .. } = self.inputs.points[point];
        let by_coordinates = partials * point.partials();
        for k in 0..3 {
            self.add(row, block, k, by_coordinates.column(k).iter());
        }
    }

    /// Adds the partial of a row by the height of a point (see [`ObservationInputs::height`]).
    pub fn by_height(&mut self, row: usize, point: usize, partial: f64) {
        self.add(row, self.inputs.points[point].block, 2, [partial].iter());
    }

    /// Adds partials of rows by the Cartesian position of the projection centre of a photo.
    pub fn by_centre<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.inputs.photos[photo].orientation.steps();
        self.by_pose(row, photo, steps.map(|(shift, _)| partials * shift));
    }

    /// Adds partials of rows by the rotation step rho of a photo about its own axes, A <- A Exp(rho).
    pub fn by_rotation<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.inputs.photos[photo].orientation.steps();
        self.by_pose(row, photo, steps.map(|(_, turn)| partials * turn));
    }

    /// Adds the same partials for [`ObservationInputs::local_attitude`], which in geographic space does not rotate with the position.
    pub fn by_local_rotation<const N: usize>(
        &mut self,
        row: usize,
        photo: usize,
        partials: &SMatrix<f64, N, 3>,
    ) {
        let turning = match self.inputs.space {
            ObjectSpace::Rectangular => 0,
            ObjectSpace::Geographic(_) => 3,
        };
        let mut by_pose = self.inputs.photos[photo].orientation.steps().map(|(_, turn)| partials * turn);
        by_pose[..turning].fill(SMatrix::zeros());
        self.by_pose(row, photo, by_pose);
    }

    /// Adds partials of rows by the offset of a shared parameter: of its vector, or in its own axes.
    pub fn by_offset<const N: usize>(&mut self, row: usize, common: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_common(row, common, |(offset, _)| partials * offset);
    }

    /// Adds partials of rows by the rotation of a shared parameter about its own axes, R <- R Exp(rho).
    pub fn by_turn<const N: usize>(&mut self, row: usize, common: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_common(row, common, |(_, turn)| partials * turn);
    }

    /// Adds unit partials of rows that are the components of a shared parameter themselves.
    pub fn add_identity(&mut self, row: usize, common: usize, count: usize) {
        let Some(InBlock { block, first, .. }) = self.inputs.commons[common].place else { return };
        (0..count).for_each(|k| self.add(row + k, block, first + k, [1.0].iter()));
    }

    fn by_common<const N: usize>(
        &mut self,
        row: usize,
        common: usize,
        partials: impl Fn((Vector3, Vector3)) -> SMatrix<f64, N, 1>,
    ) {
        let CommonSite { state, place } = self.inputs.commons[common];
        let Some(InBlock { block, first, .. }) = place else { return };
        for (k, step) in (first..).zip(state.steps()) {
            self.add(row, block, k, partials(step).iter());
        }
    }

    /// Adds partials of rows by the velocity of a photo (see [`ObservationInputs::moving`]).
    pub fn by_velocity<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_motion(row, self.inputs.moving(photo).map(|own| &own.velocity_by), partials);
    }

    /// Adds partials of rows by the rotation rate of a photo.
    pub fn by_rate<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_motion(row, self.inputs.moving(photo).map(|own| &own.rate_by), partials);
    }

    fn by_motion<const N: usize>(
        &mut self,
        row: usize,
        by: Option<&Vec<(InBlock, Matrix3xX<f64>)>>,
        partials: &SMatrix<f64, N, 3>,
    ) {
        for (InBlock { block, first, .. }, columns) in by.into_iter().flatten() {
            for (k, column) in (*first..).zip(columns.column_iter()) {
                self.add(row, *block, k, (partials * column).iter());
            }
        }
    }

    fn by_pose<const N: usize>(&mut self, row: usize, photo: usize, partials: [SMatrix<f64, N, 1>; POSE]) {
        let PhotoSite { block, made_of, .. } = self.inputs.photos[photo];
        let Some(composed) = made_of else {
            for (k, partials) in partials.iter().enumerate() {
                self.add(row, block, k, partials.iter());
            }
            return;
        };
        let all = SMatrix::<f64, N, POSE>::from_columns(&partials);
        for (block, k, step) in composed.columns() {
            self.add(row, block, k, (all * step).iter());
        }
    }

    fn add<'v>(&mut self, row: usize, block: usize, column: usize, values: impl Iterator<Item = &'v f64>) {
        let Some(&(_, first)) = self.columns.iter().find(|own| own.0 == block) else { return };
        let column = first + column;
        for (k, value) in values.enumerate() {
            self.coefficients[(row + k) * self.width + column] += value;
        }
    }
}
