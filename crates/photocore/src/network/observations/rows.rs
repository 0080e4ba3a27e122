//! What an observation is computed from, and the one place where partials by positions and rotations become those by unknowns.

use nalgebra::{DMatrix, Matrix3xX, SMatrix};

use crate::geometry::{Matrix3, ObjectSpace, Orientation, POSE, Point, Pose, Vector3, local_vertical};
use crate::network::blocks::InBlock;
use crate::network::commons::CommonState;
use crate::network::mounts::{Composed, Moving};

/// The points, photos and common unknowns that an observation touches, each known by its place in [`super::Touches`], at given values
/// of the unknowns. Cartesian positions are counted from an origin amid the network.
#[derive(Debug)]
pub struct Sites<'a> {
    pub(super) space: ObjectSpace,
    pub(super) origin: [f64; 3],
    pub(super) points: Vec<PointSite>,
    pub(super) photos: Vec<PhotoSite<'a>>,
    /// How these move, where that is asked for.
    pub(super) moving: Vec<Option<Moving>>,
    pub(super) commons: Vec<CommonSite<'a>>,
}

/// A point with its coordinates in the object space, counted from the origin, and the block of its unknowns.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct PointSite {
    pub point: Point,
    pub coordinates: [f64; 3],
    pub block: usize,
}

/// A pose, the block of its unknowns and, where it is made of several blocks, how its six step with these.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct PhotoSite<'a> {
    pub orientation: &'a Orientation,
    pub block: usize,
    pub made_of: Option<&'a Composed>,
}

/// A common unknown, and where it is unless it is known.
#[derive(Debug, Clone, Copy)]
pub(in crate::network) struct CommonSite<'a> {
    pub state: &'a CommonState,
    pub place: Option<InBlock>,
}

impl Sites<'_> {
    /// The cartesian position of a point.
    pub fn position(&self, point: usize) -> Vector3 {
        self.points[point].point.position()
    }

    /// The height of a point: its Z in rectangular space, that above the ellipsoid in geographic space.
    pub fn height(&self, point: usize) -> f64 {
        self.points[point].coordinates[2]
    }

    /// Up, the axis of heights, as a row; None in geographic space, where it is another everywhere.
    pub(super) fn up(&self) -> Option<DMatrix<f64>> {
        let up = || DMatrix::from_row_slice(1, 3, &[0.0, 0.0, 1.0]);
        matches!(self.space, ObjectSpace::Rectangular).then(up)
    }

    /// The pose of a photo.
    pub fn pose(&self, photo: usize) -> &Pose {
        self.photos[photo].orientation.pose()
    }

    /// How a photo moves; None where it is on no trajectory.
    pub fn moving(&self, photo: usize) -> Option<&Moving> {
        self.moving.get(photo)?.as_ref()
    }

    /// A common unknown.
    pub fn common(&self, common: usize) -> &CommonState {
        self.commons[common].state
    }

    /// The attitude A of a photo in the axes that its angles refer to: those of the space or, where it is geographic, east, north and up
    /// at the photo.
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

    /// The cartesian position of observed coordinates of the object space, and the axes, as rows, in which their errors are told: X, Y, Z
    /// or, where the space is geographic, east, north and up there.
    pub fn observed(&self, coordinates: [f64; 3]) -> (Vector3, Matrix3) {
        let [longitude, latitude, _] = coordinates;
        let axes = match self.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(_) => local_vertical(longitude, latitude),
        };
        (self.space.cartesian(std::array::from_fn(|k| coordinates[k] - self.origin[k])), axes)
    }
}

/// The equations of an observation, to be written: zero at first, every partial is added to what is there.
#[derive(Debug)]
pub struct Rows<'a> {
    pub(super) sites: &'a Sites<'a>,
    /// The blocks that are touched, and the first column of each.
    pub(super) columns: &'a [(usize, usize)],
    /// Columns in all.
    pub(super) width: usize,
    pub(super) constant: &'a mut [f64],
    pub(super) coefficients: &'a mut [f64],
}

