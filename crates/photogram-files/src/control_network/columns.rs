//! Columns of points and measures.

use std::borrow::Cow;
use std::collections::HashMap;

use photocore::Stopped;

use super::fault::Reason;
use super::fields::{Field, Kind, MEASURES, POINT};

/// Column value that may be absent.
pub trait Value: Copy {
    /// Representation of an absent value.
    const ABSENT: Self;
    /// Returns whether the value is absent.
    fn is_absent(&self) -> bool;
}

macro_rules! values {
    ($($of:ty: $absent:expr, $is:expr;)+) => {$(
        impl Value for $of {
            const ABSENT: Self = $absent;
            fn is_absent(&self) -> bool {
                $is(self)
            }
        }
    )+};
}

values! {
    f64: f64::NAN, |value: &f64| value.is_nan();
    [f64; 6]: [f64::NAN; 6], |value: &[f64; 6]| value[0].is_nan();
    bool: false, |value: &bool| !value;
    i8: -1, |value: &i8| *value < 0;
    i32: -1, |value: &i32| *value < 0;
}

/// Column without trailing absent values.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse<'a, T: Value>(pub Cow<'a, [T]>);

impl<T: Value> Default for Sparse<'_, T> {
    fn default() -> Self {
        Self(Cow::Owned(vec![]))
    }
}

impl<T: Value> Sparse<'_, T> {
    /// Returns the value of a row.
    pub fn get(&self, row: usize) -> T {
        self.0.get(row).copied().unwrap_or(T::ABSENT)
    }

    /// Sets the value of the last row; returns whether the row had a value.
    fn set(&mut self, row: usize, value: T) -> Result<bool, Stopped> {
        let had = !self.get(row).is_absent();
        if value.is_absent() && !had {
            return Ok(had);
        }
        let own = self.0.to_mut();
        own.truncate(row);
        reserve(own, row + 1 - own.len())?;
        own.resize(row, T::ABSENT);
        own.push(value);
        Ok(had)
    }

    /// Returns the column extended to `rows` values; None if it is empty.
    pub fn whole(self, rows: usize) -> Option<Vec<T>> {
        let mut own = self.0.into_owned();
        (!own.is_empty()).then(|| {
            own.resize(rows, T::ABSENT);
            own
        })
    }
}

fn reserve<T>(values: &mut Vec<T>, more: usize) -> Result<(), Stopped> {
    values.try_reserve(more).map_err(|_| Stopped::OutOfMemory((values.len() + more) * size_of::<T>()))
}

/// Column with a separate text in every row.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Texts {
    text: String,
    ends: Vec<usize>,
}

impl Texts {
    /// Returns the text of a row.
    pub fn get(&self, row: usize) -> &str {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        &self.text[start..self.ends[row]]
    }

    /// Returns an iterator over all texts.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &str> {
        (0..self.ends.len()).map(|row| self.get(row))
    }

    fn set(&mut self, row: usize, text: &str) -> bool {
        let had = self.ends.len() > row;
        if had {
            self.ends.truncate(row);
            self.text.truncate(self.ends.last().copied().unwrap_or(0));
        }
        self.text.push_str(text);
        self.ends.push(self.text.len());
        had
    }
}

impl<S: AsRef<str>> FromIterator<S> for Texts {
    fn from_iter<I: IntoIterator<Item = S>>(texts: I) -> Self {
        let mut own = Self::default();
        for (row, text) in texts.into_iter().enumerate() {
            own.set(row, text.as_ref());
        }
        own
    }
}

/// Column of repeated texts: row indices into a list of distinct texts.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Names<'a> {
    /// Index of the text of each row.
    pub indices: Sparse<'a, i32>,
    /// Distinct texts, in the order of their first use.
    pub names: Vec<String>,
    known: HashMap<String, i32>,
}

impl<'a> Names<'a> {
    /// Creates the column from indices and distinct texts.
    pub fn of(indices: Sparse<'a, i32>, names: Vec<String>) -> Self {
        Self { indices, names, known: HashMap::new() }
    }

    fn set(&mut self, row: usize, name: &str) -> Result<bool, Stopped> {
        let index = match self.known.get(name) {
            Some(&index) => index,
            None => {
                let index = self.names.len() as i32;
                self.names.push(name.to_owned());
                self.known.insert(name.to_owned(), index);
                index
            }
        };
        self.indices.set(row, index)
    }
}

