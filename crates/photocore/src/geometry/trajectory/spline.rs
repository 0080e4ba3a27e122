//! Spline corrections in time.

use std::ops::Range;

use smallvec::{SmallVec, smallvec};

use super::functions::{Active, BasisModel};

/// B-splines over nondecreasing knots (Cox and de Boor): B_k is nonzero between the knots k and k + degree + 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    /// Degree, 1 to 5.
    pub degree: usize,
    /// Knots in seconds; more than twice the degree.
    pub knots: Vec<f64>,
}

impl Spline {
    /// Returns the knot interval of a time, restricted to intervals with degree + 1 nonzero functions.
    fn interval(&self, time: f64) -> usize {
        let after = self.knots.partition_point(|&knot| knot <= time);
        after.saturating_sub(1).clamp(self.degree, self.count() - 1)
    }

    /// Returns the degree + 1 nonzero functions of a lower degree in an interval.
    fn lower(&self, interval: usize, degree: usize, time: f64) -> SmallVec<[f64; 6]> {
        let knot = |k: usize| self.knots[k];
        let mut all: SmallVec<[f64; 6]> = smallvec![1.0];
        for p in 1..=degree {
            let mut next: SmallVec<[f64; 6]> = smallvec![0.0; p + 1];
            for (j, value) in all.iter().enumerate() {
                // B of degree p - 1 that begins at this knot; the rest contributes to the function that begins one knot earlier.
                let k = interval + 1 + j - p;
                let length = knot(k + p) - knot(k);
                let share = if length > 0.0 { (time - knot(k)) / length } else { 0.0 };
                next[j + 1] += share * value;
                next[j] += if length > 0.0 { (1.0 - share) * value } else { 0.0 };
            }
            all = next;
        }
        all
    }
}

impl BasisModel for Spline {
    const NAME: &'static str = "spline";

    /// The numbers are the knots.
    fn from_numbers(degree: usize, numbers: &[f64]) -> Option<Self> {
        Some(Self { degree, knots: numbers.to_vec() })
    }

    fn count(&self) -> usize {
        self.knots.len().saturating_sub(self.degree + 1)
    }

    fn is_sound(&self) -> bool {
        let knots = &self.knots;
        (1..=5).contains(&self.degree)
            && knots.len() > 2 * self.degree + 1
            && knots.iter().all(|knot| knot.is_finite())
            && knots.windows(2).all(|pair| pair[0] <= pair[1])
            && knots[self.degree] < knots[self.count()]
    }

    fn put(&self, time: f64, all: &mut Active) {
        let (p, interval) = (self.degree, self.interval(time));
        let before = self.lower(interval, p - 1, time);
        let mut rates: SmallVec<[f64; 6]> = smallvec![0.0; p + 1];
        for (j, value) in before.iter().enumerate() {
            let k = interval + 1 + j - p;
            let length = self.knots[k + p] - self.knots[k];
            if length > 0.0 {
                rates[j] -= p as f64 * value / length;
                rates[j + 1] += p as f64 * value / length;
            }
        }
        *all = Active { first: interval - p, values: self.lower(interval, p, time), rates };
    }

    fn active(&self, time: f64) -> Range<usize> {
        let interval = self.interval(time);
        interval - self.degree..interval + 1
    }

    fn span(&self) -> (f64, f64) {
        let last = self.count().min(self.knots.len().saturating_sub(1));
        (self.knots[self.degree.min(last)], self.knots[last])
    }

    /// Mean of the inner knots (Greville).
    fn middle(&self, k: usize) -> Option<f64> {
        let inside = self.knots.get(k + 1..=k + self.degree)?;
        Some(inside.iter().sum::<f64>() / self.degree as f64)
    }

    /// A tenth of the mean distance between knots.
    fn reach(&self) -> Option<f64> {
        let (first, last) = self.span();
        Some(0.1 * (last - first) / (self.count() - self.degree).max(1) as f64)
    }
}
