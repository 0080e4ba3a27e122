//! Projection: camera after pose after point, with the chain rule.

use super::axes::Vector3;
use super::camera::Perspective;
use super::camera::{CameraModel, Image};
use super::orientation::Orientation;
use super::pose::POSE;
use super::space::{Lift, Point};

/// An orientation and its camera: everything of one photo that its image points share.
#[derive(Debug, Clone, Copy)]
pub struct View<C = Perspective> {
    /// Where the photo is and how it is turned.
    pub orientation: Orientation,
    /// What it sees with.
    pub camera: C,
}

/// An image position and its partials; the first index is x or y.
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

/// The ray of an image point, in cartesian coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// The projection centre.
    pub origin: Vector3,
    /// Unit vector from the projection centre towards the object.
    pub direction: Vector3,
}

impl Orientation {
    /// The projection of a point from its image and the gradients of that.
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

    /// The ray of a direction in the photo's axes.
    pub fn ray(&self, direction: &Vector3) -> Ray {
        Ray { origin: self.centre(), direction: self.pose().attitude * direction }
    }
}

impl<C: CameraModel> View<C> {
    /// The image position of a point; not finite for a point in the plane u3 = 0 of the projection centre.
    #[inline]
    pub fn project(&self, point: &Point) -> [f64; 2] {
        self.camera.image(&self.orientation.sight(point))
    }

    /// The image position of a point and its partials; not finite for a point in the plane u3 = 0 of the projection centre. A point
    /// behind the camera has the image that the formula gives.
    #[inline(always)]
    pub fn linearize(&self, point: &Point) -> Projection<C::Parameters> {
        let u = self.orientation.sight(point);
        self.orientation.projection(&u, &self.camera.linearize(&u), point)
    }

    /// The image position of a lifted point and its partials, those of the lift included.
    pub fn linearize_lifted(&self, point: &Point, lift: &Lift) -> Projection<C::Parameters> {
        Self { orientation: self.orientation.under(lift), camera: self.camera.clone() }
            .linearize(&point.lifted(lift))
    }

    /// The ray of an image position; None where no direction has it.
    pub fn ray(&self, xy: [f64; 2]) -> Option<Ray> {
        self.camera.direction(xy).map(|direction| self.orientation.ray(&direction))
    }

    /// Distance of a point from the projection centre along the optical axis: negative behind the camera, whatever the sign of the
    /// principal distance (the camera looks along -z).
    pub fn depth(&self, point: &Vector3) -> f64 {
        self.orientation.pose().depth(point)
    }

    /// The cartesian position of the projection centre.
    pub fn centre(&self) -> Vector3 {
        self.orientation.centre()
    }
}
