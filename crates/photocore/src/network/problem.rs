//! The least-squares problem of a network: points are local blocks of three, photos kept blocks of six and their cameras'.

use super::model::{Bundle, Station};
use super::precision::median;
use super::screening::{Dropped, Screened};
use super::{Camera, Image, Network, NetworkError, Options, Photo, Point, Start};
use crate::adjustment::{Method, Problem};
use crate::geometry::{ObjectSpace, Orientation, PoseNumbers, Refraction, Vector3, nearest_turns};
use crate::normals::{Layout, System};

/// A problem, and what its parts are in the network.
pub(super) struct Assembled {
    pub problem: Problem<Bundle>,
    /// The points that take part.
    pub points: Vec<usize>,
    /// Those that do not.
    pub dropped: Vec<Dropped>,
    /// What coordinates are counted from.
    pub origin: [f64; 3],
}

/// Values from which an adjustment goes on: of all points, and of the kept unknowns.
pub(super) struct Reached {
    points: Vec<[f64; 3]>,
    kept: Vec<f64>,
}

impl Assembled {
    /// Takes over adjusted unknowns; `count` is the number of all points.
    pub fn reached(&self, unknowns: &[f64], count: usize) -> Reached {
        let (points, kept) = unknowns.split_at(3 * self.points.len());
        let mut all = vec![[f64::NAN; 3]; count];
        self.points.iter().zip(points.as_chunks().0).for_each(|(&point, &at)| all[point] = at);
        Reached { points: all, kept: kept.to_vec() }
    }
}

impl Network {
    /// The projection centre of given six unknowns.
    pub(super) fn centre(&self, pose: &[f64; 6]) -> Vector3 {
        match self.poses {
            PoseNumbers::Angles(_) => self.space.cartesian([pose[0], pose[1], pose[2]]),
            PoseNumbers::Vectors => Orientation::new(self.poses, self.space, pose).centre(),
        }
    }

    /// A point near the photos: coordinates are counted from it while the network is adjusted, so that no digits are lost in
    /// large ones. Medians, so that a single photo with a wrong position does not move it. Geographic coordinates stay as they
    /// are, differences being formed in geocentric space; so do poses in vectors, whose translations turn with the rotation.
    fn origin(&self) -> [f64; 3] {
        let middle = |k: usize| {
            let values = self.photos.iter().map(|photo| photo.pose[k]).collect();
            median(values).map_or(0.0, f64::round)
        };
        match (self.space, self.poses) {
            (ObjectSpace::Rectangular, PoseNumbers::Angles(_)) => std::array::from_fn(middle),
            _ => [0.0; 3],
        }
    }

    fn camera(&self, photo: &Photo) -> &Camera {
        &self.cameras[photo.camera]
    }

    /// Standard deviations of the unknowns of a photo.
    fn photo_sd<'a>(&'a self, photo: &'a Photo, held: bool) -> impl Iterator<Item = f64> + 'a {
        let camera = self.camera(photo);
        let own = if camera.is_held() { &[][..] } else { &camera.sd[..] };
        photo.sd.iter().chain(own).map(move |&sd| if held { 0.0 } else { sd })
    }

    /// The values of the unknowns of a photo, its pose given.
    fn photo_values(&self, photo: &Photo, pose: [f64; 6]) -> impl Iterator<Item = f64> + use<> {
        let camera = self.camera(photo);
        let own = if camera.is_held() { vec![] } else { camera.camera.parameters() };
        pose.into_iter().chain(own)
    }

    /// The observed pose of a photo, as near to the initial one as whole turns bring it.
    fn observed_pose(&self, photo: &Photo) -> [f64; 6] {
        let near = nearest_turns(photo.observed, photo.pose);
        let turning = |k: usize| match self.poses {
            PoseNumbers::Angles(_) => k >= 3 || k == 0 && self.space != ObjectSpace::Rectangular,
            PoseNumbers::Vectors => false,
        };
        std::array::from_fn(|k| if turning(k) { near[k] } else { photo.observed[k] })
    }

    /// Whether a photo's attitude may step by a rotation vector: its angles are all free. Those that are weighted stay unknowns
    /// themselves, so that their weights stand in the diagonal and keep them regular; a fixed one keeps its bits.
    fn turns(&self, photo: usize) -> bool {
        let free = self.photos[photo].sd[3..].iter().all(|sd| sd.is_infinite());
        free && matches!(self.poses, PoseNumbers::Angles(_))
    }

