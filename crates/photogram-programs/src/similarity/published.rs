//! Cycle of TB 19, sections 2 to 4: linearize, accumulate normal equations, solve by Gauss-Crout, correct the angles.
//!
//! Three faults of the bulletin's program are corrected: angles are stored instead of their sines, missing coordinates are marked, and the
//! number of cycles is limited.
//!
//! The Gauss-Crout scheme follows TB 19, section 4.

use super::error::{Cause, SimilarityError};
use super::model::{SCALE, rotation_with_partials};
use super::transform::{Parameters, Similarity};
use super::{Method, Options, Station};
use photocore::geometry::{Matrix3, Vector3, rotation};

/// Largest correction of an angle, in radians, that ends the cycles.
const ANGLE: f64 = 1e-5;

/// Result of the cycles.
#[derive(Debug)]
pub struct Cycles {
    pub similarity: Similarity,
    /// Largest correction of an angle in each cycle, radians.
    pub corrections: Vec<f64>,
    /// Intermediate results of each cycle, if requested.
    pub traces: Vec<Trace>,
    pub converged: bool,
}

/// Intermediate results of one cycle: the values that the suggested program of the text prints under sense switches.
#[derive(Debug, Clone)]
pub struct Trace {
    /// A at the start of the cycle (after statement 8).
    pub rotation: Matrix3,
    /// Station, component and the eight P-values of every equation (after 27): omega, phi, kappa, s, three translations, constant.
    pub equations: Vec<(usize, usize, [f64; 8])>,
    /// Normal equations C (after 29).
    pub normal: Normal,
    /// Auxiliary table D (after 33).
    pub auxiliary: Normal,
    /// Results of the back solution (after 35): corrections of omega, phi, kappa, s, three translations from the centres.
    pub results: [f64; 7],
    /// Corrected parameters (after 36): omega, phi, kappa in radians, s, b1, b2, b3.
    pub parameters: [f64; 7],
}

/// Iterates the cycles from given initial values.
pub fn iterate(
    stations: &[Station],
    options: &Options,
    start: &Similarity,
) -> Result<Cycles, SimilarityError> {
    let mut angles = start.angles();
    let mut similarity = *start;
    let (mut corrections, mut traces) = (Vec::new(), Vec::new());
    while corrections.len() < options.max_iterations {
        let mut normal = [[0.0; 8]; 7];
        let (rotation_before, partials) = rotation_with_partials(angles);
        let mut equations = Vec::new();
        for (index, station) in stations.iter().enumerate() {
            let rows = match options.method {
                Method::FillIn => bulletin_rows(&similarity, &partials, station),
                Method::Rigorous | Method::Report => misclosure_rows(&similarity, &partials, station),
            };
            let known = station.known();
            for component in (0..3).filter(|&k| known[k]) {
                let mut row = rows[component];
                if options.scale.is_some() {
                    row[SCALE] = 0.0;
                }
                for i in 0..7 {
                    (0..8).for_each(|j| normal[i][j] += row[i] * row[j]);
                }
                if options.trace {
                    equations.push((index, component, row));
                }
            }
        }
        if options.scale.is_some() {
            normal[SCALE][SCALE] = 1.0;
        }
        let singular = || SimilarityError::Undetermined { cause: Cause::Singular, stations: vec![] };
        let (auxiliary, e) = gauss_crout(&normal).ok_or_else(singular)?;
        (0..3).for_each(|k| angles[k] += e[k]);
        similarity.rotation = rotation(angles);
        similarity.scale += e[3];
        (0..3).for_each(|k| similarity.shift[k] += e[4 + k]);
        let largest = e[..3].iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        corrections.push(largest);
        if options.trace {
            let Parameters { scale, translation, .. } = similarity.parameters();
            let [b1, b2, b3] = translation.into();
            let [omega, phi, kappa] = angles;
            traces.push(Trace {
                rotation: rotation_before,
                equations,
                normal,
                auxiliary,
                results: e,
                parameters: [omega, phi, kappa, scale, b1, b2, b3],
            });
        }
        if largest <= ANGLE {
            return Ok(Cycles { similarity, corrections, traces, converged: true });
        }
    }
    Ok(Cycles { similarity, corrections, traces, converged: false })
}

/// Returns the rows of the misclosures u = s X - A^T (x - B), constant -u (specification, section 3).
fn misclosure_rows(similarity: &Similarity, partials: &[Matrix3; 3], station: &Station) -> [[f64; 8]; 3] {
    let reduced = similarity.reduced(&station.model);
    let u = similarity.misclosure(&station.control, &station.model);
    let centred = similarity.centred(&station.control);
    let turned = partials.map(|partial| partial.tr_mul(&reduced));
    std::array::from_fn(|j| {
        let [a, b, c] = similarity.rotation.column(j).into();
        [-turned[0][j], -turned[1][j], -turned[2][j], centred[j], a, b, c, -u[j]]
    })
}

/// Returns the rows of the bulletin, v = s A X + B - x, constant -v (equations 2.10); missing X are results of the last cycle.
fn bulletin_rows(similarity: &Similarity, partials: &[Matrix3; 3], station: &Station) -> [[f64; 8]; 3] {
    let known = station.known();
    let carried = similarity.control_at(&station.model);
    let filled = Vector3::from_fn(|k, _| if known[k] { station.control[k] } else { carried[k] });
    let control = similarity.centred(&filled);
    let reduced = similarity.reduced(&station.model);
    let turned = similarity.rotation * control;
    let s = similarity.scale;
    let by_angle = partials.map(|partial| s * (partial * control));
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

/// Seven normal equations with their right-hand side as the eighth column.
pub type Normal = [[f64; 8]; 7];

/// Pivot, as a fraction of the unreduced diagonal element, below which the matrix is singular.
const SINGULAR: f64 = 1e-13;

/// Solves seven normal equations C (column 8: right-hand side). The auxiliary matrix D (equation 4.4) has columns from left to right,
/// unscaled on and below the diagonal, divided by the diagonal above. The back solution is E (equation 4.5).
///
/// Returns D and E; None if a pivot vanishes, which the bulletin does not check.
pub fn gauss_crout(c: &Normal) -> Option<(Normal, [f64; 7])> {
    let mut d = [[0.0; 8]; 7];
    for j in 0..8 {
        for i in 0..7 {
            let sum: f64 = (0..i.min(j)).map(|k| d[i][k] * d[k][j]).sum();
            d[i][j] = c[i][j] - sum;
            if i < j {
                d[i][j] /= d[i][i];
            } else if i == j && (d[i][i].is_nan() || d[i][i] <= SINGULAR * c[i][i]) {
                return None;
            }
        }
    }
    let mut e = [0.0; 7];
    for i in (0..7).rev() {
        e[i] = d[i][7] - (i + 1..7).map(|j| d[i][j] * e[j]).sum::<f64>();
    }
    Some((d, e))
}
