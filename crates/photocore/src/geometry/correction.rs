//! Corrections of comparator and scanner readings (NOAA TR NOS 57, equations 34 and 63).

use super::camera::Matrix2;
use super::camera::inverse::{inverted, times, way_back};

/// Number of coefficients of each polynomial.
pub const COEFFICIENTS: usize = 9;
/// Number of parameters of the linear part: two scales and the obliqueness.
pub const LINEAR: usize = 3;
/// Number of parameters of a correction: scales, obliqueness, coefficients of x, coefficients of y.
pub const PARAMETERS: usize = LINEAR + 2 * COEFFICIENTS;
/// Exponents of the polynomial terms x^4, y^4, x^3, y^3, x^2, y^2, x, y; the constant follows.
const DEGREES: [i32; COEFFICIENTS - 1] = [4, 4, 3, 3, 2, 2, 1, 1];

/// Scales, obliqueness and polynomials of the two axes of an instrument.
///
/// ```text
/// d = (Sx X + Sy sin(alpha) Y, Sy cos(alpha) Y),    (s, t) = (d1/hx, d2/hy)
/// true = d + (Px, Py),    Px = xA s^4 + xB t^4 + xC s^3 + xD t^3 + xE s^2 + xF t^2 + xG s + xH t + xJ,    Py likewise
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// Sx, Sy.
    pub scales: [f64; 2],
    /// alpha: angle between the y axis and the normal to the x axis, towards +x.
    pub lean: f64,
    /// Coefficients of Px and Py.
    pub polynomials: [[f64; COEFFICIENTS]; 2],
    /// hx, hy: half of the range of each axis; it normalizes the arguments of the polynomials.
    pub half_range: [f64; 2],
}

/// Corrected position with its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct CorrectedPosition {
    /// Corrected x, y.
    pub xy: [f64; 2],
    /// With respect to the reading.
    pub by_reading: Matrix2,
    /// With respect to Sx, Sy, alpha, xA .. xJ, yA .. yJ.
    pub by_parameters: [[f64; PARAMETERS]; 2],
}

/// Linear part of a correction, prepared for many positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Matrix from reading to corrected position.
    pub matrix: Matrix2,
    /// Its inverse.
    pub back: Matrix2,
    /// Partials of the position with respect to Sx, Sy, alpha for a unit reading along x, y, y.
    by_parameters: [[f64; 2]; LINEAR],
}

impl Linear {
    /// Returns the partials of the corrected position of a reading with respect to Sx, Sy, alpha.
    pub fn by_parameters(&self, [x, y]: [f64; 2]) -> [[f64; 2]; LINEAR] {
        let [by_x, by_y, by_lean] = self.by_parameters;
        [by_x.map(|by| by * x), by_y.map(|by| by * y), by_lean.map(|by| by * y)]
    }
}

impl Correction {
    /// Identity: the correction of an error-free instrument.
    pub const NONE: Self =
        Self { scales: [1.0; 2], lean: 0.0, polynomials: [[0.0; COEFFICIENTS]; 2], half_range: [1.0; 2] };

    /// Returns Sx, Sy, alpha, xA .. xJ, yA .. yJ.
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        let mut all = [0.0; PARAMETERS];
        let listed = self.scales.iter().chain([&self.lean]).chain(self.polynomials.as_flattened());
        all.iter_mut().zip(listed).for_each(|(own, listed)| *own = *listed);
        all
    }

    /// Returns a correction with these parameters and the same half ranges.
    #[must_use]
    pub fn with_parameters(&self, all: &[f64; PARAMETERS]) -> Self {
        let polynomials = [0, 1].map(|axis| std::array::from_fn(|k| all[LINEAR + COEFFICIENTS * axis + k]));
        Self { scales: [all[0], all[1]], lean: all[2], polynomials, half_range: self.half_range }
    }

    /// Returns the linear part.
    pub fn linear(&self) -> Linear {
        let ([sx, sy], (sin, cos)) = (self.scales, self.lean.sin_cos());
        let matrix = [[sx, sy * sin], [0.0, sy * cos]];
        let by_parameters = [[1.0, 0.0], [sin, cos], [sy * cos, -sy * sin]];
        Linear { matrix, back: inverted(matrix), by_parameters }
    }

    /// Returns the nine polynomial terms at a linearly corrected position, and their derivatives with respect to it.
    fn functions(&self, place: [f64; 2]) -> ([f64; COEFFICIENTS], [[f64; 2]; COEFFICIENTS]) {
        let arguments = [0, 1].map(|k| place[k] / self.half_range[k]);
        let (mut values, mut slopes) = ([1.0; COEFFICIENTS], [[0.0; 2]; COEFFICIENTS]);
        for (term, degree) in DEGREES.into_iter().enumerate() {
            let axis = term % 2;
            values[term] = arguments[axis].powi(degree);
            slopes[term][axis] = f64::from(degree) * arguments[axis].powi(degree - 1) / self.half_range[axis];
        }
        (values, slopes)
    }

    /// Adds the polynomials to a linearly corrected position; returns the result and its partials.
    fn bowed(&self, place: [f64; 2]) -> ([f64; 2], Matrix2) {
        let (values, slopes) = self.functions(place);
        let sum = |k: usize| self.polynomials[k].iter().zip(values).map(|(c, value)| c * value).sum::<f64>();
        let slope = |k: usize, axis: usize| {
            self.polynomials[k].iter().zip(slopes).map(|(c, by)| c * by[axis]).sum::<f64>()
        };
        let by = |k: usize| [0, 1].map(|axis| f64::from(u8::from(k == axis)) + slope(k, axis));
        ([0, 1].map(|k| place[k] + sum(k)), [by(0), by(1)])
    }

    /// Returns the corrected position of a reading.
    pub fn place(&self, reading: [f64; 2]) -> [f64; 2] {
        self.bowed(times(&self.linear().matrix, reading)).0
    }

    /// Returns the corrected position of a reading with all partials.
    pub fn linearize(&self, reading: [f64; 2]) -> CorrectedPosition {
        let linear = self.linear();
        let straight = times(&linear.matrix, reading);
        let (xy, by_straight) = self.bowed(straight);
        let (functions, _) = self.functions(straight);
        let by_linear = linear.by_parameters(reading).map(|column| times(&by_straight, column));
        let mut by_parameters = [[0.0; PARAMETERS]; 2];
        for (row, own) in by_parameters.iter_mut().enumerate() {
            (0..LINEAR).for_each(|k| own[k] = by_linear[k][row]);
            own[LINEAR + COEFFICIENTS * row..][..COEFFICIENTS].copy_from_slice(&functions);
        }
        let columns = [0, 1].map(|k| times(&by_straight, linear.matrix.map(|row| row[k])));
        CorrectedPosition {
            xy,
            by_reading: [0, 1].map(|row| columns.map(|column| column[row])),
            by_parameters,
        }
    }

    /// Returns the reading of a corrected position; None if the polynomials are not invertible there.
    pub fn reading(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let straight = way_back(place, place, |straight| self.bowed(straight))?;
        Some(times(&self.linear().back, straight))
    }
}
