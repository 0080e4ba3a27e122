//! Ranges from photos to points: laser altimeters, rangefinders beside a camera.

use nalgebra::{DMatrix, Matrix1x3};

use super::{CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation, three};
use crate::geometry::Vector3;

/// The distance of a point from a rangefinder that moves with a photo.
///
/// s = |P - C - A l|, with the partials e by P, -e by C and e A \[l\]x by rho, e = (P - C - A l)^T/s; of an instrument with the scale m and
/// the constant k, m s + k, with the partials m e, -m e, m e A \[l\]x, and s and 1 by m and k.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// The photo.
    pub photo: usize,
    /// P.
    pub point: usize,
    /// The observed length in the unit of the object space.
    pub length: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// l, from the projection centre to the rangefinder in the photo's axes (x right, y up, z back), in the unit of the object space.
    pub lever_arm: Vector3,
    /// The instrument, where its scale and constant count.
    pub instrument: Option<usize>,
}

impl ObservationModel for Range {
    const NAME: &'static str = "range";

    /// The length, l.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[point], &[instrument]) = (of.photos, of.points, of.commons) else { return None };
        let (length, lever_arm) = (*values.first()?, three(values, 1)?.into());
        Some(Self { photo, point, length, sd: deviation(&covariance), lever_arm, instrument })
    }

    fn touches(&self) -> Touches {
        let photos = vec![self.photo];
        Touches { photos, ..Touches::points(&[self.point]) }.and(self.instrument, CommonKind::Instrument)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let pose = sites.pose(0);
        let ray = sites.position(0) - pose.position - pose.attitude * self.lever_arm;
        let distance = ray.norm();
        let (scale, constant) = match self.instrument {
            None => (1.0, 0.0),
            Some(_) => (sites.common(0).vector().x, sites.common(0).vector().y),
        };
        let direction = scale * (ray / distance).transpose();
        rows.residual(0, &[self.length - scale * distance - constant]);
        rows.by_position(0, 0, &direction);
        rows.by_centre(0, 0, &-direction);
        rows.by_rotation(0, 0, &(direction * pose.attitude * self.lever_arm.cross_matrix()));
        if self.instrument.is_some() {
            rows.by_offset(0, 0, &Matrix1x3::new(distance, 1.0, 0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{INSTRUMENT, agrees, stays};
    use super::{Range, Vector3};

    const RANGE: Range = Range {
        photo: 1,
        point: 0,
        length: 4.0,
        sd: 0.01,
        lever_arm: Vector3::new(0.3, -1.2, 0.8),
        instrument: None,
    };

    #[test]
    fn partials_agree_with_differences() {
        for instrument in [None, Some(INSTRUMENT)] {
            agrees(&Range { instrument, ..RANGE }.into());
        }
    }

    #[test]
    fn moves_with_the_network() {
        assert!(stays(&RANGE.into()));
    }
}
