//! Final state of a block adjustment, and its datum.

use std::sync::{Arc, Mutex};

use photocore::network::{Converged, InnerConstraints, Joint, NetworkDatum, State};
use pyo3::prelude::*;

use crate::adjustment::{named_ordering, unknown};
use crate::arrays::{Matrix, matrix};

/// Datum: name, points, photos, whether scale is constrained, photos with constrained attitudes, radius that converts them to lengths.
pub type DatumRow = (String, Vec<usize>, Vec<usize>, bool, Vec<usize>, Option<f64>);

/// Converts a row to a datum.
pub fn datum_of((name, points, photos, scale, attitudes, radius): DatumRow) -> PyResult<NetworkDatum> {
    Ok(match (name.as_str(), photos.first()) {
        ("inner", _) => NetworkDatum::Inner(InnerConstraints { points, photos, attitudes, radius, scale }),
        ("relative", Some(&photo)) => NetworkDatum::RelativeToPhoto(photo),
        ("relative", None) => NetworkDatum::RelativeToPoints(points),
        (other, _) => return Err(unknown("datum", other)),
    })
}

fn row_of(datum: &NetworkDatum) -> DatumRow {
    let (name, inner) = match datum {
        NetworkDatum::Inner(inner) => ("inner", inner.clone()),
        NetworkDatum::RelativeToPhoto(photo) => {
            ("relative", InnerConstraints { photos: vec![*photo], ..Default::default() })
        }
        NetworkDatum::RelativeToPoints(points) => {
            ("relative", InnerConstraints { points: points.clone(), ..Default::default() })
        }
    };
    let InnerConstraints { points, photos, attitudes, radius, scale } = inner;
    (name.to_owned(), points, photos, scale, attitudes, radius)
}

/// Adjusted unknowns, fixed unknowns, excluded points and photos, ordering, datum, whether control was released for it.
type StateRow = (Vec<f64>, Vec<usize>, Vec<usize>, Vec<usize>, String, Option<DatumRow>, bool);

/// Converged network, which uses the memory of the adjustment; the first query takes ownership.
pub type Kept = Arc<Mutex<Option<Box<Converged>>>>;

/// Final state of an adjustment.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockState {
    pub state: State,
    pub kept: Kept,
    /// None for copies and unpickled states.
    pub joint: Option<Arc<Joint>>,
}

impl BlockState {
    /// Removes and returns the converged network at the first call; None for copies and unpickled states.
    pub fn take_kept(&self) -> Option<Box<Converged>> {
        self.kept.lock().ok().and_then(|mut kept| kept.take())
    }
}

#[pymethods]
impl BlockState {
    #[new]
    fn new(
        unknowns: Vec<f64>,
        held: Vec<usize>,
        collapsed: Vec<usize>,
        undetermined_photos: Vec<usize>,
        ordering: &str,
        datum: Option<DatumRow>,
        released: bool,
    ) -> PyResult<Self> {
        let (ordering, datum) = (named_ordering(ordering)?, datum.map(datum_of).transpose()?);
        let state = State { unknowns, held, collapsed, undetermined_photos, ordering, datum, released };
        Ok(Self { state, kept: Kept::default(), joint: None })
    }

    fn joint<'py>(&self, py: Python<'py>, points: Vec<usize>) -> PyResult<Option<Matrix<'py>>> {
        let joint = self.joint.as_ref().filter(|joint| joint.points == points);
        joint.map(|joint| matrix(py, joint.cofactors.clone(), true)).transpose()
    }

    /// Pickling support for copies and for other processes.
    fn __getnewargs__(&self) -> StateRow {
        let State { unknowns, held, collapsed, undetermined_photos, ordering, datum, released } =
            self.state.clone();
        let datum = datum.as_ref().map(row_of);
        (unknowns, held, collapsed, undetermined_photos, ordering.name().to_owned(), datum, released)
    }
}
