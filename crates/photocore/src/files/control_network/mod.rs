//! Control networks of ISIS: points, each with its measures in images.
//!
//! A network is a message in protobuf's wire format for each point ([`decoded`], [`encoded`]), or text ([`read_text`], [`text`]);
//! [`fields`] says once what both consist of. Both are read into the same columns ([`Points`]), and written from them. What has no column
//! (who measured, when, by which program; fields and keys that nobody knows) is kept with its point or measure, and written back.

mod columns;
mod decode;
mod encode;
mod fault;
pub mod fields;
mod header;
mod read_text;
mod scan;
mod values;
mod watch;
mod wire;
mod write_text;

pub use columns::{Column, Names, Points, Rest, Sparse, Table, Texts};
pub use decode::{Framing, decoded};
pub use encode::encoded;
pub use fault::{Fault, Place, Reason};
pub use header::Header;
pub use read_text::read_text;
pub use watch::Watch;
pub use write_text::text;

#[cfg(test)]
mod tests;