    /// The problem of the points that take part, from the initial values on or from those reached.
    ///
    /// # Errors
    /// Values that double precision holds too coarsely, points that have no start, more than can be numbered.
    pub(super) fn assemble(
        &self,
        options: &Options,
        screened: Screened,
        reached: Option<&Reached>,
    ) -> Result<Assembled, NetworkError> {
        let mut images_on = vec![0; self.photos.len()];
        screened.images.order.iter().for_each(|&image| images_on[self.images[image].photo] += 1);
        let unused = |photo: usize| options.hold_unused && images_on[photo] == 0;
        if reached.is_none() {
            self.check_rounding(&screened, |photo| !unused(photo))?;
        }
        let origin = self.origin();
        let mut model = self.bundle(&screened, images_on.clone(), origin);
        // The programs of their time stepped in angles.
        if !matches!(options.adjustment.method, Method::Full(_)) {
            model.turning = (0..self.photos.len()).map(|i| self.turns(i) && !unused(i)).collect();
        }
        let local = |pose: [f64; 6]| match self.poses {
            PoseNumbers::Angles(_) => {
                std::array::from_fn(|k| if k < 3 { pose[k] - origin[k] } else { pose[k] })
            }
            PoseNumbers::Vectors => pose,
        };
        let of_photos = |pose: &dyn Fn(&Photo) -> [f64; 6]| -> Vec<f64> {
            self.photos.iter().flat_map(|photo| self.photo_values(photo, local(pose(photo)))).collect()
        };
        let kept = reached.map_or_else(|| of_photos(&|photo| photo.pose), |reached| reached.kept.clone());
        let stations = model.photos(&kept);
        let start = match reached {
            Some(reached) => screened.points.iter().map(|&point| reached.points[point]).collect(),
            None => self.start(options.start, &screened, &model, &stations)?,
        };
        let own: Vec<[f64; 3]> = model.points.iter().map(|point| point.coordinates).collect();
        let prior = of_photos(&|photo| self.observed_pose(photo));
        let photo_sd = self.photos.iter().enumerate().flat_map(|(i, photo)| self.photo_sd(photo, unused(i)));
        let sd = model.points.iter().flat_map(|point| point.sd).chain(photo_sd).collect();
        let widths: Vec<usize> = model.first.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let photo_of = model.images.iter().map(|image| image.photo as u32).collect();
        let places = stations.iter().map(|station| station.orientation.centre().into()).collect();
        let layout = Layout::new(2, 3, &widths, model.start.clone(), photo_of)?.with_places(places)?;
        let problem = Problem {
            observation_sd: model.images.iter().flat_map(|image| image.sd).collect(),
            system: System::new(layout, options.ordering),
            initial: [start.into_flattened(), kept].concat(),
            prior: [own.into_flattened(), prior].concat(),
            sd,
            model,
        };
        Ok(Assembled { problem, points: screened.points, dropped: screened.dropped, origin })
    }

    fn bundle(&self, screened: &Screened, images_on: Vec<usize>, origin: [f64; 3]) -> Bundle {
        let local_point = |&point: &usize| {
            let Point { coordinates, sd } = self.points[point];
            Point { coordinates: std::array::from_fn(|k| coordinates[k] - origin[k]), sd }
        };
        let mut first = vec![0];
        for photo in &self.photos {
            let camera = self.camera(photo);
            let own = if camera.is_held() { 0 } else { camera.sd.len() };
            first.push(first[first.len() - 1] + 6 + own);
        }
        // Angles alone leave position and scale open.
        let positions = if let PoseNumbers::Angles(_) = self.poses { 3 } else { 6 };
        let placed = screened.points.iter().any(|&point| self.points[point].held() != [false; 3])
            || self.photos.iter().any(|photo| photo.sd[..positions].iter().any(|sd| sd.is_finite()));
        let images: Vec<Image> = screened.images.order.iter().map(|&image| self.images[image]).collect();
        Bundle {
            space: self.space,
            poses: self.poses,
            // Coordinates are counted from the origin; heights are not.
            refraction: self
                .refraction
                .map(|refraction| Refraction { datum: refraction.datum + origin[2], ..refraction }),
            cameras: self.photos.iter().map(|photo| self.camera(photo).camera).collect(),
            first,
            points: screened.points.iter().map(local_point).collect(),
            images,
            start: screened.images.start.clone(),
            order: screened.images.order.clone(),
            turning: vec![false; self.photos.len()],
            images_on,
            placed,
        }
    }

    /// Where points start from.
    fn start(
        &self,
        start: Start,
        screened: &Screened,
        model: &Bundle,
        stations: &[Station],
    ) -> Result<Vec<[f64; 3]>, NetworkError> {
        let given = || model.points.iter().map(|point| point.coordinates);
        if start == Start::Given && given().flatten().all(|value| !value.is_nan()) {
            let given: Vec<[f64; 3]> = given().collect();
            self.check_resolution(screened, model.middle_distance(stations, Some(&given)), start)?;
            return Ok(given);
        }
        let met = model.intersect(stations);
        let distance = model.middle_distance(stations, met.as_deref().ok());
        self.check_resolution(screened, distance, start)?;
        let mut met = met.map_err(|point| NetworkError::NoIntersection(screened.points[point]))?;
        if start == Start::Given {
            let known = met.iter_mut().zip(given()).filter(|(_, given)| given.iter().all(|x| !x.is_nan()));
            known.for_each(|(met, given)| *met = given);
        }
        Ok(met)
    }
}
