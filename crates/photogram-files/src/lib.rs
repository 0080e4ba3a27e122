//! Columns of large files: control networks of ISIS, and delimited tables.
//!
//! The functions convert between bytes and columns. They open no file and are independent of photogrammetric models.

pub mod control_network;
pub mod delimited;
