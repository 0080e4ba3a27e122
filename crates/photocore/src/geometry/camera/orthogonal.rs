//! Corrections that are orthogonal over the image format: the 12 of Ebner (1976) and the 44 of Gruen (1978).

use super::backward::{BackwardModel, Corrected};
use super::inverse::way_back;
use super::model::{Unit, parameters};

/// P_0 to P_4 of one coordinate, with derivatives.
type Monomials = [(f64, f64); 5];

/// Term of a correction: (parameter, component, number, i, j). Parameter times number is the coefficient of P_i(Y) P_j(X).
type CorrectionTerm = (usize, usize, f64, usize, usize);

/// Lists the terms of each component: parameter, i and j, and the number if it is not 1.
macro_rules! terms {
    (@) => {
        1.0
    };
    (@$number:expr) => {
        $number
    };
    ($($component:literal: $($parameter:literal($i:literal $j:literal) $(* $number:expr)?),+;)+) => {
        &[$($(($parameter, $component, terms!(@$($number)?), $i, $j),)+)+]
    };
}

/// A set of orthogonal corrections.
pub trait OrthogonalSet<const N: usize>: Copy {
    /// Name of the camera.
    const NAME: &'static str;
    /// c, xp, yp, the corrections, b.
    const PARAMETERS: &'static [(&'static str, Unit)];
    /// Formula for documents.
    const FORMULA: &'static str;
    /// Terms of the corrections; parameters are numbered from zero.
    const TERMS: &'static [CorrectionTerm];

    /// Returns the polynomials of one coordinate over a format with half side b.
    fn basis(x: f64, b: f64) -> Monomials;
}

/// Corrections of a set, backward: functions of measured coordinates, to which they are added.
///
/// X = x - xp, Y = y - yp, x to the right and y up; b is half the side of the used format and always fixed. Effects of translation,
/// rotation, scale and tilt of a vertical photo are excluded.
///
/// [`Camera`](super::Camera) lists the parameters in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orthogonal<S, const N: usize> {
    /// c, negative for the positive plane; xp, yp; the corrections; b.
    pub parameters: [f64; N],
    set: S,
}

/// [`Ebner12`], preceded by c, xp, yp and followed by b.
pub type Ebner = Orthogonal<Ebner12, 16>;
/// [`Gruen44`], preceded by c, xp, yp and followed by b.
pub type Gruen = Orthogonal<Gruen44, 48>;

/// Corrections orthogonal on the grid -b, 0, b.
///
/// ```text
/// k = X^2 - 2 b^2/3,    l = Y^2 - 2 b^2/3
/// gx = X + e1 X + e2 Y - 2 e3 k + e4 X Y + e5 l + e7 X l + e9 Y k + e11 k l
/// gy = Y - e1 Y + e2 X + e3 X Y - 2 e4 l + e6 k + e8 Y k + e10 X l + e12 k l
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ebner12;

/// Corrections orthogonal on the grid -b, -b/2, 0, b/2, b.
///
/// ```text
/// k = X^2 - b^2/2,  p = X^2 - 17 b^2/20,  r = X^2 (X^2 - 31 b^2/28) + 9 b^4/70;     l, q, s: the same of Y
/// T_ij = (row i of 1, Y, l, Y q, s) times (column j of 1, X, k, X p, r),       i, j = 1..5
/// gx = X + a12 X + a21 Y + a22 X Y + a31 l - (10/7) b22 k + sum a_ij T_ij
/// gy = Y - a12 Y + a21 X - (10/7) a22 l + b13 k + b22 X Y + sum b_ij T_ij
/// further a_ij, b_ij:  14 23 32 41  15 24 33 42 51  25 34 43 52  35 44 53  45 54  55
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gruen44;

impl OrthogonalSet<16> for Ebner12 {
    const NAME: &'static str = "ebner";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "xp" "yp"; Unit::One => "e1" "e2"; Unit::PerImage(1) => "e3" "e4" "e5" "e6";
        Unit::PerImage(2) => "e7" "e8" "e9" "e10"; Unit::PerImage(3) => "e11" "e12"; Unit::Image => "b";
    };
    const FORMULA: &'static str = "X = x - xp, Y = y - yp, k = X^2 - 2 b^2/3, l = Y^2 - 2 b^2/3, corrected = (X + e1 X + e2 Y - 2 e3 k + \
         e4 X Y + e5 l + e7 X l + e9 Y k + e11 k l, Y - e1 Y + e2 X + e3 X Y - 2 e4 l + e6 k + e8 Y k + e10 X l + e12 k l), \
         residual = corrected - image, image = c (u1, u2) / u3";
    const TERMS: &'static [CorrectionTerm] = terms! {
        0: 0(0 1), 1(1 0), 2(0 2) * -2.0, 3(1 1), 4(2 0), 6(2 1), 8(1 2), 10(2 2);
        1: 0(1 0) * -1.0, 1(0 1), 2(1 1), 3(2 0) * -2.0, 5(0 2), 7(1 2), 9(2 1), 11(2 2);
    };

    #[inline(always)]
    fn basis(x: f64, b: f64) -> Monomials {
        [(1.0, 0.0), (x, 1.0), (x * x - 2.0 * b * b / 3.0, 2.0 * x), (0.0, 0.0), (0.0, 0.0)]
    }
}

