//! Points that leave for infinity while a network is adjusted.

use super::leaving::{Ended, FEW, Leaves};
use crate::adjustment::{Method, Status};
use crate::network::Image;
use crate::network::median::median;
use crate::network::model::Bundle;
use crate::network::selection::{Dropped, Reason};
use crate::network::stations::{Station, Stations};

/// A point so many times as far from the nearest station as others is on its way out of the network,
const FAR: f64 = 100.0;
/// when no photo tells its place from infinity: its images there are closer than a standard deviation,
const AT_INFINITY: f64 = 1.0;
/// and the distance still grows, by more than this part of it in a step.
const GROWS: f64 = 0.003;
/// Times the distance of a point that stand for infinity.
const INFINITE: f64 = 1e6;
/// A point so many times as far from the nearest station as others, or as near, has left the network.
const ASTRAY: f64 = 1e3;

/// Free points that iterations which have not converged have led out of the network, or to a station, where they are few.
///
/// Rays that part before the cameras fit best at infinity, where least squares creeps to, and photos are turned until they do.
pub(super) fn look(ended: &Ended<'_>) -> Leaves {
    let Ok(adjusted) = ended.adjusted else { return Leaves::default() };
    let damped = matches!(ended.options.adjustment.method, Method::Damped(_));
    if adjusted.status != Status::NotConverged || !damped {
        return Leaves::default();
    }
    let squares = ended.assembled.nearest_stations(&adjusted.unknowns);
    let Some(middle) = median(squares.clone()) else { return Leaves::default() };
    let model = &ended.assembled.problem.model;
    let is_out = |&local: &usize| {
        let apart = (squares[local] / middle).sqrt();
        model.points[local].held() == [false; 3] && !(ASTRAY.recip()..=ASTRAY).contains(&apart)
    };
    let mut out: Vec<usize> = (0..model.locals).filter(is_out).collect();
    if FEW * out.len() > model.locals {
        out.clear();
    }
    let dropped = |i: usize| Dropped { point: ended.assembled.points[i], reason: Reason::RanOff };
    Leaves { points: out.into_iter().map(dropped).collect(), photos: vec![] }
}

impl Bundle {
    /// Free points that rays which part, or are parallel, lead out of the network, where they are few.
    ///
    /// Steps are taken in coordinates, and a place at infinity is a limit that they creep to: what images lose on the way goes with the
    /// reciprocal of the distance.
    pub fn lead_nowhere(&self, before: &[f64], after: &Stations) -> Vec<usize> {
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

    /// The square of the distance of a point from the nearest station that sees it.
    fn nearest(&self, point: usize, stations: &Stations) -> f64 {
        let place = stations.points[point].position();
        let square =
            |image: &Image| (place - stations.photos[image.photo].orientation.centre()).norm_squared();
        self.images_of(point).iter().map(square).fold(f64::INFINITY, f64::min)
    }

    /// Whether a free point could as well be at infinity, on the ray on which its first image has it.
    fn is_at_infinity(&self, point: usize, stations: &Stations) -> bool {
        let images = self.images_of(point);
        let Some(first) = images.first().filter(|_| self.points[point].held() == [false; 3]) else {
            return false;
        };
        let place = stations.points[point].position();
        let station = stations.photos[first.photo].orientation.centre();
        let places = [place, station + INFINITE * (place - station)];
        images.iter().all(|image| {
            let Station { orientation, camera } = &stations.photos[image.photo];
            let [here, there] = places.map(|place| camera.image(&orientation.pose().sight(&place)));
            let sd = stations.sd_in_camera(image);
            (0..2).all(|k| (here[k] - there[k]).abs() < AT_INFINITY * sd[k])
        })
    }
}
