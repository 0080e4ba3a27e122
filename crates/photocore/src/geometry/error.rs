//! What geometry refuses.

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
