//! Systematic film deformations: weighted sums of given functions of the position.
//!
//! Readings of a scanner or comparator as functions of the film position.

use smallvec::SmallVec;

use crate::geometry::camera::inverse::{inverted, times};
use crate::geometry::camera::{Ebner12, Matrix2, OrthogonalSet};
use crate::geometry::correction::{CorrectedPosition, Correction, LINEAR, Linear, PARAMETERS};

/// Functions of a deformation, dimensionless: weights are lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// `w1 x y/h^2` in x and `w2 (x^2 - y^2)/h^2` in y; h is half the format.
    Quadratic {
        /// h.
        half: f64,
    },
    /// Corrections of Ebner (1976) without the linear e1 and e2, as functions of `x/h` and `y/h`.
    Ebner {
        /// h.
        half: f64,
    },
    /// Displacements of grid nodes, bilinear inside the cells; edge cells extrapolate beyond the grid.
    Grid(Grid),
}

/// Nodes of a grid, row by row. Weights are the displacements in x and y, node by node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Position of the first node.
    pub first: [f64; 2],
    /// Distance between nodes along x and y.
    pub spacing: [f64; 2],
    /// Number of columns and rows, at least 2.
    pub nodes: [usize; 2],
}

/// Function that is nonzero in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Function {
    /// Index of its weight among the [`Pattern::pairs`] of the cell.
    pub weight: usize,
    /// Axis of the displacement, x or y.
    pub axis: usize,
    /// Value of the function.
    pub value: f64,
    /// Derivatives with respect to the position.
    pub slope: [f64; 2],
}

/// Functions that are nonzero in a cell.
pub type Functions = SmallVec<[Function; 20]>;

/// D at a position, and its partials with respect to the position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deformation {
    /// D, mm.
    pub shift: [f64; 2],
    /// dD/dq.
    pub by_place: Matrix2,
}

impl Deformation {
    /// Returns the weighted sum of functions.
    pub fn new(functions: &[Function], weight: impl Fn(usize) -> f64) -> Self {
        let mut all = Self::default();
        for own in functions {
            let weight = weight(own.weight);
            all.shift[own.axis] += weight * own.value;
            (0..2).for_each(|k| all.by_place[own.axis][k] += weight * own.slope[k]);
        }
        all
    }
}

impl Pattern {
    /// Returns the number of weights.
    pub fn count(&self) -> usize {
        match self {
            Self::Quadratic { .. } => 2,
            Self::Ebner { .. } => 10,
            Self::Grid(grid) => 2 * grid.nodes[0] * grid.nodes[1],
        }
    }

    /// Returns the cell of a position: 0 for patterns without a grid.
    pub fn cell(&self, place: [f64; 2]) -> usize {
        match self {
            Self::Quadratic { .. } | Self::Ebner { .. } => 0,
            Self::Grid(grid) => grid.cell(place),
        }
    }

    /// Returns the pairs of weights that are active in a cell: weights 2k and 2k + 1 are pair k.
    pub fn pairs(&self, cell: usize) -> SmallVec<[usize; 5]> {
        match self {
            Self::Quadratic { .. } | Self::Ebner { .. } => (0..self.count() / 2).collect(),
            Self::Grid(grid) => grid.corners(cell).into_iter().collect(),
        }
    }

    /// Returns the functions of a cell at a position.
    pub fn at(&self, cell: usize, place: [f64; 2]) -> Functions {
        match *self {
            Self::Quadratic { half } => quadratic(half, place).into_iter().collect(),
            Self::Ebner { half } => ebner(half, place),
            Self::Grid(grid) => grid.at(cell, place),
        }
    }
}

fn quadratic(half: f64, [x, y]: [f64; 2]) -> [Function; 2] {
    let square = half * half;
    [
        Function { weight: 0, axis: 0, value: x * y / square, slope: [y / square, x / square] },
        Function {
            weight: 1,
            axis: 1,
            value: (x * x - y * y) / square,
            slope: [2.0 * x / square, -2.0 * y / square],
        },
    ]
}

fn ebner(half: f64, place: [f64; 2]) -> Functions {
    /// Number of linear terms, e1 and e2.
    const LINEAR: usize = 2;
    let [of_x, of_y] = place.map(|value| Ebner12::basis(value / half, 1.0));
    let nonlinear = Ebner12::TERMS.iter().filter(|term| term.0 >= LINEAR);
    let function = |&(parameter, axis, number, i, j): &(usize, usize, f64, usize, usize)| {
        let ((p, by_p), (q, by_q)) = (of_y[i], of_x[j]);
        let slope = [p * by_q, by_p * q].map(|by| number * by / half);
        Function { weight: parameter - LINEAR, axis, value: number * p * q, slope }
    };
    nonlinear.map(function).collect()
}

