//! The adjusted network.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::adjusted::{adjusted_photos, adjusted_points, in_order};
use super::model::{Bundle, Owner};
use super::problem::Assembled;
use super::{
    AdjustedCamera, AdjustedCommon, AdjustedObservation, AdjustedPhoto, AdjustedPoint, Converged, Dropped,
    KindSums, Network, NetworkError, Options, State, UnitVariance, WeakPoint,
};
use crate::adjustment::{Adjustment, Leverages, Observed, Problem};
use crate::geometry::Matrix3;

/// A redundancy of less is rounding.
pub const LEAST_REDUNDANCY: f64 = 1e-9;

/// Weighted sums of squares, weights as the loss has changed them.
#[derive(Debug, Clone, Copy)]
pub struct SumsOfSquares {
    /// Of the weighted poses and cameras of the photos.
    pub camera: f64,
    /// Of the held components of control.
    pub ground: f64,
    /// Of the image coordinates.
    pub plates: f64,
    /// Of the observations beside these.
    pub observations: f64,
}

impl SumsOfSquares {
    /// Of all but photos and cameras.
    pub fn measured(&self) -> f64 {
        self.ground + self.plates + self.observations
    }

    /// All together.
    pub fn total(&self) -> f64 {
        self.camera + self.ground + self.plates + self.observations
    }
}

/// Sums of redundancy numbers, of what [`SumsOfSquares`] are sums of squares of.
#[derive(Debug, Clone, Copy)]
pub struct Redundancies {
    /// Of the weighted poses, cameras and common unknowns.
    pub camera: f64,
    /// Of the held components of control.
    pub ground: f64,
    /// Of the image coordinates.
    pub plates: f64,
    /// Of the observations beside these.
    pub observations: f64,
}

impl Redundancies {
    /// Of all but photos and cameras.
    pub fn measured(&self) -> f64 {
        self.ground + self.plates + self.observations
    }
}

/// Images that no camera can have taken, ascending.
#[derive(Debug, Default)]
pub struct Unseen {
    /// Those whose point stands behind the camera.
    pub behind: Vec<usize>,
    /// Those beyond where the lens of their camera is one-to-one: they may belong to another direction.
    pub folded: Vec<usize>,
}

/// What is determined weakly: what a combination of unknowns moves that no step could follow to its end, and points.
#[derive(Debug, Default)]
pub struct Weak {
    /// Photo and unknown (0 to 5: pose, then camera); none where the adjustment ended otherwise, as in the next two.
    pub photos: Vec<(usize, usize)>,
    /// The same for cameras that several photos share, camera and parameter.
    pub cameras: Vec<(usize, usize)>,
    /// The same for common unknowns, common unknown and its number.
    pub commons: Vec<(usize, usize)>,
    /// The points on nearly parallel rays, or at a station's own place.
    pub points: Vec<WeakPoint>,
}

/// The datum that an adjusted network is in.
#[derive(Debug, Default)]
pub struct DatumInForce {
    /// What was held to give a datum where nothing else does: photo and unknown. In the datum of inner constraints, what they were
    /// taken from.
    pub held: Vec<(usize, usize)>,
    /// The same of coefficients of trajectories: common unknown and its number.
    pub held_commons: Vec<(usize, usize)>,
    /// Relative error, by rounding, of the variances in a datum that they were taken to, about; zero otherwise.
    pub relative_error: f64,
    /// Whether control and weights of poses are exactly what a datum takes: they check nothing, and another datum may be chosen.
    pub minimal_control: bool,
}

/// Cofactors of some points with each other.
#[derive(Debug)]
pub struct Joint {
    /// Those that take part.
    pub points: Vec<usize>,
    /// (3k, 3k) of their coordinates, a priori unit weight.
    pub cofactors: DMatrix<f64>,
}

