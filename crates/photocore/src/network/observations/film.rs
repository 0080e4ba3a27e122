//! What is known of the film of a photo beforehand.

use nalgebra::{DMatrix, Vector3};

use super::{Fault, Named, ObservationModel, Precision, Rows, Sites, Touches};
use crate::network::commons::CommonKind;

/// Some of t1, t2, theta, m, b1, b2 of the film of a photo; m about that of its roll, where there is one.
///
/// `m - m_roll` has the partials 1 and -1, all others are unknowns themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// A [`CommonKind::FilmPlacement`].
    pub placement: usize,
    /// A [`CommonKind::FilmSize`].
    pub size: usize,
    /// A [`CommonKind::Roll`].
    pub roll: Option<usize>,
    /// Which of the six are known.
    pub components: Vec<usize>,
    /// As many values.
    pub observed: Vec<f64>,
    /// Of these.
    pub precision: Precision,
}

/// The number of m among the six.
const MEAN: usize = 3;

impl ObservationModel for Film {
    const NAME: &'static str = "film";

    /// Numbers of the components, then their values.
    fn from_numbers(of: &Named<'_>, values: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let &[Some(placement), Some(size), roll] = of.commons else { return None };
        let (components, observed) = values.split_at_checked(covariance.nrows())?;
        Some(Self {
            placement,
            size,
            roll,
            components: components.iter().map(|&own| own as usize).collect(),
            observed: observed.to_vec(),
            precision: Precision::Covariance(covariance),
        })
    }

    fn touches(&self) -> Touches {
        let placement = (self.placement, Some(CommonKind::FilmPlacement));
        let own = Touches { commons: vec![placement], ..Touches::default() };
        own.and(Some(self.size), CommonKind::FilmSize).and(self.roll, CommonKind::Roll)
    }

    fn rows(&self) -> usize {
        self.components.len()
    }

    fn precision(&self) -> Precision {
        self.precision.clone()
    }

    fn write(&self, sites: &Sites<'_>, rows: &mut Rows<'_>) {
        for (row, (&component, observed)) in self.components.iter().zip(&self.observed).enumerate() {
            let (common, axis) = (component / 3, component % 3);
            let along = Vector3::ith(axis, 1.0).transpose();
            let mut computed = sites.common(common).vector()[axis];
            rows.by_offset(row, common, &along);
            if component == MEAN && self.roll.is_some() {
                computed -= sites.common(2).vector().x;
                rows.by_offset(row, 2, &-Vector3::x().transpose());
            }
            rows.residual(row, &[observed - computed]);
        }
    }

    fn check(&self) -> Result<(), Fault> {
        let known =
            self.components.iter().all(|&own| own < 6) && self.observed.len() == self.components.len();
        if known && self.observed.iter().all(|own| own.is_finite()) { Ok(()) } else { Err(Fault::NotFinite) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{agrees, of_kind};
    use super::{CommonKind, Film, Precision};

    #[test]
    fn partials_agree_with_differences() {
        for (roll, components) in [(None, vec![3, 4, 5]), (Some(of_kind(CommonKind::Roll)), vec![0, 2, 3, 5])]
        {
            agrees(
                &Film {
                    placement: of_kind(CommonKind::FilmPlacement),
                    size: of_kind(CommonKind::FilmSize),
                    roll,
                    observed: vec![0.1; components.len()],
                    precision: Precision::Deviations(vec![0.01; components.len()]),
                    components,
                }
                .into(),
            );
        }
    }
}
