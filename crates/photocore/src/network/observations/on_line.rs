//! Points on an unknown straight line.

use nalgebra::{DMatrix, Matrix2x3};

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, in_own_axes, own_axes};

/// A point on a straight line.
///
/// T^T (P - p_0) - q, T being the first two of the axes of the line and p_0 the place that is given; with the partials T^T by P, -I by q, and by a
/// turn of the line about its own axes those of R^T (P - p_0).
#[derive(Debug, Clone, PartialEq)]
pub struct OnLine {
    /// The point.
    pub point: usize,
    /// The line.
    pub line: usize,
    /// Of the offsets along the first two axes of the line.
    pub precision: Precision,
}

impl ObservationModel for OnLine {
    const NAME: &'static str = "on line";

    fn from_numbers(of: &Named<'_>, _: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(line)]) = (of.points, of.commons) else { return None };
        Some(Self { point, line, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.line), CommonKind::Line)
    }

    fn rows(&self) -> usize {
        2
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        in_own_axes(sites, rows, &Matrix2x3::identity(), &[0.0; 2]);
    }

    fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        own_axes(sites, &Matrix2x3::identity())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{LINE, agrees};
    use super::{OnLine, Precision};

    #[test]
    fn partials_agree_with_differences() {
        agrees(&OnLine { point: 1, line: LINE, precision: Precision::Deviations(vec![0.01, 0.02]) }.into());
    }
}
