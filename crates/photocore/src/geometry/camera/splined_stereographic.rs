//! Splined stereographic camera of mrcal: a stereographic camera with image displacements by B-splines on a grid of knots.

use std::sync::Arc;

use super::inverse::{Matrix2, inverted, times};
use super::model::{CameraModel, Image, NODES, Patch, Unit, Window, parameters};
use super::projections::{RayProjection, Stereographic};
use crate::geometry::Vector3;

/// Maximum number of knots per axis.
const MOST: f64 = 10_000.0;
/// Maximum number of Newton steps; maximum step length; relative step length that ends the iteration (convergence is quadratic).
const STEPS: usize = 100;
const LONGEST: f64 = 0.3;
const LAST: f64 = 1e-8;

/// Stereographic camera with displacements d by uniform B-splines of order 3 or 2.
///
/// ```text
/// (X, Y, Z) = (u1, -u2, -u3),   n = |(X, Y, Z)|,   v = 2 (X, Y) / (n + Z)
/// s = (nx - 1 - m) / (4 tan(fov / 4)), m = 2 (order 3), 1 (order 2),   (i, j) = s v + ((nx - 1) / 2, (ny - 1) / 2)
/// d = sum B_b(j) B_a(i) knot(a, b),   image = (fx (v1 + d1) + cx, fy (v2 + d2) + cy)
/// ```
///
/// Image coordinates are pixels, column and row. order, nx, ny and fov (degrees) are always fixed. Knots are listed row by row, columns
/// fastest; they are zero unless set by [`CameraModel::with_knots`]. The polynomials at the edge extrapolate beyond the knots.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct SplinedStereographic {
    /// fx, fy, cx, cy, order, nx, ny, fov.
    parameters: [f64; 8],
    knots: Arc<[[f64; 2]]>,
    grid: SplineGrid,
}

/// Layout of the knots.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SplineGrid {
    /// Number of nodes per axis that affect a position; 0 for invalid constants.
    nodes: usize,
    /// Number of knots along columns and rows.
    size: [usize; 2],
    /// s, the reciprocal of the knot spacing.
    per_place: f64,
}

/// Nonzero spline values at a position along an axis, their slopes, and the first knot.
struct SplineBasis {
    first: usize,
    values: [f64; NODES],
    slopes: [f64; NODES],
}

impl SplineBasis {
    /// Evaluates the basis at a position in units of knots, of which there are `count`; the edge polynomials extrapolate.
    #[inline]
    fn at(place: f64, count: usize, nodes: usize) -> Self {
        if nodes == NODES {
            let first = (place as usize).clamp(1, count - 3);
            let x = place - first as f64;
            let (rest, square) = (1.0 - x, x * x);
            let values = [
                rest * rest * rest,
                (3.0 * x - 6.0) * square + 4.0,
                ((3.0 - 3.0 * x) * x + 3.0) * x + 1.0,
                square * x,
            ];
            let slopes = [-rest * rest, (3.0 * x - 4.0) * x, (2.0 - 3.0 * x) * x + 1.0, square];
            Self { first: first - 1, values: values.map(|v| v / 6.0), slopes: slopes.map(|v| 0.5 * v) }
        } else {
            let middle = ((place + 0.5) as usize).clamp(1, count - 2);
            let x = place - middle as f64;
            let (low, high) = (2.0 * x - 1.0, 2.0 * x + 1.0);
            let values = [0.125 * low * low, 0.75 - x * x, 0.125 * high * high, 0.0];
            Self { first: middle - 1, values, slopes: [0.5 * low, -2.0 * x, 0.5 * high, 0.0] }
        }
    }
}

impl SplineGrid {
    const NONE: Self = Self { nodes: 0, size: [0; 2], per_place: f64::NAN };

    /// Returns the grid of the constants; [`SplineGrid::NONE`] if the constants are invalid.
    fn of([order, nx, ny, fov]: [f64; 4]) -> Self {
        let whole = |count: f64| count.fract() == 0.0 && count > order && count <= MOST;
        if (order != 3.0 && order != 2.0) || !whole(nx) || !whole(ny) || !(fov > 0.0 && fov < 360.0) {
            return Self::NONE;
        }
        let per_place = (nx - order) / (4.0 * (0.25 * fov.to_radians()).tan());
        Self { nodes: order as usize + 1, size: [nx as usize, ny as usize], per_place }
    }

    /// Returns the splines along columns and rows at a position of the stereographic image.
    #[inline]
    fn bases(&self, place: [f64; 2]) -> [SplineBasis; 2] {
        [0, 1].map(|k| {
            let at = self.per_place * place[k] + 0.5 * (self.size[k] as f64 - 1.0);
            SplineBasis::at(at, self.size[k], self.nodes)
        })
    }
}

impl SplinedStereographic {
    /// Returns a position of the stereographic image with its displacement, and the partials of the sum.
    #[inline]
    fn moved(&self, place: [f64; 2]) -> ([f64; 2], Matrix2) {
        let SplineGrid { nodes, size, per_place } = self.grid;
        if nodes == 0 {
            return ([f64::NAN; 2], [[f64::NAN; 2]; 2]);
        }
        let [x, y] = self.grid.bases(place);
        let (mut at, mut by) = (place, [[1.0, 0.0], [0.0, 1.0]]);
        for b in 0..nodes {
            let row = &self.knots[(y.first + b) * size[0] + x.first..][..nodes];
            for (a, knot) in row.iter().enumerate() {
                let weight = x.values[a] * y.values[b];
                let slopes = [x.slopes[a] * y.values[b], x.values[a] * y.slopes[b]];
                for k in 0..2 {
                    at[k] += weight * knot[k];
                    by[k][0] += per_place * slopes[0] * knot[k];
                    by[k][1] += per_place * slopes[1] * knot[k];
                }
            }
        }
        (at, by)
    }