/// An adjusted network, photo by photo, point by point, image by image, as in the input.
#[derive(Debug)]
pub struct Solution {
    /// The photos.
    pub photos: Vec<AdjustedPhoto>,
    /// The cameras.
    pub cameras: Vec<AdjustedCamera>,
    /// The common unknowns.
    pub commons: Vec<AdjustedCommon>,
    /// For every iteration, the corrections of the unknowns of all photos, one photo after the other.
    pub photo_corrections: Vec<Vec<f64>>,
    /// The points; None for those that were left out.
    pub points: Vec<Option<AdjustedPoint>>,
    /// The images; None for those of points that were left out.
    pub images: Vec<Option<Observed<2>>>,
    /// The other observations; None for those of points that were left out.
    pub observations: Vec<Option<AdjustedObservation>>,
    /// The images that no camera can have taken.
    pub unseen: Unseen,
    /// Why there are no cofactors although they were asked for: what the adjusted values leave undetermined.
    pub undetermined: Option<NetworkError>,
    /// What is determined weakly.
    pub weak: Weak,
    /// The datum that it is in.
    pub datum: DatumInForce,
    /// The points that were left out, at first or because of the adjustment.
    pub dropped: Vec<Dropped>,
    /// Weighted sums of squares.
    pub sums_of_squares: SumsOfSquares,
    /// Sums of redundancy numbers; None where there are no cofactors.
    pub redundancies: Option<Redundancies>,
    /// Degrees of freedom of the chosen unit variance; not positive where there is no redundancy. Those of all observations where it is
    /// based on redundancy numbers.
    pub degrees_of_freedom: i64,
    /// Variance of unit weight; None where there are no degrees of freedom.
    pub variance_of_unit_weight: Option<f64>,
    /// Where the adjustment has ended: what covariances are computed from, and other datums.
    pub state: State,
    /// Cofactors of the points that were to be asked together (see [`super::NetworkAdjustment::kept`]).
    pub joint: Option<Arc<Joint>>,
    /// Where the adjustment has converged, the problem with its cofactors: tests of it form nothing again.
    pub converged: Option<Box<Converged>>,
    /// Status, iterations, counts, operations and times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// The covariance matrix of a point's coordinates: its cofactors times the variance of unit weight. None where it was left out, or where
    /// there are no degrees of freedom.
    pub fn covariance_of_point(&self, point: usize) -> Option<Matrix3> {
        Some(self.points.get(point)?.as_ref()?.cofactors * self.variance_of_unit_weight?)
    }

    /// The same of the unknowns of a photo: its pose and, unless it is held or shared, its camera.
    pub fn covariance_of_photo(&self, photo: usize) -> Option<DMatrix<f64>> {
        Some(&self.photos.get(photo)?.cofactors * self.variance_of_unit_weight?)
    }

    /// The observations beside images by kind; `network` is the one that was adjusted.
    pub fn kinds(&self, network: &Network) -> Vec<KindSums> {
        KindSums::all(&network.observations, &self.observations)
    }

