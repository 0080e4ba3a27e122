//! Bytes of large files as columns, and columns as bytes. What is in them is nothing to any other part of the crate.

pub mod control_network;
pub mod delimited;
