//! Object space: coordinates of points and photos, and their cartesian positions.

use super::ellipsoid::Ellipsoid;
use super::rotation::{Matrix3, Vector3};

/// Coordinate system in which positions of photos and points are given and adjusted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ObjectSpace {
    /// X, Y, Z.
    #[default]
    Rectangular,
    /// Longitude, latitude (radians) and height; attitudes refer to the local vertical frame at each station.
    Geographic(Ellipsoid),
}

impl ObjectSpace {
    /// Returns the coordinates of a cartesian position.
    pub fn coordinates(self, position: Vector3) -> [f64; 3] {
        match self {
            ObjectSpace::Rectangular => position.into(),
            ObjectSpace::Geographic(ellipsoid) => ellipsoid.geographic(position),
        }
    }

    /// Returns the cartesian position of given coordinates.
    pub fn cartesian(self, coordinates: [f64; 3]) -> Vector3 {
        match self {
            ObjectSpace::Rectangular => coordinates.into(),
            ObjectSpace::Geographic(ellipsoid) => ellipsoid.geocentric(coordinates),
        }
    }

    /// Returns the cartesian position and, as columns, its partials with respect to the coordinates.
    #[inline]
    pub fn cartesian_with_partials(self, coordinates: [f64; 3]) -> (Vector3, Matrix3) {
        match self {
            ObjectSpace::Rectangular => (coordinates.into(), Matrix3::identity()),
            ObjectSpace::Geographic(ellipsoid) => ellipsoid.geocentric_with_partials(coordinates),
        }
    }
}

/// Cartesian position of a point with its partials with respect to the three unknown coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    position: Vector3,
    /// None in rectangular space: I.
    partials: Option<Matrix3>,
}

impl Point {
    /// Returns the point with the given coordinates of the object space.
    #[inline]
    pub fn new(space: ObjectSpace, coordinates: [f64; 3]) -> Self {
        match space {
            ObjectSpace::Rectangular => Self { position: coordinates.into(), partials: None },
            ObjectSpace::Geographic(_) => {
                let (position, partials) = space.cartesian_with_partials(coordinates);
                Self { position, partials: Some(partials) }
            }
        }
    }

    /// Returns the cartesian position.
    #[inline]
    pub fn position(&self) -> Vector3 {
        self.position
    }

    /// Returns the partials of the cartesian position with respect to the three coordinates, as columns.
    #[inline]
    pub fn partials(&self) -> Matrix3 {
        self.partials.unwrap_or_else(Matrix3::identity)
    }

    /// Transforms a gradient from the cartesian position to the coordinates.
    #[inline(always)]
    pub fn by_coordinates(&self, by_position: &Vector3) -> Vector3 {
        match &self.partials {
            None => *by_position,
            Some(partials) => partials.tr_mul(by_position),
        }
    }

    /// Returns the point displaced by a lift.
    pub fn with_offset(&self, offset: &RefractionOffset) -> Self {
        Self { position: self.position + offset.vector, partials: Some(self.partials() + offset.by_point) }
    }
}

/// Apparent displacement of a point in one photo (see [`super::refraction`]): a cartesian vector, and its partials as columns.
#[derive(Debug, Clone, Copy)]
pub struct RefractionOffset {
    /// Vector from the point to its apparent position.
    pub vector: Vector3,
    /// Partials with respect to the position of the photo.
    pub by_photo: Matrix3,
    /// Partials with respect to the coordinates of the point.
    pub by_point: Matrix3,
}

impl RefractionOffset {
    /// Returns the zero lift.
    pub fn none() -> Self {
        Self { vector: Vector3::zeros(), by_photo: Matrix3::zeros(), by_point: Matrix3::zeros() }
    }
}
