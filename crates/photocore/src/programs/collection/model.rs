//! The observation equations of a collection.

use super::Image;
use crate::adjustment::Model;
use crate::geometry::vector::{apply, difference, square};
use crate::geometry::{BundlerPhoto, Vector3};
use crate::normals::GroupRows;

/// A point has run into a station when its share in what the station learns is so many times that of the others in the mean: it is
/// ten thousand times nearer than they are, and rounding leaves eight digits of what they say.
const NEAR: f64 = 1e8;
/// A point a hundred times nearer than the others is on its way there,
const ON_ITS_WAY: f64 = 1e4;
/// when no other photo tells it from the station: their images there, before and after a step, are closer than so many standard
/// deviations.
const SAME_PLACE: f64 = 3.0;

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
    /// Of which points no coordinate is known beforehand.
    pub free: Vec<bool>,
    /// Whether the position of anything is weighted or fixed: then the datum is the user's.
    pub placed: bool,
}

/// Photos and points at given values of the unknowns.
#[derive(Debug)]
pub struct Stations {
    photos: Vec<BundlerPhoto>,
    points: Vec<Vector3>,
}

impl Bundle {
    /// The photos at given values of all unknowns.
    pub fn photos(&self, unknowns: &[f64]) -> Vec<BundlerPhoto> {
        unknowns[3 * self.points..].as_chunks().0.iter().map(|&values| BundlerPhoto::new(values)).collect()
    }

    /// The images of a point.
    fn images_of(&self, point: usize) -> &[Image] {
        &self.images[self.images_of[point]..self.images_of[point + 1]]
    }

    /// Points much nearer to a station than the others that it sees.
    ///
    /// The image of a point turns by 1 / distance when point or station move; what its station learns from it, and loses again when
    /// the point is eliminated, is the square of that.
    fn approaches(&self, stations: &Stations) -> Vec<Approach> {
        let centres: Vec<Vector3> = stations.photos.iter().map(BundlerPhoto::centre).collect();
        let share = |point: usize, image: &Image| {
            square(&difference(&stations.points[point], &centres[image.photo])).recip()
        };
        let mut shares = vec![0.0; centres.len()];
        for point in 0..self.points {
            self.images_of(point).iter().for_each(|image| shares[image.photo] += share(point, image));
        }
        let approach = |point: usize, image: &Image| {
            let own = share(point, image);
            let others =
                (shares[image.photo] - own).max(0.0) / (self.images_on[image.photo] as f64 - 1.0).max(1.0);
            let near = others > 0.0 && own > ON_ITS_WAY * others;
            near.then(|| Approach { point, photo: image.photo, share: own / others })
        };
        let of_point = |point| self.images_of(point).iter().filter_map(move |image| approach(point, image));
        (0..self.points).flat_map(of_point).collect()
    }

    /// Whether nothing but its image on that photo tells a point from the station it is near to, a step having changed nothing in that.
    fn is_same_place(&self, near: &Approach, before: &Stations, after: &Stations) -> bool {
        let is_same = |image: &Image| {
            let images = [before, after].map(|stations| {
                let places = [stations.points[near.point], stations.photos[near.photo].centre()];
                places.map(|place| stations.photos[image.photo].linearize(&place).xy)
            });
            let [.., station] = images[1];
            let is_close =
                |xy: &[f64; 2]| (0..2).all(|k| (xy[k] - station[k]).abs() < SAME_PLACE * image.sd[k]);
            images.as_flattened().iter().all(is_close)
        };
        let mut elsewhere =
            self.images_of(near.point).iter().filter(|image| image.photo != near.photo).peekable();
        self.free[near.point] && elsewhere.peek().is_some() && elsewhere.all(is_same)
    }
}

/// A point much nearer to a station than the others.
struct Approach {
    point: usize,
    photo: usize,
    /// Its share in what the station learns, in those of the others in the mean.
    share: f64,
}

impl Model for Bundle {
    type Prepared = Stations;

    fn prepare(&self, unknowns: &[f64]) -> Stations {
        let points = unknowns[..3 * self.points].as_chunks().0.to_vec();
        Stations { photos: self.photos(unknowns), points }
    }

    #[inline(always)]
    fn observe(&self, stations: &Stations, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let observed = &self.images[group];
        let image = stations.photos[observed.photo].linearize(&stations.points[local]);
        for row in 0..2 {
            rows.constant[row] = observed.xy[row] - image.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&image.point[row]);
            rows.kept[9 * row..][..9].copy_from_slice(&image.photo[row]);
        }
    }

    /// Points that have run into a station, or are on their way there: two rays that meet there ask for it.
    fn collapsed(&self, before: &[f64], after: &[f64]) -> Vec<usize> {
        let stations = self.prepare(after);
        let mut near = self.approaches(&stations);
        if !near.is_empty() {
            let stations_before = self.prepare(before);
            near.retain(|near| near.share > NEAR || self.is_same_place(near, &stations_before, &stations));
        }
        near.dedup_by_key(|near| near.point);
        near.iter().map(|near| near.point).collect()
    }

    /// Rotation and translation of the first photo, and the component of a translation that changes most when the scale does.
    fn datum(&self, unknowns: &[f64]) -> Vec<usize> {
        let photos = self.photos(unknowns);
        let with_images = || (0..photos.len()).filter(|&photo| self.images_on[photo] > 0);
        let (false, Some(first)) = (self.placed, with_images().next()) else { return vec![] };
        let centre = photos[first].centre();
        let shifts = with_images().filter(|&photo| photo != first).flat_map(|photo| {
            let shift = apply(photos[photo].rotation(), &difference(&photos[photo].centre(), &centre));
            (0..3).map(move |k| (shift[k].abs(), 9 * photo + 3 + k))
        });
        let scale = shifts.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, unknown)| unknown);
        (9 * first..9 * first + 6).chain(scale).map(|unknown| 3 * self.points + unknown).collect()
    }
}
