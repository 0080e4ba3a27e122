//! Pure functions of photogrammetric geometry with their partial derivatives.
//!
//! * [`mod@pose`]: position and attitude of a photo; [`attitude`]: parametrizations of attitudes;
//! * [`camera`]: camera models, one file per model;
//! * [`orientation`]: a pose with its six unknowns; [`projection`]: the chain point, pose, camera;
//! * [`mod@rotation`]: vectors and matrices, three linear equations, omega, phi, kappa and the rotation matrix; [`angle_axis`]: rotation
//!   vectors;
//! * [`space`]: coordinates of the object space; [`ellipsoid`]: longitude, latitude, height, and the local vertical frame;
//! * [`mod@film`]: deformation and scanning of film; [`mod@correction`]: readings of comparators and scanners;
//! * [`lens`]: radial and decentering distortion, forward and inverse;
//! * [`plate_lens`]: the lens of a star plate;
//! * [`refraction`]: displacement of points by air and water; [`atmosphere`]: the standard atmosphere;
//! * [`mod@trajectory`]: poses as functions of time.
//!
//! Vectors and matrices in cartesian axes are `nalgebra` types. Three numbers of different units or meanings (coordinates of the object
//! space, angles, standard deviations) are arrays. Angles are in radians, lengths in the unit of the object space, image coordinates in the
//! unit of the camera.
//!
//! ```
//! use photocore::geometry::{ObjectSpace, View, Point, RotationSense};
//!
//! // A vertical photo, 150 mm, from 1,000 m above the ground: 100 m there are 15 mm here.
//! let (space, sense) = (ObjectSpace::Rectangular, RotationSense::GroundToPhoto);
//! let photo = View::new(space, sense, [0.0, 0.0, 1000.0], [0.0; 3], -150.0);
//! let image = photo.linearize(&Point::new(space, [100.0, 50.0, 0.0]));
//! assert!((image.xy[0] - 15.0).abs() < 1e-12 && (image.xy[1] - 7.5).abs() < 1e-12);
//! assert!((image.point[0][0] - 0.15).abs() < 1e-12, "dx/dX in millimetres a metre");
//! assert_eq!(image.photo[0][0], -image.point[0][0], "a station moves what it sees the other way");
//! ```

pub mod angle_axis;
pub mod atmosphere;
pub mod attitude;
pub mod camera;
pub mod correction;
pub mod ellipsoid;
pub mod film;
pub mod lens;
pub mod orientation;
pub mod plate_lens;
pub mod pose;
pub mod projection;
pub mod refraction;
pub mod rotation;
pub mod space;
pub mod trajectory;

pub use angle_axis::{angle_axis_rotation, angle_axis_with_jacobian};
pub use attitude::{AttitudeNumbers, RotationSense};
pub use camera::{Bal, Brown, Camera, CameraModel, Image, Perspective, Unit};
pub use ellipsoid::{Ellipsoid, GeometryError, local_vertical};
pub use lens::{Displacement, Distortion, Undistorted};
pub use orientation::{Orientation, PoseNumbers};
pub use plate_lens::{PlateLens, Plated};
pub use pose::{POSE, Pose, Steps};
pub use projection::{Projection, Ray, View};
pub use refraction::{AirModel, Refraction, Vertical, Water, WaterModel};
#[doc(hidden)]
pub use rotation::principal_axes;
pub use rotation::{Matrix3, Vector3, nearest_turns, rotation, rotation_angles};
pub use space::{ObjectSpace, Point, RefractionOffset};
