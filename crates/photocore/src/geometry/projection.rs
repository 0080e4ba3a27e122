//! Projection of a point through pose and camera, with the chain rule.
//!
//! A central perspective obeys the collinearity equations x = c u1/u3, y = c u2/u3 with u = A^T (P - C), linearized in all nine unknowns.
//! C is the projection centre and P the point, both cartesian. They are object coordinates in rectangular space and geocentric coordinates
//! in geographic space. There, omega, phi, kappa refer to the local vertical frame at the station.

use super::attitude::RotationSense;
use super::camera::{CameraModel, Image, Perspective};
use super::orientation::Orientation;
use super::pose::POSE;
use super::rotation::Vector3;
use super::space::{ObjectSpace, Point};

/// Orientation and camera of a photo.
#[derive(Debug, Clone, Copy)]
pub struct View<C = Perspective> {
    /// Position and attitude of the photo.
    pub orientation: Orientation,
    /// Camera of the photo.
    pub camera: C,
}

/// Image position and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Projection<P = [f64; 1]> {
    /// x, y in the unit of the camera.
    pub xy: [f64; 2],
    /// With respect to the six unknowns of the pose.
    pub photo: [[f64; POSE]; 2],
    /// With respect to the parameters of the camera.
    pub camera: [P; 2],
    /// With respect to the coordinates of the point.
    pub point: [[f64; 3]; 2],
}

/// Ray of an image point, in cartesian coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// The projection centre.
    pub origin: Vector3,
    /// Unit vector from the projection centre towards the object.
    pub direction: Vector3,
}

impl Orientation {
    /// Returns the projection of a point, given its image and the gradients of the image.
    #[inline(always)]
    pub fn projection<P: Copy>(&self, u: &Vector3, image: &Image<P>, point: &Point) -> Projection<P> {
        let (x_photo, x_point) = self.chain(u, &image.by_u[0], point);
        let (y_photo, y_point) = self.chain(u, &image.by_u[1], point);
        Projection {
            xy: image.xy,
            photo: [x_photo, y_photo],
            camera: image.by_parameters,
            point: [x_point, y_point],
        }
    }

    /// Returns the ray of a direction in the photo's axes.
    pub fn ray(&self, direction: &Vector3) -> Ray {
        Ray { origin: self.centre(), direction: self.pose().attitude * direction }
    }
}

impl<C: CameraModel> View<C> {
    /// Returns the image position of a point; not finite for a point in the plane u3 = 0 of the projection centre.
    #[inline]
    pub fn project(&self, point: &Point) -> [f64; 2] {
        self.camera.image(&self.orientation.to_camera_frame(point))
    }

    /// Returns the image position of a point and its partials; not finite for a point in the plane u3 = 0 of the projection centre. Points
    /// behind the camera are not rejected.
    #[inline(always)]
    pub fn linearize(&self, point: &Point) -> Projection<C::Parameters> {
        let u = self.orientation.to_camera_frame(point);
        self.orientation.projection(&u, &self.camera.linearize(&u), point)
    }

    /// Returns the ray of an image position; None if the position is outside the range of the camera model.
    pub fn ray(&self, xy: [f64; 2]) -> Option<Ray> {
        self.camera.direction(xy).map(|direction| self.orientation.ray(&direction))
    }

    /// Returns the distance of a point from the projection centre along the optical axis. It is negative behind the camera, for any sign of
    /// the principal distance (the camera looks along -z).
    pub fn depth(&self, point: &Vector3) -> f64 {
        self.orientation.pose().depth(point)
    }

    /// Returns the cartesian position of the projection centre.
    pub fn centre(&self) -> Vector3 {
        self.orientation.centre()
    }
}

impl View {
    /// Returns the photo at `position` (coordinates of the object space) with `attitude` omega, phi, kappa and the signed principal
    /// distance.
    pub fn new(
        space: ObjectSpace,
        sense: RotationSense,
        position: [f64; 3],
        attitude: [f64; 3],
        principal_distance: f64,
    ) -> Self {
        let orientation = Orientation::from_angles(space, sense, position, attitude);
        Self { orientation, camera: Perspective { principal_distance } }
    }
}
