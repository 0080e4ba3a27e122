//! Tests of the crate as one program, so that dependencies are linked once instead of per file.

#![allow(clippy::unwrap_used)]

mod comparator;
mod examples;
mod features;
mod first_values;
mod relative_orientation;
mod resection;
mod similarity;
mod stellar;
mod stellar_dense;