impl OrthogonalSet<48> for Gruen44 {
    const NAME: &'static str = "gruen";
    const PARAMETERS: &'static [(&'static str, Unit)] = parameters! {
        Unit::Image => "c" "xp" "yp"; Unit::One => "a12" "a21"; Unit::PerImage(1) => "a22" "a31";
        Unit::PerImage(2) => "a14" "a23" "a32" "a41"; Unit::PerImage(3) => "a15" "a24" "a33" "a42" "a51";
        Unit::PerImage(4) => "a25" "a34" "a43" "a52"; Unit::PerImage(5) => "a35" "a44" "a53";
        Unit::PerImage(6) => "a45" "a54"; Unit::PerImage(7) => "a55"; Unit::PerImage(1) => "b13" "b22";
        Unit::PerImage(2) => "b14" "b23" "b32" "b41"; Unit::PerImage(3) => "b15" "b24" "b33" "b42" "b51";
        Unit::PerImage(4) => "b25" "b34" "b43" "b52"; Unit::PerImage(5) => "b35" "b44" "b53";
        Unit::PerImage(6) => "b45" "b54"; Unit::PerImage(7) => "b55"; Unit::Image => "b";
    };
    const FORMULA: &'static str = "X = x - xp, Y = y - yp, k = X^2 - b^2/2, p = X^2 - 17 b^2/20, r = X^2 (X^2 - 31 b^2/28) + 9 b^4/70, \
         l, q, s of Y as k, p, r of X, T_ij = (1, Y, l, Y q, s)_i (1, X, k, X p, r)_j, corrected = (X + a12 X + a21 Y + a22 X Y + a31 l \
         - (10/7) b22 k + sum a_ij T_ij, Y - a12 Y + a21 X - (10/7) a22 l + b13 k + b22 X Y + sum b_ij T_ij), residual = corrected - \
         image, image = c (u1, u2) / u3";
    const TERMS: &'static [CorrectionTerm] = terms! {
        0: 0(0 1), 1(1 0), 2(1 1), 3(2 0), 24(0 2) * (-10.0 / 7.0), 4(0 3), 5(1 2), 6(2 1), 7(3 0), 8(0 4), 9(1 3),
            10(2 2), 11(3 1), 12(4 0), 13(1 4), 14(2 3), 15(3 2), 16(4 1), 17(2 4), 18(3 3), 19(4 2), 20(3 4),
            21(4 3), 22(4 4);
        1: 0(1 0) * -1.0, 1(0 1), 2(2 0) * (-10.0 / 7.0), 23(0 2), 24(1 1), 25(0 3), 26(1 2), 27(2 1), 28(3 0),
            29(0 4), 30(1 3), 31(2 2), 32(3 1), 33(4 0), 34(1 4), 35(2 3), 36(3 2), 37(4 1), 38(2 4), 39(3 3),
            40(4 2), 41(3 4), 42(4 3), 43(4 4);
    };

    #[inline(always)]
    fn basis(x: f64, b: f64) -> Monomials {
        let (square, format) = (x * x, b * b);
        [
            (1.0, 0.0),
            (x, 1.0),
            (square - format / 2.0, 2.0 * x),
            (x * (square - 0.85 * format), 3.0 * square - 0.85 * format),
            (
                square * (square - 31.0 / 28.0 * format) + 9.0 / 70.0 * format * format,
                x * (4.0 * square - 31.0 / 14.0 * format),
            ),
        ]
    }
}

/// Index of the first correction among the parameters.
const FIRST: usize = 3;

impl<S: OrthogonalSet<N> + Default, const N: usize> BackwardModel for Orthogonal<S, N>
where
    [f64; N]: for<'a> TryFrom<&'a [f64]>,
{
    type Parameters = [f64; N];

    const NAME: &'static str = S::NAME;
    const PARAMETERS: &'static [(&'static str, Unit)] = S::PARAMETERS;
    const CONSTANTS: usize = 1;
    const FORMULA: &'static str = S::FORMULA;

    fn with_parameters(parameters: [f64; N]) -> Self {
        Self { parameters, set: S::default() }
    }

    fn parameters(&self) -> [f64; N] {
        self.parameters
    }

    fn principal_distance(&self) -> f64 {
        self.parameters[0]
    }

    #[inline(always)]
    fn correct(&self, measured: [f64; 2]) -> Corrected<[f64; N]> {
        let place = [measured[0] - self.parameters[1], measured[1] - self.parameters[2]];
        let [of_x, of_y] = place.map(|value| S::basis(value, self.parameters[N - 1]));
        let (mut xy, mut by_measured) = (place, [[1.0, 0.0], [0.0, 1.0]]);
        let mut by_parameters = [[0.0; N]; 2];
        for &(parameter, component, number, i, j) in S::TERMS {
            let ((p, by_p), (q, by_q)) = (of_y[i], of_x[j]);
            let value = number * self.parameters[FIRST + parameter];
            xy[component] += value * p * q;
            by_measured[component][0] += value * p * by_q;
            by_measured[component][1] += value * by_p * q;
            by_parameters[component][FIRST + parameter] = number * p * q;
        }
        for (own, by) in by_parameters.iter_mut().zip(&by_measured) {
            (own[1], own[2]) = (-by[0], -by[1]);
        }
        Corrected { xy, by_measured, by_parameters }
    }

    /// The corrections are small: the corrected position is the initial value.
    fn measured(&self, corrected: [f64; 2]) -> Option<[f64; 2]> {
        let start = [corrected[0] + self.parameters[1], corrected[1] + self.parameters[2]];
        way_back(start, corrected, |measured| {
            let Corrected { xy, by_measured, .. } = self.correct(measured);
            (xy, by_measured)
        })
    }
}
