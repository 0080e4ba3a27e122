//! Lens terms of Brown (1966, 1971), Conrady (1919) and their successors: radial, tangential, thin prism.
//!
//! A camera is a table of parameter roles: a projection, a lens with radial, tangential and prism terms, focal lengths.

use super::inverse::{ALL_POWERS, Matrix2, RadialFactor, RadialLimit, from_radial};
use super::model::{Image, Unit};
use super::projections::{RayProjection, Seen};
use crate::geometry::Vector3;

/// Lens with radial, tangential and thin-prism terms
///
/// ```text
/// q = a^2 + b^2
/// x = a s(q) + t1 (q + 2 a^2) + 2 t2 a b + s1 q + s2 q^2
/// y = b s(q) + t2 (q + 2 b^2) + 2 t1 a b + s3 q + s4 q^2
/// ```
///
/// (t1, t2) are P1, P2 of photogrammetry, and p2, p1 of OpenCV.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialTangential {
    /// s.
    pub radial: RadialFactor,
    /// t1, t2.
    pub tangential: [f64; 2],
    /// s1, s2; s3, s4.
    pub prism: Matrix2,
}

/// Lens terms that may be nonzero.
#[derive(Debug, Clone, Copy)]
pub struct DistortionTerms {
    /// Highest powers of N and D.
    pub powers: [usize; 2],
    /// Whether tangential terms exist.
    pub tangential: bool,
    /// Whether thin-prism terms exist.
    pub prism: bool,
}

impl DistortionTerms {
    /// All terms.
    pub const ALL: Self = Self { powers: ALL_POWERS, tangential: true, prism: true };
}
/// p3, p4 of the profile 1 + p3 q + p4 q^2, which multiplies the tangential terms (Brown 1966).
pub type Profile = [f64; 2];

/// Distorted position with its partials, and intermediate results for the partials with respect to the terms.
#[derive(Debug, Clone, Copy)]
pub struct Distorted {
    /// x, y.
    pub xy: [f64; 2],
    /// With respect to a, b.
    pub by_place: Matrix2,
    place: [f64; 2],
    square: f64,
    /// 1 / D.
    reciprocal: f64,
    /// s.
    factor: f64,
    /// 1 + p3 q + p4 q^2.
    profile: f64,
    /// Tangential terms without the profile; zero for a lens without profile.
    decentring: [f64; 2],
}

impl RadialTangential {
    /// Returns the distorted position.
    #[inline(always)]
    pub fn bend(&self, place: [f64; 2]) -> Distorted {
        self.bend_by(place, DistortionTerms::ALL)
    }

    /// Returns the distorted position of a lens with only the given terms.
    #[inline(always)]
    pub fn bend_by(&self, place: [f64; 2], terms: DistortionTerms) -> Distorted {
        let [a, b] = place;
        let ([t1, t2], [[s1, s2], [s3, s4]]) = (self.tangential, self.prism);
        let square = a * a + b * b;
        let [n, d, by_n, by_d] = self.radial.at(square, terms.powers);
        // The compiler must keep products with zero, which are not a number for infinite factors.
        let (reciprocal, factor, slope) = if terms.powers[1] == 0 {
            (1.0, n, 2.0 * by_n)
        } else {
            let reciprocal = d.recip();
            let factor = n * reciprocal;
            (reciprocal, factor, 2.0 * (by_n - factor * by_d) * reciprocal)
        };
        let (mut xy, cross) = ([a * factor, b * factor], slope * a * b);
        let mut by_place = [[factor + slope * a * a, cross], [cross, factor + slope * b * b]];
        if terms.tangential {
            let cross = cross + 2.0 * (t1 * b + t2 * a);
            xy = [
                xy[0] + t1 * (square + 2.0 * a * a) + 2.0 * t2 * a * b,
                xy[1] + t2 * (square + 2.0 * b * b) + 2.0 * t1 * a * b,
            ];
            by_place = [
                [by_place[0][0] + 6.0 * t1 * a + 2.0 * t2 * b, cross],
                [cross, by_place[1][1] + 6.0 * t2 * b + 2.0 * t1 * a],
            ];
        }
        if terms.prism {
            for (k, [first, second]) in [[s1, s2], [s3, s4]].into_iter().enumerate() {
                let along = 2.0 * (first + 2.0 * second * square);
                xy[k] += square * (first + second * square);
                by_place[k][0] += along * a;
                by_place[k][1] += along * b;
            }
        }
        Distorted { xy, by_place, place, square, reciprocal, factor, profile: 1.0, decentring: [0.0; 2] }
    }

