//! The adjusted network.

use nalgebra::DMatrix;

use super::problem::Assembled;
use super::{Dropped, Network, NetworkError, Options, Point, UnitVariance};
use crate::adjustment::{Adjustment, Observed, Problem, leading_matrix};
use crate::geometry::{AttitudeNumbers, Matrix3, PoseNumbers};
use crate::network::model::Bundle;

/// An adjusted photo.
#[derive(Debug, Clone)]
pub struct AdjustedPhoto {
    /// The six unknowns of its pose.
    pub pose: [f64; 6],
    /// The parameters of its camera.
    pub camera: Vec<f64>,
    /// Cofactors (a priori unit weight) of pose and, unless it is held, camera, row by row; NaN where there are none.
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

/// Weighted sums of squares, weights as the loss has changed them.
#[derive(Debug, Clone, Copy)]
pub struct SumsOfSquares {
    /// Of the weighted poses and cameras of the photos.
    pub camera: f64,
    /// Of the held components of control.
    pub ground: f64,
    /// Of the image coordinates.
    pub plates: f64,
}

impl SumsOfSquares {
    /// All together.
    pub fn total(&self) -> f64 {
        self.camera + self.ground + self.plates
    }
}

/// An adjusted network, photo by photo, point by point, image by image, as in the input.
#[derive(Debug)]
pub struct Solution {
    /// The photos.
    pub photos: Vec<AdjustedPhoto>,
    /// For every iteration, the corrections of the unknowns of all photos, one photo after the other.
    pub photo_corrections: Vec<Vec<f64>>,
    /// The points; None for those that were left out.
    pub points: Vec<Option<AdjustedPoint>>,
    /// The images; None for those of points that were left out.
    pub images: Vec<Option<Observed<2>>>,
    /// The images whose point stands behind the camera, ascending.
    pub behind: Vec<usize>,
    /// Why there are no cofactors although they were asked for: what the adjusted values leave undetermined.
    pub undetermined: Option<NetworkError>,
    /// What a combination of unknowns moves that is determined so weakly that no step could follow it to its end, photo and
    /// unknown (0 to 5: pose, then camera); none where the adjustment ended otherwise.
    pub weak: Vec<(usize, usize)>,
    /// What was held to give a datum where nothing else does: photo and unknown. In the datum of inner constraints, what they were
    /// taken from.
    pub datum: Vec<(usize, usize)>,
    /// The points that were left out at first.
    pub dropped: Vec<Dropped>,
    /// The points that were left out because they ran into a station, ascending.
    pub collapsed: Vec<usize>,
    /// Weighted sums of squares.
    pub sums_of_squares: SumsOfSquares,
    /// Degrees of freedom of the chosen unit variance; not positive where there is no redundancy.
    pub degrees_of_freedom: i64,
    /// Variance of unit weight; None where there are no degrees of freedom.
    pub variance_of_unit_weight: Option<f64>,
    /// Status, iterations, counts, operations and times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Puts the pieces of an adjustment back into the order of the network.
    pub(super) fn new(
        network: &Network,
        options: &Options,
        assembled: &Assembled,
        mut adjustment: Adjustment,
        collapsed: Vec<usize>,
    ) -> Self {
        let Assembled { problem, points, dropped, .. } = assembled;
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let (sums_of_squares, degrees_of_freedom) =
            statistics(options.unit_variance, problem, &adjustment, &unknowns);
        let over_freedom = |sum: f64| (degrees_of_freedom > 0).then(|| sum / degrees_of_freedom as f64);
        let variance_of_unit_weight = match options.unit_variance {
            UnitVariance::Unity => Some(1.0),
            UnitVariance::Free => over_freedom(sums_of_squares.ground + sums_of_squares.plates),
            UnitVariance::Constrained => over_freedom(sums_of_squares.total()),
        };
        let mut images = vec![None; network.images.len()];
        for (group, &image) in problem.model.order.iter().enumerate() {
            images[image] = Some(adjustment.observed(group, network.images[image].sd));
        }
        let of_photo = |&unknown: &usize| of_photo(problem, unknown);
        let mut solution = Self {
            photos: photos(network, assembled, &adjustment, &unknowns),
            photo_corrections: adjustment.corrections().collect(),
            points: adjusted_points(network, assembled, &adjustment, &unknowns),
            images,
            behind: vec![],
            undetermined: adjustment.undetermined.take().map(|error| NetworkError::new(error, points)),
            weak: adjustment.weak.iter().map(of_photo).collect(),
            datum: adjustment.datum.iter().map(of_photo).collect(),
            dropped: dropped.clone(),
            collapsed,
            sums_of_squares,
            degrees_of_freedom,
            variance_of_unit_weight,
            adjustment,
        };
        solution.find_behind(assembled, &unknowns);
        solution.adjustment.cofactors = None;
        solution.adjustment.release_observations();
        solution
    }

