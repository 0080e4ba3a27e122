//! What an observation is computed from, and the one place where partials by positions and rotations become those by unknowns.

use nalgebra::SMatrix;

use crate::geometry::{Matrix3, ObjectSpace, Orientation, Point, Pose, Vector3, local_vertical};

/// The points and photos that an observation touches, each known by its place in [`super::Touches`], at given values of the unknowns.
/// Cartesian positions are counted from an origin amid the network.
#[derive(Debug)]
pub struct Sites<'a> {
    pub(super) space: ObjectSpace,
    pub(super) origin: [f64; 3],
    /// Each point with its coordinates in the object space, counted from the origin.
    pub(super) points: Vec<(Point, [f64; 3])>,
    pub(super) photos: Vec<&'a Orientation>,
}

impl Sites<'_> {
    /// The cartesian position of a point.
    pub fn position(&self, point: usize) -> Vector3 {
        self.points[point].0.position()
    }

    /// The height of a point: its Z in rectangular space, that above the ellipsoid in geographic space.
    pub fn height(&self, point: usize) -> f64 {
        self.points[point].1[2]
    }

    /// The pose of a photo.
    pub fn pose(&self, photo: usize) -> &Pose {
        self.photos[photo].pose()
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
    /// The first column of each point, then of each photo.
    pub(super) columns: Vec<usize>,
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
        let by_coordinates = partials * self.sites.points[point].0.partials();
        for k in 0..3 {
            self.add(row, self.columns[point] + k, by_coordinates.column(k).iter());
        }
    }

    /// The partial of a row by the height of a point (see [`Sites::height`]).
    pub fn by_height(&mut self, row: usize, point: usize, partial: f64) {
        self.add(row, self.columns[point] + 2, [partial].iter());
    }

    /// Partials of some rows by the cartesian position of the projection centre of a photo.
    pub fn by_centre<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.sites.photos[photo].steps();
        self.by_pose(row, photo, steps.map(|(shift, _)| partials * shift));
    }

    /// Partials of some rows by the rotation step rho of a photo about its own axes, A <- A Exp(rho).
    pub fn by_rotation<const N: usize>(&mut self, row: usize, photo: usize, partials: &SMatrix<f64, N, 3>) {
        let steps = self.sites.photos[photo].steps();
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
        let mut by_pose = self.sites.photos[photo].steps().map(|(_, turn)| partials * turn);
        by_pose[..turning].fill(SMatrix::zeros());
        self.by_pose(row, photo, by_pose);
    }

    fn by_pose<const N: usize>(&mut self, row: usize, photo: usize, partials: [SMatrix<f64, N, 1>; 6]) {
        let first = self.columns[self.sites.points.len() + photo];
        for (k, partials) in partials.iter().enumerate() {
            self.add(row, first + k, partials.iter());
        }
    }

    fn add<'v>(&mut self, row: usize, column: usize, values: impl Iterator<Item = &'v f64>) {
        for (k, value) in values.enumerate() {
            self.coefficients[(row + k) * self.width + column] += value;
        }
    }
}
