//! Points that harm what hangs on them: on rays that are nearly parallel, or much nearer to a station than all others.

use super::median::median;
use super::model::Bundle;
use super::selection::TOGETHER;
use super::{AdjustedPoint, Network};
use crate::geometry::{self, Matrix3};
use crate::parallel;

/// The largest standard deviation of a point over its smallest, from which on its rays are nearly parallel.
const RATIO: f64 = 1e4;
/// The distance of a point from a station, in the median of all, below which it is at the station's own place.
const NEAR: f64 = 1e-3;

/// A point that is hardly determined, or makes others so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeakPoint {
    /// Index of the point.
    pub point: usize,
    /// The largest standard deviation over the smallest, in any directions; infinite where rounding has taken the smallest, NaN where
    /// there are no cofactors.
    pub ratio: f64,
    /// Its distance from the nearest station that sees it, in the median of these distances.
    pub distance: f64,
}

impl Network {
    /// The points that are worse than they should be; `squares` are the squares of their distances from the nearest station.
    pub(super) fn weak_points(
        &self,
        model: &Bundle,
        points: &[usize],
        adjusted: &[Option<AdjustedPoint>],
        squares: &[f64],
    ) -> Vec<WeakPoint> {
        let middle = median(squares.to_vec()).unwrap_or(f64::NAN).sqrt();
        let weak = |i: usize| {
            let (point, square) = (points[i], squares[i]);
            let adjusted = adjusted[point].as_ref()?;
            let free = model.points[i].held() == [false; 3];
            let near = square < (NEAR * middle).powi(2);
            let cofactors = if free { self.cartesian_cofactors(adjusted) } else { Matrix3::identity() };
            (near || is_flat(&cofactors)).then(|| WeakPoint {
                point,
                ratio: if free { ratio(&cofactors) } else { 1.0 },
                distance: square.sqrt() / middle,
            })
        };
        parallel::by_parts(points.len(), TOGETHER, &|some| some.filter_map(&weak).collect())
    }

    /// The cofactors of a point in the length unit, whatever its coordinates are.
    fn cartesian_cofactors(&self, point: &AdjustedPoint) -> Matrix3 {
        let own = point.cofactors;
        if self.space == geometry::ObjectSpace::Rectangular {
            return own;
        }
        let by = geometry::Point::new(self.space, point.coordinates).partials();
        by * own * by.transpose()
    }
}

/// Whether the ratio may be too large: with the trace t and the determinant d of a positive matrix, largest over smallest eigenvalue is no
/// more than t^3 / 4 d.
fn is_flat(cofactors: &Matrix3) -> bool {
    let bound = 4.0 * RATIO * RATIO * cofactors.determinant();
    let cube = cofactors.trace().powi(3);
    // Written so that cofactors that are not there are none.
    cube > bound && ratio(cofactors) > RATIO
}

/// The largest standard deviation over the smallest.
fn ratio(cofactors: &Matrix3) -> f64 {
    if !cofactors.iter().all(|value| value.is_finite()) {
        return f64::NAN;
    }
    let eigenvalues = cofactors.symmetric_eigenvalues();
    let (smallest, largest) = (eigenvalues.min(), eigenvalues.max());
    // The smallest of a matrix is known to its largest's rounding.
    if smallest > f64::EPSILON * largest { (largest / smallest).sqrt() } else { f64::INFINITY }
}