    /// Returns the stereographic image of u, with its partials with respect to the ray in vision axes.
    #[inline]
    fn seen(u: &Vector3) -> ([f64; 2], [[f64; 3]; 2]) {
        let seen = Stereographic::project([u.x, -u.y, -u.z], [0.0; 2]);
        (seen.ab, seen.by_ray)
    }

    /// Returns the knots that affect images within `margin` knot spacings of the image of u; None for invalid constants.
    pub fn window(&self, u: &Vector3, margin: f64) -> Option<Window> {
        let SplineGrid { nodes, per_place, .. } = self.grid;
        if nodes == 0 {
            return None;
        }
        let (place, _) = Self::seen(u);
        let at = |off: f64| self.grid.bases(place.map(|own| own + off / per_place)).map(|own| own.first);
        Some(Window { first: at(-margin), end: at(margin).map(|first| first + nodes) })
    }

    /// Returns the number of knots per row.
    pub fn columns(&self) -> usize {
        self.grid.size[0]
    }

    /// Returns the position of the stereographic image whose displaced position is `target`.
    fn unmoved(&self, target: [f64; 2]) -> Option<[f64; 2]> {
        let mut place = target;
        for _ in 0..STEPS {
            let (at, by) = self.moved(place);
            let step = times(&inverted(by), [target[0] - at[0], target[1] - at[1]]);
            let length = step[0].hypot(step[1]);
            let part = if length > LONGEST { LONGEST / length } else { 1.0 };
            place = [place[0] + part * step[0], place[1] + part * step[1]];
            if length <= LAST * (1.0 + place[0].hypot(place[1])) {
                let [[a, b], [c, d]] = by;
                return (a * d > b * c).then_some(place);
            }
        }
        None
    }
}

impl CameraModel for SplinedStereographic {
    type Parameters = [f64; 8];

    const NAME: &'static str = "splined_stereographic";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "fx" "fy" "cx" "cy"; Unit::One => "order" "nx" "ny" "fov_x_deg";
    };
    const CONSTANTS: usize = 4;
    const DOWN: bool = true;
    const FORMULA: &'static str = "(a, b) = 2 (P1, -P2) / (|P| - P3), s = (nx - order) / (4 tan(fov_x_deg / 4)), (i, j) = s (a, b) + \
         ((nx - 1) / 2, (ny - 1) / 2), (dx, dy) = sum over knots of B(i) B(j) (dx, dy), B uniform B-splines of the order, image = \
         (fx (a + dx) + cx, fy (b + dy) + cy)";

    fn with_parameters(parameters: [f64; 8]) -> Self {
        let [.., order, nx, ny, fov] = parameters;
        let grid = SplineGrid::of([order, nx, ny, fov]);
        Self { parameters, knots: vec![[0.0; 2]; grid.size[0] * grid.size[1]].into(), grid }
    }

    fn parameters(&self) -> [f64; 8] {
        self.parameters
    }

    /// The knots are retained if the constants are unchanged.
    fn with_others(&self, parameters: [f64; 8]) -> Self {
        if parameters[4..] == self.parameters[4..] {
            return Self { parameters, knots: self.knots.clone(), grid: self.grid };
        }
        Self::with_parameters(parameters)
    }

    fn knots(&self) -> Option<&[[f64; 2]]> {
        Some(&self.knots)
    }

    fn with_knots(&self, knots: Arc<[[f64; 2]]>) -> Option<Self> {
        (knots.len() == self.knots.len()).then(|| Self { knots, ..self.clone() })
    }

    /// None for invalid constants.
    #[inline]
    fn patch(&self, u: &Vector3) -> Option<Patch> {
        let nodes = self.grid.nodes;
        if nodes == 0 {
            return None;
        }
        let (place, _) = Self::seen(u);
        let [x, y] = self.grid.bases(place);
        let mut weights = [0.0; NODES * NODES];
        for (k, weight) in weights[..nodes * nodes].iter_mut().enumerate() {
            *weight = x.values[k % nodes] * y.values[k / nodes];
        }
        Some(Patch { first: [x.first, y.first], nodes, weights })
    }

    fn scale(&self) -> f64 {
        self.parameters[0].abs()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        let [fx, fy, cx, cy, ..] = self.parameters;
        let (place, _) = Self::seen(u);
        let ([a, b], _) = self.moved(place);
        [fx * a + cx, fy * b + cy]
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; 8]> {
        let [fx, fy, cx, cy, ..] = self.parameters;
        let (place, by_ray) = Self::seen(u);
        let ([a, b], by_place) = self.moved(place);
        let by = |row: usize, k: usize| by_place[row][0] * by_ray[0][k] + by_place[row][1] * by_ray[1][k];
        let by_u = [(0, fx), (1, fy)].map(|(row, f)| Vector3::new(by(row, 0), -by(row, 1), -by(row, 2)) * f);
        let mut by_parameters = [[0.0; 8]; 2];
        (by_parameters[0][0], by_parameters[0][2]) = (a, 1.0);
        (by_parameters[1][1], by_parameters[1][3]) = (b, 1.0);
        Image { xy: [fx * a + cx, fy * b + cy], by_u, by_parameters }
    }

    /// None if the displacements fold the image, or Newton's method does not converge.
    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let [fx, fy, cx, cy, ..] = self.parameters;
        let place = self.unmoved([(x - cx) / fx, (y - cy) / fy])?;
        let [x, y, z] = Stereographic::ray(place, [0.0; 2])?;
        Some(Vector3::new(x, -y, -z).normalize())
    }

    fn faces(&self, u: &Vector3) -> bool {
        let ray = [u.x, -u.y, -u.z];
        Stereographic::faces(ray, [0.0; 2])
    }
}
