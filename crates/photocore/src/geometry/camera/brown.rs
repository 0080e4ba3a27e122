//! Camera of photogrammetric calibration certificates: Brown (1971), as a function of measured coordinates.

use super::backward::{BackwardModel, Corrected};
use super::inverse::{RadialFactor, RadialLimit, from_radial};
use super::model::{Unit, parameters};
use super::radial_tangential::{Distorted, DistortionTerms, RadialTangential, power_of};

/// Radial and tangential corrections, affinity and shear, backward: functions of measured coordinates, to which they are added.
///
/// ```text
/// X = (x - xp)(1 + b1) + (y - yp) b2,    Y = y - yp,    r^2 = X^2 + Y^2
/// R = K1 (r^2 - r0^2) + K2 (r^4 - r0^4) + K3 (r^6 - r0^6)
/// gx = X + X R + P1 (r^2 + 2 X^2) + 2 P2 X Y
/// gy = Y + Y R + P2 (r^2 + 2 Y^2) + 2 P1 X Y
/// residual = g - c (u1, u2) / u3
/// ```
///
/// x points to the right, y up. r0 is zero unless the radial terms are balanced; it is always fixed. With AFTER, X = x - xp, and b1 X + b2
/// Y is added to gx (Fraser 1997): affinity and the lens terms are added independently.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrownCorrection<const AFTER: bool> {
    /// c, negative for the positive plane.
    pub principal_distance: f64,
    /// xp, yp.
    pub principal_point: [f64; 2],
    /// K1, K2, K3, P1, P2, r0.
    pub terms: BrownTerms,
    /// b1, b2.
    pub affinity: [f64; 2],
}

/// [`BrownCorrection`] with affinity and shear first.
pub type Brown = BrownCorrection<false>;
/// [`BrownCorrection`] with affinity and shear added to the lens terms.
pub type BrownAffinityAfter = BrownCorrection<true>;

impl<const AFTER: bool> BrownCorrection<AFTER> {
    /// Returns the affinity and shear of the argument of the lens, and the affinity and shear added to its value.
    #[inline(always)]
    fn affine(&self) -> ([f64; 2], [f64; 2]) {
        if AFTER { ([0.0; 2], self.affinity) } else { (self.affinity, [0.0; 2]) }
    }

    /// Returns a measured position relative to the principal point, and the same position as argument of the lens.
    #[inline(always)]
    fn place(&self, measured: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let [dx, dy] = [measured[0] - self.principal_point[0], measured[1] - self.principal_point[1]];
        let ([a1, a2], _) = self.affine();
        ([dx, dy], [dx * (1.0 + a1) + dy * a2, dy])
    }
}

/// Radial terms that vanish at a radius r0, and tangential terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrownTerms {
    /// K1, K2, K3.
    pub radial: [f64; 3],
    /// P1, P2.
    pub tangential: [f64; 2],
    /// r0.
    pub balance: f64,
}

impl BrownTerms {
    /// Nonzero terms of the lens.
    pub(super) const TERMS: DistortionTerms =
        DistortionTerms { powers: [3, 0], tangential: true, prism: false };

    /// Returns the lens with the radial factor 1 + R.
    #[inline(always)]
    pub(super) fn lens(&self) -> RadialTangential {
        let ([k1, k2, k3], at) = (self.radial, self.balance * self.balance);
        let constant = 1.0 - at * (k1 + at * (k2 + at * k3));
        let numerator = [constant, k1, k2, k3, 0.0, 0.0, 0.0];
        let radial = RadialFactor { numerator, denominator: [1.0, 0.0, 0.0, 0.0] };
        RadialTangential { radial, tangential: self.tangential, prism: [[0.0; 2]; 2] }
    }

    /// Returns the partials of the distorted position with respect to K1, K2, K3, P1, P2.
    #[inline(always)]
    pub(super) fn partials(&self, bent: &Distorted, place: [f64; 2]) -> [[f64; 2]; 5] {
        let square = self.balance * self.balance;
        let radial = |power: i32| {
            let (free, whole) = (power_of(square, power), bent.by_numerator(power));
            [whole[0] - free * place[0], whole[1] - free * place[1]]
        };
        let [p1, p2] = bent.by_tangential();
        [radial(1), radial(2), radial(3), p1, p2]
    }
}

impl<const AFTER: bool> BackwardModel for BrownCorrection<AFTER> {
    type Parameters = [f64; 11];