impl Rows<'_> {
    /// Observed minus computed of the rows from the given one on.
    pub fn residual(&mut self, row: usize, values: &[f64]) {
        self.constant[row..row + values.len()].copy_from_slice(values);
    }

    /// Partials of some rows, from the given one on, by the cartesian position of a point.
    pub fn by_position<const N: usize>(&mut self, row: usize, point: usize, partials: &SMatrix<f64, N, 3>) {
        let PointSite { point, block, .. } = self.sites.points[point];
        let by_coordinates = partials * point.partials();
        for k in 0..3 {
            self.add(row, block, k, by_coordinates.column(k).iter());
        }
    }

    /// The partial of a row by the height of a point (see [`Sites::height`]).
    pub fn by_height(&mut self, row: usize, point: usize, partial: f64) {
        self.add(row, self.sites.points[point].block, 2, [partial].iter());
    }

    /// Partials of some rows by the cartesian position of the projection centre of a photo.
    pub fn by_centre<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.sites.photos[photo].orientation.steps();
        self.by_pose(row, photo, steps.map(|(shift, _)| partials * shift));
    }

    /// Partials of some rows by the rotation step rho of a photo about its own axes, A <- A Exp(rho).
    pub fn by_rotation<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.sites.photos[photo].orientation.steps();
        self.by_pose(row, photo, steps.map(|(_, turn)| partials * turn));
    }

    /// The same where what is computed comes from [`Sites::local_attitude`]: in geographic space that does not turn with the position.
    pub fn by_local_rotation<const N: usize>(
        &mut self,
        row: usize,
        photo: usize,
        partials: &SMatrix<f64, N, 3>,
    ) {
        let turning = match self.sites.space {
            ObjectSpace::Rectangular => 0,
            ObjectSpace::Geographic(_) => 3,
        };
        let mut by_pose = self.sites.photos[photo].orientation.steps().map(|(_, turn)| partials * turn);
        by_pose[..turning].fill(SMatrix::zeros());
        self.by_pose(row, photo, by_pose);
    }

    /// Partials of some rows by the offset of a common unknown: of its vector, or in the own axes of a place.
    pub fn by_offset<const N: usize>(&mut self, row: usize, common: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_common(row, common, |(offset, _)| partials * offset);
    }

    /// Partials of some rows by the turn of a common unknown about its own axes, R <- R Exp(rho).
    pub fn by_turn<const N: usize>(&mut self, row: usize, common: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_common(row, common, |(_, turn)| partials * turn);
    }

    /// The partials of rows that are the unknowns of a common one themselves, as they are counted.
    pub fn by_itself(&mut self, row: usize, common: usize, count: usize) {
        let Some(InBlock { block, first, .. }) = self.sites.commons[common].place else { return };
        (0..count).for_each(|k| self.add(row + k, block, first + k, [1.0].iter()));
    }

    fn by_common<const N: usize>(
        &mut self,
        row: usize,
        common: usize,
        partials: impl Fn((Vector3, Vector3)) -> SMatrix<f64, N, 1>,
    ) {
        let CommonSite { state, place } = self.sites.commons[common];
        let Some(InBlock { block, first, .. }) = place else { return };
        for (k, step) in (first..).zip(state.steps()) {
            self.add(row, block, k, partials(step).iter());
        }
    }

    /// Partials of some rows by the velocity of a photo (see [`Sites::moving`]).
    pub fn by_velocity<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_motion(row, self.sites.moving(photo).map(|own| &own.velocity_by), partials);
    }

    /// Partials of some rows by the rate of a photo.
    pub fn by_rate<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        self.by_motion(row, self.sites.moving(photo).map(|own| &own.rate_by), partials);
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
        let PhotoSite { block, made_of, .. } = self.sites.photos[photo];
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
