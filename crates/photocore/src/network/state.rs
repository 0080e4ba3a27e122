//! Where an adjustment of a network has ended, and what its coordinates refer to.

use crate::normals::Ordering;

/// Where an adjustment of a network has ended: all that is needed to come back to it.
#[derive(Debug, Clone)]
pub struct State {
    /// The adjusted unknowns, in the order of the adjustment.
    pub unknowns: Vec<f64>,
    /// Those of them that were held for a datum.
    pub held: Vec<usize>,
    /// Points that were left out because they ran into a station, or their rays do not determine them, ascending.
    pub collapsed: Vec<usize>,
    /// Photos that were left out because their images do not determine them, ascending.
    pub loose: Vec<usize>,
    /// The ordering in force.
    pub ordering: Ordering,
    /// The datum that it was taken to since; None for that of what was held, or of the observations.
    pub datum: Option<NetworkDatum>,
    /// Whether control and weights of poses, which were exactly what a datum takes, were given up for it.
    pub released: bool,
}

/// What coordinates and their cofactors refer to.
#[derive(Debug, Clone)]
pub enum NetworkDatum {
    /// Chosen points and photos are, together, as near to their given places as they come: of networks that are free.
    Inner(InnerConstraints),
    /// Cofactors are relative to a photo (of one on a frame: to the frame), as if its pose were held where it has been adjusted to. Nothing is moved, scale stays as it is
    /// given or held, and the network need not be free.
    RelativeToPhoto(usize),
    /// The same with points, whose mean position and orientation count.
    RelativeToPoints(Vec<usize>),
}

/// Inner constraints: the datum in which chosen points and photos, taken together, are as near as they come to their given places
/// (where a point has none, to where it started from).
#[derive(Debug, Clone, Default)]
pub struct InnerConstraints {
    /// Indices of points.
    pub points: Vec<usize>,
    /// Indices of photos, whose positions count.
    pub photos: Vec<usize>,
    /// Indices of photos, whose attitudes count: a turn of one about its own axes, times `radius`.
    pub attitudes: Vec<usize>,
    /// What makes turns comparable with shifts; None for the root mean square distance of all points and photos from their middle.
    pub radius: Option<f64>,
    /// Whether scale is taken from them, too; otherwise it stays as it is held.
    pub scale: bool,
}
