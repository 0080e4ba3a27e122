//! Ellipsoid of revolution: geographic and geocentric coordinates, and the local vertical frame.
//!
//! Geographic positions are (longitude east positive, latitude, height): radians, radians, the linear unit of
//! the semi-axes.

use super::rotation::{Matrix3, Vector3};

/// Invalid argument of a geometric object.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// Semi-axes that do not satisfy 0 < b <= a, or are not finite.
    #[error("a spheroid needs finite semi-axes with 0 < b <= a, not a = {a}, b = {b}")]
    Semiaxes {
        /// Semi-major axis passed.
        a: f64,
        /// Semi-minor axis passed.
        b: f64,
    },
    /// Invalid water level or refractive index.
    #[error(
        "water needs a finite level and a finite refractive index of at least 1, not {level} and {index}"
    )]
    Water {
        /// Level passed.
        level: f64,
        /// Index passed.
        index: f64,
    },
}

/// Ellipsoid of revolution, oblate or a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    a: f64,
    b: f64,
}

impl Ellipsoid {
    /// Clarke 1866 in metres, the default of GIANT.
    pub const CLARKE_1866: Self = Self { a: 6_378_206.4, b: 6_356_583.8 };

    /// Returns the ellipsoid with semi-major axis `a` and semi-minor axis `b`, finite with 0 < b <= a.
    pub fn new(a: f64, b: f64) -> Result<Self, GeometryError> {
        if a.is_finite() && 0.0 < b && b <= a {
            Ok(Self { a, b })
        } else {
            Err(GeometryError::Semiaxes { a, b })
        }
    }

    /// Returns the semi-major axis.
    pub fn a(&self) -> f64 {
        self.a
    }

    /// Returns the semi-minor axis.
    pub fn b(&self) -> f64 {
        self.b
    }

    /// Returns a^2 - b^2 without cancellation.
    fn focal_square(&self) -> f64 {
        (self.a - self.b) * (self.a + self.b)
    }

    /// Returns geocentric X, Y, Z of a geographic position.
    pub fn geocentric(&self, position: [f64; 3]) -> Vector3 {
        let [longitude, latitude, height] = position;
        let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
        let w = self.w(sp);
        let normal = self.a / w;
        let polar = self.b * (self.b / self.a) / w;
        Vector3::new((normal + height) * cp * cl, (normal + height) * cp * sl, (polar + height) * sp)
    }

    /// Returns geocentric X, Y, Z and the matrix whose columns are the partial derivatives with respect to longitude, latitude, height.
    ///
    /// The columns are east, north and up, the first two multiplied by the radii (N + h) cos lat and (M + h).
    pub fn geocentric_with_partials(&self, position: [f64; 3]) -> (Vector3, Matrix3) {
        let [longitude, latitude, height] = position;
        let vertical = local_vertical(longitude, latitude);
        let (sp, cp) = latitude.sin_cos();
        let w = self.w(sp);
        let parallel = (self.a / w + height) * cp;
        let meridian = self.b * (self.b / self.a) / (w * w * w) + height;
        let scale = Vector3::new(parallel, meridian, 1.0);
        (self.geocentric(position), vertical.transpose() * Matrix3::from_diagonal(&scale))
    }

    /// Returns longitude, latitude and height of a geocentric position.
    ///
    /// Bowring's formula for the reduced latitude beta (Survey Review 1976), a Newton iteration, is repeated until convergence. The result
    /// is exact to the rounding of the coordinates at any height above the evolute. The longitude is 0 at the poles; the latitude is 0 at
    /// the centre of the ellipsoid.
    pub fn geographic(&self, xyz: Vector3) -> [f64; 3] {
        const MOST_STEPS: usize = 20;
        let [x, y, z] = xyz.into();
        let axis_distance = x.hypot(y);
        let focal = self.focal_square();
        let mut beta = (self.a * z).atan2(self.b * axis_distance);
        let mut latitude = beta;
        for _ in 0..MOST_STEPS {
            let (sb, cb) = beta.sin_cos();
            let north = z + focal / self.b * sb.powi(3);
            let out = axis_distance - focal / self.a * cb.powi(3);
            latitude = north.atan2(out);
            let next = (self.b * north).atan2(self.a * out);
            let change = next - beta;
            beta = next;
            if change.abs() <= f64::EPSILON {
                break;
            }
        }
        let (sp, cp) = latitude.sin_cos();
        let height = axis_distance * cp + z * sp - self.a * self.w(sp);
        [y.atan2(x), latitude, height]
    }

    /// Returns W = sqrt(1 - e^2 sin^2 lat); the radius of curvature in the prime vertical is N = a / W.
    fn w(&self, sin_latitude: f64) -> f64 {
        (1.0 - self.focal_square() / (self.a * self.a) * sin_latitude * sin_latitude).sqrt()
    }
}

/// Returns R, the rotation from geocentric axes to the local vertical frame: its rows are east, north and up.
pub fn local_vertical(longitude: f64, latitude: f64) -> Matrix3 {
    let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
    Matrix3::new(-sl, cl, 0.0, -sp * cl, -sp * sl, cp, cp * cl, cp * sl, sp)
}

/// Returns the rotation vectors w of R per longitude and latitude in the local vertical frame: `dR/dq = [w]x R`.
pub fn local_vertical_turns(latitude: f64) -> [Vector3; 2] {
    let (sp, cp) = latitude.sin_cos();
    [Vector3::new(0.0, -cp, -sp), Vector3::x()]
}
