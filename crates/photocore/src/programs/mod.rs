//! The photogrammetric models.

pub mod block;
