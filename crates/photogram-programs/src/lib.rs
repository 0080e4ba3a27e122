//! Photogrammetric models other than the network, and published algorithms, on the engine of [`photocore`].

pub mod comparator;
pub mod features;
pub mod first_values;
pub mod nearest;
pub mod relative_orientation;
pub mod resection;
pub mod similarity;
pub mod sky;
pub mod stellar;
