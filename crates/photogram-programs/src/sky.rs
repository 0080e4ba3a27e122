//! Transformation of apparent places of stars to refracted standard coordinates, and its inverse (NOAA TR NOS 55, equations 1 to 18).
//!
//! Standard coordinates are the gnomonic projection on the plane at unit distance towards the zenith: xi north, eta east. Hour angles are
//! positive west; azimuths are counted from south, positive west.
//!
//! The attitude alpha, omega, kappa of a stellar camera follows equation 19 of NOAA TR NOS 55.

use photocore::geometry::{Matrix3, Vector3};

/// One second of arc in radians.
pub const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// Coefficients tau of the report's fit to Garfinkel's tables, in seconds of arc.
pub const REFRACTION: [f64; 4] = [1050.6103, 706.115_02, 262.060_86, 142.672_93];
/// Gamma of the same fit.
const GAMMA: f64 = 8.7137;
/// Standard conditions: 0 degrees Celsius in kelvin, one atmosphere in millimetres of mercury.
const STANDARD: (f64, f64) = (273.15, 760.0);

/// Air at a station and its refraction (equations 7 to 9).
#[derive(Debug, Clone, Copy)]
pub struct Air {
    /// P T^(-3/2), relative to standard conditions, in radians per second of arc.
    scale: f64,
    /// T^(1/2) / gamma.
    slope: f64,
}

/// Refraction at an observed zenith distance z, with its derivatives, in radians.
#[derive(Debug, Clone, Copy)]
pub struct Refraction {
    /// True minus observed zenith distance.
    pub angle: f64,
    /// With respect to the observed zenith distance.
    pub slope: f64,
    /// With respect to the four coefficients in seconds of arc.
    pub coefficients: [f64; 4],
}

impl Air {
    /// Returns the air of a temperature in kelvin and a pressure in millimetres of mercury; a pressure of 0 disables refraction.
    pub fn new(temperature: f64, pressure: f64) -> Self {
        let (t, p) = (temperature / STANDARD.0, pressure / STANDARD.1);
        Self { scale: p * t.powf(-1.5) * ARCSEC, slope: t.sqrt() / GAMMA }
    }

    /// Returns the refraction at an observed zenith distance.
    pub fn refraction(&self, zenith_distance: f64, tau: &[f64; 4]) -> Refraction {
        let (sin, cos) = zenith_distance.sin_cos();
        let u = (0.5 * (self.slope * sin).atan2(cos)).tan();
        let u2 = u * u;
        let powers = [u, u * u2, u * u2 * u2, u * u2 * u2 * u2];
        let by_u = tau[0] + u2 * (3.0 * tau[1] + u2 * (5.0 * tau[2] + u2 * 7.0 * tau[3]));
        let u_by_z = 0.5 * (1.0 + u2) * self.slope / (cos * cos + self.slope * self.slope * sin * sin);
        let sum: f64 = powers.iter().zip(tau).map(|(power, tau)| power * tau).sum();
        Refraction {
            angle: self.scale * sum,
            slope: self.scale * by_u * u_by_z,
            coefficients: powers.map(|power| self.scale * power),
        }
    }

    /// Returns the observed zenith distance of a true one, by Newton's method to full precision.
    pub fn observed(&self, zenith_distance: f64, tau: &[f64; 4]) -> f64 {
        let mut observed = zenith_distance;
        for _ in 0..20 {
            let refraction = self.refraction(observed, tau);
            let step = (zenith_distance - observed - refraction.angle) / (1.0 + refraction.slope);
            observed += step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        observed
    }

    /// Returns the refraction at a true zenith distance by the report's iteration: substitution until two values differ by at most
    /// `tolerance` (radians), then their mean (equation 11).
    pub fn published(&self, zenith_distance: f64, tau: &[f64; 4], tolerance: f64) -> f64 {
        let (mut observed, mut last) = (zenith_distance, 0.0);
        for _ in 0..100 {
            let angle = self.refraction(observed, tau).angle;
            observed = zenith_distance - angle;
            if (angle - last).abs() <= tolerance {
                return 0.5 * (angle + last);
            }
            last = angle;
        }
        last
    }
}

/// Observing station: latitude, aberration and air.
#[derive(Debug, Clone, Copy)]
pub struct Station {
    /// Sine and cosine of the latitude.
    latitude: (f64, f64),
    /// Constant of diurnal aberration in radians.
    aberration: f64,
    /// Air at the station.
    pub air: Air,
}

/// Standard coordinates and their partials; the first index is xi or eta.
#[derive(Debug, Clone, Copy)]
pub struct Standard {
    /// xi, eta.
    pub coordinates: [f64; 2],
    /// With respect to right ascension and declination.
    pub place: [[f64; 2]; 2],
    /// With respect to the four coefficients of refraction in seconds of arc.
    pub coefficients: [[f64; 4]; 2],
}

impl Station {
    /// Returns a station at a latitude (radians), with the constant of diurnal aberration at the equator (radians).
    pub fn new(latitude: f64, aberration: f64, air: Air) -> Self {
        Self { latitude: latitude.sin_cos(), aberration, air }
    }

