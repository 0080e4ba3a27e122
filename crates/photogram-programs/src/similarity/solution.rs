//! Result of an absolute orientation.

use super::error::{Cause, SimilarityError};
use super::misclosures::Weighted;
use super::model::AsControl;
use super::published::{Cycles, Trace};
use super::start::{Chosen, Started};
use super::transform::{Matrix7, Similarity};
use super::{Station, determinacy, misclosures};
use photocore::Iteration;
use photocore::adjustment::{Adjustment, Problem, Status, leading_matrix};
use photocore::geometry::{Matrix3, Vector3};

/// Station after the orientation. Unknown values are NaN.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedStation {
    /// u = s X - A^T (x - B) of the known components, in control axes and model units.
    pub misclosure: Vector3,
    /// v = s A X + B - x with the adjusted X (TB 19, equation 5.1), in model axes and units.
    pub model_residual: Vector3,
    /// Adjusted control coordinates, in ground units; unknown ones are computed from the model.
    pub control: Vector3,
    /// Cofactors of the control coordinates (a priori unit weight).
    pub cofactors: Matrix3,
    /// Redundancy numbers of the known components: they sum to the degrees of freedom.
    pub redundancy: [f64; 3],
    /// Misclosure / root of its own cofactor (Baarda's w), a priori unit weight; NaN without redundancy.
    pub standardized: [f64; 3],
}

/// Oriented model.
#[derive(Debug)]
pub struct Solution {
    /// Similarity.
    pub similarity: Similarity,
    /// Initial similarity of the iteration.
    pub initial: Similarity,
    /// Source of the initial values.
    pub started: Started,
    /// Alternative orientations with a similar fit.
    pub alternatives: Vec<Similarity>,
    /// Status at the end of the iteration.
    pub status: Status,
    /// Iterations of the engine; empty for the cycles of the bulletin.
    pub iterations: Vec<Iteration>,
    /// Largest correction of an angle in each cycle of the bulletin, radians.
    pub cycles: Option<Vec<f64>>,
    /// Intermediate results of these cycles, if requested.
    pub traces: Vec<Trace>,
    /// Cofactors of the tangent parameters (see [`Similarity`]), a priori unit weight.
    pub tangent_cofactors: Matrix7,
    /// Condition number of the linearized misclosures.
    pub condition: f64,
    /// Cause of weak control, and the stations concerned.
    pub weakness: Option<(Cause, Vec<usize>)>,
    /// Weighted sum of squares.
    pub sum_of_squares: f64,
    /// Stations.
    pub stations: Vec<AdjustedStation>,
}

impl Solution {
    /// Creates the solution from an adjustment with standard deviations multiplied by `inner`.
    pub(super) fn new(
        Weighted { stations, inner }: &Weighted,
        problem: &Problem<AsControl>,
        adjustment: &Adjustment,
        chosen: Chosen,
        cycles: Option<Cycles>,
        held: bool,
    ) -> Result<Self, SimilarityError> {
        let similarity = problem.model.similarity(&adjustment.unknowns[3 * stations.len()..]);
        let singular = || SimilarityError::Undetermined { cause: Cause::Singular, stations: vec![] };
        let cofactors = misclosures::tangent_cofactors(stations, &similarity, held).ok_or_else(singular)?;
        let adjusted =
            |i: usize| AdjustedStation::new(i, &stations[i], &similarity, &cofactors, adjustment, *inner);
        let outward = inner * inner;
        let (cycles, traces) = cycles.map(|cycles| (cycles.corrections, cycles.traces)).unzip();
        let last = adjustment.iterations.last().map(|iteration| iteration.sum_of_squares);
        let iterations = adjustment.iterations.iter().map(|iteration| Iteration {
            sum_of_squares: outward * iteration.sum_of_squares,
            largest_change: inner * iteration.largest_change,
            ..*iteration
        });
        Ok(Self {
            similarity,
            initial: chosen.similarity,
            started: chosen.started,
            alternatives: chosen.alternatives,
            status: adjustment.status,
            cycles,
            traces: traces.unwrap_or_default(),
            condition: determinacy::condition(stations, &similarity, held),
            weakness: determinacy::weakness(stations, &similarity),
            sum_of_squares: outward * last.unwrap_or(adjustment.initial_sum_of_squares),
            iterations: iterations.collect(),
            tangent_cofactors: cofactors.map(|row| row.map(|cofactor| cofactor / outward)),
            stations: (0..stations.len()).map(adjusted).collect(),
        })
    }
}

impl AdjustedStation {
    fn new(
        index: usize,
        station: &Station,
        similarity: &Similarity,
        cofactors: &Matrix7,
        adjustment: &Adjustment,
        inner: f64,
    ) -> Self {
        let known = station.known();
        let u = similarity.misclosure(&station.control, &station.model);
        let (redundancy, standardized) = misclosures::test(station, similarity, cofactors);
        let values = &adjustment.unknowns[3 * index..];
        let control = |k: usize| {
            let exact = known[k] && station.control_sd[k] == 0.0;
            if exact { station.control[k] } else { values[k] + similarity.control_centre[k] }
        };
        let own: [[f64; 3]; 3] =
            leading_matrix(adjustment.cofactors.as_ref().map(|all| &all.local[9 * index..]));
        Self {
            misclosure: Vector3::from_fn(|k, _| if known[k] { u[k] } else { f64::NAN }),
            model_residual: Vector3::from_fn(|k, _| -adjustment.residuals[3 * index + k]),
            control: Vector3::from_fn(|k, _| control(k)),
            cofactors: Matrix3::from_fn(|i, j| own[i][j] / (inner * inner)),
            redundancy,
            standardized: standardized.map(|w| inner * w),
        }
    }
}
