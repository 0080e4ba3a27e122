//! Observations of single points and pairs: control points with full covariance, distances, coordinate differences.

use nalgebra::{DMatrix, SMatrix};

use super::{
    CommonKind, Named, ObservationInputs, ObservationModel, Precision, Rows, Touches, deviation, length,
    rows_of, three,
};
use crate::geometry::Matrix3;

/// Position of a point with its full covariance matrix, from a separate adjustment.
///
/// P, with the partials I; in geographic space, P and its errors refer to east, north and up at the observed position.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// Point.
    pub point: usize,
    /// Observed coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Precision of X, Y, Z or, in geographic space, of east, north and up, in units of length.
    pub precision: Precision,
}

impl ObservationModel for Control {
    const ROWS: usize = 3;

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[point] = of.points else { return None };
        Some(Self { point, coordinates: three(values, 0)?, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point])
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let (observed, axes) = inputs.observed(self.coordinates);
        rows.residual(0, (axes * (observed - inputs.position(0))).as_slice());
        rows.by_position(0, 0, &axes);
    }

    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        rows_of(&inputs.observed(self.coordinates).1)
    }
}

/// Distance between two points: a tape, a rangefinder, the ends of a scale bar.
///
/// s = |Q - P|, with the partials e = (Q - P)/s by Q and -e by P (Mikhail and Ackermann 1976, "Observations and Least Squares"). For an
/// instrument with scale m and constant k, m s + k: the partials are m e, -m e, and s and 1 by m and k.
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// End points P and Q.
    pub points: [usize; 2],
    /// Observed length in the unit of the object space.
    pub length: f64,
    /// Standard deviation of the length.
    pub sd: f64,
    /// Instrument, if its scale and constant apply.
    pub instrument: Option<usize>,
}

impl ObservationModel for Distance {
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[p, q], &[instrument], &[length]) = (of.points, of.commons, values) else { return None };
        Some(Self { points: [p, q], length, sd: deviation(&covariance), instrument })
    }

    fn touches(&self) -> Touches {
        Touches::points(&self.points).and(self.instrument, CommonKind::Instrument)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let difference = inputs.position(1) - inputs.position(0);
        let direction = length(inputs, rows, &difference, (self.length, self.instrument));
        rows.by_position(0, 0, &-direction);
        rows.by_position(0, 1, &direction);
    }
}

/// Components of the vector from one point to another: a GNSS baseline, a levelled height difference, taped offsets.
///
/// Q - P in Cartesian axes (geocentric ones in geographic space), with the partials I by Q and -I by P.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Points P and Q.
    pub points: [usize; 2],
    /// Observed components along X, Y, Z in the unit of the object space; None if not observed.
    pub components: [Option<f64>; 3],
    /// Precision of the observed components, in their order.
    pub precision: Precision,
}

impl ObservationModel for Difference {
    /// Values: the vector, with NaN for components that were not observed.
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

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let difference = inputs.position(1) - inputs.position(0);
        let observed = (0..3).filter_map(|k| self.components[k].map(|value| (k, value)));
        for (row, (k, value)) in observed.enumerate() {
            let axis: SMatrix<f64, 1, 3> = Matrix3::identity().row(k).into();
            rows.residual(row, &[value - difference[k]]);
            rows.by_position(row, 0, &-axis);
            rows.by_position(row, 1, &axis);
        }
    }

    fn axes(&self, _: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        let observed: Vec<usize> = (0..3).filter(|&k| self.components[k].is_some()).collect();
        Some(DMatrix::from_fn(observed.len(), 3, |row, k| f64::from(u8::from(observed[row] == k))))
    }
}