    /// Returns hour angle and declination with diurnal aberration, and the partials of each with respect to right ascension and declination
    /// (equations 17 and 18).
    pub fn aberrated(&self, [ra, dec]: [f64; 2], sidereal_time: f64) -> ([f64; 2], [[f64; 2]; 2]) {
        let k = self.aberration * self.latitude.1;
        let hour = sidereal_time - ra;
        let ((sh, ch), (sd, cd)) = (hour.sin_cos(), dec.sin_cos());
        let values = [hour - k * ch / cd, dec + k * sh * sd];
        let partials = [[-1.0 - k * sh / cd, -k * ch * sd / (cd * cd)], [-k * ch * sd, 1.0 + k * sh * cd]];
        (values, partials)
    }

    /// Returns the unit vector north, east, zenith of an hour angle and declination (equations 1 to 3).
    pub fn direction(&self, [hour, dec]: [f64; 2]) -> [f64; 3] {
        let (sp, cp) = self.latitude;
        let ((sh, ch), (sd, cd)) = (hour.sin_cos(), dec.sin_cos());
        [cp * sd - sp * cd * ch, -cd * sh, sp * sd + cp * cd * ch]
    }

    /// Returns hour angle and declination of a direction north, east, zenith (equation 5).
    pub fn equatorial(&self, [north, east, zenith]: &[f64; 3]) -> [f64; 2] {
        let (sp, cp) = self.latitude;
        let (x, y, z) = (cp * zenith - sp * north, -east, sp * zenith + cp * north);
        [y.atan2(x), z.atan2(x.hypot(y))]
    }

    /// Returns the refracted standard coordinates of an apparent place; not finite at and below the horizon.
    pub fn standard(&self, place: [f64; 2], sidereal_time: f64, tau: &[f64; 4]) -> Standard {
        let (equatorial, by_place) = self.aberrated(place, sidereal_time);
        let direction = self.direction(equatorial);
        let by_direction = self.refracted(&direction, tau);
        let (sp, cp) = self.latitude;
        let ((sh, ch), (sd, cd)) = (equatorial[0].sin_cos(), equatorial[1].sin_cos());
        let by_hour = [sp * cd * sh, -cd * ch, -cp * cd * sh];
        let by_dec = [cp * cd + sp * sd * ch, sd * sh, sp * cd - cp * sd * ch];
        let turned = |k: usize| -> [f64; 3] {
            std::array::from_fn(|i| by_hour[i] * by_place[0][k] + by_dec[i] * by_place[1][k])
        };
        let by_place = [turned(0), turned(1)];
        let place = by_direction.1.map(|row| by_place.map(|d| row[0] * d[0] + row[1] * d[1] + row[2] * d[2]));
        Standard { coordinates: by_direction.0, place, coefficients: by_direction.2 }
    }

    /// Returns the standard coordinates of a true direction, and their partials with respect to its components and to tau.
    ///
    /// xi = north T / s with the sine s of the true zenith distance and the tangent T of the observed one.
    fn refracted(
        &self,
        &[north, east, zenith]: &[f64; 3],
        tau: &[f64; 4],
    ) -> ([f64; 2], [[f64; 3]; 2], [[f64; 4]; 2]) {
        let s = north.hypot(east);
        if s < 1e-9 {
            let w = zenith.recip();
            let rows = [[w, 0.0, -north * w * w], [0.0, w, -east * w * w]];
            return ([north * w, east * w], rows, [[0.0; 4]; 2]);
        }
        let observed = self.air.observed(s.atan2(zenith), tau);
        let refraction = self.air.refraction(observed, tau);
        let (sin, cos) = observed.sin_cos();
        // Below the horizon the tangent would equal the tangent of a direction above it.
        let tangent = if cos > 0.0 { sin / cos } else { f64::NAN };
        let growth = (1.0 + refraction.slope).recip() / (cos * cos);
        let (w, unit) = (tangent / s, [north / s, east / s]);
        let by_s = growth * zenith / s - w / s;
        let by_zenith = -growth;
        let row = |own: usize| -> [f64; 3] {
            let value = unit[own] * s;
            let mut row = [value * by_s * unit[0], value * by_s * unit[1], unit[own] * by_zenith * s];
            row[own] += w;
            row
        };
        let by_tau = unit.map(|u| refraction.coefficients.map(|c| -u * growth * c));
        ([unit[0] * tangent, unit[1] * tangent], [row(0), row(1)], by_tau)
    }

