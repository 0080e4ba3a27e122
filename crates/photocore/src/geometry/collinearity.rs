//! The collinearity equations x = c u1/u3, y = c u2/u3 with u = G (P - C), linearized in all nine unknowns.
//!
//! C is the projection centre, P the point, both cartesian: the object coordinates themselves in rectangular
//! space, geocentric coordinates in geographic space. G turns the object space into the photo: M or M^T in
//! rectangular space, M R or M^T R in geographic space, R being the local vertical frame at the station. c is
//! the signed principal distance, negative for the positive plane; with either sign the camera looks along
//! its -z axis (GIANT guide, sections 4 and 5 of its specification).

use super::ellipsoid::{Ellipsoid, local_vertical_with_partials};
use super::rotation::rotation_with_partials;
use super::vector::{
    IDENTITY, Matrix3, Vector3, apply, apply_transposed, cross, difference, dot, product, transposed,
};

/// The coordinates in which positions of photos and points are given and adjusted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObjectSpace {
    /// X, Y, Z.
    Rectangular,
    /// Longitude, latitude (radians) and height; attitudes refer to the local vertical frame at each station.
    Geographic(Ellipsoid),
}

/// The sense of omega, phi, kappa.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RotationSense {
    /// u = M d
    GroundToPhoto,
    /// u = M^T d
    PhotoToGround,
}

impl ObjectSpace {
    /// The coordinates of a cartesian position.
    pub fn coordinates(self, position: Vector3) -> Vector3 {
        match self {
            ObjectSpace::Rectangular => position,
            ObjectSpace::Geographic(ellipsoid) => ellipsoid.geographic(position),
        }
    }

    /// The cartesian position of given coordinates.
    pub fn cartesian(self, coordinates: Vector3) -> Vector3 {
        match self {
            ObjectSpace::Rectangular => coordinates,
            ObjectSpace::Geographic(ellipsoid) => ellipsoid.geocentric(coordinates),
        }
    }
}

/// A point: its cartesian position and the partials of that with respect to the three unknown coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    position: Vector3,
    partials: Matrix3,
}

impl Point {
    /// The point with the given coordinates of the object space.
    #[inline]
    pub fn new(space: ObjectSpace, coordinates: Vector3) -> Self {
        let (position, partials) = cartesian(space, coordinates);
        Self { position, partials }
    }

    /// The cartesian position.
    #[inline]
    pub fn position(&self) -> Vector3 {
        self.position
    }

    /// Partials of the cartesian position with respect to the three coordinates, as columns.
    #[inline]
    pub fn partials(&self) -> &Matrix3 {
        &self.partials
    }

    /// The point where the lift puts it.
    pub fn lifted(&self, lift: &Lift) -> Self {
        let position = std::array::from_fn(|i| self.position[i] + lift.vector[i]);
        let row = |i: usize| std::array::from_fn(|k| self.partials[i][k] + lift.by_point[i][k]);
        Self { position, partials: std::array::from_fn(row) }
    }
}

/// By how much one photo sees a point away from its place (see [`super::refraction`]): a cartesian vector, and its partials
/// as columns.
#[derive(Debug, Clone, Copy)]
pub struct Lift {
    /// From the point to where it is seen.
    pub vector: Vector3,
    /// With respect to the position of the photo.
    pub by_photo: Matrix3,
    /// With respect to the coordinates of the point.
    pub by_point: Matrix3,
}

impl Lift {
    /// The point is seen where it is.
    pub const NONE: Self = Self { vector: [0.0; 3], by_photo: [[0.0; 3]; 3], by_point: [[0.0; 3]; 3] };
}

/// An image position and its partials.
#[derive(Debug, Clone, Copy)]
pub struct Projection {
    /// x, y in millimetres.
    pub xy: [f64; 2],
    /// Partials of x and y with respect to the position of the photo (3) and omega, phi, kappa.
    pub photo: [[f64; 6]; 2],
    /// Partials of x and y with respect to the coordinates of the point.
    pub point: [[f64; 3]; 2],
}

/// The ray of an image point, in cartesian coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// The projection centre.
    pub origin: Vector3,
    /// Unit vector from the projection centre towards the object.
    pub direction: Vector3,
}

/// Everything of one photo that its image points share.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    centre: Vector3,
    /// dC / d(position), columns.
    centre_partials: Matrix3,
    /// G: object space to photo.
    to_photo: Matrix3,
    /// A partial of a rotation is an infinitesimal rotation, dG/dq = [w_q]x G: w for the three of position,
    /// omega, phi, kappa.
    turns: [Vector3; 6],
    principal_distance: f64,
}

impl Photo {
    /// The photo at `position` (coordinates of the object space) with `attitude` omega, phi, kappa and the
    /// signed principal distance.
    pub fn new(
        space: ObjectSpace,
        sense: RotationSense,
        position: Vector3,
        attitude: Vector3,
        principal_distance: f64,
    ) -> Self {
        let (centre, centre_partials) = cartesian(space, position);
        let (m, by_angles) = rotation_with_partials(attitude);
        let (m, by_angles) = match sense {
            RotationSense::GroundToPhoto => (m, by_angles),
            RotationSense::PhotoToGround => (transposed(&m), by_angles.map(|partial| transposed(&partial))),
        };
        let [omega, phi, kappa] = by_angles.map(|partial| turn(&partial, &m));
        let (to_photo, longitude, latitude) = match space {
            ObjectSpace::Rectangular => (m, [0.0; 3], [0.0; 3]),
            ObjectSpace::Geographic(_) => {
                let (r, [by_longitude, by_latitude]) = local_vertical_with_partials(position[0], position[1]);
                // dG/dq = M dR/dq = M [w]x R = [M w]x M R
                let turned = |partial: &Matrix3| apply(&m, &turn(partial, &r));
                (product(&m, &r), turned(&by_longitude), turned(&by_latitude))
            }
        };
        let turns = [longitude, latitude, [0.0; 3], omega, phi, kappa];
        Self { centre, centre_partials, to_photo, turns, principal_distance }
    }

