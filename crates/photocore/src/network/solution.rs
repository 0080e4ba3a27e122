//! The adjusted network.

use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::model::Owner;
use super::problem::Assembled;
use super::screening::TOGETHER;
use super::stations::Placed;
use super::{
    AdjustedCamera, AdjustedCommon, AdjustedObservation, Dropped, KindSums, Network, NetworkError, Options,
    Point, Settled, State, UnitVariance, WeakPoint,
};
use crate::adjustment::{Adjustment, Observed, Problem, Tried, leading_matrix};
use crate::geometry::{AttitudeNumbers, Matrix3, PoseNumbers};
use crate::network::model::Bundle;
use crate::normals::Cofactors;

/// An adjusted photo.
#[derive(Debug, Clone)]
pub struct AdjustedPhoto {
    /// The six unknowns of its pose; of a photo on a frame those that it would have, from the poses of frame and sensor.
    pub pose: [f64; 6],
    /// The parameters of its camera.
    pub camera: Vec<f64>,
    /// Cofactors (a priori unit weight) of pose and, unless it is held or shared, camera, row by row; NaN where there are none.
    pub cofactors: Vec<f64>,
    /// Redundancy numbers of these unknowns as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: Vec<f64>,
    /// Number of images that took part.
    pub images: usize,
}

/// An adjusted point.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Cofactors (a priori unit weight); NaN where there are none.
    pub cofactors: [[f64; 3]; 3],
    /// Redundancy numbers of its components as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: [f64; 3],
    /// Its correction in the last iteration.
    pub last_correction: [f64; 3],
    /// Number of images.
    pub rays: usize,
    /// How many of them have it behind the camera.
    pub behind: usize,
}

