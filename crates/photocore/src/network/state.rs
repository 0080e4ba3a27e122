//! Final state of an adjustment, and the datum of its coordinates.

use crate::normals::Ordering;

/// Final state of an adjustment, sufficient to restore it.
#[derive(Debug, Clone)]
pub struct State {
    /// Adjusted parameters, in the order of the adjustment.
    pub unknowns: Vec<f64>,
    /// Indices of the parameters that were fixed as a minimal datum.
    pub held: Vec<usize>,
    /// Points excluded because they ran into a station or their rays do not determine them, ascending.
    pub collapsed: Vec<usize>,
    /// Photos excluded because their images do not determine them, ascending.
    pub loose: Vec<usize>,
    /// Elimination order.
    pub ordering: Ordering,
    /// Datum of a later transformation; None for the minimal datum or the datum of the observations.
    pub datum: Option<NetworkDatum>,
    /// Whether minimal control and weights of poses were removed for this datum.
    pub released: bool,
}

/// Datum of coordinates and their cofactors.
#[derive(Debug, Clone)]
pub enum NetworkDatum {
    /// Inner constraints of chosen points and photos in free networks.
    Inner(InnerConstraints),
    /// Cofactors relative to a photo (or its rig frame), as if its adjusted pose were fixed. Values and scale are unchanged, and the
    /// network need not be free.
    RelativeToPhoto(usize),
    /// Cofactors relative to the mean position and orientation of points.
    RelativeToPoints(Vec<usize>),
}

/// Inner constraints: the datum with the least sum of squared distances of chosen points and photos from their given positions (or else
/// their initial positions).
#[derive(Debug, Clone, Default)]
pub struct InnerConstraints {
    /// Indices of points.
    pub points: Vec<usize>,
    /// Indices of photos with constrained positions.
    pub photos: Vec<usize>,
    /// Indices of photos with constrained attitudes: rotations about their own axes, times `radius`.
    pub attitudes: Vec<usize>,
    /// Length that converts rotations to displacements; None for the root mean square distance of all points and photos from their centre.
    pub radius: Option<f64>,
    /// Whether they also define the scale; otherwise the scale remains unchanged.
    pub scale: bool,
}
