//! Points of equal height.

use nalgebra::DMatrix;

use super::{Named, ObservationInputs, ObservationModel, Rows, Touches, deviation};

/// Two points of equal height, or with a levelled height difference.
///
/// h = Z_Q - Z_P, with the partials 1 by Z_Q and -1 by Z_P; heights above the ellipsoid in geographic space.
#[derive(Debug, Clone, PartialEq)]
pub struct EqualHeight {
    /// Points P and Q.
    pub points: [usize; 2],
    /// Observed height of Q above P: zero or levelled.
    pub difference: f64,
    /// Standard deviation of the difference.
    pub sd: f64,
}

impl ObservationModel for EqualHeight {
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[p, q], &[difference]) = (of.points, values) else { return None };
        Some(Self { points: [p, q], difference, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&self.points)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        rows.residual(0, &[self.difference - (inputs.height(1) - inputs.height(0))]);
        rows.by_height(0, 0, -1.0);
        rows.by_height(0, 1, 1.0);
    }

    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        inputs.up()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::agrees;
    use super::EqualHeight;

    #[test]
    fn partials_agree_with_differences() {
        agrees(&EqualHeight { points: [0, 1], difference: 0.2, sd: 0.01 }.into());
    }
}
