//! Where the adjustment of a block has ended, and the datum that it was taken to.

use photocore::network::{InnerConstraints, NetworkDatum, State};
use pyo3::prelude::*;

use crate::options::{named_ordering, unknown};

/// What a datum is: its name, points, photos, and whether scale counts.
pub type DatumRow = (String, Vec<usize>, Vec<usize>, bool);

/// The datum of a row.
pub fn datum_of((name, points, photos, scale): DatumRow) -> PyResult<NetworkDatum> {
    Ok(match (name.as_str(), photos.first()) {
        ("inner", _) => NetworkDatum::Inner(InnerConstraints { points, photos, scale }),
        ("relative", Some(&photo)) => NetworkDatum::RelativeToPhoto(photo),
        ("relative", None) => NetworkDatum::RelativeToPoints(points),
        (other, _) => return Err(unknown("datum", other)),
    })
}

fn row_of(datum: &NetworkDatum) -> DatumRow {
    let (name, points, photos, scale) = match datum {
        NetworkDatum::Inner(inner) => ("inner", inner.points.clone(), inner.photos.clone(), inner.scale),
        NetworkDatum::RelativeToPhoto(photo) => ("relative", vec![], vec![*photo], false),
        NetworkDatum::RelativeToPoints(points) => ("relative", points.clone(), vec![], false),
    };
    (name.to_owned(), points, photos, scale)
}

/// Adjusted unknowns, those held, points and photos left out, ordering, datum.
type StateRow = (Vec<f64>, Vec<usize>, Vec<usize>, Vec<usize>, String, Option<DatumRow>);

/// Where an adjustment has ended.
#[pyclass(frozen, module = "photogram._photocore")]
pub struct BlockState {
    pub state: State,
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
    ) -> PyResult<Self> {
        let (ordering, datum) = (named_ordering(ordering)?, datum.map(datum_of).transpose()?);
        Ok(Self { state: State { unknowns, held, collapsed, loose, ordering, datum } })
    }

    /// So that results are copied and sent to other processes.
    fn __getnewargs__(&self) -> StateRow {
        let State { unknowns, held, collapsed, loose, ordering, datum } = self.state.clone();
        (unknowns, held, collapsed, loose, ordering.name().to_owned(), datum.as_ref().map(row_of))
    }
}
