//! Brown's camera with plates measured on a calibrated comparator (NOAA TR NOS 57, equations 34 and 63).

use super::backward::{BackwardModel, Corrected};
use super::brown::BrownTerms;
use super::inverse::{RadialLimit, from_radial, times};
use super::model::{Unit, parameters};
use crate::geometry::correction::{Correction, PARAMETERS};

const COUNT: usize = 33;

/// Readings of a comparator, corrected by its scales, obliqueness and polynomials, then by radial and tangential terms: backward.
///
/// ```text
/// (X, Y) = (x - x0, y - y0)                               readings
/// d = ((1 + mx) X + (1 + my) sin(lean) Y, (1 + my) cos(lean) Y),    (s, t) = (d1/hx, d2/hy)
/// Px = xA s^4 + xB t^4 + xC s^3 + xD t^3 + xE s^2 + xF t^2 + xG s + xH t + xJ,    Py likewise
/// (p, q) = d + (Px, Py) - (xp, yp),    r^2 = p^2 + q^2,    R = K1 r^2 + K2 r^4 + K3 r^6
/// gx = p + p R + P1 (r^2 + 2 p^2) + 2 P2 p q,    gy = q + q R + P2 (r^2 + 2 q^2) + 2 P1 p q
/// residual = g - c (u1, u2) / u3
/// ```
///
/// x0, y0 (origin of the corrections) and hx, hy (half the calibrated range) are always fixed; xp, yp is the corrected principal point
/// relative to this origin.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnComparator {
    /// c, negative for the positive plane.
    pub principal_distance: f64,
    /// xp, yp.
    pub principal_point: [f64; 2],
    /// K1, K2, K3, P1, P2; not balanced.
    pub terms: BrownTerms,
    /// mx, my: scales minus 1; lean: the angle between the y axis and the normal to the x axis, towards +x.
    pub linear: [f64; 3],
    /// Coefficients of Px and Py.
    pub polynomials: [[f64; 9]; 2],
    /// x0, y0.
    pub origin: [f64; 2],
    /// hx, hy.
    pub half_range: [f64; 2],
}

impl OnComparator {
    fn correction(&self) -> Correction {
        let [mx, my, lean] = self.linear;
        let (polynomials, half_range) = (self.polynomials, self.half_range);
        Correction { scales: [1.0 + mx, 1.0 + my], lean, polynomials, half_range }
    }

    fn counted(&self, measured: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| measured[k] - self.origin[k])
    }
}

impl BackwardModel for OnComparator {
    type Parameters = [f64; COUNT];

    const NAME: &'static str = "on_comparator";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "xp" "yp"; Unit::PerImage(2) => "K1"; Unit::PerImage(4) => "K2"; Unit::PerImage(6) => "K3";
        Unit::PerImage(1) => "P1" "P2"; Unit::One => "mx" "my" "lean";
        Unit::Image => "xA" "xB" "xC" "xD" "xE" "xF" "xG" "xH" "xJ" "yA" "yB" "yC" "yD" "yE" "yF" "yG" "yH" "yJ" "x0" "y0" "hx" "hy";
    };
    const CONSTANTS: usize = 4;
    const FORMULA: &'static str = "(X, Y) = (x - x0, y - y0), d = ((1 + mx) X + (1 + my) sin(lean) Y, (1 + my) cos(lean) Y), (s, t) = (d1/hx, d2/hy), Px = xA s^4 + xB t^4 + xC s^3 + \
         xD t^3 + xE s^2 + xF t^2 + xG s + xH t + xJ, Py likewise, (p, q) = d + (Px, Py) - (xp, yp), r^2 = p^2 + q^2, R = K1 r^2 + \
         K2 r^4 + K3 r^6, corrected = (p + p R + P1 (r^2 + 2 p^2) + 2 P2 p q, q + q R + P2 (r^2 + 2 q^2) + 2 P1 p q), residual = \
         corrected - image, image = c (u1, u2) / u3";

    fn with_parameters(values: [f64; COUNT]) -> Self {
        let at = |k: usize| values[k];
        Self {
            principal_distance: at(0),
            principal_point: [at(1), at(2)],
            terms: BrownTerms { radial: [at(3), at(4), at(5)], tangential: [at(6), at(7)], balance: 0.0 },
            linear: [at(8), at(9), at(10)],
            polynomials: [11, 20].map(|first| std::array::from_fn(|k| values[first + k])),
            origin: [at(29), at(30)],
            half_range: [at(31), at(32)],
        }
    }

    fn parameters(&self) -> [f64; COUNT] {
        let BrownTerms { radial, tangential, .. } = self.terms;
        let mut values = [0.0; COUNT];
        let parts: [&[f64]; 9] = [
            &[self.principal_distance],
            &self.principal_point,
            &radial,
            &tangential,
            &self.linear,
            &self.polynomials[0],
            &self.polynomials[1],
            &self.origin,
            &self.half_range,
        ];
        let listed = parts.into_iter().flatten();
        values.iter_mut().zip(listed).for_each(|(value, listed)| *value = *listed);
        values
    }

    fn principal_distance(&self) -> f64 {
        self.principal_distance
    }

    fn correct(&self, measured: [f64; 2]) -> Corrected<[f64; COUNT]> {
        let own = self.correction().linearize(self.counted(measured));
        let place = [0, 1].map(|k| own.xy[k] - self.principal_point[k]);
        let bent = self.terms.lens().bend(place);
        let by_point = [[-1.0, 0.0], [0.0, -1.0]].map(|v| times(&bent.by_place, v));
        let by_terms = self.terms.partials(&bent, place);
        let by_correction =
            (0..PARAMETERS).map(|k| times(&bent.by_place, own.by_parameters.map(|row| row[k])));
        let mut by_parameters = [[0.0; COUNT]; 2];
        for (k, by) in by_point.into_iter().chain(by_terms).chain(by_correction).enumerate() {
            (0..2).for_each(|row| by_parameters[row][1 + k] = by[row]);
        }
        let columns = [0, 1].map(|k| times(&bent.by_place, own.by_reading.map(|row| row[k])));
        let by_measured = [0, 1].map(|row| columns.map(|column| column[row]));
        Corrected { xy: bent.xy, by_measured, by_parameters }
    }

    fn measured(&self, corrected: [f64; 2]) -> Option<[f64; 2]> {
        let lens = self.terms.lens();
        let place = from_radial(&lens.radial, BrownTerms::TERMS.powers, corrected, |place| {
            let bent = lens.bend(place);
            (bent.xy, bent.by_place)
        })?;
        let [x, y] = self.correction().reading([0, 1].map(|k| place[k] + self.principal_point[k]))?;
        Some([self.origin[0] + x, self.origin[1] + y])
    }

    fn radius(&self, measured: [f64; 2]) -> f64 {
        let [x, y] = self.correction().place(self.counted(measured));
        (x - self.principal_point[0]).hypot(y - self.principal_point[1])
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.terms.lens().radial.limit()
    }
}
