//! Vectors and matrices in cartesian axes.

/// Three components in cartesian axes.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A matrix in cartesian axes.
pub type Matrix3 = nalgebra::Matrix3<f64>;
