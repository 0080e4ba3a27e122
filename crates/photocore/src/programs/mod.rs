//! The photogrammetric models.

pub mod block;
pub mod collection;
pub mod comparator;
mod precision;
pub mod resection;
pub mod similarity;
pub mod stellar;

pub use precision::Coarse;
