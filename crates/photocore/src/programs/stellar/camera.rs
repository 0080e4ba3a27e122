//! The camera: from standard coordinates to the plate, with partials (NOAA TR NOS 55, equations 38 to 41), or to the image of any other
//! lens.

use crate::geometry::{Camera as Lens, Displacement, Distortion, Matrix3, Vector3, pointing_with_partials};

/// Number of interior parameters.
pub const INTERIOR: usize = 13;

/// In which order scale and distortion act on the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// The image of the central perspective with the principal distances cx, cy is distorted (equation 38, as programmed).
    ScaleFirst,
    /// The image at this principal distance is distorted, then scaled by cx and cy over it (equation 40).
    DistortionFirst(f64),
}

/// How decentering distortion is parametrized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decentering {
    /// K4, K5 and the direction phi_T.
    Polar,
    /// Brown's P1 = K4 cos phi_T, P2 = K4 sin phi_T, P3 = K5 / K4: determined without distortion, too.
    Cartesian,
}

/// The kind of a camera: what is not estimated.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Another model than that of plates: the interior parameters are its own, then as many zeros as are left; x counts right, y down.
    /// Its values do not matter.
    pub lens: Option<Lens>,
    /// Order of scale and distortion.
    pub form: Form,
    /// Parameters of the decentering distortion.
    pub decentering: Decentering,
    /// Whether cx is the principal distance of both axes.
    pub common_scale: bool,
}

impl Kind {
    /// Where the principal distances of x and y stand among the interior parameters; every lens that has two begins with them.
    pub fn scales(&self) -> [usize; 2] {
        if self.lens.is_some() { [0, 1] } else { [3, 4] }
    }
}

/// A camera at given values of its interior parameters.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    kind: Kind,
    /// epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3; or those of the lens.
    interior: [f64; INTERIOR],
    distortion: Distortion,
    lens: Option<Lens>,
}

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

impl Camera {
    /// A camera with the given interior parameters.
    pub fn new(kind: Kind, mut interior: [f64; INTERIOR]) -> Self {
        if kind.common_scale {
            let [x, y] = kind.scales();
            interior[y] = interior[x];
        }
        let lens = kind.lens.and_then(|lens| lens.with_parameters(&interior[..lens.parameter_names().len()]));
        let [k4, k5, phi] = [interior[10], interior[11], interior[12]];
        let (profile, direction) = match kind.decentering {
            Decentering::Polar => ([k4, k5], [phi.cos(), phi.sin()]),
            Decentering::Cartesian => ([1.0, phi], [k4, k5]),
        };
        let radial = [interior[7], interior[8], interior[9]];
        Self { kind, interior, distortion: Distortion { radial, profile, direction }, lens }
    }

    /// epsilon, xp, yp, cx, cy, dx, dy, and the rest.
    pub fn interior(&self) -> &[f64; INTERIOR] {
        &self.interior
    }

    /// Its distortion.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Principal distances of the image that is distorted, and the scales that act afterwards.
    fn scales(&self) -> ([f64; 2], [f64; 2]) {
        let c = [self.interior[3], self.interior[4]];
        match self.kind.form {
            Form::ScaleFirst => (c, [1.0; 2]),
            Form::DistortionFirst(reference) => ([reference; 2], c.map(|c| c / reference)),
        }
    }

