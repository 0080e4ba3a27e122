//! Errors of the geometry module.

/// Invalid argument of a geometric object.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// Semi-axes that do not satisfy 0 < b <= a, or are not finite.
    #[error("a spheroid needs finite semi-axes with 0 < b <= a, not a = {a}, b = {b}")]
    Semiaxes {
        /// Semi-major axis passed.
        a: f64,
        /// Semi-minor axis passed.
        b: f64,
    },
    /// Invalid water level or refractive index.
    #[error(
        "water needs a finite level and a finite refractive index of at least 1, not {level} and {index}"
    )]
    Water {
        /// Level passed.
        level: f64,
        /// Index passed.
        index: f64,
    },
}
