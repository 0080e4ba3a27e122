//! Smooth curves: sums of coefficients that are zero.

use nalgebra::{DMatrix, Matrix3};

use super::{Fault, Named, ObservationModel, Precision, Rows, Sites, Touches, three};
use crate::geometry::Vector3;

/// A sum of coefficients of a trajectory, each with its factor: differences of neighbours (Eilers and Marx 1996), or one that follows from
/// the one before as in a process of Gauss and Markov.
///
/// `sum f_k c_k`, with the partials `f_k I`.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothness {
    /// The coefficients: common unknowns of three components.
    pub coefficients: Vec<usize>,
    /// As many factors.
    pub factors: Vec<f64>,
    /// What was observed, most often zero.
    pub observed: [f64; 3],
    /// Of x, y, z.
    pub precision: Precision,
}

impl ObservationModel for Smoothness {
    const NAME: &'static str = "smoothness";

    /// What was observed, then the factors.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let coefficients: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let factors = values.get(3..)?.to_vec();
        let precision = Precision::Covariance(covariance);
        let sound = factors.len() == coefficients.len();
        sound.then_some(Self { coefficients, factors, observed: three(values, 0)?, precision })
    }

    fn touches(&self) -> Touches {
        Touches { commons: self.coefficients.iter().map(|&own| (own, None)).collect(), ..Touches::default() }
    }

    fn rows(&self) -> usize {
        3
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let mut missing = Vector3::from(self.observed);
        for (k, &factor) in self.factors.iter().enumerate() {
            missing -= factor * sites.common(k).vector();
            rows.by_offset(0, k, &Matrix3::from_diagonal_element(factor));
        }
        rows.residual(0, missing.as_slice());
    }

    fn check(&self) -> Result<(), Fault> {
        let numbers = self.factors.iter().chain(&self.observed);
        if numbers.into_iter().all(|value| value.is_finite()) { Ok(()) } else { Err(Fault::NotFinite) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{DRIFT, LEVER_ARM, SHIFT, agrees};
    use super::{Precision, Smoothness};

    #[test]
    fn partials_agree_with_differences() {
        let (coefficients, factors) = (vec![LEVER_ARM, SHIFT, DRIFT], vec![1.0, -2.0, 1.0]);
        let precision = Precision::Deviations(vec![0.01; 3]);
        agrees(&Smoothness { coefficients, factors, observed: [0.1, 0.0, -0.2], precision }.into());
    }
}
