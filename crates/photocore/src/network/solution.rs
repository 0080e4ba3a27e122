//! Adjusted network.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::adjusted::{
    AdjustedCamera, AdjustedCommon, AdjustedPhoto, AdjustedPoint, adjusted_photos, adjusted_points, in_order,
};
use super::error::NetworkError;
use super::input::{Network, Options, State, UnitVariance};
use super::model::{Bundle, Owner};
use super::neighbourhood::TOGETHER;
use super::observations::{AdjustedObservation, KindSums};
use super::problem::Assembled;
use super::selection::Dropped;
use super::trial::Converged;
use super::visibility::{ImpossibleImages, find_impossible_images};
use super::weak_points::WeakPoint;
use crate::adjustment::{Adjustment, Leverages, Observed, Problem};
use crate::geometry::Matrix3;
use crate::parallel;

/// Smallest redundancy that is not attributed to rounding.
pub const LEAST_REDUNDANCY: f64 = 1e-9;

/// Sums of a quantity over the types of observations: weighted squares (weights as modified by the loss), or redundancy numbers.
#[derive(Debug, Clone, Copy)]
pub struct SumsByType {
    /// Weighted poses, cameras and shared parameters.
    pub camera: f64,
    /// Weighted coordinates of control points.
    pub ground: f64,
    /// Image coordinates.
    pub plates: f64,
    /// Additional observations.
    pub observations: f64,
}

impl SumsByType {
    /// Returns the sum without `camera`.
    pub fn measured(&self) -> f64 {
        self.ground + self.plates + self.observations
    }

    /// Returns the total.
    pub fn total(&self) -> f64 {
        self.camera + self.ground + self.plates + self.observations
    }
}

/// Weakly determined points, and the parameters of combinations along which the iteration did not converge.
#[derive(Debug, Default)]
pub struct Weak {
    /// Photo and parameter (0 to 5: pose, then camera); like the next two, empty unless the iteration failed in this way.
    pub photos: Vec<(usize, usize)>,
    /// Shared camera and parameter.
    pub cameras: Vec<(usize, usize)>,
    /// Shared parameter and number of its component.
    pub commons: Vec<(usize, usize)>,
    /// Points with nearly parallel rays, or at the position of a station.
    pub points: Vec<WeakPoint>,
}

/// Datum of an adjusted network.
#[derive(Debug, Default)]
pub struct DatumInForce {
    /// Parameters fixed as a minimal datum: photo and parameter. With inner constraints, the datum before the transformation.
    pub held: Vec<(usize, usize)>,
    /// Fixed coefficients of trajectories: shared parameter and number of its component.
    pub held_commons: Vec<(usize, usize)>,
    /// Approximate relative rounding error of variances after a datum transformation; zero otherwise.
    pub relative_error: f64,
    /// Whether control and weights of poses are a minimal datum: they check nothing, and another datum may be chosen.
    pub minimal_control: bool,
}

/// Joint cofactors of several points.
#[derive(Debug)]
pub struct Joint {
    /// Active points.
    pub points: Vec<usize>,
    /// Cofactors of their coordinates (3k x 3k), a priori unit weight.
    pub cofactors: DMatrix<f64>,
}

/// Adjusted network: results in the order of the input.
#[derive(Debug)]
pub struct Solution {
    /// Adjusted photos.
    pub photos: Vec<AdjustedPhoto>,
    /// Adjusted cameras.
    pub cameras: Vec<AdjustedCamera>,
    /// Adjusted shared parameters.
    pub commons: Vec<AdjustedCommon>,
    /// Corrections of the parameters of all photos in every iteration, photo by photo, if requested ([`Options::photo_corrections`]).
    pub photo_corrections: Vec<Vec<f64>>,
    /// Adjusted points; None for excluded ones.
    pub points: Vec<Option<AdjustedPoint>>,
    /// Adjusted images; None for images of excluded points.
    pub images: Vec<Option<Observed<2>>>,
    /// Adjusted additional observations; None for observations of excluded points.
    pub observations: Vec<Option<AdjustedObservation>>,
    /// Physically impossible images.
    pub unseen: ImpossibleImages,
    /// Parameters that are undetermined at the adjusted values, if cofactors were requested but do not exist.
    pub undetermined: Option<NetworkError>,
    /// Weakly determined parameters and points.
    pub weak: Weak,
    /// Datum of the solution.
    pub datum: DatumInForce,
    /// Points and photos excluded before or during the adjustment.
    pub dropped: Vec<Dropped>,
    /// Weighted sums of squares.
    pub sums_of_squares: SumsByType,
    /// Sums of redundancy numbers; None without cofactors.
    pub redundancies: Option<SumsByType>,
    /// Degrees of freedom of the chosen variance of unit weight; not positive without redundancy. With [`UnitVariance::Redundancy`], all
    /// observations count.
    pub degrees_of_freedom: i64,
    /// Variance of unit weight; None without degrees of freedom.
    pub variance_of_unit_weight: Option<f64>,
    /// Final state of the adjustment, from which covariances and other datums are computed.
    pub state: State,
    /// Joint cofactors of the requested points (see [`super::NetworkAdjustment::kept`]).
    pub joint: Option<Arc<Joint>>,
    /// Converged problem with its cofactors, from which tests are computed without a new parameters.
    pub converged: Option<Box<Converged>>,
    /// Status, iterations, counts, operations and times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Returns the covariance matrix of the coordinates of a point: cofactors times variance of unit weight. None if the point is excluded
    /// or without degrees of freedom.
    pub fn covariance_of_point(&self, point: usize) -> Option<Matrix3> {
        Some(self.points.get(point)?.as_ref()?.cofactors * self.variance_of_unit_weight?)
    }

