//! Inversion of lens models: the one-to-one range of the radial part, and Newton's method in one and two dimensions.

/// 2 x 2 matrix, row by row.
pub type Matrix2 = [[f64; 2]; 2];

/// Maximum number of Newton steps.
const STEPS: usize = 50;
/// Relative step size that ends the iteration.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Accepted relative error if rounding ends the iteration.
const REACHED: f64 = 1e-9;
/// A radial factor that provably increases up to this multiple of a radius needs no search for its limit.
const BEYOND: f64 = 1.25;

/// Limit of the one-to-one range of the radial part of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialLimit {
    /// Undistorted radius at the limit; infinite if only the image radius is bounded.
    pub radius: f64,
    /// Distorted radius at the limit.
    pub distorted: f64,
}

/// Highest powers of N and D.
pub const ALL_POWERS: [usize; 2] = [6, 3];

/// s(q) = N(q) / D(q) of the square q of a radius r; the distorted radius is r s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialFactor {
    /// Coefficients of N in ascending powers of q.
    pub numerator: [f64; 7],
    /// Coefficients of D in ascending powers of q.
    pub denominator: [f64; 4],
}

impl RadialFactor {
    /// s = 1.
    pub const NONE: Self = {
        let (mut numerator, mut denominator) = ([0.0; 7], [0.0; 4]);
        (numerator[0], denominator[0]) = (1.0, 1.0);
        Self { numerator, denominator }
    };

    /// Returns 1 + k1 q + k2 q^2 + ...; terms beyond the sixth are ignored.
    pub fn polynomial(terms: &[f64]) -> Self {
        let numerator = std::array::from_fn(|i| match i.checked_sub(1) {
            None => 1.0,
            Some(term) => terms.get(term).copied().unwrap_or_default(),
        });
        Self { numerator, denominator: [1.0, 0.0, 0.0, 0.0] }
    }

    /// Returns N, D and their derivatives with respect to q; coefficients beyond the given powers are zero.
    #[inline(always)]
    pub fn at(&self, q: f64, [numerator, denominator]: [usize; 2]) -> [f64; 4] {
        let (n, by_n) = horner(&self.numerator[..=numerator], q);
        let (d, by_d) = horner(&self.denominator[..=denominator], q);
        [n, d, by_n, by_d]
    }

    /// Returns the highest powers of N and D with nonzero coefficients.
    fn powers(&self) -> [usize; 2] {
        let last = |coefficients: &[f64]| coefficients.iter().rposition(|&c| c != 0.0).unwrap_or_default();
        [last(&self.numerator), last(&self.denominator)]
    }

    /// Returns s.
    pub fn value(&self, q: f64) -> f64 {
        let [n, d, ..] = self.at(q, ALL_POWERS);
        n / d
    }

    /// Returns D^2 d(r s)/dr = N D + 2 q (N' D - N D'): the lens is one-to-one while this and D are positive.
    #[inline(always)]
    fn slope(&self, [numerator, denominator]: [usize; 2]) -> [f64; 10] {
        let mut slope = [0.0; 10];
        for (i, n) in self.numerator[..=numerator].iter().enumerate() {
            for (j, d) in self.denominator[..=denominator].iter().enumerate() {
                slope[i + j] += n * d * (1.0 + 2.0 * i as f64 - 2.0 * j as f64);
            }
        }
        slope
    }

    /// Returns the limit of the one-to-one range of r s; None if it is unlimited.
    pub fn limit(&self) -> Option<RadialLimit> {
        let ends = [first_root(&self.slope(self.powers())), first_root(&self.denominator)];
        let q = ends.into_iter().flatten().reduce(f64::min)?;
        Some(RadialLimit { radius: q.sqrt(), distorted: q.sqrt() * self.value(q).abs() })
    }

    /// Returns the radius at which r s stops increasing; infinite if it always increases.
    pub fn fold(&self) -> f64 {
        self.limit().map_or(f64::INFINITY, |limit| limit.radius)
    }

    /// Returns whether r s provably increases up to a radius of the given square, by a lower bound from the negative terms. Most lenses
    /// need no root search. Coefficients beyond the given powers are zero.
    #[inline(always)]
    fn surely_rises(&self, q: f64, powers: [usize; 2]) -> bool {
        let [numerator, denominator] = powers;
        let slope = &self.slope(powers)[..=numerator + denominator];
        lower_bound(slope, q) > 0.0 && lower_bound(&self.denominator[..=denominator], q) > 0.0
    }

