//! The adjusted collection.

use super::model::Bundle;
use super::{Collection, CollectionError, Used};
use crate::adjustment::{Adjustment, Observed, Problem, leading_matrix};
use crate::geometry::{BundlerParameters, ObjectSpace};

/// An adjusted photo.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPhoto {
    /// Angle-axis vector, translation, f, k1, k2.
    pub parameters: BundlerParameters,
    /// Cofactors (a priori unit weight); NaN where there are none.
    pub cofactors: [[f64; 9]; 9],
    /// Redundancy numbers of the parameters as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: BundlerParameters,
    /// Number of images that took part.
    pub images: usize,
}

/// An adjusted point.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPoint {
    /// Coordinates.
    pub position: [f64; 3],
    /// Cofactors (a priori unit weight); NaN where there are none.
    pub cofactors: [[f64; 3]; 3],
    /// Redundancy numbers of the coordinates as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: [f64; 3],
    /// Number of images.
    pub rays: usize,
    /// How many of them have it behind the camera.
    pub behind: usize,
}

/// An adjusted collection, photo by photo, point by point, image by image, as in the input.
#[derive(Debug)]
pub struct Solution {
    /// The photos.
    pub photos: Vec<AdjustedPhoto>,
    /// The points; None for those that were left out.
    pub points: Vec<Option<AdjustedPoint>>,
    /// The images; None for those of points that were left out.
    pub images: Vec<Option<Observed<2>>>,
    /// Weighted sum of squares of images and weighted unknowns, weights as the loss has changed them.
    pub sum_of_squares: f64,
    /// Observations and weighted unknowns less unknowns; not positive where there is no redundancy.
    pub degrees_of_freedom: i64,
    /// Variance of unit weight; None where there are no degrees of freedom.
    pub variance_of_unit_weight: Option<f64>,
    /// The points that were left out because they ran into a station, ascending.
    pub collapsed: Vec<usize>,
    /// Why there are no cofactors although they were asked for.
    pub undetermined: Option<CollectionError>,
    /// What was held to give the cofactors a datum: photo and parameter.
    pub datum: Vec<(usize, usize)>,
    /// Status, iterations, counts, operations and times.
    pub adjustment: Adjustment,
}

impl Solution {
    /// Puts the pieces of an adjustment back into the order of the collection.
    pub(super) fn new(
        collection: &Collection,
        problem: &Problem<Bundle>,
        mut adjustment: Adjustment,
        used: &Used,
        collapsed: Vec<usize>,
    ) -> Self {
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let sum_of_squares = adjustment.reweighted_sum_of_squares(&problem.observation_sd)
            + (0..unknowns.len()).map(|i| problem.prior_square(i, unknowns[i])).sum::<f64>();
        let degrees_of_freedom = adjustment.counts.degrees_of_freedom();
        let mut images = vec![None; collection.images.len()];
        for (group, &image) in used.images.iter().enumerate() {
            images[image] = Some(adjustment.observed(group, collection.images[image].sd));
        }
        adjustment.release_observations();
        let (photos, points) =
            (photos(problem, &adjustment, &unknowns), points(problem, &adjustment, &unknowns));
        let mut all_points = vec![None; collection.points.len()];
        used.points.iter().zip(points).for_each(|(&point, adjusted)| all_points[point] = Some(adjusted));
        let first_photo = 3 * used.points.len();
        Self {
            photos,
            points: all_points,
            images,
            sum_of_squares,
            degrees_of_freedom,
            variance_of_unit_weight: (degrees_of_freedom > 0)
                .then(|| sum_of_squares / degrees_of_freedom as f64),
            collapsed,
            undetermined: adjustment
                .undetermined
                .take()
                .map(|error| CollectionError::new(error, &used.points)),
            datum: adjustment
                .datum
                .iter()
                .map(|unknown| ((unknown - first_photo) / 9, (unknown - first_photo) % 9))
                .collect(),
            adjustment,
        }
    }
}

fn photos(problem: &Problem<Bundle>, adjustment: &Adjustment, unknowns: &[f64]) -> Vec<AdjustedPhoto> {
    let first = 3 * problem.model.points;
    let adjusted = unknowns[first..].as_chunks::<9>().0.iter().zip(&problem.model.images_on).enumerate();
    let photo = |(photo, (&parameters, &images)): (usize, (&[f64; 9], &usize))| AdjustedPhoto {
        parameters,
        cofactors: leading_matrix(
            adjustment.cofactors.as_ref().filter(|_| images > 0).map(|all| &all.kept[81 * photo..]),
        ),
        redundancy: adjustment.prior_redundancy(first + 9 * photo),
        images,
    };
    adjusted.map(photo).collect()
}

fn points(problem: &Problem<Bundle>, adjustment: &Adjustment, unknowns: &[f64]) -> Vec<AdjustedPoint> {
    let photos = problem.model.photos(unknowns);
    let positions = unknowns[..3 * problem.model.points].as_chunks::<3>().0;
    let point = |(local, position): (usize, &[f64; 3])| {
        let images = &problem.model.images[problem.layout().groups_of(local)];
        AdjustedPoint {
            position: *position,
            cofactors: leading_matrix(adjustment.cofactors.as_ref().map(|all| &all.local[9 * local..])),
            redundancy: adjustment.prior_redundancy(3 * local),
            rays: images.len(),
            behind: images
                .iter()
                .filter(|image| {
                    photos[image.photo].depth(&ObjectSpace::Rectangular.cartesian(*position)) < 0.0
                })
                .count(),
        }
    };
    positions.iter().enumerate().map(point).collect()
}