/// Column of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Column<'a> {
    /// Column of [`Kind::Text`].
    Texts(Texts),
    /// Column of [`Kind::Name`].
    Names(Names<'a>),
    /// Column of [`Kind::Code`].
    Codes(Sparse<'a, i8>),
    /// Column of [`Kind::Truth`].
    Truths(Sparse<'a, bool>),
    /// Column of [`Kind::Number`].
    Numbers(Sparse<'a, f64>),
    /// Column of [`Kind::Covariance`].
    Covariances(Sparse<'a, [f64; 6]>),
    /// Column of [`Kind::Index`].
    Indices(Sparse<'a, i32>),
    /// No column: the field is stored in [`Rest`].
    Kept,
}

impl Column<'_> {
    /// Creates an empty column.
    pub fn empty(kind: Kind) -> Self {
        match kind {
            Kind::Text => Self::Texts(Texts::default()),
            Kind::Name => Self::Names(Names::default()),
            Kind::Code(_) => Self::Codes(Sparse::default()),
            Kind::Truth => Self::Truths(Sparse::default()),
            Kind::Number(_) => Self::Numbers(Sparse::default()),
            Kind::Covariance => Self::Covariances(Sparse::default()),
            Kind::Index => Self::Indices(Sparse::default()),
            Kind::Kept | Kind::Log => Self::Kept,
        }
    }

    /// Returns whether a row has a value.
    pub fn has(&self, row: usize) -> bool {
        match self {
            Self::Texts(own) => own.ends.len() > row,
            Self::Names(own) => !own.indices.get(row).is_absent(),
            Self::Codes(own) => !own.get(row).is_absent(),
            Self::Truths(own) => !own.get(row).is_absent(),
            Self::Numbers(own) => !own.get(row).is_absent(),
            Self::Covariances(own) => !own.get(row).is_absent(),
            Self::Indices(own) => !own.get(row).is_absent(),
            Self::Kept => false,
        }
    }

    /// Sets the value of the last row; returns whether the row had a value. Cells of another kind are ignored.
    pub(super) fn set(&mut self, row: usize, cell: Cell<'_>) -> Result<bool, Stopped> {
        match (self, cell) {
            (Self::Texts(own), Cell::Text(text)) => Ok(own.set(row, text)),
            (Self::Names(own), Cell::Text(text)) => own.set(row, text),
            (Self::Codes(own), Cell::Code(code)) => own.set(row, code),
            (Self::Truths(own), Cell::Truth(truth)) => own.set(row, truth),
            (Self::Numbers(own), Cell::Number(number)) => own.set(row, number),
            (Self::Covariances(own), Cell::Covariance(values)) => own.set(row, values),
            (Self::Indices(own), Cell::Index(index)) => own.set(row, index),
            _ => Ok(false),
        }
    }

    /// Checks that the column has at most `rows` values, all valid for its field.
    fn agrees(&self, field: &Field, rows: usize) -> bool {
        let fits = |length: usize| length <= rows;
        match (self, field.kind) {
            (Self::Texts(own), _) => own.ends.len() == rows,
            (Self::Names(own), _) => {
                let all = own.names.len() as i64;
                own.indices.0.len() == rows
                    && own.indices.0.iter().all(|&index| (0..all).contains(&index.into()))
            }
            (Self::Codes(own), Kind::Code(words)) => {
                fits(own.0.len()) && own.0.iter().all(|&code| i64::from(code) < words.len() as i64)
            }
            (Self::Truths(own), _) => fits(own.0.len()),
            (Self::Numbers(own), _) => fits(own.0.len()),
            (Self::Covariances(own), _) => fits(own.0.len()),
            (Self::Indices(own), _) => fits(own.0.len()),
            (Self::Kept, _) => true,
            (Self::Codes(_), _) => false,
        }
    }
}

/// Value to be stored in a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell<'a> {
    Text(&'a str),
    Code(i8),
    Truth(bool),
    Number(f64),
    Covariance([f64; 6]),
    Index(i32),
}

/// Fields without a column: their messages as bytes, per row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rest<'a> {
    /// Bytes of all rows.
    pub bytes: Cow<'a, [u8]>,
    /// Start of the bytes of each row, and end of the last row.
    pub starts: Cow<'a, [i64]>,
}

impl Default for Rest<'_> {
    fn default() -> Self {
        Self { bytes: Cow::Owned(vec![]), starts: Cow::Owned(vec![0]) }
    }
}

impl Rest<'_> {
    /// Returns the bytes of a row.
    pub fn row(&self, row: usize) -> &[u8] {
        &self.bytes[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    pub(super) fn keep(&mut self, raw: &[u8]) -> Result<(), Stopped> {
        let own = self.bytes.to_mut();
        reserve(own, raw.len())?;
        own.extend_from_slice(raw);
        Ok(())
    }
}

/// Table of points or of measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<'a> {
    /// Fields of the table, required ones first.
    pub fields: &'static [Field],
    /// One column per field.
    pub columns: Vec<Column<'a>>,
    /// Fields without a column.
    pub rest: Rest<'a>,
    /// Number of rows.
    pub rows: usize,
}

/// Number of required fields: identifier and type.
const REQUIRED: usize = 2;

impl<'a> Table<'a> {
    fn empty(fields: &'static [Field]) -> Self {
        let columns = fields.iter().map(|field| Column::empty(field.kind)).collect();
        Self { fields, columns, rest: Rest::default(), rows: 0 }
    }

    /// Ends the current row.
    pub(super) fn end_row(&mut self) -> Result<(), Reason> {
        let missing = (0..REQUIRED).find(|&slot| !self.columns[slot].has(self.rows));
        if let Some(slot) = missing {
            return Err(Reason::Missing(self.fields[slot].key));
        }
        self.rest.starts.to_mut().push(self.rest.bytes.len() as i64);
        self.rows += 1;
        Ok(())
    }

    /// Returns the column index of a message field.
    pub(super) fn slot_of_number(&self, number: u64) -> Option<usize> {
        self.fields.iter().position(|field| u64::from(field.number) == number)
    }

    fn agrees(&self) -> bool {
        let starts = &self.rest.starts;
        let inside = starts.first() == Some(&0)
            && starts.is_sorted()
            && starts.last().is_some_and(|&last| last as usize <= self.rest.bytes.len());
        inside
            && starts.len() == self.rows + 1
            && self.columns.iter().zip(self.fields).all(|(column, field)| column.agrees(field, self.rows))
            && (0..REQUIRED).all(|slot| (0..self.rows).all(|row| self.columns[slot].has(row)))
    }
}

/// Points of a network with their measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Points<'a> {
    /// Points.
    pub points: Table<'a>,
    /// Measures, grouped by point.
    pub measures: Table<'a>,
    /// Index of the first measure of each point, and the number of measures.
    pub firsts: Cow<'a, [i64]>,
}

impl Default for Points<'_> {
    fn default() -> Self {
        Self { points: Table::empty(POINT), measures: Table::empty(MEASURES), firsts: Cow::Owned(vec![0]) }
    }
}

