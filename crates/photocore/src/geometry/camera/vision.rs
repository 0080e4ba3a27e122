//! Cameras of computer vision and of Agisoft: a projection, a lens with radial, tangential and prism terms, focal lengths.
//!
//! Each camera is a table of parameter roles. Axes are vision axes, x right, y down, z forward: (X, Y, Z) = (u1, -u2, -u3). Image
//! coordinates are pixels, column and row.

use super::inverse::RadialLimit;
use super::model::{CameraModel, Image, Unit};
use super::projections::{
    Central, DivisionByRadius, Equidistant, Equisolid as EquisolidRays, ExtendedUnified, FieldOfView, Seen,
    Stereographic as StereographicRays,
};
use super::radial_tangential::{Action, BentRay, Parts, Role, Table};
use crate::geometry::Vector3;

/// Declares cameras: name and number of parameters, name in files, projection, lens formula, parameters with their roles. The last
/// `constants` of them are always fixed.
macro_rules! cameras_of_vision {
    ($($(#[$doc:meta])* $name:ident[$count:literal] = $said:literal, $projection:ident, $action:ident, $constants:literal,
       $formula:expr, [$($parameter:literal: $role:expr),* $(,)?] $(, $lanes:ident)?;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name {
            /// Parameters, in order.
            pub parameters: [f64; $count],
        }

        impl Table<$count> for $name {
            type Projection = $projection;
            const ACTION: Action = Action::$action;
            const ROLES: [Role; $count] = [$($role),*];

            // Unrolled instead of a loop: the numbers remain in registers, and the code can be vectorized.
            #[inline(always)]
            #[allow(unused_assignments)]
            fn parts(&self) -> Parts {
                let (mut parts, mut at) = (Parts::none(), 0);
                $(parts.take($role, self.parameters[at]);
                at += 1;)*
                parts.shear += parts.skew * parts.focal[0];
                parts
            }

            #[inline(always)]
            #[allow(unused_assignments)]
            fn by_parameters(parts: &Parts, seen: &Seen, bending: &BentRay) -> [[f64; $count]; 2] {
                let (mut by, mut at) = ([[0.0; $count]; 2], 0);
                $([by[0][at], by[1][at]] = parts.by($role, seen, bending);
                at += 1;)*
                by
            }
        }

        impl CameraModel for $name {
            type Parameters = [f64; $count];

            const NAME: &'static str = $said;
            const PARAMETERS: &'static [(&'static str, Unit)] = &[$(($parameter, $role.unit())),*];
            const CONSTANTS: usize = $constants;
            const DOWN: bool = !matches!(Self::ROLES[0], FUp);
            $(const $lanes: bool = true;)?
            const FORMULA: &'static str = $formula;

            fn with_parameters(parameters: [f64; $count]) -> Self {
                Self { parameters }
            }

            fn parameters(&self) -> [f64; $count] {
                self.parameters
            }

            fn scale(&self) -> f64 {
                self.parts().focal[0].abs()
            }

            fn image(&self, u: &Vector3) -> [f64; 2] {
                self.place(u)
            }

            #[inline(always)]
            fn linearize(&self, u: &Vector3) -> Image<[f64; $count]> {
                self.with_partials(u)
            }

            fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
                self.to_camera_frame(xy)
            }

            fn faces(&self, u: &Vector3) -> bool {
                self.looks_to(u)
            }

            fn radius(&self, u: &Vector3, _: [f64; 2]) -> f64 {
                self.bent_at(u)
            }

            fn fold(&self) -> f64 {
                self.bent_until()
            }

            fn radial_limit(&self) -> Option<RadialLimit> {
                self.limit()
            }
        }
    )*};
}

/// Formula of (a, b) of a central perspective, the lens and the image.
macro_rules! central {
    ($image:literal, $lens:literal) => {
        concat!("(a, b) = (P1, -P2) / -P3, r^2 = a^2 + b^2, ", $lens, ", image = ", $image)
    };
}

