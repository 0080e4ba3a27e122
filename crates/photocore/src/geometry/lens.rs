//! Lens distortion about the centre of distortion: radial and decentering, forward and inverse (NOAA TR NOS 55, equations 25 to 34).

/// Radial and decentering distortion. With (x, y) the offset of an undistorted image from the centre of distortion and
/// d its length, the image is displaced by
///
/// ```text
/// x (K1 d^2 + K2 d^4 + K3 d^6) + (3 x^2 + y^2) c t + 2 x y s t
/// y (K1 d^2 + K2 d^4 + K3 d^6) + 2 x y c t + (x^2 + 3 y^2) s t,    t = t0 + t1 d^2.
/// ```
///
/// The report's K4, K5, phi_T are t = K4 + K5 d^2, (c, s) = (cos phi_T, sin phi_T); Brown's P1, P2, P3 are t = 1 + P3 d^2,
/// (c, s) = (P1, P2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distortion {
    /// K1, K2, K3, for an offset in the unit of the image coordinates.
    pub radial: [f64; 3],
    /// t0, t1: profile of the decentering.
    pub profile: [f64; 2],
    /// c, s: direction of the decentering.
    pub direction: [f64; 2],
}

/// Displacement and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Displacement {
    /// Displacement of x and y.
    pub shift: [f64; 2],
    /// With respect to the offset.
    pub offset: [[f64; 2]; 2],
    /// With respect to K1, K2, K3.
    pub radial: [[f64; 3]; 2],
    /// With respect to t0, t1.
    pub profile: [[f64; 2]; 2],
    /// With respect to c, s.
    pub direction: [[f64; 2]; 2],
}

/// Offset corrected for distortion.
#[derive(Debug, Clone, Copy)]
pub struct Undistorted {
    /// Offset of the undistorted image from the centre of distortion.
    pub offset: [f64; 2],
    /// Changes of radial and decentering distortion in the last iteration.
    pub changes: [f64; 2],
    /// Whether both changes are at most the tolerance.
    pub converged: bool,
}

impl Distortion {
    /// Returns the radial distortion divided by the distance, K1 d^2 + K2 d^4 + K3 d^6 (equation 25).
    #[inline]
    pub fn radial_ratio(&self, square: f64) -> f64 {
        square * (self.radial[0] + square * (self.radial[1] + square * self.radial[2]))
    }

    /// Returns the profile of the decentering distortion, K4 d^2 + K5 d^4 (equation 31).
    #[inline]
    pub fn decentering_profile(&self, square: f64) -> f64 {
        square * (self.profile[0] + square * self.profile[1])
    }

    /// Returns the displacement of an image point by distortion (equation 32), given its offset from the centre of distortion.
    #[inline]
    pub fn displacement(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let square = x * x + y * y;
        let (ratio, t) = (self.radial_ratio(square), self.profile[0] + self.profile[1] * square);
        let [c, s] = self.direction;
        let (xx, xy, yy) = (3.0 * x * x + y * y, 2.0 * x * y, x * x + 3.0 * y * y);
        [x * ratio + t * (c * xx + s * xy), y * ratio + t * (c * xy + s * yy)]
    }

    /// Returns the displacement with its partials.
    pub fn linearize(&self, [x, y]: [f64; 2]) -> Displacement {
        let square = x * x + y * y;
        let [k1, k2, k3] = self.radial;
        let ratio = self.radial_ratio(square);
        let slope = 2.0 * k1 + square * (4.0 * k2 + square * 6.0 * k3);
        let t = self.profile[0] + self.profile[1] * square;
        let [c, s] = self.direction;
        let (xx, xy, yy) = (3.0 * x * x + y * y, 2.0 * x * y, x * x + 3.0 * y * y);
        let (along_x, along_y) = (c * xx + s * xy, c * xy + s * yy);
        let (tx, ty) = (2.0 * self.profile[1] * x, 2.0 * self.profile[1] * y);
        let cross = x * y * slope + 2.0 * t * (c * y + s * x);
        Displacement {
            shift: [x * ratio + t * along_x, y * ratio + t * along_y],
            offset: [
                [
                    ratio + x * x * slope + t * (6.0 * c * x + 2.0 * s * y) + tx * along_x,
                    cross + ty * along_x,
                ],
                [
                    cross + tx * along_y,
                    ratio + y * y * slope + t * (2.0 * c * x + 6.0 * s * y) + ty * along_y,
                ],
            ],
            radial: [x, y].map(|v| [v * square, v * square * square, v * square * square * square]),
            profile: [[along_x, along_x * square], [along_y, along_y * square]],
            direction: [[t * xx, t * xy], [t * xy, t * yy]],
        }
    }

    /// Returns the offset whose distorted position is `distorted`, by substitution (section 3.3 of the report's inverse). The iteration
    /// ends if radial and decentering distortion change by at most `tolerance`, or after `passes` iterations.
    pub fn undistort(&self, distorted: [f64; 2], tolerance: f64, passes: usize) -> Undistorted {
        let mut offset = distorted;
        let mut before = [0.0; 2];
        let mut changes = [0.0; 2];
        for _ in 0..passes {
            let square = offset[0] * offset[0] + offset[1] * offset[1];
            let now = [self.radial_ratio(square) * square.sqrt(), self.decentering_profile(square)];
            let shift = self.displacement(offset);
            offset = [distorted[0] - shift[0], distorted[1] - shift[1]];
            changes = [(now[0] - before[0]).abs(), (now[1] - before[1]).abs()];
            if changes.iter().all(|change| *change <= tolerance) {
                return Undistorted { offset, changes, converged: true };
            }
            before = now;
        }
        Undistorted { offset, changes, converged: false }
    }
}
