//! Physically impossible images: points behind the camera, or outside the invertible area of its lens model.

use super::input::Image;
use super::problem::Assembled;
use super::selection::TOGETHER;
use super::solution::{Solution, Unseen};
use super::stations::{Station, Stations};
use crate::parallel;

impl Solution {
    /// Finds the images of points behind the camera, or outside the invertible area of the lens model. Returns the squared distances of the
    /// points from the nearest station.
    pub(super) fn find_behind(
        &mut self,
        Assembled { problem, points, .. }: &Assembled,
        unknowns: &[f64],
    ) -> Vec<f64> {
        let model = &problem.model;
        let Stations { photos, films, .. } = model.without_points(&unknowns[model.of_stations()]);
        let mut of_shared = vec![None; model.stations()];
        let fold = |(station, block): (&Station, &Option<usize>)| match *block {
            None => station.camera.fold(),
            Some(block) => *of_shared[block].get_or_insert_with(|| station.camera.fold()),
        };
        let folds: Vec<f64> = photos.iter().zip(&model.blocks.of_camera).map(fold).collect();
        let (local, tied) = model.all_coordinates(unknowns);
        let look = |point: usize| {
            let at = local.get(point).unwrap_or_else(|| &tied[point - local.len()]);
            let position = model.space.cartesian(*at);
            let (mut nearest, mut unseen) = (f64::INFINITY, Unseen::default());
            for image in model.point_images.start[point]..model.point_images.start[point + 1] {
                let Image { photo, xy, .. } = model.images[image];
                let Station { orientation, camera } = &photos[photo];
                let u = orientation.pose().sight(&position);
                nearest = nearest.min(u.norm_squared());
                if !camera.faces(&u) {
                    unseen.behind.push(model.point_images.order[image]);
                }
                let film = films.get(photo).and_then(Option::as_ref);
                let in_camera = || film.map_or(Some(xy), |film| film.place(xy, model.passages.cell(image)));
                let beyond = |xy| camera.radius(&u, xy) > folds[photo];
                if folds[photo].is_finite() && in_camera().is_some_and(beyond) {
                    unseen.folded.push(model.point_images.order[image]);
                }
            }
            (nearest, unseen.boxed())
        };
        let of_points = parallel::map(model.points.len(), TOGETHER, look);
        let (squares, unseen): (Vec<f64>, Vec<_>) = of_points.into_iter().unzip();
        for (&point, unseen) in points.iter().zip(unseen) {
            let Some(unseen) = unseen else { continue };
            if let Some(point) = &mut self.points[point] {
                point.behind = unseen.behind.len();
            }
            self.unseen.behind.extend(unseen.behind);
            self.unseen.folded.extend(unseen.folded);
        }
        self.unseen.behind.sort_unstable();
        self.unseen.folded.sort_unstable();
        squares
    }
}

impl Unseen {
    /// Returns None if both lists are empty, as for nearly all points.
    fn boxed(self) -> Option<Box<Self>> {
        (!(self.behind.is_empty() && self.folded.is_empty())).then(|| Box::new(self))
    }
}
