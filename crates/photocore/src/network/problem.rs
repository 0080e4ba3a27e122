//! The least-squares problem of a network: points are local blocks of three, photos kept blocks of six and their own cameras', cameras
//! that several photos share and common unknowns blocks of their own; points that observations touch are kept blocks of three.

use std::collections::HashMap;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::camera_priors::CameraPrior;
use super::commons::PlacedCommon;
use super::model::Bundle;
use super::observations::{Fault, Observation, TiedObservation, Touches};
use super::precision::median;
use super::screening::{Dropped, Reason, Screened, TOGETHER};
use super::stations::Station;
use super::surroundings::Surroundings;
use super::{Camera, Image, Mount, Network, NetworkError, Options, Photo, Point, Start, State};
use crate::adjustment::{self, AdjustError, Adjustment, Method, Model, Problem, Status};
use crate::geometry::{
    Matrix3, ObjectSpace, Orientation, PoseNumbers, Refraction, Vector3, local_vertical, nearest_turns,
};
use crate::normals::{Layout, System, TieRows};

/// A problem, and what its parts are in the network.
#[derive(Debug)]
pub(super) struct Assembled {
    pub problem: Problem<Bundle>,
    /// The points that take part, in the order of the model.
    pub points: Vec<usize>,
    /// Those that do not.
    pub dropped: Vec<Dropped>,
    /// The photos that stay where they are because their images do not determine them.
    pub loose: Vec<usize>,
}

/// Values from which an adjustment goes on: of all points, and of the unknowns of photos and shared cameras.
pub(super) struct Reached {
    points: Vec<[f64; 3]>,
    stations: Vec<f64>,
}

/// Points that are not determined are few where there are so many times as many.
pub(super) const FEW: usize = 10;
/// Photos that are not determined, each by itself, are few where there are so many times as many: a network of some photos has few.
const HALF: usize = 2;
/// A point so many times as far from the nearest station as others, or as near, has left the network.
const ASTRAY: f64 = 1e3;

impl Assembled {
    /// Refuses what takes more memory than it may.
    pub fn check_memory(&self, options: &Options) -> Result<(), NetworkError> {
        let needed = self.problem.system.memory();
        match options.memory {
            Some(available) if needed > available => Err(NetworkError::Memory { needed, available }),
            _ => Ok(()),
        }
    }

    /// Whether there is room for what tests of groups need besides.
    pub fn may_keep(&self, options: &Options) -> bool {
        let system = &self.problem.system;
        options.memory.is_none_or(|available| system.memory() + system.memory_of_groups() <= available)
    }

    /// The points that an adjustment has ended with because their rays do not determine them, where they are so few that the others make
    /// up a network without them: indices into it. None where observations beside images touch them.
    pub fn few_points(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::UndeterminedLocals(locals) = error else { return vec![] };
        let free = |&local: &usize| self.problem.model.points[local].held() == [false; 3];
        let few = FEW * locals.len() <= self.problem.model.locals && locals.iter().all(free);
        if few { locals.iter().map(|&local| self.points[local]).collect() } else { vec![] }
    }

    /// The photos that an adjustment has ended with because their images do not determine them, each by itself, where they are few.
    pub fn few_photos(&self, error: &AdjustError) -> Vec<usize> {
        let AdjustError::Undetermined(combinations) = error else { return vec![] };
        let model = &self.problem.model;
        let alone = |blocks: &Vec<usize>| match blocks[..] {
            [block] => (block < model.cameras.len() && model.images_on[block] > 0).then_some(block),
            _ => None,
        };
        let Some(mut photos) = combinations.iter().map(alone).collect::<Option<Vec<usize>>>() else {
            return vec![];
        };
        photos.sort_unstable();
        photos.dedup();
        let is_frame = |photo: usize| model.mounts.iter().flatten().any(|mount| mount.frame == photo);
        let few = HALF * photos.len() <= model.cameras.len() && !photos.iter().any(|&photo| is_frame(photo));
        if few { photos } else { vec![] }
    }