impl Points<'_> {
    /// Ends the current point.
    pub(super) fn end_point(&mut self) -> Result<(), Reason> {
        let first = self.firsts.last().map_or(0, |&first| first as usize);
        self.check_reference(self.points.rows, self.measures.rows - first)?;
        self.points.end_row()?;
        self.firsts.to_mut().push(self.measures.rows as i64);
        Ok(())
    }

    fn check_reference(&self, point: usize, measures: usize) -> Result<(), Reason> {
        match self.reference(point) {
            Some(reference) if reference as usize >= measures => {
                Err(Reason::Reference { reference, measures })
            }
            _ => Ok(()),
        }
    }

    /// Returns the index of the reference measure among the measures of a point.
    pub fn reference(&self, point: usize) -> Option<i32> {
        self.points.columns.iter().find_map(|column| match column {
            Column::Indices(own) => Some(own.get(point)).filter(|index| !index.is_absent()),
            _ => None,
        })
    }

    /// Returns the range of the measures of a point.
    pub fn measures_of(&self, point: usize) -> std::ops::Range<usize> {
        self.firsts[point] as usize..self.firsts[point + 1] as usize
    }

    /// Checks the consistency of all columns before writing.
    pub(super) fn check(&self) -> Result<(), Reason> {
        let firsts = &self.firsts;
        let sound = firsts.first() == Some(&0)
            && firsts.is_sorted()
            && firsts.last() == Some(&(self.measures.rows as i64))
            && firsts.len() == self.points.rows + 1;
        match (sound, self.points.agrees(), self.measures.agrees()) {
            (false, ..) => Err(Reason::Columns("the first measures of points")),
            (_, false, _) => Err(Reason::Columns("those of points")),
            (.., false) => Err(Reason::Columns("those of measures")),
            _ => (0..self.points.rows)
                .try_for_each(|point| self.check_reference(point, self.measures_of(point).len())),
        }
    }
}
