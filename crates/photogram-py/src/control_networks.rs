//! Control networks of ISIS as columns; the documentation is in `_photocore.pyi`.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use photocore::Stopped;
use photogram_files::control_network::fields::{Field, Kind, MEASURES, POINT};
use photogram_files::control_network::{
    Column, Fault, Framing, Header, Names, Place, Points, Reason, Rest, Sparse, Table, Texts, decoded,
    encoded, read_text, text,
};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;
use pyo3::types::{PyBytes, PyDict};

use crate::memory;
use crate::work::{Workers, supervised};

/// Header of a file: texts, number of points, lengths of messages, radii, unknown fields.
type HeaderRow<'py> = ([Option<String>; 6], Option<u64>, Vec<u64>, Vec<f64>, Bound<'py, PyBytes>);
/// Columns of points and of measures by name, first measures.
type PointsRow<'py> = (Bound<'py, PyDict>, Bound<'py, PyDict>, Bound<'py, PyArray1<i64>>);

#[pyfunction]
pub fn control_header<'py>(
    py: Python<'py>,
    data: &[u8],
    start: usize,
    stop: usize,
    file: &Bound<'py, PyAny>,
) -> PyResult<HeaderRow<'py>> {
    let Header { texts, points, lengths, radii, rest } =
        Header::decoded(data, start..stop).map_err(|fault| raised(&fault, file))?;
    Ok((texts, points, lengths, radii, PyBytes::new(py, &rest)))
}

#[pyfunction]
pub fn control_header_message<'py>(
    py: Python<'py>,
    texts: [Option<String>; 6],
    points: u64,
    radii: Vec<f64>,
    rest: &[u8],
) -> Bound<'py, PyBytes> {
    let header = Header { texts, points: Some(points), lengths: vec![], radii, rest: rest.to_vec() };
    PyBytes::new(py, &header.encoded())
}

#[pyfunction]
pub fn control_points<'py>(
    py: Python<'py>,
    data: &[u8],
    start: usize,
    stop: usize,
    lengths: Option<Vec<u64>>,
    file: &Bound<'py, PyAny>,
) -> PyResult<PointsRow<'py>> {
    let framing = lengths.as_deref().map_or(Framing::Lengths, Framing::Listed);
    let read = supervised(py, Workers::CALLER, None, |context| decoded(data, start..stop, framing, context))?;
    row(py, read.map_err(|fault| raised(&fault, file))?)
}

#[pyfunction]
pub fn control_points_of_text<'py>(
    py: Python<'py>,
    data: &[u8],
    file: &Bound<'py, PyAny>,
) -> PyResult<(PointsRow<'py>, String)> {
    let read = supervised(py, Workers::CALLER, None, |context| read_text(data, context))?;
    let (points, around) = read.map_err(|fault| raised(&fault, file))?;
    Ok((row(py, points)?, around))
}

#[pyfunction]
pub fn control_point_messages<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyDict>,
    measures: &Bound<'py, PyDict>,
    firsts: PyReadonlyArray1<'py, i64>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (points, measures) = (Held::table(points, POINT)?, Held::table(measures, MEASURES)?);
    let all = all(&points, &measures, firsts.as_slice()?)?;
    let written = supervised(py, Workers::CALLER, None, |context| encoded(&all, context))?;
    Ok(PyBytes::new(py, &written.map_err(|fault| raised(&fault, py.None().bind(py)))?))
}

#[pyfunction]
pub fn control_point_text<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyDict>,
    measures: &Bound<'py, PyDict>,
    firsts: PyReadonlyArray1<'py, i64>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (points, measures) = (Held::table(points, POINT)?, Held::table(measures, MEASURES)?);
    let all = all(&points, &measures, firsts.as_slice()?)?;
    let written = supervised(py, Workers::CALLER, None, |context| text(&all, context))?;
    Ok(PyBytes::new(py, written.map_err(|fault| raised(&fault, py.None().bind(py)))?.as_bytes()))
}

/// Converts a fault to an exception with its file and the number of its point or line.
fn raised(fault: &Fault, file: &Bound<'_, PyAny>) -> PyErr {
    if let Reason::Stopped(stopped @ Stopped::OutOfMemory(_)) = &fault.reason {
        return memory::exhausted(&stopped.to_string());
    }
    let point = fault.point.map_or_else(String::new, |point| format!("point {point} "));
    let (record, message) = match fault.place {
        Place::Byte(byte) => (fault.point, format!("{} (byte {byte})", fault.reason)),
        Place::Line(line) => (Some(line), format!("{point}{}", fault.reason)),
        Place::Row => (None, format!("{point}{}", fault.reason)),
    };
    let error = || {
        let py = file.py();
        let places = PyDict::new(py);
        places.set_item("file", file)?;
        places.set_item("record", record)?;
        py.import("photogram.errors")?.getattr("InputError")?.call((message,), Some(&places))
    };
    error().map_or_else(|error| error, PyErr::from_value)
}

fn row<'py>(py: Python<'py>, all: Points<'static>) -> PyResult<PointsRow<'py>> {
    let Points { points, measures, firsts } = all;
    Ok((columns(py, points)?, columns(py, measures)?, PyArray1::from_vec(py, firsts.into_owned())))
}

