//! Common unknowns alone: those that were determined before, bases of rigs, sums of coefficients that are zero.

use nalgebra::{DMatrix, Matrix3};

use super::{CommonKind, Fault, Named, ObservationModel, Precision, Rows, Sites, Touches, deviation, three};
use crate::geometry::Vector3;

/// What was observed of common unknowns as one observation with its full covariance, from an adjustment of its own.
///
/// v = d - x, x being the unknowns, which count from what is given, and d what was observed of them, where that is another: with rotations
/// v = Log(R^T R_0), and d is zero. The partials are I.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The common unknowns; their own standard deviations are infinite.
    pub commons: Vec<usize>,
    /// How many unknowns each of them has.
    pub components: Vec<usize>,
    /// d; nothing at all where what is given was observed.
    pub observed: Vec<f64>,
    /// Of these.
    pub precision: Precision,
}

impl ObservationModel for Prior {
    const NAME: &'static str = "prior";

    /// Of a single common unknown d, or nothing; of several how many unknowns each has.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let commons: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let (components, observed) = match commons[..] {
            [_] => (vec![covariance.nrows()], values.to_vec()),
            _ => (values.iter().map(|&own| own as usize).collect(), vec![]),
        };
        let sound = components.len() == commons.len()
            && components.iter().sum::<usize>() == covariance.nrows()
            && (observed.is_empty() || observed.len() == covariance.nrows());
        sound.then_some(Self { commons, components, observed, precision: Precision::Covariance(covariance) })
    }

    fn touches(&self) -> Touches {
        Touches { commons: self.commons.iter().map(|&own| (own, None)).collect(), ..Touches::default() }
    }

    fn rows(&self) -> usize {
        self.components.iter().sum()
    }

    fn components(&self, common: usize) -> usize {
        self.components[common]
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let observed = |k: usize| self.observed.get(k).copied().unwrap_or_default();
        let mut row = 0;
        for (common, &count) in self.components.iter().enumerate() {
            let missing =
                sites.common(common).unknowns().enumerate().map(|(k, value)| observed(row + k) - value);
            rows.residual(row, &missing.collect::<Vec<f64>>());
            rows.by_itself(row, common, count);
            row += count;
        }
    }
}

/// The distance between two sensors on a frame, or of one from the frame itself: a base that was measured gives a rig its scale.
///
/// s = |c_2 - c_1|, with the partials e = (c_2 - c_1)/s by c_2 and -e by c_1, c_1 being zero where there is one sensor alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Base {
    /// The first sensor; None for that which is the frame.
    pub first: Option<usize>,
    /// The second sensor.
    pub second: usize,
    /// The observed length in the unit of the object space.
    pub length: f64,
    /// Its standard deviation.
    pub sd: f64,
}

impl ObservationModel for Base {
    const NAME: &'static str = "base";

    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let (&[first, Some(second)], &[length]) = (of.commons, values) else { return None };
        Some(Self { first, second, length, sd: deviation(&covariance) })
    }

    fn touches(&self) -> Touches {
        Touches::default().and(Some(self.second), CommonKind::Sensor).and(self.first, CommonKind::Sensor)
    }

    fn rows(&self) -> usize {
        1
    }

    fn precision(&self) -> Precision {
        Precision::Deviations(vec![self.sd])
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let mut difference = sites.common(0).vector();
        if self.first.is_some() {
            difference -= sites.common(1).vector();
        }
        let distance = difference.norm();
        let direction = (difference / distance).transpose();
        rows.residual(0, &[self.length - distance]);
        rows.by_offset(0, 0, &direction);
        if self.first.is_some() {
            rows.by_offset(0, 1, &-direction);
        }
    }
}

/// A sum of coefficients of a trajectory, each with its factor: differences of neighbours (Eilers and Marx 1996), or one that follows from
/// the one before as in a process of Gauss and Markov.
///
/// `sum f_k c_k`, with the partials `f_k I`.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothness {
    /// The coefficients: common unknowns of three components.
    pub coefficients: Vec<usize>,
    /// As many factors.
    pub factors: Vec<f64>,
    /// What was observed, most often zero.
    pub observed: [f64; 3],
    /// Of x, y, z.
    pub precision: Precision,
}

impl ObservationModel for Smoothness {
    const NAME: &'static str = "smoothness";

    /// What was observed, then the factors.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let coefficients: Vec<usize> = of.commons.iter().copied().collect::<Option<_>>()?;
        let factors = values.get(3..)?.to_vec();
        let precision = Precision::Covariance(covariance);
        let sound = factors.len() == coefficients.len();
        sound.then_some(Self { coefficients, factors, observed: three(values, 0)?, precision })
    }

    fn touches(&self) -> Touches {
        Touches { commons: self.coefficients.iter().map(|&own| (own, None)).collect(), ..Touches::default() }
    }

    fn rows(&self) -> usize {
        3
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        let mut missing = Vector3::from(self.observed);
        for (k, &factor) in self.factors.iter().enumerate() {
            missing -= factor * sites.common(k).vector();
            rows.by_offset(0, k, &Matrix3::from_diagonal_element(factor));
        }
        rows.residual(0, missing.as_slice());
    }

    fn check(&self) -> Result<(), Fault> {
        let numbers = self.factors.iter().chain(&self.observed);
        if numbers.into_iter().all(|value| value.is_finite()) { Ok(()) } else { Err(Fault::NotFinite) }
    }
}
