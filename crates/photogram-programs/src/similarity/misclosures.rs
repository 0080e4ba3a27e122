//! Statistics of the misclosures u = s X - A^T (x - B) of the known components: cofactors of the parameters, redundancy numbers and
//! test values.
//!
//! A-priori misclosures of a station have the cofactors Q_m = s^2 Q_X + A^T Q_x A. With their partials J, the parameters have the cofactors
//! Q = (sum J^T Q_m^-1 J)^-1, and the adjusted misclosures Q_u = Q_m - J Q J^T.
//!
//! Standard deviations are rescaled for the adjustment, with a lower limit against rounding of the misclosures.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

use super::model::SCALE;
use super::start::Chosen;
use super::transform::{Matrix7, Similarity, propagate};
use super::{SimilarityError, Station, determinacy};
use photocore::geometry::rotation::solve;
use photocore::geometry::{Matrix3, Vector3};

/// Redundancy number below which a test value is rounding noise.
const CHECKED: f64 = 1e-9;

/// Returns the cofactors of the tangent parameters (see [`Similarity`]), zero for a fixed scale; None if they are not determined.
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

/// Returns the redundancy numbers, the diagonal of Q_u Q_m^-1, and standardized misclosures u / root of the diagonal of Q_u (Baarda's w) of
/// a station. NaN if unknown, and for misclosures without redundancy.
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

/// Returns Q_m; unknown components have unit cofactors without correlation.
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

/// Returns the partials of the misclosures; zero for unknown components.
fn known_partials(station: &Station, similarity: &Similarity) -> [[f64; 7]; 3] {
    let partials = similarity.misclosure_partials(&station.control, &station.model);
    let known = station.known();
    std::array::from_fn(|j| if known[j] { partials[j] } else { [0.0; 7] })
}

/// Returns Q_m^-1 J.
fn weighted(before: &Matrix3, partials: &[[f64; 7]; 3]) -> Option<[[f64; 7]; 3]> {
    let mut result = [[0.0; 7]; 3];
    for i in 0..7 {
        let column = solve(before, &Vector3::from_fn(|k, _| partials[k][i]), 0.0)?;
        (0..3).for_each(|k| result[k][i] = column[k]);
    }
    Some(result)
}

/// Size of the internal standard deviations, as a fraction of the size of the model: an upper limit of the median for the model, and a
/// lower limit for all. The convergence criterion remains valid for an arbitrary unit weight, and for standard deviations far below the
/// rounding of the coordinates.
const INNER_SD: f64 = 1e-7;
/// Standard deviation of an exact model point, as a fraction of the smallest positive standard deviation of its control. The cofactors of
/// the misclosures change by 1e-8, and the normal equations retain half of their digits.
const EXACT: f64 = 1e-4;

/// Stations with standard deviations multiplied by `inner`.
#[derive(Debug)]
pub struct Weighted {
    /// Stations.
    pub stations: Vec<Station>,
    /// Factor of all standard deviations.
    pub inner: f64,
}

impl Weighted {
    /// Scales the standard deviations of the stations; very small standard deviations of the model are increased.
    ///
    /// # Errors
    /// Standard deviations that do not define a unit weight.
    pub fn new(stations: &[Station], start: &Chosen) -> Result<Self, SimilarityError> {
        let scale = start.similarity.scale;
        let misclosures = median(stations.iter().flat_map(|s| misclosure_sd(s, scale)));
        let model_sd = |station: &Station| {
            let control = positive_control_sd(station).fold(f64::INFINITY, f64::min) * scale;
            let least = EXACT * if control.is_finite() { control } else { misclosures };
            station.model_sd.map(|sd| sd.max(least))
        };
        let unit = INNER_SD * determinacy::spread(stations);
        let inner = (unit / median(stations.iter().flat_map(model_sd))).min((unit / misclosures).max(1.0));
        if !(inner.is_finite() && inner > 0.0) {
            return Err(SimilarityError::NotFinite);
        }
        let scaled = |station: &Station| Station {
            control_sd: station.control_sd.map(|sd| inner * sd),
            model_sd: model_sd(station).map(|sd| inner * sd),
            ..*station
        };
        Ok(Self { stations: stations.iter().map(scaled).collect(), inner })
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the standard deviations of the known components that are neither exact nor infinite.
fn positive_control_sd(station: &Station) -> impl Iterator<Item = f64> {
    let known = station.known();
    let sd = station.control_sd;
    (0..3).filter(move |&k| known[k] && sd[k] > 0.0).map(move |k| sd[k])
}

/// Returns approximate standard deviations of the misclosures of the known components, for any rotation.
fn misclosure_sd(station: &Station, scale: f64) -> impl Iterator<Item = f64> {
    let known = station.known();
    let [x, y, z] = station.model_sd;
    let model = x.hypot(y).hypot(z) / 3.0_f64.sqrt();
    let sd = station.control_sd;
    (0..3).filter(move |&k| known[k]).map(move |k| model.hypot(scale * sd[k]))
}
