//! Collinearity equations x = c u1/u3, y = c u2/u3 with u = A^T (P - C), linearized in all nine unknowns. The camera is a central
//! perspective, the orientation is given by position and angles.
//!
//! C is the projection centre and P the point, both cartesian. They are object coordinates in rectangular space and geocentric coordinates
//! in geographic space. There, omega, phi, kappa refer to the local vertical frame at the station.

use super::attitude::RotationSense;
use super::camera::Perspective;
use super::orientation::Orientation;
use super::projection::{Projection, View};
use super::space::{ObjectSpace, Point};

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

    /// Returns the image position of a point and the partials of program W5344 (USGS Computer Contribution 2, 1969, equations 4 and 5).
    /// They contain the measured image position instead of the computed one; both agree if the residuals are zero.
    pub fn linearize_at_measured(&self, point: &Point, measured: [f64; 2]) -> Projection {
        let u = self.orientation.sight(point);
        self.orientation.projection(&u, &self.camera.linearize_at(&u, |_| measured), point)
    }
}