    /// Puts the pieces of an adjustment back into the order of the network. Called on a thread of the threads.
    pub(super) fn new(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> Self {
        Self::with_leverages(network, options, assembled, adjustment, collapsed).0
    }

    /// The same, with what tests of groups need where the adjustment has kept that.
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
        let photos_end = problem.model.blocks.first[network.photos.len()];
        let of_photo = |&unknown: &usize| of_photo(problem, unknown);
        let photos = adjusted_photos(network, assembled, &adjustment, &unknowns);
        let mut solution = Self {
            cameras: network.adjusted_cameras(assembled, &adjustment, &unknowns, &photos),
            photos,
            commons: network.adjusted_commons(assembled, &adjustment, &unknowns),
            photo_corrections: adjustment.corrections().map(|all| all[..photos_end].to_vec()).collect(),
            points: adjusted_points(network, assembled, &adjustment, &unknowns),
            images,
            observations,
            unseen: Unseen::default(),
            undetermined: adjustment.undetermined.take().map(|error| NetworkError::new(error, assembled)),
            weak: Weak {
                photos: adjustment.weak.iter().filter_map(of_photo).collect(),
                cameras: adjustment.weak.iter().filter_map(|&unknown| of_camera(problem, unknown)).collect(),
                commons: adjustment.weak.iter().filter_map(|&unknown| of_common(problem, unknown)).collect(),
                points: vec![],
            },
            datum: DatumInForce {
                held: adjustment.datum.iter().filter_map(of_photo).collect(),
                held_commons: adjustment
                    .datum
                    .iter()
                    .filter_map(|&unknown| of_common(problem, unknown))
                    .collect(),
                ..DatumInForce::default()
            },
            dropped: dropped.clone(),
            state: State {
                unknowns: vec![],
                held: adjustment.datum.clone(),
                collapsed,
                loose: assembled.loose.clone(),
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
        let squares = solution.find_behind(assembled, &unknowns);
        let (model, points) = (&problem.model, &assembled.points[..]);
        solution.weak.points = network.weak_points(model, points, &solution.points, &squares);
        let found = Leverages::of(&mut solution.adjustment, &unknowns);
        let found = found.filter(|_| solution.adjustment.holds_after_last_step());
        solution.state.unknowns = unknowns;
        solution.adjustment.cofactors = None;
        solution.adjustment.release_observations();
        (solution, found)
    }
}

/// A sum of squares over the degrees of freedom, where there are any.
fn over(sum: f64, degrees_of_freedom: i64) -> Option<f64> {
    (degrees_of_freedom > 0).then(|| sum / degrees_of_freedom as f64)
}

/// The photo and the number of one of its unknowns; None for unknowns of anything else.
pub(super) fn of_photo(problem: &Problem<Bundle>, unknown: usize) -> Option<(usize, usize)> {
    match of_block(problem, unknown)? {
        (Owner::Photo(photo), number) => Some((photo, number)),
        _ => None,
    }
}

/// The shared camera and the number of one of its parameters; None for unknowns of anything else.
fn of_camera(problem: &Problem<Bundle>, unknown: usize) -> Option<(usize, usize)> {
    match of_block(problem, unknown)? {
        (Owner::Camera(camera), parameter) => Some((camera, parameter)),
        _ => None,
    }
}

/// The common unknown and the number of one of its unknowns; None for unknowns of anything else.
fn of_common(problem: &Problem<Bundle>, unknown: usize) -> Option<(usize, usize)> {
    match of_block(problem, unknown)? {
        (Owner::Common(common), number) => Some((common, number)),
        _ => None,
    }
}

/// What an unknown belongs to, and its number there; None for unknowns of points.
fn of_block(Problem { model, .. }: &Problem<Bundle>, unknown: usize) -> Option<(Owner, usize)> {
    model.owner(unknown)
}

/// The observations beside images.
pub(super) fn observations(
    network: &Network,
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
) -> Vec<Option<AdjustedObservation>> {
    let (model, layout) = (&problem.model, problem.layout());
    let first = layout.groups() * layout.rows();
    let mut all = vec![None; network.observations.len()];
    for (i, tied) in model.observations.iter().enumerate() {
        let tie = model.tied_images() + i;
        let rows = layout.tie_rows(tie);
        let shares = adjustment.cofactors.as_ref().map(|found| &found.ties[layout.tie_block(tie)]);
        let weight = adjustment.weights.as_ref().map_or(1.0, |all| all[layout.groups() + tie]);
        let whitened = &adjustment.residuals[first + rows.start..first + rows.end];
        all[tied.index] = Some(AdjustedObservation::new(tied, whitened, shares, weight));
    }
    all
}

/// Sums of squares by group (GIANT guide, Appendix E).
pub(super) fn sums_of_squares(
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    unknowns: &[f64],
    observations: &[Option<AdjustedObservation>],
) -> SumsOfSquares {
    let stations = problem.model.of_stations();
    let terms = problem.any().terms(unknowns);
    let squares = |range: Range<usize>| terms.sum_of_squares(range);
    let rows = problem.layout().rows();
    let of_images = &problem.observation_sd[..rows * problem.model.images.len()];
    SumsOfSquares {
        camera: squares(stations.clone()),
        ground: squares(0..stations.start) + squares(stations.end..unknowns.len()),
        plates: adjustment.reweighted_sum_of_squares(of_images, rows),
        observations: observations.iter().flatten().fold(0.0, |sum, own| sum + own.square),
    }
}

/// Sums of redundancy numbers by group; None where there are none.
fn redundancies(
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    observations: &[Option<AdjustedObservation>],
) -> Option<Redundancies> {
    let of_observations = adjustment.redundancy.as_ref()?;
    let of_unknowns = adjustment.prior_redundancy.as_ref()?;
    let stations = problem.model.of_stations();
    let images = problem.layout().rows() * problem.model.images.len();
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    Some(Redundancies {
        camera: sum(&of_unknowns[stations.clone()]),
        ground: sum(&of_unknowns[..stations.start]) + sum(&of_unknowns[stations.end..]),
        plates: sum(&of_observations[..images]),
        observations: observations.iter().flatten().fold(0.0, |all, own| all + sum(&own.redundancy)),
    })
}

/// Degrees of freedom (GIANT guide, Appendix E): observations are the image coordinates and what was observed beside them, the
/// held components of control and, but for free photos, every other weighted unknown: of photos, cameras, lever arms.
fn degrees_of_freedom(
    unit_variance: UnitVariance,
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
) -> i64 {
    let counts = adjustment.counts;
    let stations = problem.model.of_stations();
    let weighted_cameras = stations.filter(|&unknown| problem.is_weighted(unknown)).count();
    let weighted = match unit_variance {
        UnitVariance::Free => counts.weighted - weighted_cameras,
        UnitVariance::Constrained | UnitVariance::Redundancy | UnitVariance::Unity => counts.weighted,
    };
    (counts.observations + weighted) as i64 - counts.unknowns as i64
}
