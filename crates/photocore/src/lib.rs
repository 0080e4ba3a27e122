//! Photogrammetric least-squares adjustment with the covariance of every result.
//!
//! Four floors; each knows only the ones below it:
//!
//! * [`programs`]: the photogrammetric models (unknowns and observation equations);
//! * [`adjustment`]: iteration, weights, convergence, statistics; knows no photograph;
//! * [`normals`]: block normal equations, ordered, reduced, factored, solved, selectively inverted; knows no observation;
//! * [`geometry`]: rotation, collinearity, ellipsoid: pure functions with their partial derivatives.
//!
//! The crate reads no files, prints nothing and has no global state.

pub mod adjustment;
pub mod geometry;
pub mod normals;
pub mod programs;
