//! Points that a step moves out of the network or to a station.

use super::input::Image;
use super::linearization_point::{LinearizationPoint, PhotoState};
use super::model::Bundle;
use super::selection::FEW;
use crate::adjustment::median;

/// Ratio of a point's share of the station's information to the mean of the others, above which it is at the station. The point is 10,000
/// times nearer, and rounding leaves eight digits for the others.
const NEAR: f64 = 1e8;
/// Ratio above which a point is approaching the station: it is 100 times nearer than the others.
const ON_ITS_WAY: f64 = 1e4;
/// Distance of point and station in other photos, in standard deviations, below which their images are equal (before and after a step).
const SAME_PLACE: f64 = 3.0;
/// Ratio of own to median station distance above which a point may be diverging.
const FAR: f64 = 100.0;
/// Distance of its images from the images of infinity, in standard deviations, below which the point may be at infinity.
const AT_INFINITY: f64 = 1.0;
/// Minimum relative growth of its distance in a step.
const GROWS: f64 = 0.003;
/// Multiple of the distance of a point that represents infinity.
const INFINITE: f64 = 1e6;

/// A point much nearer to a station than the others.
struct NearPoint {
    point: usize,
    photo: usize,
    /// Ratio of its share of the station's information to the mean of the others.
    share: f64,
}

/// Shares of the points of a photo in the information of its station.
#[derive(Debug, Clone, Copy, Default)]
struct Shares {
    sum: f64,
    largest: f64,
}

impl Shares {
    fn add(&mut self, share: f64) {
        self.sum += share;
        self.largest = self.largest.max(share);
    }

    /// Returns the ratio of a share to the mean of the others, for `images` images; None unless it is large.
    fn ratio(&self, own: f64, images: usize) -> Option<f64> {
        let others = (self.sum - own).max(0.0) / (images as f64 - 1.0).max(1.0);
        (others > 0.0 && own > ON_ITS_WAY * others).then(|| own / others)
    }
}

impl Bundle {
    /// Returns points at a station or approaching it, to which their rays lead them.
    pub fn find_points_at_stations(&self, before: &[f64], after: &LinearizationPoint) -> Vec<usize> {
        let mut near = self.near_stations(after);
        if !near.is_empty() {
            let before = self.evaluated(before);
            near.retain(|near| near.share > NEAR || self.is_same_place(near, &before, after));
        }
        near.dedup_by_key(|near| near.point);
        near.iter().map(|near| near.point).collect()
    }

    /// Returns points much nearer to a station than its other points.
    ///
    /// The image of a point rotates by 1 / distance per displacement of point or station. Its share of the station's information, which the
    /// elimination of the point removes again, is the square of this.
    fn near_stations(&self, linearization: &LinearizationPoint) -> Vec<NearPoint> {
        let share = |point: usize, image: &Image| {
            let centre = linearization.photos[image.photo].orientation.centre();
            (linearization.points[point].position() - centre).norm_squared().recip()
        };
        let mut shares = vec![Shares::default(); linearization.photos.len()];
        for point in 0..self.points.len() {
            self.images_of(point).iter().for_each(|image| shares[image.photo].add(share(point, image)));
        }
        let has_near = |(shares, &images): (&Shares, &usize)| shares.ratio(shares.largest, images).is_some();
        if !shares.iter().zip(&self.images_on).any(has_near) {
            return vec![];
        }
        let near_station = |point: usize, image: &Image| {
            let photo = image.photo;
            let share = shares[photo].ratio(share(point, image), self.images_on[photo])?;
            Some(NearPoint { point, photo, share })
        };
        let of_point =
            |point| self.images_of(point).iter().filter_map(move |image| near_station(point, image));
        (0..self.points.len()).flat_map(of_point).collect()
    }

    /// Returns true if, before and after the step, all other images of a point agree with the image of the station.
    fn is_same_place(
        &self,
        near: &NearPoint,
        before: &LinearizationPoint,
        after: &LinearizationPoint,
    ) -> bool {
        let is_same = |image: &Image| {
            let images = [before, after].map(|linearization| {
                let station = linearization.photos[near.photo].orientation.centre();
                let PhotoState { orientation, camera } = &linearization.photos[image.photo];
                [linearization.points[near.point].position(), station]
                    .map(|place| camera.image(&orientation.pose().to_camera_frame(&place)))
            });
            let [.., station] = images[1];
            let sd = after.sd_in_camera(image);
            let is_close = |xy: &[f64; 2]| (0..2).all(|k| (xy[k] - station[k]).abs() < SAME_PLACE * sd[k]);
            images.as_flattened().iter().all(is_close)
        };
        let mut elsewhere =
            self.images_of(near.point).iter().filter(|image| image.photo != near.photo).peekable();
        let free = self.points[near.point].held() == [false; 3];
        free && elsewhere.peek().is_some() && elsewhere.all(is_same)
    }

    /// Returns free points that diverging or parallel rays move out of the network, if these are few.
    ///
    /// Steps are changes of coordinates, so that a point at infinity is only a limit: the image residuals decrease with the reciprocal
    /// distance.
    pub fn find_diverging_points(&self, before: &[f64], after: &LinearizationPoint) -> Vec<usize> {
        let squares: Vec<f64> = (0..self.locals).map(|point| self.nearest(point, after)).collect();
        let Some(middle) = median(squares.clone()) else { return vec![] };
        let is_far =
            |&point: &usize| squares[point] > FAR * FAR * middle && self.is_at_infinity(point, after);
        let mut out: Vec<usize> = (0..self.locals).filter(is_far).collect();
        if out.is_empty() {
            return out;
        }
        let before = self.evaluated(before);
        let grown = (1.0 + GROWS) * (1.0 + GROWS);
        out.retain(|&point| squares[point] > grown * self.nearest(point, &before));
        if FEW * out.len() <= self.locals { out } else { vec![] }
    }

    /// Returns the squared distance of a point from the nearest station that observes it.
    fn nearest(&self, point: usize, linearization: &LinearizationPoint) -> f64 {
        let place = linearization.points[point].position();
        let square =
            |image: &Image| (place - linearization.photos[image.photo].orientation.centre()).norm_squared();
        self.images_of(point).iter().map(square).fold(f64::INFINITY, f64::min)
    }

    /// Returns true if a free point may as well be at infinity, on the ray of its first image.
    fn is_at_infinity(&self, point: usize, linearization: &LinearizationPoint) -> bool {
        let images = self.images_of(point);
        let Some(first) = images.first().filter(|_| self.points[point].held() == [false; 3]) else {
            return false;
        };
        let place = linearization.points[point].position();
        let station = linearization.photos[first.photo].orientation.centre();
        let places = [place, station + INFINITE * (place - station)];
        images.iter().all(|image| {
            let PhotoState { orientation, camera } = &linearization.photos[image.photo];
            let [here, there] = places.map(|place| camera.image(&orientation.pose().to_camera_frame(&place)));
            let sd = linearization.sd_in_camera(image);
            (0..2).all(|k| (here[k] - there[k]).abs() < AT_INFINITY * sd[k])
        })
    }
}