    const NAME: &'static str = if AFTER { "brown_affinity_after" } else { "brown" };
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "xp" "yp"; Unit::PerImage(2) => "K1"; Unit::PerImage(4) => "K2"; Unit::PerImage(6) => "K3";
        Unit::PerImage(1) => "P1" "P2"; Unit::One => "b1" "b2"; Unit::Image => "r0";
    };
    const CONSTANTS: usize = 1;
    const IN_LANES: bool = !AFTER;
    const FORMULA: &'static str = if AFTER {
        "X = x - xp, Y = y - yp, R = K1 (r^2 - r0^2) + K2 (r^4 - r0^4) + K3 (r^6 - r0^6), corrected = (X + X R + P1 (r^2 + 2 X^2) + \
         2 P2 X Y + b1 X + b2 Y, Y + Y R + P2 (r^2 + 2 Y^2) + 2 P1 X Y), residual = corrected - image, image = c (u1, u2) / u3"
    } else {
        "X = (x - xp)(1 + b1) + (y - yp) b2, Y = y - yp, R = K1 (r^2 - r0^2) + K2 (r^4 - r0^4) + K3 (r^6 - r0^6), corrected = (X + \
         X R + P1 (r^2 + 2 X^2) + 2 P2 X Y, Y + Y R + P2 (r^2 + 2 Y^2) + 2 P1 X Y), residual = corrected - image, image = c (u1, u2) / u3"
    };

    fn with_parameters([principal_distance, xp, yp, k1, k2, k3, p1, p2, b1, b2, balance]: [f64; 11]) -> Self {
        Self {
            principal_distance,
            principal_point: [xp, yp],
            terms: BrownTerms { radial: [k1, k2, k3], tangential: [p1, p2], balance },
            affinity: [b1, b2],
        }
    }

    fn parameters(&self) -> [f64; 11] {
        let BrownTerms { radial: [k1, k2, k3], tangential: [p1, p2], balance } = self.terms;
        let ([xp, yp], [b1, b2]) = (self.principal_point, self.affinity);
        [self.principal_distance, xp, yp, k1, k2, k3, p1, p2, b1, b2, balance]
    }

    fn principal_distance(&self) -> f64 {
        self.principal_distance
    }

    #[inline(always)]
    fn correct(&self, measured: [f64; 2]) -> Corrected<[f64; 11]> {
        let ([dx, dy], place) = self.place(measured);
        let ([a1, a2], [b1, b2]) = self.affine();
        let bent = self.terms.lens().bend_by(place, BrownTerms::TERMS);
        let [[xx, xy], [yx, yy]] = bent.by_place;
        let by_measured = [[xx * (1.0 + a1) + b1, xx * a2 + xy + b2], [yx * (1.0 + a1), yx * a2 + yy]];
        let by_affinity = |along: [f64; 2]| along.map(|d| if AFTER { [d, 0.0] } else { [xx * d, yx * d] });
        let [by_b1, by_b2] = by_affinity([dx, dy]);
        let [k1, k2, k3, p1, p2] = self.terms.partials(&bent, place);
        // r0 is always fixed.
        let row = |k: usize| {
            let [to_x, to_y] = by_measured[k];
            [0.0, -to_x, -to_y, k1[k], k2[k], k3[k], p1[k], p2[k], by_b1[k], by_b2[k], 0.0]
        };
        Corrected {
            xy: [bent.xy[0] + b1 * dx + b2 * dy, bent.xy[1]],
            by_measured,
            by_parameters: [row(0), row(1)],
        }
    }

    fn measured(&self, corrected: [f64; 2]) -> Option<[f64; 2]> {
        let ([a1, a2], [b1, b2]) = self.affine();
        let lens = self.terms.lens();
        let [x, y] = from_radial(&lens.radial, BrownTerms::TERMS.powers, corrected, |[x, y]| {
            let Distorted { xy, by_place: [by_x, by_y], .. } = lens.bend([x, y]);
            ([xy[0] + b1 * x + b2 * y, xy[1]], [[by_x[0] + b1, by_x[1] + b2], by_y])
        })?;
        let dx = (x - a2 * y) / (1.0 + a1);
        Some([self.principal_point[0] + dx, self.principal_point[1] + y])
    }

    fn radius(&self, measured: [f64; 2]) -> f64 {
        let (_, [x, y]) = self.place(measured);
        x.hypot(y)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.terms.lens().radial.limit()
    }
}