/// Photos that a thread takes at least.
const PHOTOS_TOGETHER: usize = 128;
/// A redundancy of less is rounding.
const LEAST_REDUNDANCY: f64 = 1e-9;

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
    /// These by kind.
    pub kinds: Vec<KindSums>,
    /// The images whose point stands behind the camera, ascending.
    pub behind: Vec<usize>,
    /// The images beyond where the lens of their camera is one-to-one, ascending: they may belong to another direction.
    pub folded: Vec<usize>,
    /// Why there are no cofactors although they were asked for: what the adjusted values leave undetermined.
    pub undetermined: Option<NetworkError>,
    /// What a combination of unknowns moves that is determined so weakly that no step could follow it to its end, photo and
    /// unknown (0 to 5: pose, then camera); none where the adjustment ended otherwise.
    pub weak: Vec<(usize, usize)>,
    /// The same for cameras that several photos share, camera and parameter.
    pub weak_cameras: Vec<(usize, usize)>,
    /// The same for common unknowns, common unknown and its number.
    pub weak_commons: Vec<(usize, usize)>,
    /// What was held to give a datum where nothing else does: photo and unknown. In the datum of inner constraints, what they were
    /// taken from.
    pub datum: Vec<(usize, usize)>,
    /// The points that were left out at first.
    pub dropped: Vec<Dropped>,
    /// The points that were left out because they ran into a station, or their rays do not determine them, ascending.
    pub collapsed: Vec<usize>,
    /// The points on nearly parallel rays, or at a station's own place.
    pub weak_points: Vec<WeakPoint>,
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
    /// About how large a part of the variances rounding may be, in a datum that they were taken to; zero otherwise.
    pub lost_digits: f64,
    /// Whether control and weights of poses are exactly what a datum takes: they check nothing, and another datum may be chosen.
    pub minimal_control: bool,
    /// Where the adjustment has converged, the problem with its cofactors: tests of it form nothing again.
    pub settled: Option<Box<Settled>>,
    /// Status, iterations, counts, operations and times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Puts the pieces of an adjustment back into the order of the network. Called on a thread of the pool.
    pub(super) fn new(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> Self {
        Self::with_tried(network, options, assembled, adjustment, collapsed).0
    }

    /// The same, with what tests of groups need where the adjustment has kept that.
    pub(super) fn with_tried(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        mut adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> (Self, Option<Tried>) {
        let Assembled { problem, dropped, .. } = assembled;
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let observations = observations(network, problem, &adjustment);
        let sums_of_squares = sums_of_squares(problem, &adjustment, &unknowns, &observations);
        let redundancies = redundancies(problem, &adjustment, &observations);
        let degrees_of_freedom = degrees_of_freedom(options.unit_variance, problem, &adjustment);
        let over_freedom = |sum: f64| (degrees_of_freedom > 0).then(|| sum / degrees_of_freedom as f64);
        let variance_of_unit_weight = match options.unit_variance {
            UnitVariance::Unity => Some(1.0),
            UnitVariance::Free => over_freedom(sums_of_squares.measured()),
            UnitVariance::Constrained => over_freedom(sums_of_squares.total()),
            UnitVariance::Redundancy => redundancies
                .map(|own| own.measured())
                .filter(|&own| own > LEAST_REDUNDANCY)
                .map(|own| sums_of_squares.measured() / own),
        };
        let observed = |image: usize, group: usize| adjustment.observed(group, network.images[image].sd);
        let images = in_order(network.images.len(), &problem.model.order, observed);
        let photos_end = problem.model.first[network.photos.len()];
        let of_photo = |&unknown: &usize| of_photo(problem, unknown);
        let photos = photos(network, assembled, &adjustment, &unknowns);
        let mut solution = Self {
            cameras: network.adjusted_cameras(assembled, &adjustment, &unknowns, &photos),
            photos,
            commons: network.adjusted_commons(assembled, &adjustment, &unknowns),
            photo_corrections: adjustment.corrections().map(|all| all[..photos_end].to_vec()).collect(),
            points: adjusted_points(network, assembled, &adjustment, &unknowns),
            images,
            kinds: KindSums::all(&network.observations, &observations),
            observations,
            behind: vec![],
            folded: vec![],
            weak_points: vec![],
            undetermined: adjustment.undetermined.take().map(|error| NetworkError::new(error, assembled)),
            weak: adjustment.weak.iter().filter_map(of_photo).collect(),
            weak_cameras: adjustment.weak.iter().filter_map(|&unknown| of_camera(problem, unknown)).collect(),
            weak_commons: adjustment.weak.iter().filter_map(|&unknown| of_common(problem, unknown)).collect(),
            datum: adjustment.datum.iter().filter_map(of_photo).collect(),
            dropped: dropped.clone(),
            state: State {
                unknowns: vec![],
                held: adjustment.datum.clone(),
                collapsed: collapsed.clone(),
                loose: assembled.loose.clone(),
                ordering: adjustment.ordering,
                datum: None,
                released: false,
            },
            lost_digits: 0.0,
            minimal_control: false,
            settled: None,
            collapsed,
            sums_of_squares,
            redundancies,
            degrees_of_freedom,
            variance_of_unit_weight,
            adjustment,
        };
        let squares = solution.find_behind(assembled, &unknowns);
        let (model, points) = (&problem.model, &assembled.points[..]);
        solution.weak_points = network.weak_points(model, points, &solution.points, &squares);
        let found = Tried::of(problem, &unknowns, &mut solution.adjustment);
        solution.state.unknowns = unknowns;
        solution.adjustment.cofactors = None;
        solution.adjustment.release_observations();
        (solution, found)
    }
}

/// The photo and the number of one of its unknowns; None for unknowns of anything else.
fn of_photo(problem: &Problem<Bundle>, unknown: usize) -> Option<(usize, usize)> {
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
    let all = model.of_stations();
    let kept = all.contains(&unknown).then(|| unknown - all.start)?;
    let block = model.first.partition_point(|&start| start <= kept) - 1;
    Some((model.owner(block), kept - model.first[block]))
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

fn photos(
    network: &Network,
    Assembled { problem, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<AdjustedPhoto> {
    let model = &problem.model;
    let origin = model.origin;
    let positions = if let PoseNumbers::Angles(_) = network.poses { 3 } else { 0 };
    let placed = model.placed(&unknowns[model.of_stations()]);
    let photo = |(index, photo): (usize, &super::Photo)| {
        let range = model.of_block(index);
        let (first, end) = (range.start, range.end);
        let values = &unknowns[range];
        let count = (end - first).pow(2);
        let angles = reported_angles(model, index, values);
        let absolute = |k: usize| {
            let counted = if k < positions { values[k] + origin[k] } else { values[k] };
            let counted = angles.filter(|_| k >= 3).map_or(counted, |angles| angles[k - 3]);
            // Fixed ones as they were given, to the last bit.
            if k < positions && photo.sd[k] == 0.0 { photo.pose[k] } else { counted }
        };
        // A photo without images that is held has no cofactors: nothing was asked of it.
        let asked = model.images_on[index] > 0 || problem.sd[first..end].iter().any(|&sd| sd != 0.0);
        let cofactors = adjustment.cofactors.as_ref().filter(|_| asked);
        let redundancy = adjustment.prior_redundancy.as_ref();
        let camera = match model.camera_block[index] {
            Some(block) => unknowns[model.of_block(block)].to_vec(),
            None if values.len() > 6 => values[6..].to_vec(),
            None => model.cameras[index].parameters(),
        };
        if model.mount(index).is_some() {
            // In a part of a network its images may be at home below.
            let asked = model.images_on[index] > 0 || !problem.layout().contributions().is_empty();
            let cofactors = adjustment.cofactors.as_ref().filter(|_| asked);
            let (pose, cofactors) = mounted_pose(network, problem, &placed, index, cofactors);
            let redundancy = vec![if cofactors[0].is_nan() { f64::NAN } else { 0.0 }; 6];
            return AdjustedPhoto { pose, camera, cofactors, redundancy, images: model.images_on[index] };
        }
        AdjustedPhoto {
            pose: std::array::from_fn(absolute),
            camera,
            cofactors: cofactors.map_or_else(
                || vec![f64::NAN; count],
                |all| in_angles(model, index, values, model.cofactors_of_block(all, index)),
            ),
            redundancy: redundancy
                .map_or_else(|| vec![f64::NAN; end - first], |all| all[first..end].to_vec()),
            images: model.images_on[index],
        }
    };
    network.photos.par_iter().enumerate().with_min_len(PHOTOS_TOGETHER).map(photo).collect()
}

/// The six numbers of the pose of a photo that is mounted, and their cofactors; NaN where there are none.
fn mounted_pose(
    network: &Network,
    problem: &Problem<Bundle>,
    Placed { photos, mounted, .. }: &Placed,
    photo: usize,
    cofactors: Option<&Cofactors>,
) -> ([f64; 6], Vec<f64>) {
    let (model, orientation) = (&problem.model, &photos[photo].orientation);
    let (mut pose, taken) = model.reported(orientation);
    let found = cofactors.zip(mounted[photo].as_ref()).zip(taken).map(|((all, own), taken)| {
        let cofactors = model.mounted_cofactors(problem.layout(), photo, own, all);
        (taken * cofactors * taken.transpose()).as_slice().to_vec()
    });
    if let PoseNumbers::Angles(_) = network.poses {
        (0..3).for_each(|k| pose[k] += model.origin[k]);
    }
    (pose, found.unwrap_or_else(|| vec![f64::NAN; 36]))
}

/// The angles of a photo that steps by a rotation vector; at a singular attitude kappa is zero and omega takes the sum.
fn reported_angles(model: &Bundle, photo: usize, values: &[f64]) -> Option<[f64; 3]> {
    let numbers = AttitudeNumbers::OmegaPhiKappa(model.turning_sense(photo)?);
    let angles = [values[3], values[4], values[5]];
    Some(if numbers.is_singular(angles) { numbers.numbers(&numbers.attitude(angles)) } else { angles })
}

/// Cofactors of a photo's unknowns: where its attitude has stepped by a rotation vector rho = K d(angles), taken to the angles by
/// diag(I, K^-1, I). NaN for angles that are not determined, phi being 90 degrees.
fn in_angles(model: &Bundle, photo: usize, values: &[f64], cofactors: &[f64]) -> Vec<f64> {
    let Some(sense) = model.turning_sense(photo) else { return cofactors.to_vec() };
    let (numbers, angles) = (AttitudeNumbers::OmegaPhiKappa(sense), [values[3], values[4], values[5]]);
    let inverse = numbers.rates(angles).try_inverse().filter(|_| !numbers.is_singular(angles));
    let inverse = inverse.unwrap_or_else(|| Matrix3::repeat(f64::NAN));
    let width = values.len();
    let mut found = DMatrix::from_row_slice(width, width, cofactors);
    let rows = inverse * found.fixed_rows::<3>(3);
    found.fixed_rows_mut::<3>(3).copy_from(&rows);
    let columns = found.fixed_columns::<3>(3) * inverse.transpose();
    found.fixed_columns_mut::<3>(3).copy_from(&columns);
    ((&found + found.transpose()) / 2.0).as_slice().to_vec()
}

fn adjusted_points(
    network: &Network,
    Assembled { problem, points, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<Option<AdjustedPoint>> {
    let (model, origin) = (&problem.model, problem.model.origin);
    let cofactors = adjustment.cofactors.as_ref();
    let corrections = last_corrections(adjustment);
    let (local, tied) = model.all_coordinates(unknowns);
    in_order(network.points.len(), points, |point, i| {
        let values = i.checked_sub(model.locals).map_or_else(|| &local[i], |tie| &tied[tie]);
        let Point { coordinates, sd } = network.points[point];
        let absolute = |k: usize| if sd[k] == 0.0 { coordinates[k] } else { values[k] + origin[k] };
        let first = model.of_point(i).start;
        let own = cofactors.map(|all| match i.checked_sub(model.locals) {
            None => &all.local[9 * i..],
            // The last kept blocks.
            Some(tied) => &all.kept[all.kept.len() - 9 * (points.len() - model.locals - tied)..],
        });
        AdjustedPoint {
            coordinates: std::array::from_fn(absolute),
            cofactors: leading_matrix(own),
            redundancy: adjustment.prior_redundancy(first),
            last_correction: std::array::from_fn(|k| corrections(first + k)),
            rays: model.images_of(i).len(),
            behind: 0,
        }
    })
}

/// What `each` makes of the things of a network that take part, as the network numbers them; None for all others. `order` are those that
/// do, as the problem has them; `each` is given both numbers.
fn in_order<T: Send>(
    count: usize,
    order: &[usize],
    each: impl Fn(usize, usize) -> T + Sync,
) -> Vec<Option<T>> {
    let mut place = vec![u32::MAX; count];
    order.iter().zip(0..).for_each(|(&thing, own)| place[thing] = own);
    let of = |(thing, &own): (usize, &u32)| (own != u32::MAX).then(|| each(thing, own as usize));
    place.par_iter().enumerate().with_min_len(TOGETHER).map(of).collect()
}

/// The correction of each unknown in the last iteration; zero where there was none.
fn last_corrections(adjustment: &Adjustment) -> impl Fn(usize) -> f64 {
    let local = &adjustment.last_local_corrections;
    let kept = adjustment.history.last_chunk::<2>();
    move |unknown| match unknown.checked_sub(local.len()) {
        None => local[unknown],
        Some(kept_unknown) => kept.map_or(0.0, |[before, after]| after[kept_unknown] - before[kept_unknown]),
    }
}

/// Sums of squares by group (GIANT guide, Appendix E).
pub(super) fn sums_of_squares(
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    unknowns: &[f64],
    observations: &[Option<AdjustedObservation>],
) -> SumsOfSquares {
    let stations = problem.model.of_stations();
    let squares = |range: Range<usize>| problem.prior_sum_of_squares(unknowns, range);
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
