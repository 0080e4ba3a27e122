//! Common unknowns that were determined before.

use nalgebra::DMatrix;

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches};

/// What was observed of a common unknown as one observation with its full covariance, from an adjustment of its own.
///
/// v = d - x, x being the unknowns, which count from what is given, and d what was observed of them, where that is another: with rotations
/// v = Log(R^T R_0), and d is zero. The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The common unknown; its own standard deviations are infinite.
    pub common: usize,
    /// How many unknowns it has.
    pub components: usize,
    /// d; nothing at all where what is given was observed.
    pub observed: Vec<f64>,
    /// Of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    const NAME: &'static str = "prior";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[Some(common)] = of.commons else { return None };
        let (components, observed) = (covariance.nrows(), values.to_vec());
        let sound = observed.is_empty() || observed.len() == components;
        sound.then_some(Self { common, components, observed, precision: Precision::Covariance(covariance) })
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
        let observed = |k: usize| self.observed.get(k).copied().unwrap_or_default();
        let missing = sites.common(0).unknowns().enumerate().map(|(k, value)| observed(k) - value);
        rows.residual(0, &missing.collect::<Vec<f64>>());
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
            let observed = vec![0.5; components];
            agrees(&Prior { common, components, observed, precision }.into());
        }
    }
}
