//! Points at an unknown height.

use nalgebra::{DMatrix, RowVector3};

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation};

/// A point at the height of a level, or so much above it: a water line, the horizon of a levelling instrument.
///
/// Z - h, with the partials 1 by Z and -1 by h; heights above the ellipsoid in geographic space. As many points as there are give one check
/// fewer, as their differences with the full covariance of these would.
#[derive(Debug, Clone, PartialEq)]
pub struct OnLevel {
    /// The point.
    pub point: usize,
    /// The level.
    pub level: usize,
    /// The observed height above it: zero, or what was levelled.
    pub difference: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ObservationModel for OnLevel {
    const NAME: &'static str = "on level";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(level)], &[difference]) = (of.points, of.commons, values) else { return None };
        Some(Self { point, level, difference, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.level), CommonKind::Level)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        rows.residual(0, &[self.difference - (sites.height(0) - sites.common(0).height())]);
        rows.by_height(0, 0, 1.0);
        rows.by_offset(0, 0, &RowVector3::new(0.0, 0.0, -1.0));
    }

    fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        sites.up()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{LEVEL, agrees};
    use super::OnLevel;

    #[test]
    fn partials_agree_with_differences() {
        agrees(&OnLevel { point: 1, level: LEVEL, difference: 0.2, sd: 0.01 }.into());
    }
}