    /// Finds the images whose point stands behind the camera.
    fn find_behind(&mut self, Assembled { problem, points, .. }: &Assembled, unknowns: &[f64]) {
        let (model, layout) = (&problem.model, problem.layout());
        let (coordinates, photos) = unknowns.split_at(layout.all_locals().end);
        let photos = model.photos(photos);
        for (local, (&point, &at)) in points.iter().zip(coordinates.as_chunks().0).enumerate() {
            let position = model.space.cartesian(at);
            let hidden =
                |&group: &usize| photos[model.images[group].photo].orientation.pose().depth(&position) < 0.0;
            let found: Vec<usize> =
                layout.groups_of(local).filter(hidden).map(|group| model.order[group]).collect();
            if let Some(point) = &mut self.points[point] {
                point.behind = found.len();
            }
            self.behind.extend(found);
        }
        self.behind.sort_unstable();
    }
}

/// The photo and the number of one of its unknowns.
fn of_photo(problem: &Problem<Bundle>, unknown: usize) -> (usize, usize) {
    let (first, kept) = (&problem.model.first, unknown - problem.layout().all_kept().start);
    let photo = first.partition_point(|&start| start <= kept) - 1;
    (photo, kept - first[photo])
}

fn photos(
    network: &Network,
    Assembled { problem, origin, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<AdjustedPhoto> {
    let model = &problem.model;
    let locals = problem.layout().all_kept().start;
    let positions = if let PoseNumbers::Angles(_) = network.poses { 3 } else { 0 };
    let mut start = 0;
    let photo = |(index, photo): (usize, &super::Photo)| {
        let (first, end) = (locals + model.first[index], locals + model.first[index + 1]);
        let values = &unknowns[first..end];
        let (count, given) = ((end - first).pow(2), start);
        start += count;
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
        AdjustedPhoto {
            pose: std::array::from_fn(absolute),
            camera: if values.len() > 6 { values[6..].to_vec() } else { model.cameras[index].parameters() },
            cofactors: cofactors.map_or_else(
                || vec![f64::NAN; count],
                |all| in_angles(model, index, values, &all.kept[given..given + count]),
            ),
            redundancy: redundancy
                .map_or_else(|| vec![f64::NAN; end - first], |all| all[first..end].to_vec()),
            images: model.images_on[index],
        }
    };
    network.photos.iter().enumerate().map(photo).collect()
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
    Assembled { problem, points, origin, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<Option<AdjustedPoint>> {
    let mut adjusted = vec![None; network.points.len()];
    let cofactors = adjustment.cofactors.as_ref();
    for (local, (&point, values)) in points.iter().zip(unknowns.as_chunks::<3>().0).enumerate() {
        let Point { coordinates, sd } = network.points[point];
        let absolute = |k: usize| if sd[k] == 0.0 { coordinates[k] } else { values[k] + origin[k] };
        adjusted[point] = Some(AdjustedPoint {
            coordinates: std::array::from_fn(absolute),
            cofactors: leading_matrix(cofactors.map(|all| &all.local[9 * local..])),
            redundancy: adjustment.prior_redundancy(3 * local),
            last_correction: std::array::from_fn(|k| adjustment.last_local_corrections[3 * local + k]),
            rays: problem.layout().groups_of(local).len(),
            behind: 0,
        });
    }
    adjusted
}

/// Sums of squares by group, and degrees of freedom (GIANT guide, Appendix E): observations are the image coordinates, the
/// held components of control and, with constrained photos, the weighted unknowns of these.
fn statistics(
    unit_variance: UnitVariance,
    problem: &Problem<Bundle>,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> (SumsOfSquares, i64) {
    let layout = problem.layout();
    let squares = |range: std::ops::Range<usize>| range.map(|i| problem.prior_square(i, unknowns[i])).sum();
    let sums = SumsOfSquares {
        camera: squares(layout.all_kept()),
        ground: squares(layout.all_locals()),
        plates: adjustment.reweighted_sum_of_squares(&problem.observation_sd),
    };
    let counts = adjustment.counts;
    let weighted_cameras = layout.all_kept().filter(|&unknown| problem.is_weighted(unknown)).count();
    let weighted = match unit_variance {
        UnitVariance::Constrained => counts.weighted,
        UnitVariance::Free | UnitVariance::Unity => counts.weighted - weighted_cameras,
    };
    (sums, (counts.observations + weighted) as i64 - counts.unknowns as i64)
}