/// Formula of an equidistant projection, the lens and the image.
macro_rules! fisheye {
    ($image:literal, $lens:literal) => {
        concat!(
            "(a, b) = theta (P1, -P2) / rho, rho = hypot(P1, P2), theta = atan2(rho, -P3), r^2 = a^2 + b^2, ",
            $lens,
            ", image = ",
            $image
        )
    };
}

use Role::*;

cameras_of_vision! {
    /// SIMPLE_PINHOLE of COLMAP: a central perspective.
    SimplePinhole[3] = "simple_pinhole", Central, Whole, 0,
        central!("(f a + cx, f b + cy)", "no lens"),
        ["f": F, "cx": Cx, "cy": Cy];
    /// PINHOLE of COLMAP: a central perspective with different focal lengths of columns and rows.
    Pinhole[4] = "pinhole", Central, Whole, 0,
        central!("(fx a + cx, fy b + cy)", "no lens"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy];
    /// SIMPLE_RADIAL of COLMAP: one radial term.
    SimpleRadial[4] = "simple_radial", Central, Whole, 0,
        central!("(f A + cx, f B + cy)", "(A, B) = (a, b) (1 + k r^2)"),
        ["f": F, "cx": Cx, "cy": Cy, "k": N(1)], IN_LANES;
    /// RADIAL of COLMAP: two radial terms.
    Radial[5] = "radial", Central, Whole, 0,
        "p = (P1, -P2) / -P3, image = (cx, cy) + f (1 + k1 p^2 + k2 p^4) p",
        ["f": F, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2)];
    /// Camera of Bundler and of "Bundle Adjustment in the Large" (Agarwal, Snavely, Seitz and Szeliski 2010): image coordinates are pixels
    /// from the principal point, x to the right and y up.
    Bal[3] = "bal", Central, Whole, 0,
        "p = -(P1, P2) / P3, image = f (1 + k1 p^2 + k2 p^4) p",
        ["f": FUp, "k1": N(1), "k2": N(2)];
    /// OPENCV of COLMAP: two radial and two tangential terms; p1, p2 are P2, P1 of photogrammetry.
    Opencv[8] = "opencv", Central, Whole, 0,
        central!("(fx A + cx, fy B + cy)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4) + (2 p1 a b + p2 (r^2 + 2 a^2), p1 (r^2 + 2 b^2) + 2 p2 a b)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2), "p1": T(1), "p2": T(0)], IN_LANES;
    /// FULL_OPENCV of COLMAP: a rational radial factor; k3 follows p2.
    FullOpencv[12] = "full_opencv", Central, Whole, 0,
        central!("(fx A + cx, fy B + cy)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + (2 p1 a b + p2 (r^2 + 2 a^2), \
             p1 (r^2 + 2 b^2) + 2 p2 a b)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2), "p1": T(1), "p2": T(0), "k3": N(3), "k4": D(1), "k5": D(2),
         "k6": D(3)];
    /// Camera of OpenCV: [`FullOpencv`] with a thin prism; pixel centres are integers.
    OpencvPinhole[16] = "opencv_pinhole", Central, Whole, 0,
        central!("(fx A + cx, fy B + cy)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + (2 p1 a b + p2 (r^2 + 2 a^2), \
             p1 (r^2 + 2 b^2) + 2 p2 a b) + (s1 r^2 + s2 r^4, s3 r^2 + s4 r^4)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2), "p1": T(1), "p2": T(0), "k3": N(3), "k4": D(1), "k5": D(2),
         "k6": D(3), "s1": S(0), "s2": S(1), "s3": S(2), "s4": S(3)];
    /// FOV of COLMAP (Devernay and Faugeras 2001). At omega = 0 the derivative with respect to omega vanishes: use another initial value.
    Fov[5] = "fov", FieldOfView, Whole, 0,
        central!("(fx A + cx, fy B + cy)", "(A, B) = (a, b) atan(2 r tan(omega / 2)) / (r omega)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "omega": Own(0)];
    /// SIMPLE_FISHEYE of COLMAP: equidistant.
    SimpleFisheye[3] = "simple_fisheye", Equidistant, Whole, 0,
        fisheye!("(f a + cx, f b + cy)", "no lens"),
        ["f": F, "cx": Cx, "cy": Cy];
    /// FISHEYE of COLMAP: equidistant.
    Fisheye[4] = "fisheye", Equidistant, Whole, 0,
        fisheye!("(fx a + cx, fy b + cy)", "no lens"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy];
    /// SIMPLE_RADIAL_FISHEYE of COLMAP: one radial term in theta.
    SimpleRadialFisheye[4] = "simple_radial_fisheye", Equidistant, Whole, 0,
        fisheye!("(f A + cx, f B + cy)", "(A, B) = (a, b) (1 + k r^2)"),
        ["f": F, "cx": Cx, "cy": Cy, "k": N(1)];
    /// RADIAL_FISHEYE of COLMAP: two radial terms in theta.
    RadialFisheye[5] = "radial_fisheye", Equidistant, Whole, 0,
        fisheye!("(f A + cx, f B + cy)", "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4)"),
        ["f": F, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2)];
    /// OPENCV_FISHEYE of COLMAP (Kannala and Brandt 2006): four radial terms in theta.
    OpencvFisheye[8] = "opencv_fisheye", Equidistant, Whole, 0,
        fisheye!("(fx A + cx, fy B + cy)", "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4)];
    /// Fisheye of OpenCV: [`OpencvFisheye`] with a skew; pixel centres are integers.
    OpencvFisheyeSkew[9] = "opencv_fisheye_skew", Equidistant, Whole, 0,
        fisheye!("(fx (A + skew B) + cx, fy B + cy)", "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "skew": Skew, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4)];
    /// THIN_PRISM_FISHEYE of COLMAP; k3 follows p2.
    ThinPrismFisheye[12] = "thin_prism_fisheye", Equidistant, Whole, 0,
        fisheye!("(fx A + cx, fy B + cy)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (2 p1 a b + p2 (r^2 + 2 a^2), p1 (r^2 + 2 b^2) + 2 p2 a b) + \
             (sx1, sy1) r^2"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2), "p1": T(1), "p2": T(0), "k3": N(3), "k4": N(4), "sx1": S(0),
         "sy1": S(2)];
    /// RAD_TAN_THIN_PRISM_FISHEYE of COLMAP: tangential and prism terms act on the radially distorted position; p0, p1 are P1, P2 of
    /// photogrammetry.
    RadTanThinPrismFisheye[16] = "rad_tan_thin_prism_fisheye", Equidistant, Staged, 0,
        fisheye!("(fx A + cx, fy B + cy)",
            "(x, y) = (a, b) (1 + k0 r^2 + ... + k5 r^12), q^2 = x^2 + y^2, (A, B) = (x + p0 (2 x^2 + q^2) + 2 p1 x y + s0 q^2 + s1 q^4, \
             y + 2 p0 x y + p1 (2 y^2 + q^2) + s2 q^2 + s3 q^4)"),
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k0": N(1), "k1": N(2), "k2": N(3), "k3": N(4), "k4": N(5), "k5": N(6), "p0": T(0),
         "p1": T(1), "s0": S(0), "s1": S(1), "s2": S(2), "s3": S(3)];
    /// SIMPLE_DIVISION of COLMAP (Fitzgibbon 2001).
    SimpleDivision[4] = "simple_division", DivisionByRadius, Whole, 0,
        "(A, B) = (P1, -P2) 2 / (-P3 + sqrt(P3^2 - 4 k (P1^2 + P2^2))), image = (f A + cx, f B + cy)",
        ["f": F, "cx": Cx, "cy": Cy, "k": Own(0)];
    /// DIVISION of COLMAP (Fitzgibbon 2001).
    Division[5] = "division", DivisionByRadius, Whole, 0,
        "(A, B) = (P1, -P2) 2 / (-P3 + sqrt(P3^2 - 4 k (P1^2 + P2^2))), image = (fx A + cx, fy B + cy)",
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k": Own(0)];
    /// Equal-area fisheye, the projection of most all-sky lenses.
    Equisolid[6] = "equisolid", EquisolidRays, Whole, 0,
        "(a, b) = 2 sin(theta / 2) (P1, -P2) / rho, rho = hypot(P1, P2), theta = atan2(rho, -P3), r^2 = a^2 + b^2, \
         (A, B) = (a, b) (1 + k1 r^2 + k2 r^4), image = (fx A + cx, fy B + cy)",
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2)];
    /// Stereographic fisheye, which preserves circles of the sphere.
    Stereographic[6] = "stereographic", StereographicRays, Whole, 0,
        "(a, b) = 2 tan(theta / 2) (P1, -P2) / rho, rho = hypot(P1, P2), theta = atan2(rho, -P3), r^2 = a^2 + b^2, \
         (A, B) = (a, b) (1 + k1 r^2 + k2 r^4), image = (fx A + cx, fy B + cy)",
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "k1": N(1), "k2": N(2)];
    /// EUCM of COLMAP: the extended unified camera (Khomutenko, Garcia and Martinet 2016).
    Eucm[6] = "eucm", ExtendedUnified, Whole, 0,
        "d = sqrt(beta (P1^2 + P2^2) + P3^2), (A, B) = (P1, -P2) / (alpha d - (1 - alpha) P3), image = (fx A + cx, fy B + cy)",
        ["fx": Fx, "fy": Fy, "cx": Cx, "cy": Cy, "alpha": Own(0), "beta": Own(1)];
    /// Frame camera of Agisoft; cx, cy are relative to the centre of the image of w by h pixels, p1, p2 are P1, P2 of photogrammetry.
    AgisoftFrame[13] = "agisoft_frame", Central, Whole, 2,
        central!("(w/2 + cx + A f + A b1 + B b2, h/2 + cy + B f)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (p1 (r^2 + 2 a^2) + 2 p2 a b, p2 (r^2 + 2 b^2) + 2 p1 a b)"),
        ["f": F, "cx": Cx, "cy": Cy, "b1": B1, "b2": B2, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4), "p1": T(0), "p2": T(1), "w": W,
         "h": H];
    /// Fisheye of Agisoft: [`AgisoftFrame`] with an equidistant projection.
    AgisoftFisheye[13] = "agisoft_fisheye", Equidistant, Whole, 2,
        fisheye!("(w/2 + cx + A f + A b1 + B b2, h/2 + cy + B f)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (p1 (r^2 + 2 a^2) + 2 p2 a b, p2 (r^2 + 2 b^2) + 2 p1 a b)"),
        ["f": F, "cx": Cx, "cy": Cy, "b1": B1, "b2": B2, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4), "p1": T(0), "p2": T(1), "w": W,
         "h": H];
    /// [`AgisoftFrame`] with a tangential profile, as in files of 2016 to about 2020.
    AgisoftFrameP4[15] = "agisoft_frame_p4", Central, Profiled, 2,
        central!("(w/2 + cx + A f + A b1 + B b2, h/2 + cy + B f)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (p1 (r^2 + 2 a^2) + 2 p2 a b, p2 (r^2 + 2 b^2) + 2 p1 a b) \
             (1 + p3 r^2 + p4 r^4)"),
        ["f": F, "cx": Cx, "cy": Cy, "b1": B1, "b2": B2, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4), "p1": T(0), "p2": T(1),
         "p3": P(0), "p4": P(1), "w": W, "h": H];
    /// [`AgisoftFisheye`] with a tangential profile.
    AgisoftFisheyeP4[15] = "agisoft_fisheye_p4", Equidistant, Profiled, 2,
        fisheye!("(w/2 + cx + A f + A b1 + B b2, h/2 + cy + B f)",
            "(A, B) = (a, b) (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + (p1 (r^2 + 2 a^2) + 2 p2 a b, p2 (r^2 + 2 b^2) + 2 p1 a b) \
             (1 + p3 r^2 + p4 r^4)"),
        ["f": F, "cx": Cx, "cy": Cy, "b1": B1, "b2": B2, "k1": N(1), "k2": N(2), "k3": N(3), "k4": N(4), "p1": T(0), "p2": T(1),
         "p3": P(0), "p4": P(1), "w": W, "h": H];
}
