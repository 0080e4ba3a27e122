//! Columns of large files: control networks of ISIS, and delimited tables.
//!
//! The functions convert bytes to columns and columns to bytes. They open no file and know no photogrammetric model.

pub mod control_network;
pub mod delimited;
