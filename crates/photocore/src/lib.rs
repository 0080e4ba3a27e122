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

pub mod adjustment;
pub mod geometry;
pub mod network;
pub mod normals;
mod parallel;
mod sorting;

/// Functions that other crates of this project use; they may change at any time.
#[doc(hidden)]
pub mod internal {
    pub use crate::adjustment::go_on;
    pub use crate::geometry::principal_axes;
    pub use crate::network::meet;
    pub use crate::parallel::map;
    pub use crate::sorting::{median, order, sort_by};
}

pub use nalgebra;
pub use parallel::{Stopped, Threads};

/// Compiles and runs the example in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
