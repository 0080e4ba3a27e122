//! Photogrammetric least-squares adjustment with the covariance of every result.
//!
//! Four layers; each layer depends only on the layers below it in this list:
//!
//! * [`network`]: joint adjustment of cameras, photos, points and image observations; [`programs`]: the other photogrammetric models;
//! * [`adjustment`]: iteration, weights, convergence, statistics; independent of photogrammetry;
//! * [`normals`]: block normal equations (ordering, reduction, factorization, solution, selected inverse); independent of observations;
//! * [`geometry`]: poses, cameras, projection, ellipsoid, refraction: pure functions with their partial derivatives.
//!
//! Vectors and matrices are [`nalgebra`] types. The crate reads no files, prints nothing and uses no global state.

pub mod adjustment;
pub mod geometry;
pub mod network;
pub mod normals;
mod parallel;
pub mod programs;
mod sorting;
mod threads;

pub use nalgebra;
pub use threads::{Stopped, Threads};

/// The code examples of the README, compiled and run as doctests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
