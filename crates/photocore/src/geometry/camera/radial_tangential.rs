//! The terms of Brown (1966, 1971), Conrady (1919) and those who came after: radial, tangential, thin prism.

use super::inverse::{ALL_POWERS, Matrix2, RadialFactor};

/// The lens
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

/// Which terms of a lens may be other than zero.
#[derive(Debug, Clone, Copy)]
pub struct Terms {
    /// The highest powers of N and D.
    pub powers: [usize; 2],
    /// Whether there are terms of a thin prism.
    pub prism: bool,
}

impl Terms {
    /// All of them.
    pub const ALL: Self = Self { powers: ALL_POWERS, prism: true };
}
/// How tangential terms grow beyond their own powers: they are multiplied by 1 + p3 q + p4 q^2 (Brown 1966).
pub type Profile = [f64; 2];

/// Where a place goes, with its partials by the place, and what those by the terms need.
#[derive(Debug, Clone, Copy)]
pub struct Bent {
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
    /// What the tangential terms would add without it; zero where there is none.
    decentring: [f64; 2],
}

impl RadialTangential {
    /// Where a place goes.
    #[inline(always)]
    pub fn bend(&self, place: [f64; 2]) -> Bent {
        self.bend_by(place, Terms::ALL)
    }

    /// The same of a lens of which it is known that all but some terms are zero.
    #[inline(always)]
    pub fn bend_by(&self, place: [f64; 2], terms: Terms) -> Bent {
        let [a, b] = place;
        let ([t1, t2], [[s1, s2], [s3, s4]]) = (self.tangential, self.prism);
        let square = a * a + b * b;
        let [n, d, by_n, by_d] = self.radial.at(square, terms.powers);
        let reciprocal = d.recip();
        let factor = n * reciprocal;
        let slope = 2.0 * (by_n - factor * by_d) * reciprocal;
        let cross = slope * a * b + 2.0 * (t1 * b + t2 * a);
        let mut xy = [
            a * factor + t1 * (square + 2.0 * a * a) + 2.0 * t2 * a * b,
            b * factor + t2 * (square + 2.0 * b * b) + 2.0 * t1 * a * b,
        ];
        let mut by_place = [
            [factor + slope * a * a + 6.0 * t1 * a + 2.0 * t2 * b, cross],
            [cross, factor + slope * b * b + 6.0 * t2 * b + 2.0 * t1 * a],
        ];
        if terms.prism {
            for (k, [first, second]) in [[s1, s2], [s3, s4]].into_iter().enumerate() {
                let along = 2.0 * (first + 2.0 * second * square);
                xy[k] += square * (first + second * square);
                by_place[k][0] += along * a;
                by_place[k][1] += along * b;
            }
        }
        Bent { xy, by_place, place, square, reciprocal, factor, profile: 1.0, decentring: [0.0; 2] }
    }

    /// Where a place goes with tangential terms that have a profile.
    #[inline(always)]
    pub fn bend_profiled(&self, place: [f64; 2], [p3, p4]: Profile, terms: Terms) -> Bent {
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
        Bent {
            xy: [0, 1].map(|k| bent.xy[k] + excess * decentring[k]),
            by_place: [0, 1]
                .map(|i| [0, 1].map(|k| bent.by_place[i][k] + own[i][k] + slope * decentring[i] * place[k])),
            profile: 1.0 + excess,
            decentring,
            ..bent
        }
    }
}

/// A positive power as products: what is called for it could not be part of a vector.
#[inline(always)]
pub fn power_of(x: f64, power: i32) -> f64 {
    let mut product = x;
    for _ in 1..power {
        product *= x;
    }
    product
}

impl Bent {
    /// By the coefficient of q^i in N.
    #[inline(always)]
    pub fn by_numerator(&self, power: i32) -> [f64; 2] {
        let (scale, [a, b]) = (power_of(self.square, power) * self.reciprocal, self.place);
        [scale * a, scale * b]
    }

    /// By the coefficient of q^i in D.
    #[inline(always)]
    pub fn by_denominator(&self, power: i32) -> [f64; 2] {
        self.by_numerator(power).map(|value| -self.factor * value)
    }

    /// By t1, t2.
    #[inline(always)]
    pub fn by_tangential(&self) -> [[f64; 2]; 2] {
        let ([a, b], q) = (self.place, self.square);
        let (profile, cross) = (self.profile, self.profile * (2.0 * a * b));
        [[profile * (q + 2.0 * a * a), cross], [cross, profile * (q + 2.0 * b * b)]]
    }

    /// By p3, p4 of the profile.
    #[inline(always)]
    pub fn by_profile(&self) -> [[f64; 2]; 2] {
        let q = self.square;
        [q, q * q].map(|power| self.decentring.map(|value| power * value))
    }

    /// By s1, s2, which only x has, as s3, s4 are those of y.
    #[inline(always)]
    pub fn by_prism(&self) -> [f64; 2] {
        [self.square, self.square * self.square]
    }
}
