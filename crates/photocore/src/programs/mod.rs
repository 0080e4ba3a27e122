//! The photogrammetric models.

pub mod block;
pub mod collection;
pub mod comparator;
pub mod resection;
pub mod similarity;
pub mod stellar;
