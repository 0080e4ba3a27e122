//! Whether the control determines the seven parameters, and if not, why.

use nalgebra::DMatrix;

use super::Station;
use super::error::{Cause, SimilarityError};
use super::model::{CHANGES, SCALE};
use super::moments::EIGEN_STEPS;
use super::transform::Similarity;
use crate::geometry::{Matrix3, Vector3};

/// A combination of parameters is not determined when a change of it moves the stations, in the known components, by less than this
/// fraction of what the best determined one does.
const UNDETERMINED: f64 = 1e-6;
/// Stations are in line when they are off it by less than this fraction of its length.
const IN_LINE: f64 = 1e-5;
/// And nearly so with this fraction.
const NEARLY_IN_LINE: f64 = 1e-2;

/// Counts known components: seven at least, of these four horizontal (both X and Y among them) and three elevations. That is two
/// horizontal pairs where they come in pairs (TB 19, section 6), but each coordinate counts by itself. A scale that is held takes the
/// place of one horizontal coordinate.
pub fn check_counts(stations: &[Station], held: bool) -> Result<(), SimilarityError> {
    let known = std::array::from_fn(|k| stations.iter().filter(|station| station.known()[k]).count());
    let [x, y, z] = known;
    if x + y + usize::from(held) < 4 || x == 0 || y == 0 || z < 3 {
        return Err(SimilarityError::Insufficient { known });
    }
    Ok(())
}

/// Looks for combinations of parameters that leave all known components where they are.
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

/// What makes control weak that still determines the orientation, and the stations concerned.
pub fn weakness(stations: &[Station], similarity: &Similarity) -> Option<(Cause, Vec<usize>)> {
    shape(stations, similarity, NEARLY_IN_LINE)
}

/// Whether stations coincide or are in line, off it by less than a fraction of its length.
fn shape(stations: &[Station], similarity: &Similarity, tolerance: f64) -> Option<(Cause, Vec<usize>)> {
    let chosen = |of: &dyn Fn(&Station) -> bool| -> Vec<usize> {
        (0..stations.len()).filter(|&i| of(&stations[i])).collect()
    };
    let plan = |list: &[usize]| -> Vec<Vector3> {
        let position = |&i: &usize| similarity.control_at(&stations[i].model);
        list.iter().map(position).map(|at| Vector3::new(at.x, at.y, 0.0)).collect()
    };
    // Written so that coincident positions are in line.
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

/// The condition number of the linearized misclosures: rotations in radians, the scale relative, translations as fractions of the size
/// of the model; infinite where they are singular.
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

/// Root mean square distance of the stations from their centre, in model units.
pub fn spread(stations: &[Station]) -> f64 {
    let positions: Vec<Vector3> = stations.iter().map(|station| station.model).collect();
    extents(&positions).iter().map(|extent| extent * extent).sum::<f64>().sqrt()
}

/// Mean of the values that a function gives; zero when it gives none.
pub fn known_mean(stations: &[Station], value: impl Fn(&Station) -> Option<f64>) -> f64 {
    let values: Vec<f64> = stations.iter().filter_map(value).collect();
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Root mean square extents of some positions along their principal axes, the largest first.
fn extents(positions: &[Vector3]) -> [f64; 3] {
    let count = positions.len().max(1) as f64;
    let mean = positions.iter().sum::<Vector3>() / count;
    let moments: Matrix3 = positions.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let values = eigenvalues(&(moments / count).data.0);
    std::array::from_fn(|k| values[2 - k].max(0.0).sqrt())
}

/// Eigenvalues of a symmetric matrix, ascending; NaN when it is not finite.
fn eigenvalues<const N: usize>(matrix: &[[f64; N]; N]) -> [f64; N] {
    // Steps are limited: squares of large numbers overflow, and nothing would come to rest.
    let matrix = DMatrix::from_row_slice(N, N, matrix.as_flattened());
    let Some(eigen) = matrix.try_symmetric_eigen(f64::EPSILON, EIGEN_STEPS) else { return [f64::NAN; N] };
    let mut values: [f64; N] = std::array::from_fn(|i| eigen.eigenvalues[i]);
    values.sort_unstable_by(f64::total_cmp);
    values
}