/// Returns nonempty columns by name, and fields without a column as `rest`.
fn columns<'py>(py: Python<'py>, table: Table<'static>) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    let rows = table.rows;
    for (field, column) in table.fields.iter().zip(table.columns) {
        match column {
            Column::Texts(own) => all.set_item(field.name, own.iter().collect::<Vec<_>>())?,
            Column::Names(Names { indices, names, .. }) => {
                let indices = PyArray1::from_vec(py, indices.whole(rows).unwrap_or_default());
                all.set_item(field.name, (indices, names))?;
            }
            Column::Codes(own) => put(&all, field, own.whole(rows).map(|own| PyArray1::from_vec(py, own)))?,
            Column::Truths(own) => put(&all, field, own.whole(rows).map(|own| PyArray1::from_vec(py, own)))?,
            Column::Numbers(own) => {
                put(&all, field, own.whole(rows).map(|own| PyArray1::from_vec(py, own)))?;
            }
            Column::Indices(own) => {
                put(&all, field, own.whole(rows).map(|own| PyArray1::from_vec(py, own)))?;
            }
            Column::Covariances(own) => {
                let flat = own.whole(rows).map(|own| PyArray1::from_vec(py, own.into_flattened()));
                put(&all, field, flat.map(|flat| flat.reshape([rows, 6])).transpose()?)?;
            }
            Column::Kept => {}
        }
    }
    let Rest { bytes, starts } = table.rest;
    let starts = PyArray1::from_vec(py, starts.into_owned());
    all.set_item("rest", (PyArray1::from_vec(py, bytes.into_owned()), starts))?;
    Ok(all)
}

fn put<'py>(all: &Bound<'py, PyDict>, field: &Field, column: Option<impl IntoPyObject<'py>>) -> PyResult<()> {
    column.map_or(Ok(()), |column| all.set_item(field.name, column))
}

/// Column owned by Python; arrays are not copied.
enum Held<'py> {
    Texts(Texts),
    Names(PyReadonlyArray1<'py, i32>, Vec<String>),
    Codes(PyReadonlyArray1<'py, i8>),
    Truths(PyReadonlyArray1<'py, bool>),
    Numbers(PyReadonlyArray1<'py, f64>),
    Covariances(PyReadonlyArray2<'py, f64>),
    Indices(PyReadonlyArray1<'py, i32>),
    Empty(Kind),
}

/// Columns of a table owned by Python, and fields without a column.
struct HeldTable<'py> {
    fields: &'static [Field],
    columns: Vec<Held<'py>>,
    rest: (PyReadonlyArray1<'py, u8>, PyReadonlyArray1<'py, i64>),
}

impl<'py> Held<'py> {
    fn table(all: &Bound<'py, PyDict>, fields: &'static [Field]) -> PyResult<HeldTable<'py>> {
        let rest = all.as_any().get_item("rest")?.extract()?;
        let columns = fields.iter().map(|field| match all.get_item(field.name)? {
            Some(column) => Self::of(field.kind, &column),
            None => Ok(Self::Empty(field.kind)),
        });
        Ok(HeldTable { fields, columns: columns.collect::<PyResult<_>>()?, rest })
    }

    fn of(kind: Kind, column: &Bound<'py, PyAny>) -> PyResult<Self> {
        Ok(match kind {
            Kind::Text => Self::Texts(column.extract::<Vec<PyBackedStr>>()?.into_iter().collect()),
            Kind::Name => {
                let (indices, names) = column.extract()?;
                Self::Names(indices, names)
            }
            Kind::Code(_) => Self::Codes(column.extract()?),
            Kind::Truth => Self::Truths(column.extract()?),
            Kind::Number(_) => Self::Numbers(column.extract()?),
            Kind::Covariance => Self::Covariances(column.extract()?),
            Kind::Index => Self::Indices(column.extract()?),
            Kind::Kept | Kind::Log => Self::Empty(kind),
        })
    }

    fn column(&self) -> PyResult<Column<'_>> {
        Ok(match self {
            Self::Texts(own) => Column::Texts(own.clone()),
            Self::Names(indices, names) => {
                Column::Names(Names::of(Sparse(indices.as_slice()?.into()), names.clone()))
            }
            Self::Codes(own) => Column::Codes(Sparse(own.as_slice()?.into())),
            Self::Truths(own) => Column::Truths(Sparse(own.as_slice()?.into())),
            Self::Numbers(own) => Column::Numbers(Sparse(own.as_slice()?.into())),
            Self::Covariances(own) => Column::Covariances(Sparse(own.as_slice()?.as_chunks().0.into())),
            Self::Indices(own) => Column::Indices(Sparse(own.as_slice()?.into())),
            Self::Empty(kind) => Column::empty(*kind),
        })
    }
}

fn table<'a>(held: &'a HeldTable<'_>) -> PyResult<Table<'a>> {
    let columns = held.columns.iter().map(Held::column).collect::<PyResult<_>>()?;
    let (bytes, starts) = (held.rest.0.as_slice()?, held.rest.1.as_slice()?);
    let rest = Rest { bytes: bytes.into(), starts: starts.into() };
    Ok(Table { fields: held.fields, columns, rest, rows: starts.len().saturating_sub(1) })
}

fn all<'a>(
    points: &'a HeldTable<'_>,
    measures: &'a HeldTable<'_>,
    firsts: &'a [i64],
) -> PyResult<Points<'a>> {
    Ok(Points { points: table(points)?, measures: table(measures)?, firsts: firsts.into() })
}
