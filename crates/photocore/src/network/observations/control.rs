//! Control points whose coordinates are correlated.

use nalgebra::DMatrix;

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches, rows_of, three};

/// The position of a point with its full covariance, from an adjustment of its own.
///
/// P, with the partials I; in geographic space P and its errors are told in the axes east, north and up of the observed place.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// The point.
    pub point: usize,
    /// Its observed coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Of X, Y, Z or, in geographic space, of east, north and up, in units of length.
    pub precision: Precision,
}

impl ObservationModel for Control {
    const NAME: &'static str = "control";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[point] = of.points else { return None };
        Some(Self { point, coordinates: three(values, 0)?, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point])
    }

    fn rows(&self) -> usize {
        3
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let (observed, axes) = sites.observed(self.coordinates);
        rows.residual(0, (axes * (observed - sites.position(0))).as_slice());
        rows.by_position(0, 0, &axes);
    }

    fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        rows_of(&sites.observed(self.coordinates).1)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PLACES, agrees};
    use super::{Control, Precision};

    #[test]
    fn partials_agree_with_differences() {
        let precision = Precision::Deviations(vec![0.01; 3]);
        agrees(&Control { point: 1, coordinates: PLACES[0], precision }.into());
    }
}
