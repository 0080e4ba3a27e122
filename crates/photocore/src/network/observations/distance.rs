//! Distances between points, scale bars.

use super::{ObservationModel, Precision, Rows, Sites, Touches};

/// The distance between two points: a tape, a rangefinder, the ends of a scale bar.
///
/// s = |Q - P|, with the partials e = (Q - P)/s by Q and -e by P (Mikhail and Ackermann 1976, "Observations and Least Squares").
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// Its ends P and Q.
    pub points: [usize; 2],
    /// The observed length in the unit of the object space.
    pub length: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ObservationModel for Distance {
    const NAME: &'static str = "distance";

    fn touches(&self) -> Touches {
        Touches::points(&self.points)
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
        let direction = (difference / distance).transpose();
        rows.residual(0, &[self.length - distance]);
        rows.by_position(0, 0, &-direction);
        rows.by_position(0, 1, &direction);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{agrees, stays};
    use super::Distance;

    #[test]
    fn partials_agree_with_differences() {
        agrees(&Distance { points: [1, 0], length: 4.0, sd: 0.01 }.into());
    }

    #[test]
    fn moves_with_the_network() {
        assert!(stays(&Distance { points: [1, 0], length: 4.0, sd: 0.01 }.into()));
    }
}
