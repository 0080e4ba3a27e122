//! Points on an unknown plane.

use nalgebra::{DMatrix, RowVector3};

use super::{
    CommonKind, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation, in_own_axes, own_axes,
};

/// A point on a plane, or at a distance from it: the standard deviation is how flat that is.
///
/// n.(P - p_0) - d, n being the third of the axes of the plane and p_0 the place that is given; with the partials n by P, -1 by d, and by a
/// turn of the plane about its own axes those of R^T (P - p_0).
#[derive(Debug, Clone, PartialEq)]
pub struct OnPlane {
    /// The point.
    pub point: usize,
    /// The plane.
    pub plane: usize,
    /// The observed distance from it along its normal.
    pub distance: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ObservationModel for OnPlane {
    const NAME: &'static str = "on plane";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(plane)], &[distance]) = (of.points, of.commons, values) else { return None };
        Some(Self { point, plane, distance, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.plane), CommonKind::Plane)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        in_own_axes(sites, rows, &RowVector3::new(0.0, 0.0, 1.0), &[self.distance]);
    }

    fn axes(&self, sites: &Sites<'_>) -> Option<DMatrix<f64>> {
        own_axes(sites, &RowVector3::new(0.0, 0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PLANE, agrees};
    use super::OnPlane;

    #[test]
    fn partials_agree_with_differences() {
        agrees(&OnPlane { point: 1, plane: PLANE, distance: 0.1, sd: 0.01 }.into());
    }
}