    /// The image position of a point, in millimetres; not finite for a point in the plane u3 = 0 of the
    /// projection centre.
    #[inline]
    pub fn project(&self, point: &Point) -> [f64; 2] {
        let u = apply(&self.to_photo, &difference(&point.position, &self.centre));
        let scale = self.principal_distance / u[2];
        [scale * u[0], scale * u[1]]
    }

    /// Distance of a point from the projection centre along the optical axis: negative behind the camera, whatever the sign of the
    /// principal distance (the camera looks along -z).
    pub fn depth(&self, point: &Vector3) -> f64 {
        -dot(&self.to_photo[2], &difference(point, &self.centre))
    }

    /// The image position of a point and its partials; not finite for a point in the plane u3 = 0 of the
    /// projection centre.
    #[inline(always)]
    pub fn linearize(&self, point: &Point) -> Projection {
        self.linearize_with(point, |computed| computed)
    }

    /// The image position of a point and, in place of its partials, those of program W5344 (USGS Computer Contribution 2, 1969,
    /// equations 4 and 5): with the measured image position where the computed one stands in the partials. Both are the same
    /// where the residuals are zero.
    pub fn linearize_at_measured(&self, point: &Point, measured: [f64; 2]) -> Projection {
        self.linearize_with(point, |_| measured)
    }

    /// x = c u1/u3 has the gradient (c/u3, 0, -x/u3) with respect to u; `in_partials` chooses this x from the computed one.
    #[inline(always)]
    fn linearize_with(&self, point: &Point, in_partials: impl Fn([f64; 2]) -> [f64; 2]) -> Projection {
        let u = apply(&self.to_photo, &difference(&point.position, &self.centre));
        let scale = self.principal_distance / u[2];
        let xy = [scale * u[0], scale * u[1]];
        let [x, y] = in_partials(xy);
        let (x_photo, x_point) = self.partials(&[scale, 0.0, -x / u[2]], &u, point);
        let (y_photo, y_point) = self.partials(&[0.0, scale, -y / u[2]], &u, point);
        Projection { xy, photo: [x_photo, y_photo], point: [x_point, y_point] }
    }

    /// The image position of a lifted point and its partials, those of the lift included.
    ///
    /// The lifted point less the centre is all that counts: what the photo's position does to the lift is taken off the
    /// partials of the centre.
    pub fn linearize_lifted(&self, point: &Point, lift: &Lift) -> Projection {
        let row = |i: usize| std::array::from_fn(|k| self.centre_partials[i][k] - lift.by_photo[i][k]);
        let photo = Self { centre_partials: std::array::from_fn(row), ..*self };
        photo.linearize(&point.lifted(lift))
    }

    /// Partials of one image coordinate, given its gradient g with respect to u.
    ///
    /// du = G dP - G dC + w x u dq, and g . (w x u) = (u x g) . w.
    #[inline(always)]
    fn partials(&self, g: &Vector3, u: &Vector3, point: &Point) -> ([f64; 6], Vector3) {
        let in_object_space = apply_transposed(&self.to_photo, g);
        let by_point = apply_transposed(&point.partials, &in_object_space);
        let by_centre = apply_transposed(&self.centre_partials, &in_object_space);
        let moment = cross(u, g);
        let mut by_photo = self.turns.map(|w| dot(&moment, &w));
        for k in 0..3 {
            by_photo[k] -= by_centre[k];
        }
        (by_photo, by_point)
    }

    /// The ray of an image position in millimetres.
    pub fn ray(&self, xy: [f64; 2]) -> Ray {
        let c = self.principal_distance;
        let length = (xy[0] * xy[0] + xy[1] * xy[1] + c * c).sqrt();
        // u is parallel to (x, y, c) and u3 is negative: the camera looks along -z.
        let signed = -length * c.signum();
        let direction = apply_transposed(&self.to_photo, &[xy[0] / signed, xy[1] / signed, c / signed]);
        Ray { origin: self.centre, direction }
    }

    /// The cartesian position of the projection centre.
    #[inline]
    pub fn centre(&self) -> Vector3 {
        self.centre
    }

    /// Partials of the projection centre with respect to the position of the photo, as columns.
    #[inline]
    pub fn centre_partials(&self) -> &Matrix3 {
        &self.centre_partials
    }
}

/// The cartesian position and, as columns, its partials with respect to the coordinates of the object space.
#[inline]
fn cartesian(space: ObjectSpace, coordinates: Vector3) -> (Vector3, Matrix3) {
    match space {
        ObjectSpace::Rectangular => (coordinates, IDENTITY),
        ObjectSpace::Geographic(ellipsoid) => ellipsoid.geocentric_with_partials(coordinates),
    }
}

/// w of the skew matrix [w]x = (dA/dq) A^T of a rotation A.
fn turn(partial: &Matrix3, rotation: &Matrix3) -> Vector3 {
    [dot(&partial[2], &rotation[1]), dot(&partial[0], &rotation[2]), dot(&partial[1], &rotation[0])]
}
