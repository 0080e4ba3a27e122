//! Points on an unknown vertical.

use nalgebra::{DMatrix, Matrix2x3};

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, in_own_axes, own_axes};

/// A point on a plumb line.
///
/// (X - X0, Y - Y0), with the partials 1 by X, Y and -1 by X0, Y0; in geographic space along east and north of the given place.
#[derive(Debug, Clone, PartialEq)]
pub struct OnPlumbLine {
    /// The point.
    pub point: usize,
    /// The line.
    pub line: usize,
    /// Of the offsets along X and Y or, in geographic space, east and north.
    pub precision: Precision,
}

impl ObservationModel for OnPlumbLine {
    const NAME: &'static str = "on plumb line";

    fn from_numbers(of: &Named<'_>, _: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(line)]) = (of.points, of.commons) else { return None };
        Some(Self { point, line, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.line), CommonKind::PlumbLine)
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
    use super::super::tests::{PLUMB_LINE, agrees};
    use super::{OnPlumbLine, Precision};

    #[test]
    fn partials_agree_with_differences() {
        agrees(
            &OnPlumbLine { point: 1, line: PLUMB_LINE, precision: Precision::Deviations(vec![0.01, 0.02]) }
                .into(),
        );
    }
}