    /// Returns the approximate ratio of undistorted to distorted radius by one Newton step from the squared distorted radius. None unless
    /// the solution is provably within [`BEYOND`] times this ratio, and r s increases up to there.
    #[inline(always)]
    fn nearly(&self, distorted: f64, powers: [usize; 2]) -> Option<f64> {
        let [n, d, by_n, by_d] = self.at(distorted, powers);
        let ratio = 1.0 - (n - d) * d / (n * d + 2.0 * distorted * (by_n * d - n * by_d));
        let far = BEYOND * ratio;
        let [n, d, ..] = self.at(far * far * distorted, powers);
        let within = ratio > 0.0 && far * n >= d && self.surely_rises(far * far * distorted, powers);
        within.then_some(ratio)
    }

    /// Returns the radius of a distorted radius; None if the one-to-one range does not contain it.
    pub fn invert(&self, distorted: f64) -> Option<f64> {
        if !distorted.is_finite() {
            return None;
        }
        let free = self.newton(distorted, f64::INFINITY);
        if let Some(radius) = free.filter(|&radius| self.surely_rises(radius * radius, self.powers())) {
            return Some(radius);
        }
        match self.limit() {
            Some(limit) if distorted >= limit.distorted => None,
            Some(limit) => self.newton(distorted, limit.radius),
            None => self.newton(distorted, f64::INFINITY),
        }
    }

    /// Newton's method for the radius, bracketed by bisection.
    fn newton(&self, distorted: f64, limit: f64) -> Option<f64> {
        let powers = self.powers();
        let (mut low, mut high) = (0.0f64, limit);
        let mut radius = distorted.min(limit);
        for _ in 0..STEPS {
            let q = radius * radius;
            let [n, d, by_n, by_d] = self.at(q, powers);
            let excess = radius * n / d - distorted;
            if excess > 0.0 {
                high = radius
            } else {
                low = radius
            }
            let next = radius - excess * d * d / (n * d + 2.0 * q * (by_n * d - n * by_d));
            let middle = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * low };
            let next = if next >= low && next <= high { next } else { middle };
            let change = (next - radius).abs();
            radius = next;
            if change <= ROUNDING * radius {
                return Some(radius);
            }
        }
        // In flat parts of the curve rounding changes the radius by more than its last digits.
        let difference = radius * self.value(radius * radius) - distorted;
        (difference.abs() <= REACHED * distorted).then_some(radius)
    }
}

/// Evaluates a polynomial and its derivative without products with zero, which a compiler may not remove.
#[inline(always)]
fn horner(coefficients: &[f64], x: f64) -> (f64, f64) {
    let Some((&last, rest)) = coefficients.split_last() else { return (0.0, 0.0) };
    let Some((&next, rest)) = rest.split_last() else { return (last, 0.0) };
    rest.iter().rev().fold((last * x + next, last), |(value, slope), c| (value * x + c, slope * x + value))
}

/// Returns a lower bound of a polynomial between zero and x: its positive constant and its negative terms at x.
#[inline(always)]
fn lower_bound(coefficients: &[f64], x: f64) -> f64 {
    let terms = coefficients.iter().rev().fold(0.0, |value, c| value * x + c.min(0.0));
    terms + coefficients[0].max(0.0)
}

/// Returns the smallest positive root with a sign change of a polynomial.
fn first_root(coefficients: &[f64]) -> Option<f64> {
    positive_roots(coefficients).first().copied()
}

/// Returns the positive roots with a sign change, ascending: at most one between neighbouring roots of the derivative.
fn positive_roots(coefficients: &[f64]) -> Vec<f64> {
    let used = coefficients.iter().rposition(|&c| c != 0.0).unwrap_or_default();
    if used == 0 || !coefficients.iter().all(|c| c.is_finite()) {
        return vec![];
    }
    let own = &coefficients[..=used];
    let value = |x: f64| horner(own, x).0;
    let derivative: Vec<f64> = (1..=used).map(|i| i as f64 * own[i]).collect();
    // Upper bound of all roots (Fujiwara 1916).
    let term = |i: usize| (own[i] / own[used]).abs().powf(((used - i) as f64).recip());
    let bound = 2.0 * (0..used).map(term).fold(0.0, f64::max);
    let mut ends = positive_roots(&derivative);
    ends.retain(|&end| end < bound);
    ends.push(bound);
    let mut roots = Vec::new();
    let mut low = 0.0;
    for high in ends {
        if (value(low) < 0.0) != (value(high) < 0.0) {
            roots.push(bisected(low, high, value));
        }
        low = high;
    }
    roots
}

