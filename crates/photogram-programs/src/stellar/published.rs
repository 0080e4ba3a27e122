//! Observation equations of the report's program (its equations 48 to 62 and 73 to 74).
//!
//! Distortion is evaluated at the undistorted measured image, so that discrepancies refer to the undistorted plate. The partials neglect
//! the change of refraction with direction.

use super::adjust::parameters_of;
use super::model::{Partials, Rows, Sight, Tolerances};
use super::{Attitude, COMMON, Calibration, Camera, StellarError};
use photocore::Threads;
use photocore::adjustment::AdjustError;
use photocore::geometry::Displacement;

/// Published equations of an image.
#[derive(Debug, Clone, Copy)]
pub struct PublishedRows {
    /// Discrepancies and partials.
    pub rows: Rows,
    /// Refracted standard coordinates of the star.
    pub standard: [f64; 2],
    /// Measured image without distortion.
    pub undistorted: [f64; 2],
    /// Changes of radial and decentering distortion in the last iteration, if it did not converge.
    pub unsettled: Option<[f64; 2]>,
}

/// One correction of all parameters.
#[derive(Debug, Clone)]
pub struct Correction {
    /// Corrections of the parameters: attitudes three each, then the shared ones.
    pub parameters: Vec<f64>,
    /// Full cofactor matrix of the parameters, row by row; zero for fixed parameters and those without effect.
    pub cofactors: Vec<f64>,
    /// Natural logarithm of the determinant of the reduced normal equations.
    pub log_determinant: f64,
    /// Parameters without effect on observations and weights: they are not corrected.
    pub without_effect: Vec<usize>,
}

impl Calibration {
    /// Corrects the parameters with the equations of the report's program at the initial values.
    ///
    /// # Errors
    /// Undetermined stars or parameters, or stars without images.
    pub fn correction(&self, tolerances: &Tolerances, threads: &Threads) -> Result<Correction, StellarError> {
        let problem = threads.install(|| self.problem(1.0, Partials::Published(*tolerances)))?;
        let first = self.formed(&problem, vec![], threads)?;
        let idle = first.factor.without_effect();
        let normal = if idle.is_empty() { first } else { self.formed(&problem, idle.clone(), threads)? };
        if let Some(error @ AdjustError::UndeterminedLocals(_)) = normal.undetermined() {
            return Err(self.named(&problem, error, threads));
        }
        let undetermined = || {
            let combinations = normal.undetermined_unknowns().into_iter();
            StellarError::Undetermined(combinations.map(|each| parameters_of(&problem, each)).collect())
        };
        let found = self.of_parameters(&normal, &problem, threads)?;
        let (log_determinant, cofactors) = found.ok_or_else(undetermined)?;
        Ok(Correction {
            parameters: normal.factor.reduced_corrections(),
            cofactors,
            log_determinant,
            without_effect: parameters_of(&problem, idle),
        })
    }

    /// Returns the equations of all images at the initial values, as formed by the report's program.
    pub fn published(&self, tolerances: &Tolerances) -> Result<Vec<PublishedRows>, StellarError> {
        self.check()?;
        let sight = self.initial();
        Ok((0..self.images.len()).map(|image| self.published_image(&sight, image, tolerances)).collect())
    }