    /// The image of standard coordinates through another lens, with all partials.
    fn through(&self, lens: &Lens, attitude: &Attitude, standard: [f64; 2]) -> PlateImage {
        // A direction has y down and looks along z; that of a photo y up and looks along -z.
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

    /// The image of standard coordinates, with all partials.
    pub fn linearize(&self, attitude: &Attitude, standard: [f64; 2]) -> PlateImage {
        if let Some(lens) = &self.lens {
            return self.through(lens, attitude, standard);
        }
        let [m, n, q] = Attitude::turned(&attitude.matrix, standard);
        // A direction behind the camera has no image.
        let q = if q > 0.0 { q } else { f64::NAN };
        let w = [m / q, n / q];
        let (c, scale) = self.scales();
        let base = [c[0] * w[0], c[1] * w[1]];
        let lens = self.distortion.linearize([base[0] - self.interior[5], base[1] - self.interior[6]]);
        let image = [base[0] + lens.shift[0], base[1] + lens.shift[1]];
        let y = self.interior[2] + scale[1] * image[1];
        let x = self.interior[1] + scale[0] * image[0] - self.interior[0] * y;
        // Partials of the distorted image with respect to m / q and n / q.
        let by_base: [[f64; 2]; 2] =
            std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) + lens.offset[i][j]));
        let by_w: [[f64; 2]; 2] =
            std::array::from_fn(|i| std::array::from_fn(|j| scale[i] * by_base[i][j] * c[j]));
        let by_angle = |a: usize| {
            let [dm, dn, dq] = Attitude::turned(&attitude.partials[a], standard);
            let dw = [(dm - w[0] * dq) / q, (dn - w[1] * dq) / q];
            by_w.map(|row| row[0] * dw[0] + row[1] * dw[1])
        };
        let by_standard = |k: usize| {
            let dw: [f64; 2] =
                std::array::from_fn(|i| (attitude.matrix[(i, k)] - w[i] * attitude.matrix[(2, k)]) / q);
            by_w.map(|row| row[0] * dw[0] + row[1] * dw[1])
        };
        let angles: [[f64; 2]; 3] = std::array::from_fn(by_angle);
        let axes: [[f64; 2]; 2] = std::array::from_fn(by_standard);
        let mut plate = PlateImage {
            xy: [x, y],
            standard: std::array::from_fn(|i| axes.map(|d| d[i])),
            pointing: std::array::from_fn(|i| angles.map(|d| d[i])),
            interior: self.by_interior(&lens, &by_base, scale, w, image),
        };
        self.shear(&mut plate);
        plate
    }

    /// Partials with respect to the interior parameters, before the axes are made oblique.
    fn by_interior(
        &self,
        lens: &Displacement,
        by_base: &[[f64; 2]; 2],
        scale: [f64; 2],
        w: [f64; 2],
        image: [f64; 2],
    ) -> [[f64; INTERIOR]; 2] {
        let phi = self.interior[12];
        let mut rows = [[0.0; INTERIOR]; 2];
        for (i, row) in rows.iter_mut().enumerate() {
            row[1 + i] = 1.0;
            for j in 0..2 {
                row[3 + j] = match self.kind.form {
                    Form::ScaleFirst => by_base[i][j] * w[j],
                    Form::DistortionFirst(reference) if i == j => image[i] / reference,
                    Form::DistortionFirst(_) => 0.0,
                };
                row[5 + j] = -scale[i] * lens.offset[i][j];
            }
            if self.kind.common_scale {
                row[3] += std::mem::take(&mut row[4]);
            }
            for k in 0..3 {
                row[7 + k] = scale[i] * lens.radial[i][k];
            }
            let (profile, direction) = (lens.profile[i], lens.direction[i]);
            let decentering = match self.kind.decentering {
                Decentering::Polar => {
                    [profile[0], profile[1], direction[1] * phi.cos() - direction[0] * phi.sin()]
                }
                Decentering::Cartesian => [direction[0], direction[1], profile[1]],
            };
            (0..3).for_each(|k| row[10 + k] = scale[i] * decentering[k]);
        }
        rows
    }

    /// x loses epsilon times y.
    fn shear(&self, plate: &mut PlateImage) {
        let epsilon = self.interior[0];
        let [x, y] = &mut plate.standard;
        (0..2).for_each(|k| x[k] -= epsilon * y[k]);
        let [x, y] = &mut plate.pointing;
        (0..3).for_each(|k| x[k] -= epsilon * y[k]);
        let [x, y] = &mut plate.interior;
        (0..INTERIOR).for_each(|k| x[k] -= epsilon * y[k]);
        x[0] = -plate.xy[1];
    }

    /// The image without distortion and obliqueness: the offset of the distorted image from the centre of distortion.
    fn upright(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (_, scale) = self.scales();
        let [epsilon, xp, yp, _, _, dx, dy, ..] = self.interior;
        [(x + epsilon * y - xp) / scale[0] - dx, (y - yp) / scale[1] - dy]
    }

    /// Frees a measured image from distortion (report's section on the inverse): the undistorted image, the changes of the last
    /// pass, and whether they fell below `tolerance`.
    ///
    /// The image of another lens stays as it is: [`Camera::standard`] asks the lens.
    pub fn undistorted(&self, xy: [f64; 2], tolerance: f64, passes: usize) -> ([f64; 2], [f64; 2], bool) {
        if self.lens.is_some() {
            return (xy, [0.0; 2], true);
        }
        let found = self.distortion.undistort(self.upright(xy), tolerance, passes);
        let (_, scale) = self.scales();
        let [_, xp, yp, _, _, dx, dy, ..] = self.interior;
        let image = [xp + scale[0] * (found.offset[0] + dx), yp + scale[1] * (found.offset[1] + dy)];
        (image, found.changes, found.converged)
    }

    /// Standard coordinates of an undistorted image (equation 44); not finite where a lens has no ray.
    pub fn standard(&self, matrix: &Matrix3, undistorted: [f64; 2]) -> [f64; 2] {
        let [_, xp, yp, cx, cy, ..] = self.interior;
        let ray = match &self.lens {
            Some(lens) => lens.direction(undistorted).map_or([f64::NAN; 3], |u| [u.x, -u.y, -u.z]),
            None => [(undistorted[0] - xp) / cx, (undistorted[1] - yp) / cy, 1.0],
        };
        let [xi, eta, zenith] = matrix.tr_mul(&Vector3::from(ray)).into();
        [xi / zenith, eta / zenith]
    }
}