    /// Free points that iterations which have not converged have led out of the network, or to a station, where they are few.
    ///
    /// Rays that part before the cameras fit best at infinity, where least squares creeps to, and photos are turned until they do.
    pub fn run_off(&self, ended: &Adjustment, options: &adjustment::Options) -> Vec<Dropped> {
        if ended.status != Status::NotConverged || !matches!(options.method, Method::Damped(_)) {
            return vec![];
        }
        let squares = self.nearest_stations(&ended.unknowns);
        let Some(middle) = median(squares.clone()) else { return vec![] };
        let model = &self.problem.model;
        let is_out = |&local: &usize| {
            let apart = (squares[local] / middle).sqrt();
            model.points[local].held() == [false; 3] && !(ASTRAY.recip()..=ASTRAY).contains(&apart)
        };
        let out: Vec<usize> = (0..model.locals).filter(is_out).collect();
        let few = FEW * out.len() <= model.locals;
        let reason = Reason::RanOff;
        if few { out.iter().map(|&i| Dropped { point: self.points[i], reason }).collect() } else { vec![] }
    }

    /// Points that an adjustment has ended for, so that it can go on without them: they have run into a station, or out of the network.
    pub fn collapsed(&self, ended: &Adjustment) -> Vec<Dropped> {
        if ended.collapsed.is_empty() {
            return vec![];
        }
        let squares = self.nearest_stations(&ended.unknowns);
        let middle = median(squares.clone()).unwrap_or(f64::INFINITY);
        let dropped = |&local: &usize| Dropped {
            point: self.points[local],
            reason: if squares[local] > middle { Reason::RanOff } else { Reason::RanIntoStation },
        };
        ended.collapsed.iter().map(dropped).collect()
    }

    /// Points whose first values are those of a station that sees them, so that no image can be computed.
    pub fn at_stations(&self) -> Vec<Dropped> {
        let squares = self.nearest_stations(&self.problem.initial);
        let reason = Reason::AtStation;
        let at_station = self.points.iter().zip(&squares).filter(|(_, square)| **square == 0.0);
        at_station.map(|(&point, _)| Dropped { point, reason }).collect()
    }

    /// The same at the first values, and their median.
    pub fn first_distances(&self) -> Option<(Vec<f64>, f64)> {
        let squares = self.nearest_stations(&self.problem.initial);
        median(squares.clone()).map(|middle| (squares, middle))
    }

    /// Squares of the distances of all points from the nearest station that sees them.
    fn nearest_stations(&self, unknowns: &[f64]) -> Vec<f64> {
        let model = &self.problem.model;
        let photos = model.photos(&unknowns[model.of_stations()]);
        let of_point = |(at, images): (&[f64; 3], &[usize])| {
            let position = model.space.cartesian(*at);
            let square =
                |image: &Image| photos[image.photo].orientation.pose().sight(&position).norm_squared();
            model.images[images[0]..images[1]].iter().map(square).fold(f64::INFINITY, f64::min)
        };
        model.coordinates(unknowns).zip(model.start.windows(2)).map(of_point).collect()
    }

    /// Begins where an adjustment has ended.
    pub fn go_on_from(&mut self, state: &State) -> Result<(), NetworkError> {
        if state.unknowns.len() != self.problem.initial.len() {
            return Err(NetworkError::State);
        }
        self.problem.initial.clone_from(&state.unknowns);
        Ok(())
    }

