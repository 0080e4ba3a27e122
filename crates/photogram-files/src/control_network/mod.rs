//! Control networks of ISIS: points with their measures in images.
//!
//! A network is a sequence of protobuf messages, one per point ([`decoded`], [`encoded`]), or text ([`read_text`], [`text`]); [`fields`]
//! declares the contents of both. Both are read into the same columns ([`Points`]), and written from them. Data without a column (author,
//! date, program, unknown fields and keys) is stored with its point or measure, and written unchanged.

mod columns;
mod fault;
pub mod fields;
mod header;
mod messages;
mod scan;
mod text;

pub use columns::{Column, Names, Points, Rest, Sparse, Table, Texts};
pub use fault::{Fault, Place, Reason};
pub use header::Header;
pub use messages::{Framing, decoded, encoded};
pub use text::{read_text, text};

#[cfg(test)]
mod tests;
