//! Common unknowns that were determined before.

use nalgebra::DMatrix;

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches};

/// What is given of common unknowns as one observation with its full covariance, from an adjustment of its own.
///
/// v = -x, x being the unknowns, which count from what is given: with rotations v = Log(R^T R_0). The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The common unknowns; their own standard deviations are infinite.
    pub commons: Vec<usize>,
    /// How many unknowns each of them has.
    pub components: Vec<usize>,
    /// Of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    const NAME: &'static str = "prior";

    /// How many unknowns each common one has; nothing where there is one.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let commons: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let components: Vec<usize> = match values {
            [] => vec![covariance.nrows()],
            values => values.iter().map(|&own| own as usize).collect(),
        };
        let sound = components.len() == commons.len() && components.iter().sum::<usize>() == covariance.nrows();
        sound.then_some(Self { commons, components, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches { commons: self.commons.iter().map(|&own| (own, None)).collect(), ..Touches::default() }
    }

    fn rows(&self) -> usize {
        self.components.iter().sum()
    }

    fn components(&self, common: usize) -> usize {
        self.components[common]
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let mut row = 0;
        for (common, &count) in self.components.iter().enumerate() {
            let missing: Vec<f64> = sites.common(common).unknowns().map(|value| -value).collect();
            rows.residual(row, &missing);
            rows.by_itself(row, common, count);
            row += count;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PLANE, SENSORS, agrees};
    use super::{Precision, Prior};

    #[test]
    fn partials_agree_with_differences() {
        for (commons, components) in
            [(vec![SENSORS[0]], vec![6]), (vec![PLANE], vec![3]), (vec![PLANE, SENSORS[0]], vec![3, 6])]
        {
            let precision = Precision::Deviations(vec![0.01; components.iter().sum()]);
            agrees(&Prior { commons, components, precision }.into());
        }
    }
}
