//! The cycle of TB 19: linearize, accumulate normal equations, solve by Gauss-Crout, correct the angles; sections 2 to 4.
//!
//! Corrected where the bulletin's program is at fault: angles are kept and not their sines, missing coordinates are known to be
//! missing, and there is a limit of cycles.

use super::crout::gauss_crout;
use super::determinacy::Cause;
use super::transform::Similarity;
use super::{Method, Options, SimilarityError, Station};
use crate::geometry::vector::{apply, apply_transposed};
use crate::geometry::{Matrix3, Vector3, rotation, rotation_with_partials};

/// The cycles end when all three corrections of angles are at most this, in radians.
const ANGLE: f64 = 1e-5;

/// Where the cycles ended.
#[derive(Debug)]
pub struct Cycles {
    pub similarity: Similarity,
    /// Largest correction of an angle in each cycle, radians.
    pub corrections: Vec<f64>,
    pub converged: bool,
}

/// Carries out the cycles from given initial values.
pub fn iterate(
    stations: &[Station],
    options: &Options,
    start: &Similarity,
) -> Result<Cycles, SimilarityError> {
    let mut angles = start.angles();
    let mut similarity = *start;
    let mut corrections = Vec::new();
    while corrections.len() < options.max_iterations {
        let mut normal = [[0.0; 8]; 7];
        let (_, partials) = rotation_with_partials(angles);
        for station in stations {
            let rows = match options.method {
                Method::FillIn => bulletin_rows(&similarity, &partials, station),
                Method::Rigorous | Method::Report => misclosure_rows(&similarity, &partials, station),
            };
            for (row, _) in rows.iter().zip(station.known()).filter(|(_, known)| *known) {
                for i in 0..7 {
                    (0..8).for_each(|j| normal[i][j] += row[i] * row[j]);
                }
            }
        }
        let singular = || SimilarityError::Undetermined { cause: Cause::Singular, stations: vec![] };
        let (_, e) = gauss_crout(&normal).ok_or_else(singular)?;
        (0..3).for_each(|k| angles[k] += e[k]);
        similarity.rotation = rotation(angles);
        similarity.scale += e[3];
        (0..3).for_each(|k| similarity.shift[k] += e[4 + k]);
        let largest = e[..3].iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        corrections.push(largest);
        if largest <= ANGLE {
            return Ok(Cycles { similarity, corrections, converged: true });
        }
    }
    Ok(Cycles { similarity, corrections, converged: false })
}

/// Rows of the misclosures u = s X - A^T (x - B), constant -u (specification, section 3).
fn misclosure_rows(similarity: &Similarity, partials: &[Matrix3; 3], station: &Station) -> [[f64; 8]; 3] {
    let reduced = similarity.reduced(&station.model);
    let u = similarity.misclosure(&station.control, &station.model);
    let centred = similarity.centred(&station.control);
    let turned = partials.map(|partial| apply_transposed(&partial, &reduced));
    std::array::from_fn(|j| {
        let [a, b, c]: Vector3 = std::array::from_fn(|i| similarity.rotation[i][j]);
        [-turned[0][j], -turned[1][j], -turned[2][j], centred[j], a, b, c, -u[j]]
    })
}

/// Rows of the bulletin, v = s A X + B - x, constant -v (equations 2.10), with missing X as the last cycle gives it.
fn bulletin_rows(similarity: &Similarity, partials: &[Matrix3; 3], station: &Station) -> [[f64; 8]; 3] {
    let known = station.known();
    let carried = similarity.control_at(&station.model);
    let filled = std::array::from_fn(|k| if known[k] { station.control[k] } else { carried[k] });
    let control = similarity.centred(&filled);
    let reduced = similarity.reduced(&station.model);
    let turned = apply(&similarity.rotation, &control);
    let s = similarity.scale;
    let by_angle = partials.map(|partial| apply(&partial, &control).map(|value| s * value));
    std::array::from_fn(|i| {
        let mut row = [
            by_angle[0][i],
            by_angle[1][i],
            by_angle[2][i],
            turned[i],
            0.0,
            0.0,
            0.0,
            reduced[i] - s * turned[i],
        ];
        row[4 + i] = 1.0;
        row
    })
}
