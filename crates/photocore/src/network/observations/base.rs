//! Distances between the sensors of a rig.

use nalgebra::DMatrix;

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation};

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

#[cfg(test)]
mod tests {
    use super::super::tests::{SENSORS, agrees};
    use super::Base;

    #[test]
    fn partials_agree_with_differences() {
        for first in [None, Some(SENSORS[0])] {
            agrees(&Base { first, second: SENSORS[1], length: 0.5, sd: 0.01 }.into());
        }
    }
}
