//! Statistics of the misclosures u = s X - A^T (x - B) of the known components: cofactors of the parameters, redundancy numbers and
//! test values.
//!
//! Before the adjustment the misclosures of a station have the cofactors Q_m = s^2 Q_X + A^T Q_x A. With J their partials, the
//! parameters have the cofactors Q = (sum J^T Q_m^-1 J)^-1, and the misclosures Q_u = Q_m - J Q J^T after the adjustment.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use super::Station;
use super::model::SCALE;
use super::transform::{Matrix7, Similarity, propagate};
use crate::geometry::cramer::solve;
use crate::geometry::{Matrix3, Vector3};

/// A redundancy number below this is what rounding leaves of zero: a test value would be noise.
const CHECKED: f64 = 1e-9;

/// Cofactors of the tangent parameters (see [`Similarity`]), zero for a scale that is held; None when they are not determined.
pub fn tangent_cofactors(stations: &[Station], similarity: &Similarity, held: bool) -> Option<Matrix7> {
    let mut normal = [[0.0; 7]; 7];
    for station in stations {
        let partials = known_partials(station, similarity);
        let weighted = weighted(&cofactors_before(station, similarity), &partials)?;
        for i in 0..7 {
            for j in 0..7 {
                normal[i][j] += (0..3).map(|k| partials[k][i] * weighted[k][j]).sum::<f64>();
            }
        }
    }
    if held {
        (0..7).for_each(|i| (normal[i][SCALE], normal[SCALE][i]) = (0.0, 0.0));
        normal[SCALE][SCALE] = 1.0;
    }
    let mut scale: [f64; 7] = std::array::from_fn(|i| normal[i][i].sqrt().recip());
    let scaled = Mat::from_fn(7, 7, |i, j| scale[i] * normal[i][j] * scale[j]);
    let inverse = scaled.llt(Side::Lower).ok()?.inverse();
    if held {
        scale[SCALE] = 0.0;
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| scale[i] * inverse[(i, j)] * scale[j])))
}

/// Redundancy numbers, the diagonal of Q_u Q_m^-1, and standardized misclosures u / root of the diagonal of Q_u (Baarda's w) of a
/// station; NaN where unknown, and where a misclosure is not checked by any other.
pub fn test(station: &Station, similarity: &Similarity, cofactors: &Matrix7) -> ([f64; 3], [f64; 3]) {
    let known = station.known();
    let before = cofactors_before(station, similarity);
    let taken = propagate(&known_partials(station, similarity), cofactors);
    let after = Matrix3::from_fn(|i, j| before[(i, j)] - taken[i][j]);
    let u = similarity.misclosure(&station.control, &station.model);
    let redundancy: [f64; 3] = std::array::from_fn(|j| {
        let unit = Vector3::ith(j, 1.0);
        let column = solve(&before, &unit, 0.0).filter(|_| known[j]);
        column.map_or(f64::NAN, |column| (after * column)[j])
    });
    let standardized =
        std::array::from_fn(|j| if redundancy[j] > CHECKED { u[j] / after[(j, j)].sqrt() } else { f64::NAN });
    (redundancy, standardized)
}

/// Q_m; unknown components stand aside with unit cofactors.
fn cofactors_before(station: &Station, similarity: &Similarity) -> Matrix3 {
    let known = station.known();
    let own = station.control_sd.map(|sd| (similarity.scale * sd).powi(2));
    let turned = similarity.rotated_variances(&station.model_sd);
    Matrix3::from_fn(|i, j| match (known[i] && known[j], i == j) {
        (true, true) => own[i] + turned[(i, i)],
        (true, false) => turned[(i, j)],
        (false, same) => f64::from(u8::from(same)),
    })
}

/// Partials of the misclosures; zero for unknown components.
fn known_partials(station: &Station, similarity: &Similarity) -> [[f64; 7]; 3] {
    let partials = similarity.misclosure_partials(&station.control, &station.model);
    let known = station.known();
    std::array::from_fn(|j| if known[j] { partials[j] } else { [0.0; 7] })
}

/// Q_m^-1 J.
fn weighted(before: &Matrix3, partials: &[[f64; 7]; 3]) -> Option<[[f64; 7]; 3]> {
    let mut result = [[0.0; 7]; 3];
    for i in 0..7 {
        let column = solve(before, &Vector3::from_fn(|k, _| partials[k][i]), 0.0)?;
        (0..3).for_each(|k| result[k][i] = column[k]);
    }
    Some(result)
}
