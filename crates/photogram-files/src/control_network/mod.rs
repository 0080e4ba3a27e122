//! Control networks of ISIS: points, each with its measures in images.
//!
//! A network is a message in protobuf's wire format for each point ([`decoded`], [`encoded`]), or text ([`read_text`], [`text`]);
//! [`fields`] says once what both consist of. Both are read into the same columns ([`Points`]), and written from them. What has no column
//! (who measured, when, by which program; fields and keys that nobody knows) is kept with its point or measure, and written back.

mod columns;
mod fault;
pub mod fields;
mod header;
mod messages;
mod scan;
mod text;
mod values;

pub use columns::{Column, Names, Points, Rest, Sparse, Table, Texts};
pub use fault::{Fault, Place, Reason};
pub use header::Header;
pub use messages::{Framing, Watch, decoded, encoded};
pub use text::{read_text, text};

#[cfg(test)]
mod tests;
