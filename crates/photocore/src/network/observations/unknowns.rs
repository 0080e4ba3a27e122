//! Observations of shared parameters only: prior values, baselines of rigs.

use nalgebra::DMatrix;

use super::{
    CommonKind, Named, ObservationInputs, ObservationModel, Precision, Rows, Touches, deviation, length,
};

/// Joint observation of shared parameters with a full covariance matrix, from a separate adjustment.
///
/// v = d - x, with the parameters x relative to the given values, and the observed d if it differs from them. For rotations v = Log(R^T
/// R_0), and d is zero. The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Shared parameters, whose own standard deviations are infinite.
    pub commons: Vec<usize>,
    /// Number of components of each.
    pub components: Vec<usize>,
    /// Observed d; empty if the given values were observed.
    pub observed: Vec<f64>,
    /// Precision of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    /// Values: d or nothing for a single shared parameter; numbers of components for several.
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

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let observed = |k: usize| self.observed.get(k).copied().unwrap_or_default();
        let mut row = 0;
        for (common, &count) in self.components.iter().enumerate() {
            let missing =
                inputs.common(common).unknowns().enumerate().map(|(k, value)| observed(row + k) - value);
            rows.residual(row, &missing.collect::<Vec<f64>>());
            rows.add_identity(row, common, count);
            row += count;
        }
    }
}

/// Distance between two sensors on a frame, or between a sensor and the frame: a measured baseline defines the scale of a rig.
///
/// s = |c_2 - c_1|, with the partials e = (c_2 - c_1)/s by c_2 and -e by c_1; c_1 is zero for a single sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// First sensor; None for the frame itself.
    pub first: Option<usize>,
    /// Second sensor.
    pub second: usize,
    /// Observed length in the unit of the object space.
    pub length: f64,
    /// Standard deviation of the length.
    pub sd: f64,
}

impl ObservationModel for Base {
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[first, Some(second)], &[length]) = (of.commons, values) else { return None };
        Some(Self { first, second, length, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::default().and(Some(self.second), CommonKind::Sensor).and(self.first, CommonKind::Sensor)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        let mut difference = inputs.common(0).vector();
        if self.first.is_some() {
            difference -= inputs.common(1).vector();
        }
        let direction = length(inputs, rows, &difference, (self.length, None));
        rows.by_offset(0, 0, &direction);
        if self.first.is_some() {
            rows.by_offset(0, 1, &-direction);
        }
    }
}
