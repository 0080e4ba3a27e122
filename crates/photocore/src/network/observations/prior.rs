//! Common unknowns that were determined before.

use nalgebra::DMatrix;

use super::{Named, ObservationModel, Precision, Rows, Sites, Touches};

/// What was observed of common unknowns as one observation with its full covariance, from an adjustment of its own.
///
/// v = d - x, x being the unknowns, which count from what is given, and d what was observed of them, where that is another: with rotations
/// v = Log(R^T R_0), and d is zero. The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The common unknowns; their own standard deviations are infinite.
    pub commons: Vec<usize>,
    /// How many unknowns each of them has.
    pub components: Vec<usize>,
    /// d; nothing at all where what is given was observed.
    pub observed: Vec<f64>,
    /// Of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    const NAME: &'static str = "prior";

    /// Of a single common unknown d, or nothing; of several how many unknowns each has.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let commons: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let (components, observed) = match commons[..] {
            [_] => (vec![covariance.nrows()], values.to_vec()),
            _ => (values.iter().map(|&own| own as usize).collect(), vec![]),
        };
        let sound = components.len() == commons.len()
            && components.iter().sum::<usize>() == covariance.nrows()
            && (observed.is_empty() || observed.len() == covariance.nrows());
        sound.then_some(Self { commons, components, observed, precision: Precision::Covariance(covariance) })
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
        let observed = |k: usize| self.observed.get(k).copied().unwrap_or_default();
        let mut row = 0;
        for (common, &count) in self.components.iter().enumerate() {
            let missing =
                sites.common(common).unknowns().enumerate().map(|(k, value)| observed(row + k) - value);
            rows.residual(row, &missing.collect::<Vec<f64>>());
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
            let count = components.iter().sum();
            let (precision, observed) = (Precision::Deviations(vec![0.01; count]), vec![0.5; count]);
            agrees(&Prior { commons, components, observed, precision }.into());
        }
    }
}
