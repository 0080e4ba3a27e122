//! Positions of photos from GNSS.

use nalgebra::DMatrix;

use super::{CommonKind, Named, ObservationModel, Precision, Quantity, Rows, Sites, Touches, rows_of, three};
use crate::geometry::Vector3;

/// The position of the antenna of a photo.
///
/// `C + A l + s + d dt`, with the partials `I` by C, `-A [l]x` by rho, `A` by l, `I` by s and `dt I` by d (Ackermann and Schade 1993); in
/// geographic space positions and their errors are told in the axes east, north and up of the observed place.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// The photo.
    pub photo: usize,
    /// The observed coordinates of the antenna in the object space.
    pub coordinates: [f64; 3],
    /// l, from the projection centre to the antenna in the photo's axes (x right, y up, z back), in the unit of the object space.
    pub lever_arm: Quantity<Vector3>,
    /// s, where there is one.
    pub shift: Option<usize>,
    /// d, where there is one.
    pub drift: Option<usize>,
    /// dt in seconds: from the time that the drift counts from.
    pub time: f64,
    /// Of X, Y, Z or, in geographic space, of east, north and up, in units of length.
    pub precision: Precision,
}

impl Position {
    /// With a lever arm that is known, and nothing else.
    pub fn new(photo: usize, coordinates: [f64; 3], lever_arm: Vector3, precision: Precision) -> Self {
        let lever_arm = Quantity::Known(lever_arm);
        Self { photo, coordinates, lever_arm, shift: None, drift: None, time: 0.0, precision }
    }
}

impl Position {
    /// l; zero where it is unknown.
    pub(in crate::network) fn known_lever_arm(&self) -> Vector3 {
        match self.lever_arm {
            Quantity::Known(lever_arm) => lever_arm,
            Quantity::Common(_) => Vector3::zeros(),
        }
    }
}

impl ObservationModel for Position {
    const NAME: &'static str = "position";

    /// The coordinates, l where it is known, dt; lever arm, shift and drift.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[photo], &[lever_arm, shift, drift]) = (of.photos, of.commons) else { return None };
        Some(Self {
            photo,
            coordinates: three(values, 0)?,
            lever_arm: Quantity::new(lever_arm, three(values, 3)?.into()),
            shift,
            drift,
            time: *values.get(6)?,
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        Touches::photos(&[self.photo])
            .and(self.lever_arm.common(), CommonKind::LeverArm)
            .and(self.shift, CommonKind::Shift)
            .and(self.drift, CommonKind::Drift)
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
        let lever_arm =
            self.lever_arm.common().map_or_else(|| self.known_lever_arm(), |_| sites.common(0).vector());
        let mut computed = pose.position + pose.attitude * lever_arm;
        rows.by_centre(0, 0, &axes);
        rows.by_rotation(0, 0, &(-axes * pose.attitude * lever_arm.cross_matrix()));
        let mut place = 0;
        if self.lever_arm.common().is_some() {
            rows.by_offset(0, 0, &(axes * pose.attitude));
            place = 1;
        }
        for factor in [self.shift.map(|_| 1.0), self.drift.map(|_| self.time)].into_iter().flatten() {
            let own = sites.common(place);
            computed += factor * own.attitude() * own.vector();
            rows.by_offset(0, place, &(factor * axes * own.attitude()));
            place += 1;
        }
        rows.residual(0, (axes * (observed - computed)).as_slice());
    }

    /// What a drift takes up depends on where all antennas are.
    fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        self.drift.is_none().then(|| sites.observed(self.coordinates).1).and_then(|axes| rows_of(&axes))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{DRIFT, LEVER_ARM, PLACES, SHIFT, agrees};
    use super::{Position, Precision, Quantity, Vector3};

    #[test]
    fn partials_agree_with_differences() {
        let (lever_arm, precision) = (Vector3::new(0.3, -1.2, 0.8), Precision::Deviations(vec![0.01; 3]));
        let known = Position::new(1, PLACES[0], lever_arm, precision);
        agrees(&known.clone().into());
        agrees(&Position { shift: Some(SHIFT), ..known.clone() }.into());
        let lever_arm = Quantity::Common(LEVER_ARM);
        let all = Position { lever_arm, shift: Some(SHIFT), drift: Some(DRIFT), time: -7.5, ..known };
        agrees(&all.into());
    }
}
