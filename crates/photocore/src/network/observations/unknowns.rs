//! Common unknowns alone: those that were determined before, bases of rigs.

use nalgebra::DMatrix;

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation};

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

/// The distance between two sensors on a frame, or of one from the frame itself: a base that was measured gives a rig its scale.
///
/// s = |c_2 - c_1|, with the partials e = (c_2 - c_1)/s by c_2 and -e by c_1, c_1 being zero where there is one sensor alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// The first sensor; None for that which is the frame.
    pub first: Option<usize>,
    /// The second sensor.
    pub second: usize,
    /// The observed length in the unit of the object space.
    pub length: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ObservationModel for Base {
    const NAME: &'static str = "base";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[first, Some(second)], &[length]) = (of.commons, values) else { return None };
        Some(Self { first, second, length, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::default().and(Some(self.second), CommonKind::Sensor).and(self.first, CommonKind::Sensor)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let mut difference = sites.common(0).vector();
        if self.first.is_some() {
            difference -= sites.common(1).vector();
        }
        let distance = difference.norm();
        let direction = (difference / distance).transpose();
        rows.residual(0, &[self.length - distance]);
        rows.by_offset(0, 0, &direction);
        if self.first.is_some() {
            rows.by_offset(0, 1, &-direction);
        }
    }
}