    /// Returns the covariance matrix of the parameters of a photo: its pose and its own free camera.
    pub fn covariance_of_photo(&self, photo: usize) -> Option<DMatrix<f64>> {
        Some(&self.photos.get(photo)?.cofactors * self.variance_of_unit_weight?)
    }

    /// Returns the additional observations by type; `network` is the network that was adjusted.
    pub fn kinds(&self, network: &Network) -> Vec<KindSums> {
        KindSums::all(&network.observations, &self.observations)
    }

    /// Returns the results of an adjustment in the order of the network. Called from a worker thread.
    #[doc(hidden)]
    pub fn new(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> Self {
        Self::with_leverages(network, options, assembled, adjustment, collapsed).0
    }

    /// Returns the solution, and the leverages for group tests if the adjustment stores them.
    pub(super) fn with_leverages(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        mut adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> (Self, Option<Leverages>) {
        let Assembled { problem, dropped, .. } = assembled;
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let observations = observations(network, problem, &adjustment);
        let sums_of_squares = sums_of_squares(problem, &adjustment, &unknowns, &observations);
        let redundancies = redundancies(problem, &adjustment, &observations);
        let degrees_of_freedom = degrees_of_freedom(options.unit_variance, problem, &adjustment);
        let variance_of_unit_weight = match options.unit_variance {
            UnitVariance::Unity => Some(1.0),
            UnitVariance::Free => over(sums_of_squares.measured(), degrees_of_freedom),
            UnitVariance::Constrained => over(sums_of_squares.total(), degrees_of_freedom),
            UnitVariance::Redundancy => redundancies
                .map(|own| own.measured())
                .filter(|&own| own > LEAST_REDUNDANCY)
                .map(|own| sums_of_squares.measured() / own),
        };
        let observed = |image: usize, group: usize| adjustment.observed(group, network.images[image].sd);
        let images = in_order(network.images.len(), &problem.model.point_images.order, observed);
        let photos = adjusted_photos(network, assembled, &adjustment, &unknowns);
        let mut solution = Self {
            cameras: network.adjusted_cameras(assembled, &adjustment, &unknowns, &photos),
            photos,
            commons: network.adjusted_commons(assembled, &adjustment, &unknowns),
            photo_corrections: adjustment.corrections().collect(),
            points: adjusted_points(network, assembled, &adjustment, &unknowns),
            images,
            observations,
            unseen: ImpossibleImages::default(),
            undetermined: adjustment.undetermined.take().map(|error| NetworkError::new(error, assembled)),
            weak: Weak {
                photos: owned(problem, &adjustment.weak, Owner::Photo),
                cameras: owned(problem, &adjustment.weak, Owner::Camera),
                commons: owned(problem, &adjustment.weak, Owner::Common),
                points: vec![],
            },
            datum: DatumInForce {
                held: owned(problem, &adjustment.datum, Owner::Photo),
                held_commons: owned(problem, &adjustment.datum, Owner::Common),
                ..DatumInForce::default()
            },
            dropped: dropped.clone(),
            state: State {
                unknowns: vec![],
                held: adjustment.datum.clone(),
                collapsed,
                undetermined_photos: assembled.undetermined_photos.clone(),
                ordering: adjustment.effort.ordering,
                datum: None,
                released: false,
            },
            joint: None,
            converged: None,
            sums_of_squares,
            redundancies,
            degrees_of_freedom,
            variance_of_unit_weight,
            adjustment,
        };
        let (squares, unseen) = find_impossible_images(assembled, &unknowns, &mut solution.points);
        solution.unseen = unseen;
        let (model, points) = (&problem.model, &assembled.points[..]);
        solution.weak.points = network.weak_points(model, points, &solution.points, &squares);
        let found = Leverages::of(&mut solution.adjustment, &unknowns);
        let found = found.filter(|_| solution.adjustment.holds_after_last_step());
        solution.state.unknowns = unknowns;
        solution.adjustment.cofactors = None;
        solution.adjustment.history = vec![];
        solution.adjustment.release_observations();
        (solution, found)
    }
}

impl Assembled {
    /// Returns the sums of squares of an adjustment at its final values, by group.
    pub fn sums_of_squares(&self, network: &Network, adjustment: &Adjustment, values: &[f64]) -> SumsByType {
        let observations = observations(network, &self.problem, adjustment);
        sums_of_squares(&self.problem, adjustment, values, &observations)
    }
}

/// Returns a sum of squares over the degrees of freedom, None if these are not positive.
fn over(sum: f64, degrees_of_freedom: i64) -> Option<f64> {
    (degrees_of_freedom > 0).then(|| sum / degrees_of_freedom as f64)
}

/// Returns the owners of parameters that are of one type, each with the number of the parameter there.
fn owned(problem: &Problem<Bundle>, unknowns: &[usize], of: fn(usize) -> Owner) -> Vec<(usize, usize)> {
    let own = |&unknown: &usize| {
        let (owner, number) = problem.model.owner(unknown)?;
        Some((owner.index(of)?, number))
    };
    unknowns.iter().filter_map(own).collect()
}

fn observations(
    network: &Network,
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
) -> Vec<Option<AdjustedObservation>> {
    let (model, layout) = (&problem.model, problem.layout());
    let of = |i: usize| {
        let (active, term) = (&model.observations[i], model.image_terms() + i);
        let shares = adjustment.cofactors.as_ref().map(|found| &found.terms[layout.term_block(term)]);
        let weight = adjustment.weights.as_ref().map_or(1.0, |all| all[layout.groups() + term]);
        let whitened = &adjustment.residuals[layout.equations_of_term(term)];
        AdjustedObservation::new(active, whitened, shares, weight)
    };
    let found = parallel::map(model.observations.len(), TOGETHER, of);
    let mut all = vec![None; network.observations.len()];
    model.observations.iter().zip(found).for_each(|(active, own)| all[active.index] = Some(own));
    all
}

/// Returns the sums of squares by group (GIANT guide, Appendix E).
fn sums_of_squares(
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    unknowns: &[f64],
    observations: &[Option<AdjustedObservation>],
) -> SumsByType {
    let parameters = problem.model.parameter_unknowns();
    let prior_terms = problem.any().prior_terms(unknowns);
    let squares = |range: Range<usize>| prior_terms.sum_of_squares(range);
    let rows = problem.layout().rows();
    let of_images = &problem.observation_sd[..rows * problem.model.images.len()];
    SumsByType {
        camera: squares(parameters.clone()),
        ground: squares(0..parameters.start) + squares(parameters.end..unknowns.len()),
        plates: adjustment.reweighted_sum_of_squares(of_images, rows),
        observations: observations.iter().flatten().fold(0.0, |sum, own| sum + own.square),
    }
}

/// Returns the sums of redundancy numbers by group; None without redundancy numbers.
fn redundancies(
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    observations: &[Option<AdjustedObservation>],
) -> Option<SumsByType> {
    let of_observations = adjustment.redundancy.as_ref()?;
    let of_unknowns = adjustment.prior_redundancy.as_ref()?;
    let parameters = problem.model.parameter_unknowns();
    let images = problem.layout().rows() * problem.model.images.len();
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    Some(SumsByType {
        camera: sum(&of_unknowns[parameters.clone()]),
        ground: sum(&of_unknowns[..parameters.start]) + sum(&of_unknowns[parameters.end..]),
        plates: sum(&of_observations[..images]),
        observations: observations.iter().flatten().fold(0.0, |all, own| all + sum(&own.redundancy)),
    })
}

/// Returns the degrees of freedom (GIANT guide, Appendix E). Observations are image coordinates, additional observations, control
/// components and, except for free photos, every other weighted parameter.
fn degrees_of_freedom(
    unit_variance: UnitVariance,
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
) -> i64 {
    let counts = adjustment.counts;
    let parameters = problem.model.parameter_unknowns();
    let weighted_cameras = parameters.filter(|&unknown| problem.is_weighted(unknown)).count();
    let weighted = match unit_variance {
        UnitVariance::Free => counts.weighted - weighted_cameras,
        UnitVariance::Constrained | UnitVariance::Redundancy | UnitVariance::Unity => counts.weighted,
    };
    (counts.observations + weighted) as i64 - counts.unknowns as i64
}
