//! Polynomial corrections in time.

use super::functions::{Active, BasisModel};

/// Powers of scaled time: `B_k = ((t - reference) / scale)^k`, k from 0 to the degree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polynomial {
    /// Highest power.
    pub degree: usize,
    /// Time with the scaled value 0.
    pub reference: f64,
    /// Unit of the scaled time, in seconds.
    pub scale: f64,
}

impl BasisModel for Polynomial {
    const NAME: &'static str = "polynomial";

    /// The numbers are the reference and the scale.
    fn from_numbers(degree: usize, numbers: &[f64]) -> Option<Self> {
        let &[reference, scale] = numbers else { return None };
        Some(Self { degree, reference, scale })
    }

    fn count(&self) -> usize {
        self.degree + 1
    }

    fn is_sound(&self) -> bool {
        self.reference.is_finite() && self.scale.is_finite() && self.scale > 0.0
    }

    fn put(&self, time: f64, all: &mut Active) {
        let s = (time - self.reference) / self.scale;
        let (mut power, mut rate) = (1.0, 0.0);
        for k in 0..=self.degree {
            all.values.push(power);
            all.rates.push(rate);
            rate = (k + 1) as f64 * power / self.scale;
            power *= s;
        }
    }
}
