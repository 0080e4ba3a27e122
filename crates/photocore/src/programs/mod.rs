//! The photogrammetric models beside the network.

pub mod comparator;
pub mod resection;
pub mod similarity;
pub mod stellar;