impl Grid {
    /// Returns the cell of a position; cells are numbered by their first corners.
    fn cell(&self, place: [f64; 2]) -> usize {
        let along = |k: usize| {
            let from_first = (place[k] - self.first[k]) / self.spacing[k];
            from_first.floor().clamp(0.0, self.nodes[k] as f64 - 2.0) as usize
        };
        along(1) * self.nodes[0] + along(0)
    }

    fn corners(&self, cell: usize) -> [usize; 4] {
        [cell, cell + 1, cell + self.nodes[0], cell + self.nodes[0] + 1]
    }

    fn at(&self, cell: usize, place: [f64; 2]) -> Functions {
        let corner = [cell % self.nodes[0], cell / self.nodes[0]];
        let along = |k: usize| (place[k] - self.first[k]) / self.spacing[k] - corner[k] as f64;
        let sides = |k: usize| {
            let (u, rate) = (along(k), 1.0 / self.spacing[k]);
            [(1.0 - u, -rate), (u, rate)]
        };
        let ([left, right], [low, high]) = (sides(0), sides(1));
        let corners = [(left, low), (right, low), (left, high), (right, high)];
        let shifts = corners.into_iter().enumerate().flat_map(|(k, ((of_x, by_x), (of_y, by_y)))| {
            let (value, slope) = (of_x * of_y, [by_x * of_y, of_x * by_y]);
            [0, 1].map(|axis| Function { weight: 2 * k + axis, axis, value, slope })
        });
        shifts.collect()
    }
}

/// Scanner with the correction of its readings.
///
/// ```text
/// (X, Y) = (x - o1, y - o2) pitch, or (x - o1, o2 - y) pitch where rows count down,    true = correction(X, Y)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanner {
    correction: Correction,
    /// Linear part of the correction.
    linear: Linear,
    /// Whether the polynomials may be nonzero.
    curved: bool,
    /// o1, o2.
    origin: [f64; 2],
    /// Reading units per mm along each axis.
    units: [f64; 2],
}

/// Reading with its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Scanned {
    /// Column and row, or x and y.
    pub xy: [f64; 2],
    /// With respect to the corrected position.
    pub by_place: Matrix2,
    /// With respect to the parameters of the correction.
    pub by_parameters: [[f64; PARAMETERS]; 2],
}

impl Scanner {
    /// Returns a scanner with `pitch` mm per unit of readings; `down`: whether the second coordinate increases downwards. The correction
    /// applies to readings in mm from the origin, y up. Its polynomials are used only if it is `curved`.
    pub fn new((correction, curved): (Correction, bool), pitch: f64, origin: [f64; 2], down: bool) -> Self {
        let units = [1.0 / pitch, if down { -1.0 } else { 1.0 } / pitch];
        Self { correction, linear: correction.linear(), curved, origin, units }
    }

    /// Returns the reading units per mm, without sign.
    pub fn scale(&self) -> f64 {
        self.units[0]
    }

    /// Returns the corrected position of a reading.
    pub fn place(&self, xy: [f64; 2]) -> [f64; 2] {
        let counted = [0, 1].map(|k| (xy[k] - self.origin[k]) / self.units[k]);
        if self.curved { self.correction.place(counted) } else { times(&self.linear.matrix, counted) }
    }

    /// Returns the reading of a corrected position; None if the correction is not invertible there.
    pub fn read(&self, place: [f64; 2]) -> Option<Scanned> {
        let mut by_parameters = [[0.0; PARAMETERS]; 2];
        let (reading, back, count) = if self.curved {
            let reading = self.correction.reading(place)?;
            let CorrectedPosition { by_reading, by_parameters: by, .. } = self.correction.linearize(reading);
            by_parameters = by;
            (reading, inverted(by_reading), PARAMETERS)
        } else {
            let reading = times(&self.linear.back, place);
            let by = self.linear.by_parameters(reading);
            (0..2).for_each(|row| (0..LINEAR).for_each(|k| by_parameters[row][k] = by[k][row]));
            (reading, self.linear.back, LINEAR)
        };
        let by_place = [0, 1].map(|row| back[row].map(|value| self.units[row] * value));
        // g(reading; parameters) = position is constant, so d reading = -(dg/d reading)^-1 dg/d parameter.
        for k in 0..count {
            let moved = times(&by_place, [by_parameters[0][k], by_parameters[1][k]]);
            (0..2).for_each(|row| by_parameters[row][k] = -moved[row]);
        }
        let xy = [0, 1].map(|k| self.origin[k] + self.units[k] * reading[k]);
        Some(Scanned { xy, by_place, by_parameters })
    }
}