    /// Returns the distorted position of a lens with a tangential profile.
    #[inline(always)]
    pub fn bend_profiled(&self, place: [f64; 2], [p3, p4]: Profile, terms: DistortionTerms) -> Distorted {
        let ([a, b], [t1, t2], bent) = (place, self.tangential, self.bend_by(place, terms));
        let [by_t1, by_t2] = bent.by_tangential();
        let decentring = [0, 1].map(|k| t1 * by_t1[k] + t2 * by_t2[k]);
        let excess = bent.square * (p3 + p4 * bent.square);
        let slope = 2.0 * (p3 + 2.0 * p4 * bent.square);
        let cross = excess * 2.0 * (t1 * b + t2 * a);
        let own = [
            [excess * (6.0 * t1 * a + 2.0 * t2 * b), cross],
            [cross, excess * (6.0 * t2 * b + 2.0 * t1 * a)],
        ];
        Distorted {
            xy: [0, 1].map(|k| bent.xy[k] + excess * decentring[k]),
            by_place: [0, 1]
                .map(|i| [0, 1].map(|k| bent.by_place[i][k] + own[i][k] + slope * decentring[i] * place[k])),
            profile: 1.0 + excess,
            decentring,
            ..bent
        }
    }
}

/// Returns a positive power as products: unlike a function call they can be vectorized.
#[inline(always)]
pub fn power_of(x: f64, power: i32) -> f64 {
    let mut product = x;
    for _ in 1..power {
        product *= x;
    }
    product
}

impl Distorted {
    /// Returns the partials with respect to the coefficient of q^i in N.
    #[inline(always)]
    pub fn by_numerator(&self, power: i32) -> [f64; 2] {
        let (scale, [a, b]) = (power_of(self.square, power) * self.reciprocal, self.place);
        [scale * a, scale * b]
    }

    /// Returns the partials with respect to the coefficient of q^i in D.
    #[inline(always)]
    pub fn by_denominator(&self, power: i32) -> [f64; 2] {
        self.by_numerator(power).map(|value| -self.factor * value)
    }

    /// Returns the partials with respect to t1, t2.
    #[inline(always)]
    pub fn by_tangential(&self) -> [[f64; 2]; 2] {
        let ([a, b], q) = (self.place, self.square);
        let (profile, cross) = (self.profile, self.profile * (2.0 * a * b));
        [[profile * (q + 2.0 * a * a), cross], [cross, profile * (q + 2.0 * b * b)]]
    }

    /// Returns the partials with respect to p3, p4 of the profile.
    #[inline(always)]
    pub fn by_profile(&self) -> [[f64; 2]; 2] {
        let q = self.square;
        [q, q * q].map(|power| self.decentring.map(|value| power * value))
    }

    /// Returns the partials of x with respect to s1, s2, which equal the partials of y with respect to s3, s4.
    #[inline(always)]
    pub fn by_prism(&self) -> [f64; 2] {
        [self.square, self.square * self.square]
    }
}

/// Role of a camera parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Both focal lengths; both with y upwards; the focal length of columns; of rows.
    F,
    FUp,
    Fx,
    Fy,
    /// Principal point.
    Cx,
    Cy,
    /// Image size; the principal point is relative to its centre.
    W,
    H,
    /// Addition to the focal length of columns; shear of rows into columns; the shear relative to the focal length.
    B1,
    B2,
    Skew,
    /// Parameter of the projection.
    Own(usize),
    /// Coefficient of N or D of the radial factor, by its power.
    N(usize),
    D(usize),
    /// t1 or t2.
    T(usize),
    /// s1 and s2 of x, s3 and s4 of y.
    S(usize),
    /// p3 or p4 of the tangential profile.
    P(usize),
}

/// Order of the lens terms: all in one step, radial terms first and the others on the radially distorted position, or in one step with a
/// tangential profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    Whole,
    Staged,
    Profiled,
}

impl Role {
    pub const fn unit(self) -> Unit {
        match self {
            Self::Skew | Self::Own(_) | Self::N(_) | Self::D(_) | Self::T(_) | Self::S(_) | Self::P(_) => {
                Unit::One
            }
            _ => Unit::Image,
        }
    }
}

