//! Lens of a star plate: from the tangents of a direction to the plate, with partials (NOAA TR NOS 55, equations 38 to 41).

use super::lens::{Displacement, Distortion};

/// Number of interior parameters.
pub const INTERIOR: usize = 13;

/// Order of scale and distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// The image of the central perspective with the principal distances cx, cy is distorted (equation 38, as programmed).
    ScaleFirst,
    /// The image at this principal distance is distorted, then scaled by cx and cy over it (equation 40).
    DistortionFirst(f64),
}

/// Parametrization of the decentering distortion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decentering {
    /// K4, K5 and the direction phi_T.
    Polar,
    /// Brown's P1 = K4 cos phi_T, P2 = K4 sin phi_T, P3 = K5 / K4: also regular for zero distortion.
    Cartesian,
}

/// Type of a plate camera: the model without its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kind {
    /// Order of scale and distortion.
    pub form: Form,
    /// Parameters of the decentering distortion.
    pub decentering: Decentering,
    /// Whether cx is the principal distance of both axes.
    pub common_scale: bool,
}

/// Lens of a plate at given values of its interior parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlateLens {
    kind: Kind,
    /// epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3.
    interior: [f64; INTERIOR],
    distortion: Distortion,
}

/// Position on the plate and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Plated {
    /// x, y on the plate.
    pub xy: [f64; 2],
    /// With respect to the tangents.
    pub tangents: [[f64; 2]; 2],
    /// With respect to the interior parameters.
    pub interior: [[f64; INTERIOR]; 2],
}

impl PlateLens {
    /// Returns the lens with the given interior parameters.
    pub fn new(kind: Kind, mut interior: [f64; INTERIOR]) -> Self {
        if kind.common_scale {
            interior[4] = interior[3];
        }
        let [k4, k5, phi] = [interior[10], interior[11], interior[12]];
        let (profile, direction) = match kind.decentering {
            Decentering::Polar => ([k4, k5], [phi.cos(), phi.sin()]),
            Decentering::Cartesian => ([1.0, phi], [k4, k5]),
        };
        let radial = [interior[7], interior[8], interior[9]];
        Self { kind, interior, distortion: Distortion { radial, profile, direction } }
    }

    /// Returns the type of the camera.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns epsilon, xp, yp, cx, cy, dx, dy, and the distortion parameters.
    pub fn interior(&self) -> &[f64; INTERIOR] {
        &self.interior
    }

    /// Returns the distortion.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Returns the principal distances before distortion and the scales after it.
    pub fn scales(&self) -> ([f64; 2], [f64; 2]) {
        let c = [self.interior[3], self.interior[4]];
        match self.kind.form {
            Form::ScaleFirst => (c, [1.0; 2]),
            Form::DistortionFirst(reference) => ([reference; 2], c.map(|c| c / reference)),
        }
    }

    /// Returns the plate position of the tangents m/q, n/q with all partials.
    pub fn place(&self, w: [f64; 2]) -> Plated {
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
        let mut plate = Plated {
            xy: [x, y],
            tangents: by_w,
            interior: self.by_interior(&lens, &by_base, scale, w, image),
        };
        self.shear(&mut plate);
        plate
    }

    /// Returns the partials with respect to the interior parameters before the obliqueness is applied.
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

    /// Subtracts epsilon times y from x.
    fn shear(&self, plate: &mut Plated) {
        let epsilon = self.interior[0];
        let [x, y] = &mut plate.tangents;
        (0..2).for_each(|k| x[k] -= epsilon * y[k]);
        let [x, y] = &mut plate.interior;
        (0..INTERIOR).for_each(|k| x[k] -= epsilon * y[k]);
        x[0] = -plate.xy[1];
    }

    /// Removes the obliqueness: returns the offset of the distorted image from the centre of distortion.
    pub fn upright(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (_, scale) = self.scales();
        let [epsilon, xp, yp, _, _, dx, dy, ..] = self.interior;
        [(x + epsilon * y - xp) / scale[0] - dx, (y - yp) / scale[1] - dy]
    }

    /// Corrects a measured image for distortion (report's section on the inverse). Returns the undistorted image, the changes of the last
    /// iteration and the convergence flag for `tolerance`.
    pub fn undistorted(&self, xy: [f64; 2], tolerance: f64, passes: usize) -> ([f64; 2], [f64; 2], bool) {
        let found = self.distortion.undistort(self.upright(xy), tolerance, passes);
        let (_, scale) = self.scales();
        let [_, xp, yp, _, _, dx, dy, ..] = self.interior;
        let image = [xp + scale[0] * (found.offset[0] + dx), yp + scale[1] * (found.offset[1] + dy)];
        (image, found.changes, found.converged)
    }
}
