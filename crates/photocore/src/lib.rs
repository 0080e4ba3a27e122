//! Photogrammetric least-squares adjustment with the covariance of every result.
//!
//! The crate has four layers; each layer uses only the layers below it:
//!
//! * [`network`]: simultaneous adjustment of cameras, photos, points and observations;
//! * [`adjustment`]: iteration, weights, convergence and statistics, independent of photogrammetry;
//! * [`normals`]: ordering, reduction, factorisation, solution and selected inverse of block normal equations;
//! * [`geometry`]: poses, cameras, projection, ellipsoid and refraction as pure functions with partial derivatives.
//!
//! Vectors and matrices are [`nalgebra`] types. The crate does not read files, print or use global state.
//!
//! # From a network to covariances
//!
//! The main types of the adjustment of a block with fixed cameras, in the order of the computation. Other types are parts of these or serve
//! special cases.
//!
//! | step | layer | types |
//! | --- | --- | --- |
//! | input | `network` | `Network`, `Options` |
//! | active points, photos and images | `network` | `Selected` |
//! | parameters and observation equations | `network` | `Bundle`, `Assembled` |
//! | pattern of the normal equations | `normals` | `Layout`, `Symbolic`, `Incidence`, `System` |
//! | least-squares problem | `adjustment` | `Problem`, `Terms` |
//! | iterations | `adjustment` | `Run`, `Linearized` |
//! | values at given parameters | `network` | `Stations` |
//! | image, pose and point | `geometry` | `Camera`, `Orientation`, `Point` |
//! | weighted equations | `adjustment` | `Evaluated`, `ObservationEquations` |
//! | rows and normal matrices | `normals` | `GroupRows`, `Prior`, `Batch`, `Front`, `Formation` |
//! | factor and inverse | `normals` | `Factor`, `SelectedInverse`, `Cofactors` |
//! | results | `adjustment` | `Adjustment`, `Leverages` |
//! | results in the terms of the network | `network` | `Solution` |

pub mod adjustment;
pub mod geometry;
pub mod network;
pub mod normals;
mod parallel;

/// Functions that other crates of this project use; they may change at any time.
#[doc(hidden)]
pub mod internal {
    pub use crate::adjustment::{go_on, median};
    pub use crate::geometry::principal_axes;
    pub use crate::network::meet;
    pub use crate::parallel::map;
}

pub use nalgebra;
pub use parallel::{Stopped, Threads};

/// Compiles and runs the example in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
