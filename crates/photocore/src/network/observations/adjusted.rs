//! Adjusted additional observations.

use smallvec::SmallVec;

use super::{AssembledObservation, Observation};

/// An adjusted observation, component by component.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedObservation {
    /// Observed minus computed values, in the units of the components.
    pub residual: Vec<f64>,
    /// Redundancy numbers `(Qvv S^-1)_ii` with the a-priori covariance matrix S. They may be outside 0 to 1 if components are correlated;
    /// NaN if not requested.
    pub redundancy: Vec<f64>,
    /// Standardized residuals `(S^-1 v)_i / sqrt((S^-1 Qvv S^-1)_ii)`, a priori unit weight; NaN if not requested, or without redundancy.
    pub standardized: Vec<f64>,
    /// v^T S^-1 v, with the weight as modified by the loss.
    pub square: f64,
    /// Weight factor of the loss; 1 without a loss.
    pub weight: f64,
}

/// Sums over all observations of one type.
#[derive(Debug, Clone, PartialEq)]
pub struct KindSums {
    /// Name of the type.
    pub kind: &'static str,
    /// Number of active observations.
    pub observations: usize,
    /// Number of their components.
    pub components: usize,
    /// Sum of v^T S^-1 v, weights as modified by the loss.
    pub sum_of_squares: f64,
    /// Sum of the redundancy numbers; NaN if not requested.
    pub redundancy: f64,
}

/// Smallest relative variance of a test value that is not rounding noise.
const LEAST_REDUNDANCY: f64 = 1e-10;

impl AdjustedObservation {
    /// Returns the results from z = L^-1 v and the leverages a Q a^T of the whitened equations, row by row.
    ///
    /// With B = a Q a^T and whitened a: Qvv = L (I - B) L^T, Qvv S^-1 = L (I - B) L^-1, S^-1 Qvv S^-1 = L^-T (I - B) L^-1.
    pub(in super::super) fn new(
        active: &AssembledObservation,
        whitened: &[f64],
        shares: Option<&[f64]>,
        weight: f64,
    ) -> Self {
        let (n, root) = (whitened.len(), &active.root);
        // L^-1, row by row.
        let mut inverse = SmallVec::<[f64; 9]>::from_elem(0.0, n * n);
        (0..n).for_each(|k| inverse[k * (n + 1)] = 1.0);
        active.whiten(&mut inverse, n);
        let product =
            |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| (0..n).map(|k| a(k) * b(k)).sum::<f64>();
        let residual = (0..n).map(|i| product(&|k| root[(i, k)], &|k| whitened[k])).collect();
        let (mut redundancy, mut standardized) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        if let Some(shares) = shares {
            for i in 0..n {
                let column = |k: usize| inverse[k * n + i];
                // (I - B) L^-1, its column i.
                let left: SmallVec<[f64; 3]> =
                    (0..n).map(|k| column(k) - product(&|j| shares[k * n + j], &column)).collect();
                redundancy[i] = product(&|k| root[(i, k)], &|k| left[k]);
                let variance = product(&column, &|k| left[k]);
                if variance > LEAST_REDUNDANCY * product(&column, &column) {
                    standardized[i] = product(&column, &|k| whitened[k]) / variance.sqrt();
                }
            }
        }
        let square = weight * product(&|k| whitened[k], &|k| whitened[k]);
        Self { residual, redundancy, standardized, square, weight }
    }
}

impl KindSums {
    /// Returns the sums of each observed type.
    pub(in super::super) fn all(
        observations: &[Observation],
        adjusted: &[Option<AdjustedObservation>],
    ) -> Vec<Self> {
        let of_kind = |&kind: &&'static str| {
            let own = observations.iter().zip(adjusted).filter(|(own, _)| own.kind() == kind);
            let taking_part: Vec<_> = own.filter_map(|(_, adjusted)| adjusted.as_ref()).collect();
            Self {
                kind,
                observations: taking_part.len(),
                components: taking_part.iter().map(|own| own.residual.len()).sum(),
                sum_of_squares: taking_part.iter().map(|own| own.square).sum(),
                redundancy: taking_part.iter().flat_map(|own| &own.redundancy).sum(),
            }
        };
        super::KINDS.iter().map(of_kind).filter(|sums| sums.observations > 0).collect()
    }
}
