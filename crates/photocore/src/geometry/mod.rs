//! Pure functions of photogrammetric geometry with their partial derivatives.
//!
//! * [`vector`]: products of 3-vectors and 3x3 matrices;
//! * [`mod@rotation`]: omega, phi, kappa and the rotation matrix;
//! * [`angle_axis`]: rotations as one vector;
//! * [`bundler`]: the camera of "Bundle Adjustment in the Large", nine unknowns a photo;
//! * [`ellipsoid`]: longitude, latitude, height, geocentric coordinates, and the local vertical frame;
//! * [`collinearity`]: the projection of a point into a photo and its linearization;
//! * [`lens`]: radial and decentering distortion, forward and inverse;
//! * [`sky`]: apparent places of stars, diurnal aberration, refraction, standard coordinates;
//! * [`mod@pointing`]: the attitude of a camera under the sky.
//! * [`refraction`]: how air and water displace a point, [`atmosphere`]: the air.
//!
//! Angles are radians, image coordinates millimetres, lengths the linear unit of the object space.

pub mod angle_axis;
pub mod atmosphere;
pub mod bundler;
pub mod collinearity;
pub mod ellipsoid;
pub mod lens;
pub mod pointing;
pub mod refraction;
pub mod rotation;
pub mod sky;
pub mod vector;

pub use angle_axis::{angle_axis_rotation, angle_axis_with_jacobian};
pub use bundler::{BundlerImage, BundlerParameters, BundlerPhoto};
pub use collinearity::{Lift, ObjectSpace, Photo, Point, Projection, Ray, RotationSense};
pub use ellipsoid::{Ellipsoid, local_vertical, local_vertical_with_partials};
pub use lens::{Displacement, Distortion, Undistorted};
pub use pointing::{pointing, pointing_angles, pointing_with_partials};
pub use refraction::{AirModel, Refraction, Vertical, Water, WaterModel};
pub use rotation::{nearest_turns, rotation, rotation_angles, rotation_with_partials};
pub use sky::{Air, Standard, Station};
pub use vector::{Matrix3, Vector3};

/// What geometry refuses.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// Semi-axes that are not finite, or not 0 < b <= a.
    #[error("a spheroid needs finite semi-axes with 0 < b <= a, not a = {a}, b = {b}")]
    Semiaxes {
        /// The semi-major axis as given.
        a: f64,
        /// The semi-minor axis as given.
        b: f64,
    },
    /// A water level or refractive index that cannot be.
    #[error(
        "water needs a finite level and a finite refractive index of at least 1, not {level} and {index}"
    )]
    Water {
        /// The level as given.
        level: f64,
        /// The index as given.
        index: f64,
    },
}