/// Returns the root of a function between two bounds by bisection.
fn bisected(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    let sign = value(low) < 0.0;
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if (value(middle) < 0.0) == sign { low = middle } else { high = middle }
    }
}

/// Returns the inverse of a matrix; not finite for a singular matrix.
#[inline(always)]
pub fn inverted([[a, b], [c, d]]: Matrix2) -> Matrix2 {
    let determinant = a * d - b * c;
    [[d / determinant, -b / determinant], [-c / determinant, a / determinant]]
}

/// Returns the product of a matrix and a vector.
#[inline(always)]
pub fn times([x, y]: &Matrix2, v: [f64; 2]) -> [f64; 2] {
    [x[0] * v[0] + x[1] * v[1], y[0] * v[0] + y[1] * v[1]]
}

/// Returns the argument for which a map (its value and partials) equals `target`, by Newton's method from `start`. None without
/// convergence, or if the determinant becomes negative on the way.
#[inline(always)]
pub fn way_back(
    start: [f64; 2],
    target: [f64; 2],
    map: impl Fn([f64; 2]) -> ([f64; 2], Matrix2),
) -> Option<[f64; 2]> {
    let mut at = start;
    let (mut before, mut grown) = (f64::INFINITY, 0);
    for _ in 0..STEPS {
        let (value, by) = map(at);
        let determinant = by[0][0] * by[1][1] - by[0][1] * by[1][0];
        if determinant <= 0.0 {
            return None;
        }
        if value == target {
            return Some(at);
        }
        let [x, y] = [target[0] - value[0], target[1] - value[1]].map(|lack| lack / determinant);
        let step = [by[1][1] * x - by[0][1] * y, by[0][0] * y - by[1][0] * x];
        at = [at[0] + step[0], at[1] + step[1]];
        let [square, size] = [step, at].map(square_of);
        // Expected error after a step: its square times the curvature, estimated from the previous step or assumed as for typical lenses.
        let (rounding, shown) = (ROUNDING * ROUNDING * size, if square > before { square } else { before });
        if square * square <= rounding * size && square * square * square <= rounding * shown * shown {
            return Some(at);
        }
        grown += usize::from(square >= before);
        before = square;
        if grown == 2 || !square.is_finite() {
            return (square <= REACHED * REACHED * size).then_some(at);
        }
    }
    None
}

/// Returns the argument for which a lens (its value and partials) equals `target`. The initial value inverts the radial part along the
/// direction of `target`. Coefficients of that part beyond the given powers are zero.
#[inline(always)]
pub fn from_radial(
    radial: &RadialFactor,
    powers: [usize; 2],
    target: [f64; 2],
    lens: impl Fn([f64; 2]) -> ([f64; 2], Matrix2) + Copy,
) -> Option<[f64; 2]> {
    let distorted = square_of(target);
    if let Some(ratio) = radial.nearly(distorted, powers) {
        let found = way_back(target.map(|value| ratio * value), target, lens);
        let far = BEYOND * ratio;
        if found.is_some_and(|place| square_of(place) <= far * far * distorted) {
            return found;
        }
    }
    from_limited(*radial, target, lens)
}

/// Handles lenses with a limited radial part; passed by value, so that this rarely called function forces no variable into memory.
#[cold]
#[inline(never)]
fn from_limited(
    radial: RadialFactor,
    target: [f64; 2],
    lens: impl Fn([f64; 2]) -> ([f64; 2], Matrix2),
) -> Option<[f64; 2]> {
    way_back_of_any(radial, target, &lens)
}

fn way_back_of_any(
    radial: RadialFactor,
    target: [f64; 2],
    lens: &dyn Fn([f64; 2]) -> ([f64; 2], Matrix2),
) -> Option<[f64; 2]> {
    let distorted = target[0].hypot(target[1]);
    let ratio = if distorted > 0.0 { radial.invert(distorted)? / distorted } else { 1.0 };
    way_back(target.map(|value| ratio * value), target, lens)
}

#[inline(always)]
fn square_of([a, b]: [f64; 2]) -> f64 {
    a * a + b * b
}
