//! Brown's camera whose plates are measured on a comparator that is calibrated itself (NOAA TR NOS 57, equations 34 and 63).

use super::backward::{BackwardModel, Corrected};
use super::brown::BrownTerms;
use super::inverse::{Matrix2, RadialLimit, from_radial, inverted, times, way_back};
use super::model::Unit;

/// Exponents of the terms of a polynomial, the constant behind them: x^4, y^4, x^3, y^3, x^2, y^2, x, y.
const DEGREES: [i32; 8] = [4, 4, 3, 3, 2, 2, 1, 1];
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
/// x0, y0, the reading from which corrections count, and hx, hy, half the calibrated range, are never unknowns; xp, yp is the principal
/// point from there, corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnComparator {
    /// c, negative for the positive plane.
    pub principal_distance: f64,
    /// xp, yp.
    pub principal_point: [f64; 2],
    /// K1, K2, K3, P1, P2; not balanced.
    pub terms: BrownTerms,
    /// mx, my: scales less 1; lean: the angle between the y axis and the normal to the x axis, towards +x.
    pub linear: [f64; 3],
    /// Coefficients of Px and Py.
    pub polynomials: [[f64; 9]; 2],
    /// x0, y0.
    pub origin: [f64; 2],
    /// hx, hy.
    pub half_range: [f64; 2],
}

impl OnComparator {
    /// The linear correction.
    fn matrix(&self) -> Matrix2 {
        let [mx, my, lean] = self.linear;
        let (sin, cos) = lean.sin_cos();
        [[1.0 + mx, (1.0 + my) * sin], [0.0, (1.0 + my) * cos]]
    }

    /// The nine functions of a linearly corrected place, and their derivatives by it.
    fn functions(&self, place: [f64; 2]) -> ([f64; 9], [[f64; 2]; 9]) {
        let arguments = [0, 1].map(|k| place[k] / self.half_range[k]);
        let (mut values, mut slopes) = ([1.0; 9], [[0.0; 2]; 9]);
        for (term, degree) in DEGREES.into_iter().enumerate() {
            let axis = term % 2;
            values[term] = arguments[axis].powi(degree);
            slopes[term][axis] = f64::from(degree) * arguments[axis].powi(degree - 1) / self.half_range[axis];
        }
        (values, slopes)
    }

    /// A linearly corrected place with its polynomials, and the partials of that.
    fn bowed(&self, place: [f64; 2]) -> ([f64; 2], Matrix2) {
        let (values, slopes) = self.functions(place);
        let sum = |k: usize| self.polynomials[k].iter().zip(values).map(|(c, value)| c * value).sum::<f64>();
        let slope = |k: usize, axis: usize| {
            self.polynomials[k].iter().zip(slopes).map(|(c, by)| c * by[axis]).sum::<f64>()
        };
        let by = |k: usize| [0, 1].map(|axis| f64::from(u8::from(k == axis)) + slope(k, axis));
        ([0, 1].map(|k| place[k] + sum(k)), [by(0), by(1)])
    }
}

impl BackwardModel for OnComparator {
    type Parameters = [f64; COUNT];

    const NAME: &'static str = "on_comparator";
    const PARAMETERS: &'static [(&'static str, Unit)] = &[
        ("c", Unit::Image),
        ("xp", Unit::Image),
        ("yp", Unit::Image),
        ("K1", Unit::PerImage(2)),
        ("K2", Unit::PerImage(4)),
        ("K3", Unit::PerImage(6)),
        ("P1", Unit::PerImage(1)),
        ("P2", Unit::PerImage(1)),
        ("mx", Unit::One),
        ("my", Unit::One),
        ("lean", Unit::One),
        ("xA", Unit::Image),
        ("xB", Unit::Image),
        ("xC", Unit::Image),
        ("xD", Unit::Image),
        ("xE", Unit::Image),
        ("xF", Unit::Image),
        ("xG", Unit::Image),
        ("xH", Unit::Image),
        ("xJ", Unit::Image),
        ("yA", Unit::Image),
        ("yB", Unit::Image),
        ("yC", Unit::Image),
        ("yD", Unit::Image),
        ("yE", Unit::Image),
        ("yF", Unit::Image),
        ("yG", Unit::Image),
        ("yH", Unit::Image),
        ("yJ", Unit::Image),
        ("x0", Unit::Image),
        ("y0", Unit::Image),
        ("hx", Unit::Image),
        ("hy", Unit::Image),
    ];
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
        let [x, y] = [0, 1].map(|k| measured[k] - self.origin[k]);
        let (linear, [_, my, lean]) = (self.matrix(), self.linear);
        let (sin, cos) = lean.sin_cos();
        let straight = times(&linear, [x, y]);
        let (bowed, by_straight) = self.bowed(straight);
        let place = [0, 1].map(|k| bowed[k] - self.principal_point[k]);
        let bent = self.terms.lens().bend(place);
        let through = |v: [f64; 2]| times(&bent.by_place, v);
        let (functions, _) = self.functions(straight);
        let by_scales = [[x, 0.0], [sin * y, cos * y], [(1.0 + my) * cos * y, -(1.0 + my) * sin * y]]
            .map(|v| through(times(&by_straight, v)));
        let by_point = [through([-1.0, 0.0]), through([0.0, -1.0])];
        let by_terms = self.terms.partials(&bent, place);
        let mut by_parameters = [[0.0; COUNT]; 2];
        for (row, own) in by_parameters.iter_mut().enumerate() {
            let columns = by_point.iter().chain(&by_terms).chain(&by_scales).map(|by| by[row]);
            own[1..11].iter_mut().zip(columns).for_each(|(own, by)| *own = by);
            for (term, value) in functions.into_iter().enumerate() {
                own[11 + term] = bent.by_place[row][0] * value;
                own[20 + term] = bent.by_place[row][1] * value;
            }
        }
        let columns = [[linear[0][0], linear[1][0]], [linear[0][1], linear[1][1]]]
            .map(|column| through(times(&by_straight, column)));
        let by_measured = [0, 1].map(|row| columns.map(|column| column[row]));
        Corrected { xy: bent.xy, by_measured, by_parameters }
    }

    fn measured(&self, corrected: [f64; 2]) -> Option<[f64; 2]> {
        let lens = self.terms.lens();
        let place = from_radial(&lens.radial, BrownTerms::TERMS.powers, corrected, |place| {
            let bent = lens.bend(place);
            (bent.xy, bent.by_place)
        })?;
        let bowed = [0, 1].map(|k| place[k] + self.principal_point[k]);
        let straight = way_back(bowed, bowed, |place| self.bowed(place))?;
        let [x, y] = times(&inverted(self.matrix()), straight);
        Some([self.origin[0] + x, self.origin[1] + y])
    }

    fn radius(&self, measured: [f64; 2]) -> f64 {
        let from = [0, 1].map(|k| measured[k] - self.origin[k]);
        let (bowed, _) = self.bowed(times(&self.matrix(), from));
        (bowed[0] - self.principal_point[0]).hypot(bowed[1] - self.principal_point[1])
    }

    fn fold(&self) -> f64 {
        self.terms.lens().radial.fold()
    }

    fn radial_limit(&self) -> Option<RadialLimit> {
        self.terms.lens().radial.limit()
    }
}
