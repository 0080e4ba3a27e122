//! Common unknowns that were determined before.

use nalgebra::DMatrix;

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches};

/// What is given of a common unknown as one observation with its full covariance, from an adjustment of its own.
///
/// v = -x, x being the unknowns, which count from what is given: with rotations v = Log(R^T R_0). The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The common unknown; its own standard deviations are infinite.
    pub common: usize,
    /// How many unknowns it has.
    pub components: usize,
    /// Of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    const NAME: &'static str = "prior";

    fn from_numbers(of: &Named<'_>, _: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[Some(common)] = of.commons else { return None };
        Some(Self { common, components: covariance.nrows(), precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches { commons: vec![(self.common, None)], ..Touches::default() }
    }

    fn rows(&self) -> usize {
        self.components
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let unknowns: Vec<f64> = sites.common(0).unknowns().collect();
        rows.residual(0, &unknowns.iter().map(|value| -value).collect::<Vec<f64>>());
        rows.by_itself(0, 0, self.components);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PLANE, SENSORS, agrees};
    use super::{Precision, Prior};

    #[test]
    fn partials_agree_with_differences() {
        for (common, components) in [(SENSORS[0], 6), (PLANE, 3)] {
            let precision = Precision::Deviations(vec![0.01; components]);
            agrees(&Prior { common, components, precision }.into());
        }
    }
}
