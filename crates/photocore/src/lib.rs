//! Photogrammetric least-squares adjustment with the covariance of every result.
//!
//! Four floors; each knows only the ones below it:
//!
//! * [`network`]: cameras, photos, points and images adjusted together; [`programs`]: the other photogrammetric models;
//! * [`adjustment`]: iteration, weights, convergence, statistics; knows no photograph;
//! * [`normals`]: block normal equations, ordered, reduced, factored, solved, selectively inverted; knows no observation;
//! * [`geometry`]: poses, cameras, projection, ellipsoid, refraction: pure functions with their partial derivatives.
//!
//! Vectors and matrices are those of [`nalgebra`]. The crate reads no files, prints nothing and has no global state.

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

/// What the README shows is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