/// Returns the lens terms of the given roles.
pub(super) const fn terms(roles: &[Role]) -> DistortionTerms {
    let mut terms = DistortionTerms { powers: [0, 0], tangential: false, prism: false };
    let mut i = 0;
    while i < roles.len() {
        match roles[i] {
            Role::N(power) if power > terms.powers[0] => terms.powers[0] = power,
            Role::D(power) if power > terms.powers[1] => terms.powers[1] = power,
            Role::T(_) => terms.tangential = true,
            Role::S(_) => terms.prism = true,
            _ => {}
        }
        i += 1;
    }
    terms
}

/// Parts of a camera: image = (fx a + shear b + x0, fy b + y0) of the distorted a, b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts {
    pub focal: [f64; 2],
    pub shear: f64,
    pub skew: f64,
    /// Whether the camera has one of these parameters.
    pub sheared: bool,
    pub origin: [f64; 2],
    pub own: [f64; 2],
    pub lens: RadialTangential,
    pub profile: Profile,
}

impl Parts {
    /// Returns zero parameters and the identity lens.
    #[inline(always)]
    pub fn none() -> Self {
        let lens =
            RadialTangential { radial: RadialFactor::NONE, tangential: [0.0; 2], prism: [[0.0; 2]; 2] };
        let (origin, own) = ([0.0; 2], [0.0; 2]);
        Self { focal: [0.0; 2], shear: 0.0, skew: 0.0, sheared: false, origin, own, lens, profile: [0.0; 2] }
    }

    /// Sets the value of a parameter.
    #[inline(always)]
    pub fn take(&mut self, role: Role, value: f64) {
        match role {
            Role::F => (self.focal[0], self.focal[1]) = (self.focal[0] + value, self.focal[1] + value),
            Role::FUp => (self.focal[0], self.focal[1]) = (self.focal[0] + value, self.focal[1] - value),
            Role::Fx | Role::B1 => self.focal[0] += value,
            Role::Fy => self.focal[1] += value,
            Role::Cx => self.origin[0] += value,
            Role::Cy => self.origin[1] += value,
            Role::W => self.origin[0] += 0.5 * value,
            Role::H => self.origin[1] += 0.5 * value,
            Role::B2 => (self.shear, self.sheared) = (self.shear + value, true),
            Role::Skew => (self.skew, self.sheared) = (value, true),
            Role::Own(k) => self.own[k] = value,
            Role::N(power) => self.lens.radial.numerator[power] = value,
            Role::D(power) => self.lens.radial.denominator[power] = value,
            Role::T(k) => self.lens.tangential[k] = value,
            Role::S(k) => self.lens.prism[k / 2][k % 2] = value,
            Role::P(k) => self.profile[k] = value,
        }
    }

    /// Applies the lens to a position.
    #[inline(always)]
    fn bend(&self, ab: [f64; 2], action: Action, terms: DistortionTerms) -> BentRay {
        if action != Action::Staged {
            let bent = match action {
                Action::Profiled => self.lens.bend_profiled(ab, self.profile, terms),
                _ => self.lens.bend_by(ab, terms),
            };
            return BentRay {
                first: bent,
                last: bent,
                by_first: [[1.0, 0.0], [0.0, 1.0]],
                by_place: bent.by_place,
            };
        }
        let straight = RadialFactor::NONE;
        let first = RadialTangential { tangential: [0.0; 2], prism: [[0.0; 2]; 2], ..self.lens };
        let first = first.bend_by(ab, DistortionTerms { tangential: false, prism: false, ..terms });
        let last = RadialTangential { radial: straight, ..self.lens };
        let last = last.bend_by(first.xy, DistortionTerms { powers: [0, 0], ..terms });
        let (to, from) = (last.by_place, first.by_place);
        let by_place = [0, 1].map(|i| [0, 1].map(|k| to[i][0] * from[0][k] + to[i][1] * from[1][k]));
        BentRay { first, last, by_first: to, by_place }
    }

    #[inline(always)]
    fn image(&self, ab: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.moved(ab);
        [x + self.origin[0], y + self.origin[1]]
    }

    /// Transforms a change of a, b to a change of the image.
    #[inline(always)]
    fn moved(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let x = self.focal[0] * a;
        [if self.sheared { x + self.shear * b } else { x }, self.focal[1] * b]
    }

