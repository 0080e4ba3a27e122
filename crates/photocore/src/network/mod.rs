//! Networks of photos: poses, cameras, points and images adjusted together.
//!
//! Parameters are the pose of every photo, the coordinates of every point and the parameters of the cameras that are not fixed. Each is
//! fixed, weighted or free. Observations are image coordinates and the additional [`observations`]. Aerial blocks (GIANT guide, sections 4
//! to 9) have fixed cameras and poses in angles. Collections "in the large" (Agarwal, Snavely, Seitz and Szeliski 2010) have one camera per
//! photo and poses in vectors; self-calibrating blocks share one camera. Positions are X, Y, Z or longitude, latitude, height.
//!
//! Files of this folder import in one direction: from the rows below and, in the same row, from the files to the right. `./dev lint` checks
//! this table.
//!
//! | part | files and folders |
//! | --- | --- |
//! | tests of observations | `snooping`, `hypotheses`, `responses`, `predictions`, `group_tests` |
//! | adjustment | `adjust` |
//! | results | `groups`, `covariance`, `solution`, `visibility`, `weak_points`, `adjusted` |
//! | trials without some observations | `trial`, `test_groups` |
//! | exclusion of points and photos | `screens` |
//! | problem of least squares | `naming`, `datum`, `problem`, `layout`, `bundle`, `parameter_values` |
//! | values and equations at given parameters | `evaluated`, `rigid_motions`, `diverging`, `corrected_images`, `composed`, `simd`, `precision`, `intersection`, `motions`, `weighted_angles` |
//! | unknowns | `model`, `blocks`, `linearization_point` |
//! | selection of the input | `check`, `selection`, `neighbourhood` |
//! | input and errors | `error`, `interface`, `camera_priors`, `input` |
//! | types of observations and parameters | `image_corrections`, `observations`, `mounts`, `film`, `commons` |
//!
//! Two photos over four control points:
//!
//! ```
//! use photocore::geometry::{self, ObjectSpace, Perspective, RotationSense};
//! use photocore::network::{Camera, Image, Network, Options, Photo, Point};
//!
//! let corners = [[0.0, 0.0, 0.0], [900.0, 0.0, 40.0], [0.0, 900.0, 70.0], [900.0, 900.0, 10.0]];
//! let stations = [[200.0, 450.0, 1500.0], [700.0, 450.0, 1500.0]];
//! let mut network = Network::new();
//! network.cameras.push(Camera::held(Perspective { principal_distance: -150.0 }.into()));
//! network.points = corners.map(|coordinates| Point::control(coordinates, [0.02; 3])).to_vec();
//! for (photo, station) in stations.into_iter().enumerate() {
//!     let space = ObjectSpace::Rectangular;
//!     let truth = geometry::View::new(space, RotationSense::GroundToPhoto, station, [0.01, -0.02, 0.1], -150.0);
//!     let image = |(point, corner)| Image {
//!         photo,
//!         point,
//!         xy: truth.project(&geometry::Point::new(space, corner)),
//!         sd: [0.005; 2],
//!     };
//!     network.images.extend(corners.into_iter().enumerate().map(image));
//!     // Poses are known to some metres and degrees.
//!     let [x, y, z] = station;
//!     network.photos.push(Photo::free([x + 5.0, y - 4.0, z + 9.0, 0.0, 0.0, 0.0], 0));
//! }
//! let solution = network.adjust(&Options::default())?;
//! let photo = &solution.photos[1];
//! assert!((photo.pose[0] - 700.0).abs() < 1e-6 && (photo.pose[5] - 0.1).abs() < 1e-9);
//! // Four points seen twice, and their coordinates, less twelve unknowns of the photos and twelve of the points.
//! assert_eq!(solution.degrees_of_freedom, 16 + 12 - 12 - 12);
//! assert!(photo.cofactors[0].sqrt() < 1.0, "standard deviation of the station's X in metres");
//! # Ok::<(), photocore::network::NetworkError>(())
//! ```

mod adjust;
mod adjusted;
mod blocks;
mod bundle;
mod camera_priors;
mod check;
pub mod commons;
mod composed;
mod corrected_images;
mod covariance;
mod datum;
mod diverging;
mod error;
mod evaluated;
pub mod film;
mod group_tests;
mod groups;
pub mod hypotheses;
pub mod image_corrections;
mod input;
mod interface;
mod intersection;
mod layout;
mod linearization_point;
mod model;
mod motions;
pub mod mounts;
mod naming;
mod neighbourhood;
pub mod observations;
mod parameter_values;
mod precision;
mod predictions;
mod problem;
mod responses;
mod rigid_motions;
mod screens;
mod selection;
mod simd;
pub mod snooping;
mod solution;
mod test_groups;
mod trial;
mod visibility;
mod weak_points;
mod weighted_angles;

pub use adjust::NetworkAdjustment;
pub use adjusted::{AdjustedCamera, AdjustedCommon, AdjustedPhoto, AdjustedPoint};
pub use commons::{Common, CommonKind};
pub use covariance::{Covariances, Of};
pub use error::{Coarse, Combination, NetworkError, PosePart};
pub use group_tests::{TestOfGroup, TestOfRow, Tests};
pub use groups::Groups;
pub use image_corrections::ImageCorrection;
pub use input::{
    Camera, Image, InnerConstraints, Minimum, Network, NetworkDatum, Options, Photo, Point, Screens, Start,
    State, UnitVariance,
};
pub use interface::{BlockId, Interface};
#[doc(hidden)]
pub use intersection::meet;
pub use mounts::{Mount, Trajectory};
pub use observations::{AdjustedObservation, KindSums, Observation, Precision};
pub use predictions::ResidualBlock;
#[doc(hidden)]
pub use problem::Assembled;
#[doc(hidden)]
pub use selection::Selected;
pub use selection::{Dropped, Reason};
pub use solution::{DatumInForce, Joint, LEAST_REDUNDANCY, Solution, SumsByType, Weak};
pub use test_groups::{GroupId, TestGroups, TestKind};
pub use trial::{Converged, Excluded, Outcome, Trial};
pub use visibility::ImpossibleImages;
pub use weak_points::WeakPoint;
