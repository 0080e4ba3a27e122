//! The observation equations of a collection.

use super::Image;
use crate::adjustment::Model;
use crate::geometry::{BundlerPhoto, ObjectSpace, Point, Vector3};
use crate::normals::GroupRows;

/// A point has run into a station when its share in what the station learns is so many times that of the others in the mean: it is
/// ten thousand times nearer than they are, and rounding leaves eight digits of what they say.
const NEAR: f64 = 1e8;

/// Images by photos with nine unknowns each.
#[derive(Debug)]
pub struct Bundle {
    /// How many points take part: the local blocks.
    pub points: usize,
    /// The images, point by point: the groups of observations.
    pub images: Vec<Image>,
    /// The images of point i are `images[images_of[i]..images_of[i + 1]]`.
    pub images_of: Vec<usize>,
    /// How many of them each photo has.
    pub images_on: Vec<usize>,
    /// Whether the position of anything is weighted or fixed: then the datum is the user's.
    pub placed: bool,
}

/// Photos and points at given values of the unknowns.
#[derive(Debug)]
pub struct Stations {
    photos: Vec<BundlerPhoto>,
    points: Vec<Point>,
}

impl Bundle {
    /// The photos at given values of all unknowns.
    pub fn photos(&self, unknowns: &[f64]) -> Vec<BundlerPhoto> {
        unknowns[3 * self.points..]
            .as_chunks()
            .0
            .iter()
            .map(|&values| BundlerPhoto::from_parameters(values))
            .collect()
    }
}

impl Model for Bundle {
    type Prepared = Stations;

    fn prepare(&self, unknowns: &[f64]) -> Stations {
        let points = unknowns[..3 * self.points].as_chunks().0.iter();
        let points = points.map(|&at| Point::new(ObjectSpace::Rectangular, at)).collect();
        Stations { photos: self.photos(unknowns), points }
    }

    #[inline(always)]
    fn observe(&self, stations: &Stations, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let observed = &self.images[group];
        let image = stations.photos[observed.photo].linearize(&stations.points[local]);
        for row in 0..2 {
            rows.constant[row] = observed.xy[row] - image.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&image.point[row]);
            rows.kept[9 * row..][..6].copy_from_slice(&image.photo[row]);
            rows.kept[9 * row + 6..][..3].copy_from_slice(&image.camera[row]);
        }
    }

    /// Points that have run into a station: two rays that meet there ask for it. The image of such a point turns by 1 / distance
    /// when point or station move; what its station learns from it, and loses again when the point is eliminated, is the square of that.
    fn collapsed(&self, _: &[f64], unknowns: &[f64]) -> Vec<usize> {
        let photos = self.photos(unknowns);
        let points = unknowns[..3 * self.points].as_chunks::<3>().0;
        let centres: Vec<Vector3> = photos.iter().map(BundlerPhoto::centre).collect();
        let share = |point: usize, image: &Image| {
            (Vector3::from(points[point]) - centres[image.photo]).norm_squared().recip()
        };
        let mut shares = vec![0.0; photos.len()];
        for (point, images) in self.images_of.windows(2).enumerate() {
            self.images[images[0]..images[1]]
                .iter()
                .for_each(|image| shares[image.photo] += share(point, image));
        }
        let collapsed = |point: &usize| {
            self.images[self.images_of[*point]..self.images_of[*point + 1]].iter().any(|image| {
                let own = share(*point, image);
                let others = (shares[image.photo] - own).max(0.0)
                    / (self.images_on[image.photo] as f64 - 1.0).max(1.0);
                others > 0.0 && own > NEAR * others
            })
        };
        (0..self.points).filter(collapsed).collect()
    }

    /// Rotation and translation of the first photo, and the component of a translation that changes most when the scale does.
    fn datum(&self, unknowns: &[f64]) -> Vec<usize> {
        let photos = self.photos(unknowns);
        let with_images = || (0..photos.len()).filter(|&photo| self.images_on[photo] > 0);
        let (false, Some(first)) = (self.placed, with_images().next()) else { return vec![] };
        let centre = photos[first].centre();
        let shifts = with_images().filter(|&photo| photo != first).flat_map(|photo| {
            let shift = photos[photo].orientation.pose().sight(&centre);
            (0..3).map(move |k| (shift[k].abs(), 9 * photo + 3 + k))
        });
        let scale = shifts.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, unknown)| unknown);
        (9 * first..9 * first + 6).chain(scale).map(|unknown| 3 * self.points + unknown).collect()
    }
}
