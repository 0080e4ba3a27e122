//! What is wrong with a file, and where.

use thiserror::Error;

use photocore::Stopped;

/// Where something stands in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The byte, from 0.
    Byte(usize),
    /// The line, from 1.
    Line(usize),
    /// It is in no file: columns are written.
    Row,
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Reason {
    /// The file or a message ends before its time.
    #[error("ends within {0}")]
    Ends(&'static str),
    /// A number of more than 64 bits.
    #[error("has a number of more than 64 bits")]
    Endless,
    /// A field of an impossible number.
    #[error("has a field of the impossible number {0}")]
    Number(u64),
    /// A field that is not of the type that it should be.
    #[error("has field {0} in the wire type {1}, which it cannot have")]
    Wire(u64, u8),
    /// A text that is none.
    #[error("has a text in {0} that is not UTF-8")]
    Utf8(&'static str),
    /// A value that does not belong there.
    #[error("has {value:?} for {key}, which is {expected}")]
    Value {
        /// What has it.
        key: &'static str,
        /// The value.
        value: String,
        /// What it can be.
        expected: &'static str,
    },
    /// A part that has to be there.
    #[error("has no {0}")]
    Missing(&'static str),
    /// A key that stands there twice.
    #[error("has {0} twice")]
    Twice(&'static str),
    /// A reference that is not among the measures.
    #[error("refers to its measure {reference}, counted from 0, and has {measures}")]
    Reference {
        /// Its index, from 0.
        reference: i32,
        /// Measures of the point.
        measures: usize,
    },
    /// A line of text that is not understood.
    #[error("has a line that is no part of a control network: {0:?}")]
    Line(String),
    /// What a text can hold and messages cannot, or the other way round.
    #[error("has {0}, which has no place in {1}")]
    NoPlace(String, &'static str),
    /// Lengths or indices of columns that do not agree.
    #[error("has columns that do not agree: {0}")]
    Columns(&'static str),
    /// The end came from outside.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// What is wrong with a file, and where.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{reason}")]
pub struct Fault {
    /// What is wrong.
    pub reason: Reason,
    /// The point, from 1, where it is in one.
    pub point: Option<usize>,
    /// Where it stands.
    pub place: Place,
}

impl Reason {
    /// The fault at a byte.
    pub(super) fn at_byte(self, byte: usize) -> Fault {
        Fault { reason: self, point: None, place: Place::Byte(byte) }
    }

    /// The fault on a line.
    pub(super) fn on_line(self, line: usize) -> Fault {
        Fault { reason: self, point: None, place: Place::Line(line) }
    }

    /// The fault of columns that are written.
    pub(super) fn of_columns(self) -> Fault {
        Fault { reason: self, point: None, place: Place::Row }
    }
}

impl Fault {
    /// The same in a point, counted from 0.
    pub(super) fn in_point(self, point: usize) -> Self {
        Self { point: Some(point + 1), ..self }
    }
}