    /// Returns the apparent place of refracted standard coordinates: refraction is evaluated once at the observed zenith distance,
    /// aberration is iterated.
    pub fn place(&self, coordinates: [f64; 2], sidereal_time: f64, tau: &[f64; 4]) -> [f64; 2] {
        let tangent = coordinates[0].hypot(coordinates[1]);
        let observed = tangent.atan();
        let zenith_distance = observed + self.air.refraction(observed, tau).angle;
        let (sin, cos) = zenith_distance.sin_cos();
        let along = if tangent > 0.0 { sin / tangent } else { 0.0 };
        let [hour, dec] = self.equatorial(&[coordinates[0] * along, coordinates[1] * along, cos]);
        let mut place = [sidereal_time - hour, dec];
        for _ in 0..4 {
            let again = self.aberrated(place, sidereal_time).0;
            place = [place[0] + again[0] - hour, place[1] + dec - again[1]];
        }
        place
    }

    /// Returns the partials of standard coordinates with respect to a refracted right ascension and declination (the report's AA to DD);
    /// rows xi and eta.
    pub fn standard_by_refracted(&self, [hour, dec]: [f64; 2], zenith: f64, xi: f64) -> [[f64; 2]; 2] {
        let ((sh, ch), (sd, _)) = (hour.sin_cos(), dec.sin_cos());
        let (aa, square) = (sd / zenith, zenith * zenith);
        let eta = -dec.cos() * sh / zenith;
        [[eta * aa, ch / square], [self.latitude.1 / square - xi * aa, self.latitude.0 * sh / square]]
    }
}

/// Returns the matrix from north, east, zenith (left-handed) to x, y and axis of a diapositive; its determinant is -1.
///
/// The rotations are alpha about east (zenith towards north), omega about the rotated north (axis towards east), kappa about the axis; then
/// x is reflected. The axis points to (sin alpha cos omega, sin omega, cos alpha cos omega).
pub fn pointing([alpha, omega, kappa]: [f64; 3]) -> Matrix3 {
    let [(sa, ca), (so, co), (sk, ck)] = [alpha, omega, kappa].map(f64::sin_cos);
    Matrix3::new(
        -ca * ck + sa * so * sk,
        -co * sk,
        sa * ck + ca * so * sk,
        -ca * sk - sa * so * ck,
        co * ck,
        sa * sk - ca * so * ck,
        sa * co,
        so,
        ca * co,
    )
}

/// Returns the matrix and its partials with respect to alpha, omega, kappa.
pub fn pointing_with_partials(angles: [f64; 3]) -> (Matrix3, [Matrix3; 3]) {
    let m = pointing(angles);
    let [(sa, ca), (so, co), (sk, ck)] = angles.map(f64::sin_cos);
    let zero = Vector3::zeros();
    let alpha = Matrix3::from_columns(&[m.column(2).into(), zero, -m.column(0)]);
    let tilted = Vector3::new(-sa * so, co, -ca * so).transpose();
    let omega = Matrix3::from_rows(&[m.row(2) * sk, m.row(2) * -ck, tilted]);
    let kappa = Matrix3::from_rows(&[-m.row(1), m.row(0).into(), zero.transpose()]);
    (m, [alpha, omega, kappa])
}

/// Returns the angles of a matrix (equations 96 to 98): alpha and kappa in [-pi, pi], omega in [-pi/2, pi/2].
///
/// If the axis points due east or west, only a combination of alpha and kappa is determined; kappa is then zero.
pub fn pointing_angles(m: &Matrix3) -> [f64; 3] {
    let cos_omega = m[(2, 0)].hypot(m[(2, 2)]);
    let omega = m[(2, 1)].atan2(cos_omega);
    if cos_omega < 1e-15 {
        return [m[(0, 2)].atan2(-m[(1, 2)] * omega.signum()), omega, 0.0];
    }
    [m[(2, 0)].atan2(m[(2, 2)]), omega, (-m[(0, 1)]).atan2(m[(1, 1)])]
}
