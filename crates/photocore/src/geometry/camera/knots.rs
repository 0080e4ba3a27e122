//! Knots of the spline of a lens, by their numbers.

/// Nodes of a spline that a place lies between, along one axis, at the most.
pub(super) const NODES: usize = 4;

/// The knots that an image depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// The first of them, by column and row.
    pub first: [usize; 2],
    /// How many there are along columns and rows, each.
    pub nodes: usize,
    /// What each has of the displacement, row by row: d image / d knot = diag(fx, fy) times that. Zero beyond nodes^2.
    pub weights: [f64; NODES * NODES],
}

impl Patch {
    /// The knots, numbered row by row of so many columns, with their weights.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = (usize, f64)> + use<'_> {
        let ([first, row], nodes) = (self.first, self.nodes);
        let number = move |k: usize| (row + k / nodes) * columns + first + k % nodes;
        self.weights[..nodes * nodes].iter().enumerate().map(move |(k, &weight)| (number(k), weight))
    }
}

/// Knots of some columns and rows that stand together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// The first, by column and row.
    pub first: [usize; 2],
    /// One beyond the last.
    pub end: [usize; 2],
}

impl Window {
    /// Whether it has all knots of a patch.
    pub fn has(&self, patch: &Patch) -> bool {
        (0..2).all(|k| self.first[k] <= patch.first[k] && patch.first[k] + patch.nodes <= self.end[k])
    }

    /// Its knots, numbered row by row of so many columns.
    pub fn knots(&self, columns: usize) -> impl Iterator<Item = usize> + use<> {
        let Self { first, end } = *self;
        (first[1]..end[1]).flat_map(move |row| (first[0]..end[0]).map(move |column| row * columns + column))
    }
}
