//! The photogrammetric models.

pub mod block;
pub mod stellar;
