//! Positions of photos from GNSS.

use super::{ObservationModel, Precision, Rows, Sites, Touches};
use crate::geometry::Vector3;

/// The position of the antenna of a photo.
///
/// `C + A l`, with the partials `I` by C and `-A [l]x` by rho (Ackermann and Schade 1993); in geographic space positions and their errors are
/// told in the axes east, north and up of the observed place.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// The photo.
    pub photo: usize,
    /// The observed coordinates of the antenna in the object space.
    pub coordinates: [f64; 3],
    /// l, from the projection centre to the antenna in the photo's axes (x right, y up, z back), in the unit of the object space.
    pub lever_arm: Vector3,
    /// Of X, Y, Z or, in geographic space, of east, north and up, in units of length.
    pub precision: Precision,
}

impl ObservationModel for Position {
    const NAME: &'static str = "position";

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo])
    }

    fn rows(&self) -> usize {
        3
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let pose = sites.pose(0);
        let (observed, axes) = sites.observed(self.coordinates);
        let computed = pose.position + pose.attitude * self.lever_arm;
        rows.residual(0, (axes * (observed - computed)).as_slice());
        rows.by_centre(0, 0, &axes);
        rows.by_rotation(0, 0, &(-axes * pose.attitude * self.lever_arm.cross_matrix()));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PLACES, agrees};
    use super::{Position, Precision, Vector3};

    #[test]
    fn partials_agree_with_differences() {
        let (lever_arm, precision) = (Vector3::new(0.3, -1.2, 0.8), Precision::Deviations(vec![0.01; 3]));
        agrees(&Position { photo: 1, coordinates: PLACES[0], lever_arm, precision }.into());
    }
}
