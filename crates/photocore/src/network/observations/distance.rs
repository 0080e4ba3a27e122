//! Distances between points, scale bars.

use nalgebra::{DMatrix, Matrix1x3};

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation};

/// The distance between two points: a tape, a rangefinder, the ends of a scale bar.
///
/// s = |Q - P|, with the partials e = (Q - P)/s by Q and -e by P (Mikhail and Ackermann 1976, "Observations and Least Squares"); of an
/// instrument with the scale m and the constant k, m s + k, with the partials m e, -m e, and s and 1 by m and k.
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// Its ends P and Q.
    pub points: [usize; 2],
    /// The observed length in the unit of the object space.
    pub length: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// The instrument, where its scale and constant count.
    pub instrument: Option<usize>,
}

impl ObservationModel for Distance {
    const NAME: &'static str = "distance";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[p, q], &[instrument], &[length]) = (of.points, of.commons, values) else { return None };
        Some(Self { points: [p, q], length, sd: deviation(&covariance), instrument })
    }

    fn touches(&self) -> Touches {
        Touches::points(&self.points).and(self.instrument, CommonKind::Instrument)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let difference = sites.position(1) - sites.position(0);
        let distance = difference.norm();
        let (scale, constant) = match self.instrument {
            None => (1.0, 0.0),
            Some(_) => (sites.common(0).vector().x, sites.common(0).vector().y),
        };
        let direction = scale * (difference / distance).transpose();
        rows.residual(0, &[self.length - scale * distance - constant]);
        rows.by_position(0, 0, &-direction);
        rows.by_position(0, 1, &direction);
        if self.instrument.is_some() {
            rows.by_offset(0, 0, &Matrix1x3::new(distance, 1.0, 0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{INSTRUMENT, agrees, stays};
    use super::Distance;

    #[test]
    fn partials_agree_with_differences() {
        for instrument in [None, Some(INSTRUMENT)] {
            agrees(&Distance { points: [1, 0], length: 4.0, sd: 0.01, instrument }.into());
        }
    }

    #[test]
    fn moves_with_the_network() {
        assert!(stays(&Distance { points: [1, 0], length: 4.0, sd: 0.01, instrument: None }.into()));
    }
}