    /// Takes over adjusted unknowns; `count` is the number of all points.
    pub fn reached(&self, unknowns: &[f64], count: usize) -> Reached {
        let model = &self.problem.model;
        let mut all = vec![[f64::NAN; 3]; count];
        self.points.iter().zip(model.coordinates(unknowns)).for_each(|(&point, &at)| all[point] = at);
        Reached { points: all, stations: unknowns[model.of_stations()].to_vec() }
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
    fn origin(&self, middle: [f64; 3]) -> [f64; 3] {
        match (self.space, self.poses) {
            (ObjectSpace::Rectangular, PoseNumbers::Angles(_)) => middle.map(f64::round),
            _ => [0.0; 3],
        }
    }

    /// The medians of the coordinates of the photos.
    fn middle(&self) -> [f64; 3] {
        let middle = |k: usize| median(self.photos.iter().map(|photo| photo.pose[k]).collect());
        std::array::from_fn(|k| middle(k).unwrap_or_default())
    }

    fn camera(&self, photo: &Photo) -> &Camera {
        &self.cameras[photo.camera]
    }

    /// Standard deviations of the unknowns of photos, shared cameras and common unknowns; those of `unused` and of mounted photos, of
    /// cameras that have no others, and of common unknowns that nothing which takes part is of, are held.
    fn station_sd(
        &self,
        model: &Bundle,
        surroundings: &Surroundings,
        unused: impl Fn(usize) -> bool,
    ) -> Vec<f64> {
        let mut all = Vec::new();
        let mut used = vec![false; self.cameras.len()];
        surroundings.cameras().into_iter().for_each(|camera| used[camera] = true);
        let elsewhere = surroundings.commons();
        for (index, photo) in self.photos.iter().enumerate() {
            let own = if model.has_own_camera(index) { &self.camera(photo).sd[..] } else { &[] };
            used[photo.camera] |= !unused(index);
            let held = unused(index) || model.mount(index).is_some();
            all.extend(photo.sd.iter().chain(own).map(|&sd| if held { 0.0 } else { sd }));
        }
        for &camera in &model.shared {
            all.extend(self.cameras[camera].sd.iter().map(|&sd| if used[camera] { sd } else { 0.0 }));
        }
        for (common, own) in self.commons.iter().enumerate().filter(|&(i, _)| model.common_block[i].is_some())
        {
            let is_used = model.uses_of_commons[common] > 0 || elsewhere.contains(&common);
            all.extend(own.sd.iter().map(|&sd| if is_used { sd } else { 0.0 }));
        }
        all
    }

    /// The values of the unknowns of photos, with the given poses, of shared cameras and common unknowns.
    fn station_values(&self, model: &Bundle, pose: impl Fn(&Photo) -> [f64; 6]) -> Vec<f64> {
        let mut all = Vec::new();
        for (index, photo) in self.photos.iter().enumerate() {
            all.extend(pose(photo));
            if model.has_own_camera(index) {
                all.extend(self.camera(photo).camera.parameters());
            }
        }
        all.extend(model.shared.iter().flat_map(|&camera| self.cameras[camera].camera.parameters()));
        // They count from what is given.
        all.resize(model.of_stations().len(), 0.0);
        all
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

    /// Whether a photo's attitude steps by a rotation vector: a fixed angle keeps its bits.
    fn turns(&self, photo: usize) -> bool {
        let fixed = self.photos[photo].sd[3..].contains(&0.0);
        !fixed && matches!(self.poses, PoseNumbers::Angles(_))
    }

    /// The problem of the points that take part, from the initial values on or from those reached.
    ///
    /// # Errors
    /// Values that double precision holds too coarsely, points that have no start, more than can be numbered.
    pub(super) fn assemble(
        &self,
        options: &Options,
        mut screened: Screened,
        reached: Option<&Reached>,
    ) -> Result<Assembled, NetworkError> {
        let order = screened.images.order.par_iter().with_min_len(TOGETHER);
        let images: Vec<Image> = order.map(|&image| self.images[image]).collect();
        let mut images_on = vec![0; self.photos.len()];
        images.iter().for_each(|image| images_on[image.photo] += 1);
        // A frame is used when a photo on it is.
        let mut used: Vec<bool> = images_on.iter().map(|&images| images > 0).collect();
        self.mounts.iter().for_each(|mount| used[mount.frame] |= images_on[mount.photo] > 0);
        let loose = screened.loose.clone();
        let unused =
            |photo: usize| !used[photo] && (options.hold_unused || loose.binary_search(&photo).is_ok());
        if reached.is_none() {
            self.check_rounding(&screened, |photo| !unused(photo))?;
        }
        let middle = screened.surroundings.middle.unwrap_or_else(|| self.middle());
        let origin = self.origin(middle);
        let mut model = self.bundle(&mut screened, images, images_on.clone(), middle)?;
        model.minimum = options.minimum;
        // The programs of their time stepped in angles.
        if !matches!(options.adjustment.method, Method::Full(_)) {
            let turns = |photo: usize| self.turns(photo) && !unused(photo) && model.mount(photo).is_none();
            model.turning = (0..self.photos.len()).map(turns).collect();
        }
        let local = |pose: [f64; 6]| match self.poses {
            PoseNumbers::Angles(_) => {
                std::array::from_fn(|k| if k < 3 { pose[k] - origin[k] } else { pose[k] })
            }
            PoseNumbers::Vectors => pose,
        };
        let values = reached.map_or_else(
            || self.station_values(&model, |photo| local(photo.pose)),
            |reached| reached.stations.clone(),
        );
        let placed = model.placed(&values);
        let stations = placed.photos;
        let start = match reached {
            Some(reached) => screened.points.iter().map(|&point| reached.points[point]).collect(),
            None => self.start(options.start, &screened, &model, &stations)?,
        };
        let of_points =
            |each: fn(&Point) -> [f64; 3]| -> Vec<[f64; 3]> { model.points.iter().map(each).collect() };
        let observed = self.station_values(&model, |photo| local(self.observed_pose(photo)));
        let station_sd = self.station_sd(&model, &screened.surroundings, unused);
        // Local points, photos and shared cameras, points that observations touch.
        let unknowns = |points: &[[f64; 3]], stations: &[f64]| {
            let (local, tied) = points.split_at(model.locals);
            [local.as_flattened(), stations, tied.as_flattened()].concat()
        };
        let (initial, (prior, sd)) = rayon::join(
            || unknowns(&start, &values),
            || {
                rayon::join(
                    || unknowns(&of_points(|point| point.coordinates), &observed),
                    || unknowns(&of_points(|point| point.sd), &station_sd),
                )
            },
        );
        let tied = start[model.locals..].iter().map(|&at| self.space.cartesian(at));
        let centres: Vec<[f64; 3]> =
            stations.iter().map(|station| station.orientation.centre().into()).collect();
        let cameras = model.places_of_cameras(&centres);
        let tied: Vec<[f64; 3]> = tied.map(Into::into).collect();
        let commons = model.places_of_commons(&centres, &tied);
        let places = [centres, cameras, commons, tied].concat();
        let of_images = model.images.par_iter().with_min_len(TOGETHER).map(|image| image.sd);
        let mut observation_sd = of_images.collect::<Vec<[f64; 2]>>().into_flattened();
        model.observations.iter().for_each(|tied| observation_sd.extend(vec![1.0; tied.root.nrows()]));
        let held: Vec<bool> = sd.iter().map(|&sd| sd == 0.0).collect();
        let (outer, below) = screened.surroundings.blocks(&model, &screened.points)?;
        let layout = layout(&model, places)?.with_held(&held).as_part(outer, below)?;
        let problem = Problem {
            observation_sd,
            system: System::new(layout, options.ordering),
            initial,
            prior,
            sd,
            model,
        };
        self.check_observations(&problem)?;
        Ok(Assembled { problem, points: screened.points, dropped: screened.dropped, loose: screened.loose })
    }

    /// Refuses observations that cannot be computed from the initial values.
    fn check_observations(&self, problem: &Problem<Bundle>) -> Result<(), NetworkError> {
        let model = &problem.model;
        if model.observations.is_empty() {
            return Ok(());
        }
        let (stations, layout) = (model.prepare(&problem.initial), problem.layout());
        for (i, TiedObservation { index, observation, root, .. }) in model.observations.iter().enumerate() {
            let tie = model.tied_images() + i;
            let mut constant = vec![0.0; root.nrows()];
            let mut coefficients = vec![0.0; root.nrows() * layout.tie_columns(tie).count()];
            let mut rows = TieRows { constant: &mut constant, coefficients: &mut coefficients };
            model.observe_tie(&stations, tie, &mut rows);
            if !constant.iter().chain(&coefficients).all(|value| value.is_finite()) {
                let (index, kind, fault) = (*index, observation.kind(), Fault::NotFinite);
                return Err(NetworkError::Observation { index, kind, fault });
            }
        }
        Ok(())
    }

    fn bundle(
        &self,
        screened: &mut Screened,
        images: Vec<Image>,
        images_on: Vec<usize>,
        middle: [f64; 3],
    ) -> Result<Bundle, NetworkError> {
        let origin = self.origin(middle);
        let local_point = |&point: &usize| {
            let Point { coordinates, sd } = self.points[point];
            Point { coordinates: std::array::from_fn(|k| coordinates[k] - origin[k]), sd }
        };
        let (shared, mut first) = (self.shared_cameras(&screened.surroundings), vec![0]);
        for photo in &self.photos {
            let camera = self.camera(photo);
            let own = if camera.is_held() || shared.binary_search(&photo.camera).is_ok() {
                0
            } else {
                camera.sd.len()
            };
            first.push(first[first.len() - 1] + 6 + own);
        }
        for &camera in &shared {
            first.push(first[first.len() - 1] + self.cameras[camera].sd.len());
        }
        let mut common_block = vec![None; self.commons.len()];
        for (index, common) in self.commons.iter().enumerate().filter(|(_, common)| !common.is_held()) {
            common_block[index] = Some(first.len() - 1);
            first.push(first[first.len() - 1] + common.sd.len());
        }
        let mut squares = vec![0];
        first
            .windows(2)
            .for_each(|ends| squares.push(squares[squares.len() - 1] + (ends[1] - ends[0]).pow(2)));
        let vertical = self.vertical(middle);
        let place = |common| PlacedCommon::new(common, self.space, origin, &vertical);
        let block = |photo: &Photo| Some(self.photos.len() + shared.binary_search(&photo.camera).ok()?);
        let mounts = self.mounts_by_photo();
        let mut uses_of_commons = vec![0; self.commons.len()];
        for mount in images.iter().filter_map(|image| mounts.get(image.photo)?.as_ref()) {
            uses_of_commons[mount.sensor] += 1;
        }
        let commons_of = |&observation: &usize| self.observations[observation].touches().commons;
        let touched = screened.observations.iter().flat_map(commons_of);
        touched.for_each(|(common, _)| uses_of_commons[common] += 1);
        let (placed, anchor) = self.placed(screened, &mounts);
        let mut bundle = Bundle {
            space: self.space,
            poses: self.poses,
            // Coordinates are counted from the origin; heights are not.
            refraction: self
                .refraction
                .map(|refraction| Refraction { datum: refraction.datum + origin[2], ..refraction }),
            cameras: self.photos.iter().map(|photo| self.camera(photo).camera).collect(),
            first,
            camera_block: self.photos.iter().map(block).collect(),
            shared,
            squares,
            camera_priors: vec![],
            commons: self.commons.iter().map(place).collect(),
            common_block,
            uses_of_commons,
            mounts,
            origin,
            locals: screened.locals,
            points: screened.points.par_iter().with_min_len(TOGETHER).map(local_point).collect(),
            images,
            start: std::mem::take(&mut screened.images.start),
            order: std::mem::take(&mut screened.images.order),
            turning: vec![false; self.photos.len()],
            images_on,
            observations: vec![],
            placed,
            anchor,
            minimum: None,
            parts: OnceLock::new(),
        };
        let prior = |(index, camera): (usize, &Camera)| {
            camera.covariance.as_ref()?;
            CameraPrior::of(camera, self.first_parameter(&bundle, index)?)
        };
        bundle.camera_priors = self.cameras.iter().enumerate().filter_map(prior).collect();
        bundle.observations = self.tied_observations(screened, &bundle)?;
        Ok(bundle)
    }

    /// The axes amid the photos, as rows, that shifts and drifts are told in: X, Y, Z or, in geographic space, east, north and up.
    fn vertical(&self, middle: [f64; 3]) -> Matrix3 {
        match self.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(_) => local_vertical(middle[0], middle[1]),
        }
    }

    /// Whether the datum is the user's; and the photo to hold where it is not, but the position of a single one is fixed.
    fn placed(&self, screened: &Screened, mounts: &[Option<Mount>]) -> (bool, Option<usize>) {
        // Angles alone leave position and scale open.
        let positions = if let PoseNumbers::Angles(_) = self.poses { 3 } else { 6 };
        let own = |photo: &Photo| photo.sd[..positions].iter().any(|sd| sd.is_finite());
        let mounted = |index: usize| mounts.get(index).is_some_and(Option::is_some);
        let mut photos = (0..self.photos.len()).filter(|&index| !mounted(index) && own(&self.photos[index]));
        let fixed = |index: usize| self.photos[index].sd[..positions].iter().all(|&sd| sd == 0.0);
        match (photos.next(), photos.next()) {
            _ if screened.points.iter().any(|&point| self.points[point].held() != [false; 3]) => (true, None),
            (None, _) => (false, None),
            (first, None) if first.is_some_and(fixed) => (false, first),
            _ => (true, None),
        }
    }

    /// The unknown that the first parameter of a camera is; None where no photo has it.
    fn first_parameter(&self, model: &Bundle, camera: usize) -> Option<usize> {
        Some(match model.shared.binary_search(&camera) {
            Ok(shared) => model.of_block(model.cameras.len() + shared).start,
            Err(_) => model.of_block(self.photos.iter().position(|photo| photo.camera == camera)?).start + 6,
        })
    }

    /// The observations that take part.
    fn tied_observations(
        &self,
        screened: &Screened,
        model: &Bundle,
    ) -> Result<Vec<TiedObservation>, NetworkError> {
        let Screened { points, locals, observations, .. } = screened;
        let place: HashMap<usize, usize> =
            points[*locals..].iter().enumerate().map(|(i, &point)| (point, locals + i)).collect();
        let tied = |&index: &usize| {
            let observation: &Observation = &self.observations[index];
            let touches = observation.touches();
            let points = touches.points.iter().map(|point| place[point]).collect();
            let touches = Touches { points, ..touches };
            let blocks = model.blocks_of(&touches);
            let root = match blocks.len() {
                0 => Err(Fault::NothingUnknown),
                _ => observation.precision().root(observation.rows()),
            };
            let kind = observation.kind();
            Ok(TiedObservation {
                index,
                touches,
                blocks,
                root: root.map_err(|fault| NetworkError::Observation { index, kind, fault })?,
                observation: observation.clone(),
            })
        };
        observations.iter().map(tied).collect()
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
            let distance = model.middle_distance(stations, Some(&given));
            self.check_resolution(screened, model, distance, start)?;
            return Ok(given);
        }
        let met = model.intersect(stations);
        let distance = model.middle_distance(stations, met.as_deref().ok());
        self.check_resolution(screened, model, distance, start)?;
        let mut met = met.map_err(|point| NetworkError::NoIntersection(screened.points[point]))?;
        if start == Start::Given {
            let known = met.iter_mut().zip(given()).filter(|(_, given)| given.iter().all(|x| !x.is_nan()));
            known.for_each(|(met, given)| *met = given);
        }
        Ok(met)
    }
}

/// The blocks of a model, at the given places, and what ties them.
fn layout(model: &Bundle, places: Vec<[f64; 3]>) -> Result<Layout, NetworkError> {
    let (groups, tied) = (model.start[model.locals], model.points.len() - model.locals);
    let widths = model.first.windows(2).map(|pair| pair[1] - pair[0]);
    let widths: Vec<usize> = widths.chain(vec![3; tied]).collect();
    let images = &model.images[..groups];
    let photo_of = images.iter().map(|image| model.carrier(image.photo) as u32).collect();
    let mut layout = Layout::new(2, 3, &widths, model.start[..=model.locals].to_vec(), photo_of)?;
    if !(model.shared.is_empty() && model.mounts.is_empty()) {
        let (mut further_ptr, mut further) = (Vec::with_capacity(groups + 1), Vec::with_capacity(groups));
        further_ptr.push(0);
        for image in images {
            further.extend(model.further(image).map(|block| block as u32));
            further_ptr.push(further.len());
        }
        layout = layout.with_further(further_ptr, further)?;
    }
    Ok(layout.with_places(places)?.with_ties(model.ties())?.with_pairs(model.pairs())?)
}
