//! Where the adjustment of a block has ended, and the datum that it was taken to.

use std::sync::{Arc, Mutex};

use photocore::network::{Converged, InnerConstraints, Joint, NetworkDatum, State};
use pyo3::prelude::*;

use crate::arrays::{Matrix, matrix};
use crate::options::{named_ordering, unknown};

/// What a datum is: its name, points, photos, whether scale counts, photos whose attitudes count, and what makes these lengths.
pub type DatumRow = (String, Vec<usize>, Vec<usize>, bool, Vec<usize>, Option<f64>);

/// The datum of a row.
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

/// Adjusted unknowns, those held, points and photos left out, ordering, datum, whether control was given up for it.
type StateRow = (Vec<f64>, Vec<usize>, Vec<usize>, Vec<usize>, String, Option<DatumRow>, bool);

/// A network where its adjustment has converged, until the first that asks takes it: its memory is that of the adjustment.
pub type Kept = Arc<Mutex<Option<Box<Converged>>>>;

/// Where an adjustment has ended.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockState {
    pub state: State,
    pub kept: Kept,
    /// None of copies and of what was read.
    pub joint: Option<Arc<Joint>>,
}

impl BlockState {
    /// What the adjustment has kept, the first time; none of copies and of what was read.
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
        loose: Vec<usize>,
        ordering: &str,
        datum: Option<DatumRow>,
        released: bool,
    ) -> PyResult<Self> {
        let (ordering, datum) = (named_ordering(ordering)?, datum.map(datum_of).transpose()?);
        let state = State { unknowns, held, collapsed, loose, ordering, datum, released };
        Ok(Self { state, kept: Kept::default(), joint: None })
    }

    fn joint<'py>(&self, py: Python<'py>, points: Vec<usize>) -> PyResult<Option<Matrix<'py>>> {
        let joint = self.joint.as_ref().filter(|joint| joint.points == points);
        joint.map(|joint| matrix(py, joint.cofactors.clone(), true)).transpose()
    }

    /// So that results are copied and sent to other processes.
    fn __getnewargs__(&self) -> StateRow {
        let State { unknowns, held, collapsed, loose, ordering, datum, released } = self.state.clone();
        let datum = datum.as_ref().map(row_of);
        (unknowns, held, collapsed, loose, ordering.name().to_owned(), datum, released)
    }
}
