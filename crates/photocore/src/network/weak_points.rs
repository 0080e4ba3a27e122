//! Ill-conditioned points: on nearly parallel rays, or much nearer to a station than all others.

use super::adjusted::AdjustedPoint;
use super::input::Network;
use super::model::Bundle;
use super::neighbourhood::TOGETHER;
use crate::adjustment::median;
use crate::geometry::{self, Matrix3};
use crate::parallel;

/// Ratio of largest to smallest standard deviation of a point above which its rays count as nearly parallel.
const RATIO: f64 = 1e4;
/// Ratio of own to median station distance below which a point counts as at the station.
const NEAR: f64 = 1e-3;

/// A weakly determined point, or a point that makes others weak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeakPoint {
    /// Index of the point.
    pub point: usize,
    /// Ratio of largest to smallest standard deviation over all directions; infinite if the smallest is lost by rounding, NaN without
    /// cofactors.
    pub ratio: f64,
    /// Ratio of its distance from the nearest observing station to the median of these distances.
    pub distance: f64,
}

impl Network {
    /// Returns the weak points; `squares` contains their squared distances from the nearest station.
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

    /// Returns the Cartesian cofactors of a point in units of length.
    fn cartesian_cofactors(&self, point: &AdjustedPoint) -> Matrix3 {
        let own = point.cofactors;
        if self.space == geometry::ObjectSpace::Rectangular {
            return own;
        }
        let by = geometry::Point::new(self.space, point.coordinates).partials();
        by * own * by.transpose()
    }
}

/// Returns true if the ratio may be too large. For trace t and determinant d of a positive matrix, the ratio of largest to smallest
/// eigenvalue is at most t^3 / 4 d.
fn is_flat(cofactors: &Matrix3) -> bool {
    let bound = 4.0 * RATIO * RATIO * cofactors.determinant();
    let cube = cofactors.trace().powi(3);
    // With this comparison, undefined cofactors are not flat.
    cube > bound && ratio(cofactors) > RATIO
}

/// Returns the ratio of largest to smallest standard deviation.
fn ratio(cofactors: &Matrix3) -> f64 {
    if !cofactors.iter().all(|value| value.is_finite()) {
        return f64::NAN;
    }
    let eigenvalues = cofactors.symmetric_eigenvalues();
    let (smallest, largest) = (eigenvalues.min(), eigenvalues.max());
    // The smallest eigenvalue has the rounding error of the largest.
    if smallest > f64::EPSILON * largest { (largest / smallest).sqrt() } else { f64::INFINITY }
}
