//! The camera: from standard coordinates to the plate, with partials (NOAA TR NOS 55, equations 38 to 41).

use crate::geometry::{Matrix3, PlateLens, Plated, Vector3, pointing_with_partials};

pub use crate::geometry::plate_lens::{Decentering, Form, INTERIOR, Kind};

/// A camera of the sky: the lens of a plate, which attitudes point.
pub type Camera = PlateLens;

/// An image and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct PlateImage {
    /// x, y on the plate.
    pub xy: [f64; 2],
    /// With respect to xi, eta.
    pub standard: [[f64; 2]; 2],
    /// With respect to alpha, omega, kappa.
    pub pointing: [[f64; 3]; 2],
    /// With respect to the interior parameters.
    pub interior: [[f64; INTERIOR]; 2],
}

/// An attitude with its partials.
#[derive(Debug, Clone, Copy)]
pub struct Attitude {
    /// Rows (A1, B1, C1), (A2, B2, C2), (D, E, F).
    pub matrix: Matrix3,
    partials: [Matrix3; 3],
}

impl Attitude {
    /// The attitude alpha, omega, kappa.
    pub fn new(angles: [f64; 3]) -> Self {
        let (matrix, partials) = pointing_with_partials(angles);
        Self { matrix, partials }
    }

    /// m, n, q of standard coordinates.
    pub fn turned(matrix: &Matrix3, [xi, eta]: [f64; 2]) -> [f64; 3] {
        (matrix * Vector3::new(xi, eta, 1.0)).into()
    }
}

impl PlateLens {
    /// The image of standard coordinates, with all partials.
    pub fn linearize(&self, attitude: &Attitude, standard: [f64; 2]) -> PlateImage {
        let [m, n, q] = Attitude::turned(&attitude.matrix, standard);
        // A direction behind the camera has no image.
        let q = if q > 0.0 { q } else { f64::NAN };
        let w = [m / q, n / q];
        let Plated { xy, tangents, interior } = self.place(w);
        let by_angle = |a: usize| {
            let [dm, dn, dq] = Attitude::turned(&attitude.partials[a], standard);
            let dw = [(dm - w[0] * dq) / q, (dn - w[1] * dq) / q];
            tangents.map(|row| row[0] * dw[0] + row[1] * dw[1])
        };
        let by_standard = |k: usize| {
            let dw: [f64; 2] =
                std::array::from_fn(|i| (attitude.matrix[(i, k)] - w[i] * attitude.matrix[(2, k)]) / q);
            tangents.map(|row| row[0] * dw[0] + row[1] * dw[1])
        };
        let angles: [[f64; 2]; 3] = std::array::from_fn(by_angle);
        let axes: [[f64; 2]; 2] = std::array::from_fn(by_standard);
        PlateImage {
            xy,
            standard: std::array::from_fn(|i| axes.map(|d| d[i])),
            pointing: std::array::from_fn(|i| angles.map(|d| d[i])),
            interior,
        }
    }

    /// Standard coordinates of an undistorted image (equation 44).
    pub fn standard(&self, matrix: &Matrix3, undistorted: [f64; 2]) -> [f64; 2] {
        let [_, xp, yp, cx, cy, ..] = *self.interior();
        let (u, v) = ((undistorted[0] - xp) / cx, (undistorted[1] - yp) / cy);
        let [xi, eta, zenith] = matrix.tr_mul(&Vector3::new(u, v, 1.0)).into();
        [xi / zenith, eta / zenith]
    }
}
