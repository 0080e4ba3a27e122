//! Errors in files, with their location.

use thiserror::Error;

use photocore::Stopped;

/// Location in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Byte, counted from 0.
    Byte(usize),
    /// Line, counted from 1.
    Line(usize),
    /// None, because columns are written.
    Row,
}

/// Cause of an error.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Reason {
    /// The file or a message is truncated.
    #[error("ends within {0}")]
    Ends(&'static str),
    /// A number exceeds 64 bits.
    #[error("has a number of more than 64 bits")]
    Endless,
    /// Invalid field number.
    #[error("has a field of the impossible number {0}")]
    Number(u64),
    /// Wrong wire type of a field.
    #[error("has field {0} in the wire type {1}, which it cannot have")]
    Wire(u64, u8),
    /// Text that is not UTF-8.
    #[error("has a text in {0} that is not UTF-8")]
    Utf8(&'static str),
    /// Invalid value.
    #[error("has {value:?} for {key}, which is {expected}")]
    Value {
        /// Key of the value.
        key: &'static str,
        /// Value.
        value: String,
        /// Expected values.
        expected: &'static str,
    },
    /// Missing required part.
    #[error("has no {0}")]
    Missing(&'static str),
    /// Duplicate key.
    #[error("has {0} twice")]
    Twice(&'static str),
    /// Reference index outside of the measures.
    #[error("refers to its measure {reference}, counted from 0, and has {measures}")]
    Reference {
        /// Index, from 0.
        reference: i32,
        /// Number of measures of the point.
        measures: usize,
    },
    /// Line of text with a syntax error.
    #[error("has a line that is no part of a control network: {0:?}")]
    Line(String),
    /// Content that the other representation (text or messages) cannot store.
    #[error("has {0}, which has no place in {1}")]
    NoPlace(String, &'static str),
    /// Inconsistent lengths or indices of columns.
    #[error("has columns that do not agree: {0}")]
    Columns(&'static str),
    /// Stopped by the caller.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Error with its location.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{reason}")]
pub struct Fault {
    /// Cause.
    pub reason: Reason,
    /// Number of the point, from 1; None outside of points.
    pub point: Option<usize>,
    /// Location.
    pub place: Place,
}

impl Reason {
    /// Returns the fault at a byte.
    pub(super) fn at_byte(self, byte: usize) -> Fault {
        Fault { reason: self, point: None, place: Place::Byte(byte) }
    }

    /// Returns the fault on a line.
    pub(super) fn on_line(self, line: usize) -> Fault {
        Fault { reason: self, point: None, place: Place::Line(line) }
    }

    /// Returns the fault for columns.
    pub(super) fn of_columns(self) -> Fault {
        Fault { reason: self, point: None, place: Place::Row }
    }
}

impl Fault {
    /// Returns the fault with a point, counted from 0.
    pub(super) fn in_point(self, point: usize) -> Self {
        Self { point: Some(point + 1), ..self }
    }
}