    /// Returns the partials of the image with respect to a parameter.
    #[inline(always)]
    pub fn by(&self, role: Role, seen: &Seen, bending: &BentRay) -> [f64; 2] {
        let [a, b] = bending.last.xy;
        let through = |m: &Matrix2, v: [f64; 2]| self.moved(super::inverse::times(m, v));
        match role {
            Role::F => [a, b],
            Role::FUp => [a, -b],
            Role::Fx => [a + self.skew * b, 0.0],
            Role::Fy => [0.0, b],
            Role::Cx => [1.0, 0.0],
            Role::Cy => [0.0, 1.0],
            Role::W => [0.5, 0.0],
            Role::H => [0.0, 0.5],
            Role::B1 => [a, 0.0],
            Role::B2 => [b, 0.0],
            Role::Skew => [self.focal[0] * b, 0.0],
            Role::Own(k) => through(&bending.by_place, seen.by_own.map(|row| row[k])),
            Role::N(power) => through(&bending.by_first, bending.first.by_numerator(power as i32)),
            Role::D(power) => through(&bending.by_first, bending.first.by_denominator(power as i32)),
            Role::T(k) => self.moved(bending.last.by_tangential()[k]),
            Role::S(k) => {
                let own = bending.last.by_prism()[k % 2];
                self.moved(if k < 2 { [own, 0.0] } else { [0.0, own] })
            }
            Role::P(k) => self.moved(bending.last.by_profile()[k]),
        }
    }
}

/// Result of a lens in one or two stages: radial terms, then the rest.
pub(super) struct BentRay {
    first: Distorted,
    last: Distorted,
    /// Partials of the distorted position with respect to the result of the first stage, and to the undistorted position.
    by_first: Matrix2,
    by_place: Matrix2,
}

/// Camera model as a table: projection, order of the lens terms, parameter roles.
pub(super) trait Table<const N: usize>: Copy {
    type Projection: RayProjection;
    const ACTION: Action;
    const ROLES: [Role; N];
    const TERMS: DistortionTerms = terms(&Self::ROLES);

    fn parts(&self) -> Parts;

    /// Returns the partials of x and y with respect to the parameters.
    fn by_parameters(parts: &Parts, seen: &Seen, bending: &BentRay) -> [[f64; N]; 2];

    #[inline(always)]
    fn place(&self, u: &Vector3) -> [f64; 2] {
        let parts = self.parts();
        let seen = Self::Projection::project([u.x, -u.y, -u.z], parts.own);
        parts.image(parts.bend(seen.ab, Self::ACTION, Self::TERMS).last.xy)
    }

    #[inline(always)]
    fn with_partials(&self, u: &Vector3) -> Image<[f64; N]> {
        let parts = self.parts();
        let seen = Self::Projection::project([u.x, -u.y, -u.z], parts.own);
        let bending = parts.bend(seen.ab, Self::ACTION, Self::TERMS);
        let [a, b] = &seen.by_ray;
        let by_ray = |k: usize| parts.moved(super::inverse::times(&bending.by_place, [a[k], b[k]]));
        let [x, y, z] = [by_ray(0), by_ray(1), by_ray(2)];
        let by_u = |row: usize| Vector3::new(x[row], -y[row], -z[row]);
        let by_parameters = Self::by_parameters(&parts, &seen, &bending);
        Image { xy: parts.image(bending.last.xy), by_u: [by_u(0), by_u(1)], by_parameters }
    }

    fn to_camera_frame(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let parts = self.parts();
        let b = (y - parts.origin[1]) / parts.focal[1];
        let a = (x - parts.origin[0] - parts.shear * b) / parts.focal[0];
        let ab = from_radial(&parts.lens.radial, Self::TERMS.powers, [a, b], move |place| {
            let bending = parts.bend(place, Self::ACTION, Self::TERMS);
            (bending.last.xy, bending.by_place)
        })?;
        let [x, y, z] = Self::Projection::ray(ab, parts.own)?;
        Some(Vector3::new(x, -y, -z).normalize())
    }

    fn looks_to(&self, u: &Vector3) -> bool {
        Self::Projection::faces([u.x, -u.y, -u.z], self.parts().own)
    }

    fn bent_at(&self, u: &Vector3) -> f64 {
        let [a, b] = Self::Projection::project([u.x, -u.y, -u.z], self.parts().own).ab;
        a.hypot(b)
    }

    fn bent_until(&self) -> f64 {
        self.parts().lens.radial.fold()
    }

    fn limit(&self) -> Option<RadialLimit> {
        let parts = self.parts();
        parts.lens.radial.limit().or_else(|| Self::Projection::limit(parts.own))
    }
}
