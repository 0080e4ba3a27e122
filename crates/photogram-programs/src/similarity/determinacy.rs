//! Determinacy of the seven parameters by the control, and causes of a deficiency.

use nalgebra::DMatrix;

use super::Station;
use super::error::{Cause, SimilarityError};
use super::model::{CHANGES, SCALE};
use super::moments::EIGEN_STEPS;
use super::transform::Similarity;
use photocore::geometry::{Matrix3, Vector3};

/// Relative effect on the known components, compared with the best determined combination of parameters, below which a combination is
/// undetermined.
const UNDETERMINED: f64 = 1e-6;
/// Ratio of width to length below which stations are collinear.
const IN_LINE: f64 = 1e-5;
/// Ratio of width to length below which stations are nearly collinear.
const NEARLY_IN_LINE: f64 = 1e-2;

/// Checks the number of known components: at least seven, of which four are horizontal (both X and Y among them) and three are elevations.
/// These are two horizontal pairs (TB 19, section 6), but each coordinate counts separately. A fixed scale replaces one horizontal
/// coordinate.
pub fn check_counts(stations: &[Station], held: bool) -> Result<(), SimilarityError> {
    let known = std::array::from_fn(|k| stations.iter().filter(|station| station.known()[k]).count());
    let [x, y, z] = known;
    if x + y + usize::from(held) < 4 || x == 0 || y == 0 || z < 3 {
        return Err(SimilarityError::Insufficient { known });
    }
    Ok(())
}

/// Checks for combinations of parameters that do not change the known components.
pub fn check_geometry(
    stations: &[Station],
    similarity: &Similarity,
    held: bool,
) -> Result<(), SimilarityError> {
    if condition(stations, similarity, held) * UNDETERMINED < 1.0 {
        return Ok(());
    }
    let all = || (Cause::Singular, (0..stations.len()).collect());
    let (cause, stations) = shape(stations, similarity, IN_LINE).unwrap_or_else(all);
    Err(SimilarityError::Undetermined { cause, stations })
}

/// Returns the cause of a weak but sufficient control geometry, and the stations concerned.
pub fn weakness(stations: &[Station], similarity: &Similarity) -> Option<(Cause, Vec<usize>)> {
    shape(stations, similarity, NEARLY_IN_LINE)
}

/// Returns the cause and the stations if stations coincide or are collinear: width at most `tolerance` times length.
fn shape(stations: &[Station], similarity: &Similarity, tolerance: f64) -> Option<(Cause, Vec<usize>)> {
    let chosen = |of: &dyn Fn(&Station) -> bool| -> Vec<usize> {
        (0..stations.len()).filter(|&i| of(&stations[i])).collect()
    };
    let plan = |list: &[usize]| -> Vec<Vector3> {
        let position = |&i: &usize| similarity.control_at(&stations[i].model);
        list.iter().map(position).map(|at| Vector3::new(at.x, at.y, 0.0)).collect()
    };
    // Coincident positions are collinear by this test.
    let in_line = |positions: &[Vector3]| {
        let [length, width, _] = extents(positions);
        width <= tolerance * length
    };
    let horizontal = chosen(&|station| station.known()[0] || station.known()[1]);
    let elevated = chosen(&|station| station.elevation());
    let all = chosen(&|station| station.known() != [false; 3]);
    let space: Vec<Vector3> = all.iter().map(|&i| stations[i].model).collect();
    if extents(&plan(&horizontal))[0] <= tolerance * extents(&plan(&all))[0] {
        Some((Cause::Coincident, horizontal))
    } else if in_line(&space) {
        Some((Cause::StationsInLine, all))
    } else if in_line(&plan(&elevated)) {
        Some((Cause::ElevationsInLine, elevated))
    } else {
        None
    }
}

/// Returns the condition number of the linearized misclosures; infinite for a singular matrix. Rotations are in radians, the scale is
/// relative, translations are fractions of the size of the model.
pub fn condition(stations: &[Station], similarity: &Similarity, held: bool) -> f64 {
    let size = spread(stations);
    let unit = [1.0, 1.0, 1.0, if held { 0.0 } else { similarity.scale }, size, size, size];
    let mut normal = [[0.0; 7]; 7];
    for station in stations {
        let partials = similarity.misclosure_partials(&station.control, &station.model);
        for (partial, _) in partials.iter().zip(station.known()).filter(|(_, known)| *known) {
            let row: [f64; 7] = std::array::from_fn(|i| partial[i] * unit[i] / size);
            for i in 0..7 {
                (0..7).for_each(|j| normal[i][j] += row[i] * row[j]);
            }
        }
    }
    if held {
        // The mean of the other eigenvalues changes neither the least nor the largest.
        normal[SCALE][SCALE] = (0..CHANGES).map(|i| normal[i][i]).sum::<f64>() / (CHANGES - 1) as f64;
    }
    let values = eigenvalues(&normal);
    let (least, most) = (values[0].max(0.0), values[6]);
    (most / least).sqrt()
}

/// Returns the root mean square distance of the stations from their centre, in model units.
pub fn spread(stations: &[Station]) -> f64 {
    let positions: Vec<Vector3> = stations.iter().map(|station| station.model).collect();
    extents(&positions).iter().map(|extent| extent * extent).sum::<f64>().sqrt()
}

/// Returns the mean of the values of a function; zero without values.
pub fn known_mean(stations: &[Station], value: impl Fn(&Station) -> Option<f64>) -> f64 {
    let values: Vec<f64> = stations.iter().filter_map(value).collect();
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Returns the root mean square extents of positions along their principal axes, the largest first.
fn extents(positions: &[Vector3]) -> [f64; 3] {
    let count = positions.len().max(1) as f64;
    let mean = positions.iter().sum::<Vector3>() / count;
    let moments: Matrix3 = positions.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let values = eigenvalues(&(moments / count).data.0);
    std::array::from_fn(|k| values[2 - k].max(0.0).sqrt())
}

/// Returns the eigenvalues of a symmetric matrix, ascending; NaN if it is not finite.
fn eigenvalues<const N: usize>(matrix: &[[f64; N]; N]) -> [f64; N] {
    // The number of steps is limited: squares of large numbers overflow, and the iteration would not converge.
    let matrix = DMatrix::from_row_slice(N, N, matrix.as_flattened());
    let Some(eigen) = matrix.try_symmetric_eigen(f64::EPSILON, EIGEN_STEPS) else { return [f64::NAN; N] };
    let mut values: [f64; N] = std::array::from_fn(|i| eigen.eigenvalues[i]);
    values.sort_unstable_by(f64::total_cmp);
    values
}
