//! The adjusted block.

use super::model::CentralPerspective;
use super::{Block, BlockError, Dropped, Options, UnitVariance};
use crate::adjustment::{Adjustment, Observed, Problem, leading_matrix};

/// An adjusted photograph.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPhoto {
    /// Position in the coordinates of the object space.
    pub position: [f64; 3],
    /// Omega, phi, kappa in radians.
    pub attitude: [f64; 3],
    /// Cofactors of position and attitude (a priori unit weight); NaN when not asked for.
    pub cofactors: [[f64; 6]; 6],
    /// Redundancy numbers of its six unknowns as observations of themselves; zero unless weighted.
    pub redundancy: [f64; 6],
}

/// An adjusted point.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Cofactors (a priori unit weight); NaN when not asked for.
    pub cofactors: [[f64; 3]; 3],
    /// Redundancy numbers of its components as observations of themselves; zero unless weighted.
    pub redundancy: [f64; 3],
    /// Its correction in the last iteration.
    pub last_correction: [f64; 3],
    /// Number of images.
    pub rays: usize,
}

/// Weighted sums of squares.
#[derive(Debug, Clone, Copy)]
pub struct SumsOfSquares {
    /// Of the weighted positions and attitudes of the photographs.
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

/// An adjusted block, photograph by photograph, point by point, image by image, as in the input.
#[derive(Debug)]
pub struct Solution {
    /// The photographs.
    pub photos: Vec<AdjustedPhoto>,
    /// For every iteration, the corrections of position, omega, phi and kappa of each photograph.
    pub photo_corrections: Vec<Vec<[f64; 6]>>,
    /// The points; None for those that were left out.
    pub points: Vec<Option<AdjustedPoint>>,
    /// The images; None for those of points that were left out.
    pub images: Vec<Option<Observed<2>>>,
    /// The images whose point stands behind the camera, ascending.
    pub behind: Vec<usize>,
    /// Why there are no cofactors although they were asked for: what the adjusted values leave undetermined.
    pub undetermined: Option<BlockError>,
    /// What a combination of unknowns moves that is determined so weakly that no step could follow it to its end, photograph and
    /// unknown (0 to 5: position, omega, phi, kappa); none where the adjustment ended otherwise.
    pub weak: Vec<(usize, usize)>,
    /// The points that were left out.
    pub dropped: Vec<Dropped>,
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
    /// Puts the pieces of an adjustment back into the order of the block. `points` are those that took part.
    pub(super) fn new(
        block: &Block,
        options: &Options,
        problem: &Problem<CentralPerspective>,
        mut adjustment: Adjustment,
        points: &[usize],
        origin: [f64; 3],
        dropped: Vec<Dropped>,
    ) -> Self {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let (point_part, photo_part) = unknowns.split_at(3 * points.len());
        let (sums_of_squares, degrees_of_freedom) =
            statistics(options.unit_variance, problem, &adjustment, &unknowns);
        let variance_of_unit_weight = match options.unit_variance {
            UnitVariance::Unity => Some(1.0),
            _ if degrees_of_freedom <= 0 => None,
            UnitVariance::Free => {
                Some((sums_of_squares.ground + sums_of_squares.plates) / degrees_of_freedom as f64)
            }
            UnitVariance::Constrained => Some(sums_of_squares.total() / degrees_of_freedom as f64),
        };
        let cofactors = adjustment.cofactors.take();
        let photos = photo_part.as_chunks::<6>().0.iter().enumerate().map(|(photo, values)| AdjustedPhoto {
            position: absolute(block.photos[photo].position, block.photos[photo].position_sd, values, origin),
            attitude: std::array::from_fn(|k| values[3 + k]),
            cofactors: leading_matrix(cofactors.as_ref().map(|all| &all.kept[36 * photo..])),
            redundancy: adjustment.prior_redundancy(3 * points.len() + 6 * photo),
        });
        let mut adjusted_points = vec![None; block.points.len()];
        let layout = problem.layout();
        for (local, (&point, values)) in points.iter().zip(point_part.as_chunks::<3>().0).enumerate() {
            adjusted_points[point] = Some(AdjustedPoint {
                coordinates: absolute(
                    block.points[point].coordinates,
                    block.points[point].sd,
                    values,
                    origin,
                ),
                cofactors: leading_matrix(cofactors.as_ref().map(|all| &all.local[9 * local..])),
                redundancy: adjustment.prior_redundancy(3 * local),
                last_correction: std::array::from_fn(|k| adjustment.last_local_corrections[3 * local + k]),
                rays: layout.groups_of(local).len(),
            });
        }
        let photos = photos.collect();
        let images = images(block, problem, &adjustment);
        let behind = behind(problem, &unknowns);
        let undetermined = adjustment.undetermined.take().map(|error| BlockError::new(error, points));
        let first = problem.layout().all_kept().start;
        let of_photo = |unknown: &usize| ((unknown - first) / 6, (unknown - first) % 6);
        let weak = adjustment.weak.iter().map(of_photo).collect();
        adjustment.release_observations();
        Self {
            photos,
            photo_corrections: adjustment.corrections().map(|all| all.as_chunks().0.to_vec()).collect(),
            points: adjusted_points,
            images,
            behind,
            undetermined,
            weak,
            dropped,
            sums_of_squares,
            degrees_of_freedom,
            variance_of_unit_weight,
            adjustment,
        }
    }
}

/// Coordinates counted from the origin of the object space again; fixed ones as they were given, to the last bit.
fn absolute(given: [f64; 3], sd: [f64; 3], values: &[f64], origin: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| if sd[k] == 0.0 { given[k] } else { values[k] + origin[k] })
}

/// Sums of squares by group, and degrees of freedom (GIANT guide, Appendix E): observations are the image coordinates, the
/// held components of control and, with constrained cameras, the weighted ones of the photographs.
fn statistics(
    unit_variance: UnitVariance,
    problem: &Problem<CentralPerspective>,
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

/// Residuals and test values, image by image as in the block.
fn images(
    block: &Block,
    problem: &Problem<CentralPerspective>,
    adjustment: &Adjustment,
) -> Vec<Option<Observed<2>>> {
    let mut images = vec![None; block.images.len()];
    for (group, &image) in problem.model.order.iter().enumerate() {
        images[image] = Some(adjustment.observed(group, block.images[image].sd));
    }
    images
}

/// The images whose point stands behind the camera, as indices into the block.
fn behind(problem: &Problem<CentralPerspective>, unknowns: &[f64]) -> Vec<usize> {
    let (model, layout) = (&problem.model, problem.layout());
    let (points, photos) = unknowns.split_at(layout.all_locals().end);
    let photos = model.photos(photos);
    let mut behind = Vec::new();
    for (local, coordinates) in points.as_chunks::<3>().0.iter().enumerate() {
        let position = model.space.cartesian(*coordinates);
        let groups = layout.groups_of(local);
        let hidden = groups.filter(|&group| photos[model.images[group].photo].depth(&position) < 0.0);
        behind.extend(hidden.map(|group| model.order[group]));
    }
    behind.sort_unstable();
    behind
}
