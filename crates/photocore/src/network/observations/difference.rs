//! Differences of coordinates.

use nalgebra::{DMatrix, SMatrix};

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches, three};
use crate::geometry::Matrix3;

/// The components of the vector from one point to another: a GNSS baseline, a levelled height, offsets that were taped.
///
/// Q - P in cartesian axes (geocentric ones in geographic space), with the partials I by Q and -I by P.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// P and Q.
    pub points: [usize; 2],
    /// The observed components along X, Y, Z in the unit of the object space; None for those that were not observed.
    pub components: [Option<f64>; 3],
    /// Of those that were observed, in their order.
    pub precision: Precision,
}

impl ObservationModel for Difference {
    const NAME: &'static str = "difference";

    /// The vector, NaN for components that were not observed.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[p, q] = of.points else { return None };
        let components = three(values, 0)?.map(|value| (!value.is_nan()).then_some(value));
        if covariance.shape() != (3, 3) {
            return None;
        }
        let seen: Vec<usize> = (0..3).filter(|&k| components[k].is_some()).collect();
        let precision = Precision::Covariance(covariance.select_rows(&seen).select_columns(&seen));
        Some(Self { points: [p, q], components, precision })
    }

    fn touches(&self) -> Touches {
        Touches::points(&self.points)
    }

    fn rows(&self) -> usize {
        self.components.iter().flatten().count()
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let difference = sites.position(1) - sites.position(0);
        let observed = (0..3).filter_map(|k| self.components[k].map(|value| (k, value)));
        for (row, (k, value)) in observed.enumerate() {
            let axis: SMatrix<f64, 1, 3> = Matrix3::identity().row(k).into();
            rows.residual(row, &[value - difference[k]]);
            rows.by_position(row, 0, &-axis);
            rows.by_position(row, 1, &axis);
        }
    }

    fn axes(&self, _: &Sites<'_>) -> Option<DMatrix<f64>> {
        let observed: Vec<usize> = (0..3).filter(|&k| self.components[k].is_some()).collect();
        Some(DMatrix::from_fn(observed.len(), 3, |row, k| f64::from(u8::from(observed[row] == k))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::agrees;
    use super::{Difference, Precision};

    #[test]
    fn partials_agree_with_differences() {
        let precision = Precision::Deviations(vec![0.01, 0.02]);
        agrees(&Difference { points: [1, 0], components: [Some(1.0), None, Some(-2.0)], precision }.into());
    }
}
