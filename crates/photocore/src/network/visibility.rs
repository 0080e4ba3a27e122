//! Physically impossible images: points behind the camera, or outside the invertible area of its lens model.

use super::adjusted::AdjustedPoint;
use super::input::Image;
use super::linearization_point::{LinearizationPoint, PhotoState};
use super::neighbourhood::TOGETHER;
use super::problem::Assembled;
use crate::parallel;

/// Physically impossible images, ascending.
#[derive(Debug, Default)]
pub struct ImpossibleImages {
    /// Images of points behind the camera.
    pub behind: Vec<usize>,
    /// Images outside the invertible area of the lens model: they may belong to another direction.
    pub folded: Vec<usize>,
}

impl ImpossibleImages {
    /// Returns None if both lists are empty, as for nearly all points.
    fn boxed(self) -> Option<Box<Self>> {
        (!(self.behind.is_empty() && self.folded.is_empty())).then(|| Box::new(self))
    }
}

/// Returns the squared distances of the active points from the nearest station, and the impossible images. Counts the rays behind the
/// camera in the adjusted points.
pub(super) fn find_impossible_images(
    Assembled { problem, points, .. }: &Assembled,
    unknowns: &[f64],
    adjusted: &mut [Option<AdjustedPoint>],
) -> (Vec<f64>, ImpossibleImages) {
    let model = &problem.model;
    let LinearizationPoint { photos, films, .. } =
        model.without_points(&unknowns[model.parameter_unknowns()]);
    let mut of_shared = vec![None; model.parameter_blocks()];
    let fold = |(station, block): (&PhotoState, &Option<usize>)| match *block {
        None => station.camera.fold(),
        Some(block) => *of_shared[block].get_or_insert_with(|| station.camera.fold()),
    };
    let folds: Vec<f64> = photos.iter().zip(&model.blocks.of_camera).map(fold).collect();
    let (local, retained) = model.all_coordinates(unknowns);
    let inspect = |point: usize| {
        let at = local.get(point).unwrap_or_else(|| &retained[point - local.len()]);
        let position = model.space.cartesian(*at);
        let (mut nearest, mut unseen) = (f64::INFINITY, ImpossibleImages::default());
        for image in model.point_images.start[point]..model.point_images.start[point + 1] {
            let Image { photo, xy, .. } = model.images[image];
            let PhotoState { orientation, camera } = &photos[photo];
            let u = orientation.pose().to_camera_frame(&position);
            nearest = nearest.min(u.norm_squared());
            if !camera.faces(&u) {
                unseen.behind.push(model.point_images.order[image]);
            }
            let film = films.get(photo).and_then(Option::as_ref);
            let in_camera =
                || film.map_or(Some(xy), |film| film.place(xy, model.image_corrections.cell(image)));
            let beyond = |xy| camera.radius(&u, xy) > folds[photo];
            if folds[photo].is_finite() && in_camera().is_some_and(beyond) {
                unseen.folded.push(model.point_images.order[image]);
            }
        }
        (nearest, unseen.boxed())
    };
    let of_points = parallel::map(model.points.len(), TOGETHER, inspect);
    let (squares, unseen): (Vec<f64>, Vec<_>) = of_points.into_iter().unzip();
    let mut all = ImpossibleImages::default();
    for (&point, unseen) in points.iter().zip(unseen) {
        let Some(unseen) = unseen else { continue };
        if let Some(point) = &mut adjusted[point] {
            point.behind = unseen.behind.len();
        }
        all.behind.extend(unseen.behind);
        all.folded.extend(unseen.folded);
    }
    all.behind.sort_unstable();
    all.folded.sort_unstable();
    (squares, all)
}
