//! Stellar camera: from standard coordinates to the plate, with partials (NOAA TR NOS 55, equations 38 to 41), or to the image of any other
//! lens.

use photocore::geometry::plate_lens;
use photocore::geometry::{Camera as Lens, Distortion, Matrix3, PlateLens, Plated, Vector3};

use crate::sky::pointing_with_partials;

pub use photocore::geometry::plate_lens::{Decentering, Form, INTERIOR};

/// Type of a camera: the model without its values.
#[derive(Debug, Clone)]
pub struct Kind {
    /// Lens model other than the plate model. The interior parameters are its own, padded with zeros; x increases to the right, y
    /// downwards. Its values are ignored.
    pub lens: Option<Lens>,
    /// Order of scale and distortion.
    pub form: Form,
    /// Parameters of the decentering distortion.
    pub decentering: Decentering,
    /// Whether cx is the principal distance of both axes.
    pub common_scale: bool,
}

impl Kind {
    /// Returns the indices of the principal distances of x and y; the parameters of lenses with two distances begin with them.
    pub fn scales(&self) -> [usize; 2] {
        if self.lens.is_some() { [0, 1] } else { [3, 4] }
    }
}

/// Camera at given values of its interior parameters.
#[derive(Debug, Clone)]
pub struct Camera {
    kind: Kind,
    /// Plate lens with epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3; or the parameters of the lens.
    plate: PlateLens,
    lens: Option<Lens>,
}

/// Image and its partials; the first index is x or y.
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

/// Attitude with its partials.
#[derive(Debug, Clone, Copy)]
pub struct Attitude {
    /// Rows (A1, B1, C1), (A2, B2, C2), (D, E, F).
    pub matrix: Matrix3,
    partials: [Matrix3; 3],
}

impl Attitude {
    /// Creates the attitude alpha, omega, kappa.
    pub fn new(angles: [f64; 3]) -> Self {
        let (matrix, partials) = pointing_with_partials(angles);
        Self { matrix, partials }
    }

    /// Returns m, n, q of standard coordinates.
    pub fn turned(matrix: &Matrix3, [xi, eta]: [f64; 2]) -> [f64; 3] {
        (matrix * Vector3::new(xi, eta, 1.0)).into()
    }
}

impl Camera {
    /// Returns a camera with the given interior parameters.
    pub fn new(kind: &Kind, mut interior: [f64; INTERIOR]) -> Self {
        if kind.common_scale {
            let [x, y] = kind.scales();
            interior[y] = interior[x];
        }
        let with_own = |lens: &Lens| lens.with_parameters(&interior[..lens.parameter_names().len()]);
        let lens = kind.lens.as_ref().and_then(with_own);
        let &Kind { form, decentering, common_scale, .. } = kind;
        let of_plate = plate_lens::Kind { form, decentering, common_scale: common_scale && lens.is_none() };
        Self { kind: kind.clone(), plate: PlateLens::new(of_plate, interior), lens }
    }

    /// Returns epsilon, xp, yp, cx, cy, dx, dy, and the distortion parameters.
    pub fn interior(&self) -> &[f64; INTERIOR] {
        self.plate.interior()
    }

    /// Returns the distortion.
    pub fn distortion(&self) -> &Distortion {
        self.plate.distortion()
    }

    /// Returns the image of standard coordinates through another lens, with all partials.
    fn through(&self, lens: &Lens, attitude: &Attitude, standard: [f64; 2]) -> PlateImage {
        // Directions have y down and look along z; photo axes have y up and look along -z.
        let turned = |matrix: &Matrix3| {
            let [m, n, q] = Attitude::turned(matrix, standard);
            Vector3::new(m, -n, -q)
        };
        let u = turned(&attitude.matrix);
        let seen = lens.linearize(&u);
        let xy = if lens.faces(&u) { seen.xy } else { [f64::NAN; 2] };
        let along = attitude.matrix;
        let axes = [0, 1].map(|k| Vector3::new(along[(0, k)], -along[(1, k)], -along[(2, k)]));
        let angles = attitude.partials.each_ref().map(turned);
        let mut interior = seen.by_parameters.map(|row| {
            let mut all = [0.0; INTERIOR];
            all[..row.len()].copy_from_slice(&row);
            all
        });
        if self.kind.common_scale {
            let [x, y] = self.kind.scales();
            interior.iter_mut().for_each(|row| row[x] += std::mem::take(&mut row[y]));
        }
        PlateImage {
            xy,
            standard: seen.by_u.map(|row| axes.map(|axis| row.dot(&axis))),
            pointing: seen.by_u.map(|row| angles.map(|angle| row.dot(&angle))),
            interior,
        }
    }

    /// Returns the image of standard coordinates, with all partials.
    pub fn linearize(&self, attitude: &Attitude, standard: [f64; 2]) -> PlateImage {
        if let Some(lens) = &self.lens {
            return self.through(lens, attitude, standard);
        }
        let [m, n, q] = Attitude::turned(&attitude.matrix, standard);
        // A direction behind the camera has NaN as image.
        let q = if q > 0.0 { q } else { f64::NAN };
        let w = [m / q, n / q];
        let Plated { xy, tangents, interior } = self.plate.place(w);
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

    /// Corrects a measured image for distortion (report's section on the inverse). Returns the undistorted image, the changes of the last
    /// iteration and the convergence flag for `tolerance`.
    ///
    /// The image of another lens is unchanged: [`Camera::standard`] inverts the lens.
    pub fn undistorted(&self, xy: [f64; 2], tolerance: f64, passes: usize) -> ([f64; 2], [f64; 2], bool) {
        if self.lens.is_some() {
            return (xy, [0.0; 2], true);
        }
        self.plate.undistorted(xy, tolerance, passes)
    }

    /// Returns the standard coordinates of an undistorted image (equation 44); not finite outside of the lens model's range.
    pub fn standard(&self, matrix: &Matrix3, undistorted: [f64; 2]) -> [f64; 2] {
        let [_, xp, yp, cx, cy, ..] = *self.interior();
        let ray = match &self.lens {
            Some(lens) => lens.direction(undistorted).map_or([f64::NAN; 3], |u| [u.x, -u.y, -u.z]),
            None => [(undistorted[0] - xp) / cx, (undistorted[1] - yp) / cy, 1.0],
        };
        let [xi, eta, zenith] = matrix.tr_mul(&Vector3::from(ray)).into();
        [xi / zenith, eta / zenith]
    }
}
