//! Points on unknown levels, planes, vertical lines and straight lines.

use nalgebra::{DMatrix, Matrix2x3, RowVector3};

use super::{
    CommonKind, Named, ObservationInputs, ObservationModel, Precision, Rows, Touches, deviation, in_own_axes,
    own_axes,
};

/// A point on a plane, or at a given distance from it; its standard deviation is the flatness of the plane.
///
/// n.(P - p_0) - d, with the normal n (third axis of the plane) and the given position p_0. Partials are n by P, -1 by d, and the third row
/// of `[R^T (P - p_0)]x` by a rotation about the own axes.
#[derive(Debug, Clone, PartialEq)]
pub struct OnPlane {
    /// Point.
    pub point: usize,
    /// Plane.
    pub plane: usize,
    /// Observed distance along the normal.
    pub distance: f64,
    /// Standard deviation of the distance.
    pub sd: f64,
}

impl ObservationModel for OnPlane {
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(plane)], &[distance]) = (of.points, of.commons, values) else { return None };
        Some(Self { point, plane, distance, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.plane), CommonKind::Plane)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        in_own_axes(inputs, rows, &RowVector3::new(0.0, 0.0, 1.0), &[self.distance]);
    }

    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        own_axes(inputs, &RowVector3::new(0.0, 0.0, 1.0))
    }
}

/// A point at the height of a level, or at a given height above it: a water line, the horizon of a levelling instrument.
///
/// Z - h, with the partials 1 by Z and -1 by h; heights above the ellipsoid in geographic space. n points yield n - 1 checks, like their
/// differences with full covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct OnLevel {
    /// Point.
    pub point: usize,
    /// Level.
    pub level: usize,
    /// Observed height above the level: zero or levelled.
    pub difference: f64,
    /// Standard deviation of the height.
    pub sd: f64,
}

impl ObservationModel for OnLevel {
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[point], &[Some(level)], &[difference]) = (of.points, of.commons, values) else { return None };
        Some(Self { point, level, difference, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::points(&[self.point]).and(Some(self.level), CommonKind::Level)
    }

    fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
        rows.residual(0, &[self.difference - (inputs.height(0) - inputs.common(0).height())]);
        rows.by_height(0, 0, 1.0);
        rows.by_offset(0, 0, &RowVector3::new(0.0, 0.0, -1.0));
    }

    fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
        inputs.up()
    }
}

/// Points on a line: two offsets are observed as zero.
macro_rules! on_lines {
    ($($(#[$doc:meta])* $name:ident = $kind:ident, $axes:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            /// Point.
            pub point: usize,
            /// Line.
            pub line: usize,
            #[doc = $axes]
            pub precision: Precision,
        }

        impl ObservationModel for $name {
            const ROWS: usize = 2;

            fn from_numbers(of: &Named<'_>, _: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
                let (&[point], &[Some(line)]) = (of.points, of.commons) else { return None };
                Some(Self { point, line, precision: Precision::Covariance(covariance) })
            }

            fn touches(&self) -> Touches {
                Touches::points(&[self.point]).and(Some(self.line), CommonKind::$kind)
            }

            fn write(&self, inputs: &ObservationInputs<'_>, rows: &mut Rows<'_>) {
                in_own_axes(inputs, rows, &Matrix2x3::identity(), &[0.0; 2]);
            }

            fn axes(&self, inputs: &ObservationInputs<'_>) -> Option<DMatrix<f64>> {
                own_axes(inputs, &Matrix2x3::identity())
            }
        }
    )*};
}

on_lines! {
    /// A point on a plumb line.
    ///
    /// (X - X0, Y - Y0), with the partials 1 by X, Y and -1 by X0, Y0; in geographic space along east and north at the given position.
    OnPlumbLine = PlumbLine, "Of the offsets along X and Y or, in geographic space, east and north.";
    /// A point on a straight line.
    ///
    /// T^T (P - p_0) - q, with the first two axes T of the line and the given position p_0. Partials are T^T by P, -I by q, and the first
    /// two rows of `[R^T (P - p_0)]x` by a rotation about the own axes.
    OnLine = Line, "Of the offsets along the first two axes of the line.";
}
