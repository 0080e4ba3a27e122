//! Brown's terms as functions of ideal coordinates, as in AICON.

use super::brown::BrownTerms;
use super::inverse::{Matrix2, RadialLimit, from_radial, times};
use super::model::{CameraModel, Image, Unit, parameters};
use super::perspective::Perspective;
use super::radial_tangential::Distorted;
use crate::geometry::Vector3;

/// Radial terms (optionally balanced), tangential terms, affinity and shear, forward: functions of ideal coordinates.
///
/// ```text
/// X = c u1/u3,    Y = c u2/u3,    r^2 = X^2 + Y^2
/// R = A1 (r^2 - r0^2) + A2 (r^4 - r0^4) + A3 (r^6 - r0^6)
/// x = xp + X + X R + B1 (r^2 + 2 X^2) + 2 B2 X Y + C1 X + C2 Y
/// y = yp + Y + Y R + B2 (r^2 + 2 Y^2) + 2 B1 X Y
/// ```
///
/// x points to the right, y up. r0 is always fixed.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrownForward {
    /// c, negative for the positive plane.
    pub principal_distance: f64,
    /// xp, yp.
    pub principal_point: [f64; 2],
    /// A1, A2, A3, B1, B2, r0.
    pub terms: BrownTerms,
    /// C1, C2.
    pub affinity: [f64; 2],
}

impl BrownForward {
    fn perspective(&self) -> Perspective {
        Perspective { principal_distance: self.principal_distance }
    }

    /// Returns the lens at an ideal position, its value with affinity and shear, and the partials of this value.
    fn bent(&self, place: [f64; 2]) -> (Distorted, [f64; 2], Matrix2) {
        let (bent, [c1, c2]) = (self.terms.lens().bend(place), self.affinity);
        let [by_x, by_y] = bent.by_place;
        let xy = [bent.xy[0] + c1 * place[0] + c2 * place[1], bent.xy[1]];
        (bent, xy, [[by_x[0] + c1, by_x[1] + c2], by_y])
    }
}

impl CameraModel for BrownForward {
    type Parameters = [f64; 11];

    const NAME: &'static str = "brown_forward";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "xp" "yp"; Unit::PerImage(2) => "A1"; Unit::PerImage(4) => "A2"; Unit::PerImage(6) => "A3";
        Unit::PerImage(1) => "B1" "B2"; Unit::One => "C1" "C2"; Unit::Image => "r0";
    };
    const CONSTANTS: usize = 1;
    const FORMULA: &'static str = "(X, Y) = c (P1, P2) / P3, r^2 = X^2 + Y^2, R = A1 (r^2 - r0^2) + A2 (r^4 - r0^4) + A3 (r^6 - r0^6), \
         image = (xp + X + X R + B1 (r^2 + 2 X^2) + 2 B2 X Y + C1 X + C2 Y, yp + Y + Y R + B2 (r^2 + 2 Y^2) + 2 B1 X Y)";

    fn with_parameters([principal_distance, xp, yp, a1, a2, a3, b1, b2, c1, c2, balance]: [f64; 11]) -> Self {
        let terms = BrownTerms { radial: [a1, a2, a3], tangential: [b1, b2], balance };
        Self { principal_distance, principal_point: [xp, yp], terms, affinity: [c1, c2] }
    }

    fn parameters(&self) -> [f64; 11] {
        let BrownTerms { radial: [a1, a2, a3], tangential: [b1, b2], balance } = self.terms;
        let ([xp, yp], [c1, c2]) = (self.principal_point, self.affinity);
        [self.principal_distance, xp, yp, a1, a2, a3, b1, b2, c1, c2, balance]
    }

    fn scale(&self) -> f64 {
        self.principal_distance.abs()
    }

    fn image(&self, u: &Vector3) -> [f64; 2] {
        let (_, [x, y], _) = self.bent(self.perspective().image(u));
        [self.principal_point[0] + x, self.principal_point[1] + y]
    }

    fn linearize(&self, u: &Vector3) -> Image<[f64; 11]> {
        let Image { xy: place, by_u: [by_x, by_y], by_parameters } = self.perspective().linearize(u);
        let (bent, [x, y], by_place) = self.bent(place);
        let by_distance = times(&by_place, by_parameters.map(|[by_c]| by_c));
        let by_terms = self.terms.partials(&bent, place);
        // r0 is always fixed.
        let row = |k: usize| {
            let [a1, a2, a3, b1, b2] = by_terms.map(|by| by[k]);
            let point = [f64::from(k == 0), f64::from(k == 1)];
            let affinity = if k == 0 { place } else { [0.0; 2] };
            [by_distance[k], point[0], point[1], a1, a2, a3, b1, b2, affinity[0], affinity[1], 0.0]
        };
        Image {
            xy: [self.principal_point[0] + x, self.principal_point[1] + y],
            by_u: by_place.map(|row| by_x * row[0] + by_y * row[1]),
            by_parameters: [row(0), row(1)],
        }
    }

    fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3> {
        let target = [x - self.principal_point[0], y - self.principal_point[1]];
        let ideal = from_radial(&self.terms.lens().radial, BrownTerms::TERMS.powers, target, |place| {
            let (_, xy, by_place) = self.bent(place);
            (xy, by_place)
        })?;
        self.perspective().direction(ideal)
    }

    fn radius(&self, u: &Vector3, _: [f64; 2]) -> f64 {
        let [x, y] = self.perspective().image(u);
        x.hypot(y)
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.terms.lens().radial.limit()
    }
}
