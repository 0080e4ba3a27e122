//! Numbers and tables as text; the documentation is in `_photocore.pyi`.

use std::convert::Infallible;
use std::io::{self, Write};

use crate::arrays::Vector;
use numpy::{PyArray1, PyReadonlyArray1};
use photogram_files::delimited::{self, Table};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;
use pyo3::types::PyBytes;
use rayon::prelude::*;

use crate::work::{Workers, supervised};

#[pyfunction]
pub fn read_numbers<'py>(py: Python<'py>, text: &[u8]) -> (Vector<'py>, bool) {
    let number =
        |word: &[u8]| str::from_utf8(word).ok()?.parse().ok().filter(|value: &f64| value.is_finite());
    let (numbers, whole): (Vec<f64>, bool) = py.detach(|| {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut numbers = Vec::new();
        let bad = words.find(|word| number(word).map(|value| numbers.push(value)).is_none());
        (numbers, bad.is_none())
    });
    (PyArray1::from_vec(py, numbers), whole)
}

/// Length of a short line in bytes.
const LINE: usize = 16;

#[pyclass]
pub struct TableReader {
    table: Option<Table>,
}

#[pymethods]
impl TableReader {
    #[new]
    fn new(delimiter: u8, numeric: Vec<bool>) -> Self {
        Self { table: Some(Table::new(delimiter, &numeric)) }
    }

    fn add(&mut self, py: Python<'_>, lines: &[u8]) -> PyResult<bool> {
        let mut table = self.table.take();
        let Ok(table) = supervised(py, Workers::reading(lines.len() / LINE), None, |context| {
            let regular =
                context.threads.install(|| table.as_mut().and_then(|table| table.add(lines))).is_some();
            Ok::<_, Infallible>(table.filter(|_| regular))
        })?;
        self.table = table;
        Ok(self.table.is_some())
    }

    fn columns<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let columns = self.table.take().map(Table::columns).unwrap_or_default();
        columns
            .into_iter()
            .map(|column| match column {
                delimited::Column::Numbers(numbers) => Ok(PyArray1::from_vec(py, numbers).into_any()),
                delimited::Column::Names(names) => {
                    let (distinct, text) = (names.are_distinct(), PyBytes::new(py, &names.text));
                    (text, PyArray1::from_vec(py, names.rows), distinct).into_bound_py_any(py)
                }
            })
            .collect()
    }
}

/// Number of rows that a thread writes in one task.
const STRETCH: usize = 8192;

/// Column of a table.
pub enum Column {
    Floats(Vec<f64>),
    Integers(Vec<i64>),
    Truths(Vec<bool>),
    Texts(Vec<Option<PyBackedStr>>),
}

impl<'py> FromPyObject<'_, 'py> for Column {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(floats) = object.extract::<PyReadonlyArray1<'_, f64>>() {
            return Ok(Self::Floats(floats.as_array().to_vec()));
        }
        if let Ok(integers) = object.extract::<PyReadonlyArray1<'_, i64>>() {
            return Ok(Self::Integers(integers.as_array().to_vec()));
        }
        if let Ok(truths) = object.extract::<PyReadonlyArray1<'_, bool>>() {
            return Ok(Self::Truths(truths.as_array().to_vec()));
        }
        Ok(Self::Texts(object.extract()?))
    }
}

impl Column {
    fn len(&self) -> usize {
        match self {
            Self::Floats(column) => column.len(),
            Self::Integers(column) => column.len(),
            Self::Truths(column) => column.len(),
            Self::Texts(column) => column.len(),
        }
    }

    fn write(&self, row: usize, to: &mut Vec<u8>) {
        // Writing to memory cannot fail.
        let _ = match self {
            Self::Floats(column) if column[row].is_nan() => Ok(()),
            Self::Floats(column) => to.write_all(zmij::Buffer::new().format(column[row]).as_bytes()),
            Self::Integers(column) => write!(to, "{}", column[row]),
            Self::Truths(column) => write!(to, "{}", column[row]),
            Self::Texts(column) => column[row].as_deref().map_or(Ok(()), |text| write_text(text, to)),
        };
    }
}

/// Writes a text, quoted if it contains a possible delimiter, quote or comment character.
fn write_text(text: &str, to: &mut Vec<u8>) -> io::Result<()> {
    if !text.contains([',', ';', '"', '|', '\t', '#', '\n']) && text == text.trim() {
        return to.write_all(text.as_bytes());
    }
    write!(to, "\"{}\"", text.replace('\n', " ").replace('"', "\"\""))
}

#[pyfunction]
pub fn csv_rows<'py>(py: Python<'py>, head: &[u8], columns: Vec<Column>) -> PyResult<Bound<'py, PyBytes>> {
    let rows = columns.first().map_or(0, Column::len);
    if columns.iter().any(|column| column.len() != rows) {
        return Err(PyValueError::new_err("columns differ in length"));
    }
    let line = |row: usize, to: &mut Vec<u8>| {
        for (k, column) in columns.iter().enumerate() {
            if k > 0 {
                to.push(b',');
            }
            column.write(row, to);
        }
        to.push(b'\n');
    };
    let stretch = |first: usize| {
        let mut own = vec![];
        (first..rows.min(first + STRETCH)).for_each(|row| line(row, &mut own));
        own
    };
    let firsts: Vec<usize> = (0..rows).step_by(STRETCH).collect();
    let Ok(parts) = supervised(py, Workers::reading(rows), None, |context| {
        let parts = context.threads.install(|| firsts.par_iter().map(|&first| stretch(first)).collect());
        Ok::<Vec<Vec<u8>>, Infallible>(parts)
    })?;
    PyBytes::new_with(py, head.len() + parts.iter().map(Vec::len).sum::<usize>(), |to| {
        let mut at = head.len();
        to[..at].copy_from_slice(head);
        for part in parts {
            to[at..at + part.len()].copy_from_slice(&part);
            at += part.len();
        }
        Ok(())
    })
}
