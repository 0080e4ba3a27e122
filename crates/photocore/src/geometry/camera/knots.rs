//! Knot indices of a spline lens.

/// Maximum number of nodes per axis that affect a position.
pub(super) const NODES: usize = 4;

/// Knots that affect an image position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Column and row of the first knot.
    pub first: [usize; 2],
    /// Number of knots along each of columns and rows.
    pub nodes: usize,
    /// Weight of each knot, row by row: d image / d knot = diag(fx, fy) times the weight. Zero beyond nodes^2.
    pub weights: [f64; NODES * NODES],
}

impl Patch {
    /// Returns the knot indices (row by row, `columns` per row) with their weights.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        let ([first, row], nodes) = (self.first, self.nodes);
        let number = move |k: usize| (row + k / nodes) * columns + first + k % nodes;
        self.weights[..nodes * nodes].iter().enumerate().map(move |(k, &weight)| (number(k), weight))
    }
}

/// Rectangular block of knots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the first knot.
    pub first: [usize; 2],
    /// Column and row after the last knot.
    pub end: [usize; 2],
}

impl Window {
    /// Returns whether the window contains all knots of a patch.
    pub fn has(&self, patch: &Patch) -> bool {
        (0..2).all(|k| self.first[k] <= patch.first[k] && patch.first[k] + patch.nodes <= self.end[k])
    }

    /// Returns the knot indices, row by row with `columns` per row.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = usize> + use<> {
        let Self { first, end } = *self;
        (first[1]..end[1]).flat_map(move |row| (first[0]..end[0]).map(move |column| row * columns + column))
    }
}