    pub(super) fn published_image(
        &self,
        sight: &Sight,
        image: usize,
        tolerances: &Tolerances,
    ) -> PublishedRows {
        let image = &self.images[image];
        let place = sight.places[image.star];
        let place = [place[0] + image.shift[0], place[1] + image.shift[1]];
        let (equatorial, _) = self.station.aberrated(place, image.sidereal_time);
        let direction = self.station.direction(equatorial);
        let sin = direction[0].hypot(direction[1]);
        let zenith_distance = sin.atan2(direction[2]);
        let angle = self.station.air.published(zenith_distance, &sight.tau, tolerances.refraction);
        let (across, height) = (zenith_distance - angle).sin_cos();
        // Below the horizon the tangent would equal the tangent of a direction above it.
        let tangent = if height > 0.0 { across / height } else { f64::NAN };
        let along = if sin > 0.0 { tangent / sin } else { 1.0 };
        let apparent = [direction[0] * along, direction[1] * along, 1.0];
        let refracted = self.station.equatorial(&apparent);
        let direction = self.station.direction(refracted);
        let standard = [direction[0] / direction[2], direction[1] / direction[2]];
        let star = self.station.standard_by_refracted(refracted, direction[2], standard[0]);
        let coefficients = self.station.air.refraction(zenith_distance - angle, &sight.tau).coefficients;
        let attitude = &sight.attitudes[image.pointing];
        let (undistorted, changes, converged) =
            sight.camera.undistorted(image.xy, tolerances.distortion, tolerances.passes);
        let mut rows =
            approximate(&sight.camera, attitude, standard, image.xy, undistorted, self.kind.common_scale);
        let tangent = standard[0].hypot(standard[1]);
        let f = tangent.recip() + tangent;
        for i in 0..2 {
            let [j, k] = rows.star[i];
            let along = -(j * standard[0] + k * standard[1]) * f;
            (0..4).for_each(|t| rows.common[i][COMMON - 4 + t] = along * coefficients[t]);
            rows.star[i] = std::array::from_fn(|c| j * star[0][c] + k * star[1][c]);
        }
        PublishedRows { rows, standard, undistorted, unsettled: (!converged).then_some(changes) }
    }
}

/// Returns the rows of an image; the columns of the star still refer to standard coordinates.
fn approximate(
    camera: &Camera,
    attitude: &Attitude,
    standard: [f64; 2],
    measured: [f64; 2],
    undistorted: [f64; 2],
    common_scale: bool,
) -> Rows {
    let [epsilon, xp, yp, cx, cy, dx, dy, ..] = *camera.interior();
    let offset = [undistorted[0] - xp - dx, undistorted[1] - yp - dy];
    let lens = camera.distortion().linearize(offset);
    let [m, n, q] = Attitude::turned(&attitude.matrix, standard);
    // A direction behind the camera has NaN as image.
    let q = if q > 0.0 { q } else { f64::NAN };
    let computed = [cx * m / q + xp + lens.shift[0] - epsilon * measured[1], cy * n / q + yp + lens.shift[1]];
    let [[a1, a2, d], [b1, b2, e], _] = attitude.matrix.data.0;
    let (p1, p2) = ((computed[0] - xp) / cx, (computed[1] - yp) / cy);
    let (p3, p4, p6, p7) = (p1 * d - a1, p1 * e - b1, p2 * d - a2, p2 * e - b2);
    let p9 = p2 * b1 - p1 * b2;
    // With the axis upright in omega B1 and B2 are -cos omega sin kappa and cos omega cos kappa.
    let (sin, cos) = (-b1).atan2(b2).sin_cos();
    let mut common = camera_columns(camera, &lens);
    common[0][0] = -measured[1];
    common[0][3] = p1;
    common[1][if common_scale { 3 } else { 4 }] = p2;
    Rows {
        constant: [measured[0] - computed[0], measured[1] - computed[1]],
        star: [[-cx * p3 / q, -cx * p4 / q], [-cy * p6 / q, -cy * p7 / q]],
        pointing: [
            [-cx * (p1 * p9 + p7), cx * ((1.0 + p1 * p1) * sin - p1 * p2 * cos), -cx * p2],
            [-cy * (p2 * p9 - p4), -cy * ((1.0 + p2 * p2) * cos - p1 * p2 * sin), cy * p1],
        ],
        common,
    }
}

/// Returns the columns of principal point and distortion.
fn camera_columns(camera: &Camera, lens: &Displacement) -> [[f64; COMMON]; 2] {
    let phi = camera.interior()[12];
    let (sin, cos) = phi.sin_cos();
    std::array::from_fn(|i| {
        let mut row = [0.0; COMMON];
        for j in 0..2 {
            row[5 + j] = -lens.offset[i][j];
            row[1 + j] = f64::from(u8::from(i == j)) + row[5 + j];
        }
        row[7..10].copy_from_slice(&lens.radial[i]);
        row[10..12].copy_from_slice(&lens.profile[i]);
        row[12] = lens.direction[i][1] * cos - lens.direction[i][0] * sin;
        row
    })
}
