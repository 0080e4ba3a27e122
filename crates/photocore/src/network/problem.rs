//! Least-squares problem of a network. Points are local blocks of three. Retained blocks are photos with their own cameras, shared cameras,
//! shared parameters, and points that observations connect with other objects.

use super::error::NetworkError;
use super::input::{Image, Network, Options, Point, Start, State};
use super::interface::Interface;
use super::layout::layout;
use super::linearization_point::{LinearizationPoint, PhotoState};
use super::model::{Bundle, Owner};
use super::neighbourhood::TOGETHER;
use super::observations::{Fault, Linear};
use super::selection::{Dropped, LeftOut, Selected};
use crate::adjustment::{AnyProblem, Method, Problem, median};
use crate::geometry::{ObjectSpace, POSE, PoseNumbers};
use crate::normals::{Layout, RowBuffer, System};
use crate::{Threads, parallel};

/// A problem, and the indices of its parts in the network.
#[derive(Debug)]
#[doc(hidden)]
pub struct Assembled {
    pub(super) problem: Problem<Bundle>,
    /// Active points, in the order of the model.
    pub points: Vec<usize>,
    /// Excluded points and photos, with reasons.
    pub dropped: Vec<Dropped>,
    /// Photos that are fixed because their images do not determine them.
    pub(super) undetermined_photos: Vec<usize>,
}

/// Adjusted values of all points and retained blocks, to continue an adjustment.
#[doc(hidden)]
pub struct Reached {
    points: Vec<[f64; 3]>,
    parameters: Vec<f64>,
}

impl Assembled {
    /// Returns the least-squares problem.
    pub fn problem(&self) -> &AnyProblem<'_> {
        self.problem.any()
    }

    /// Returns the number of active images.
    pub fn images(&self) -> usize {
        self.problem.model.images.len()
    }

    /// Returns the indices of some parameters of photos, each given by photo and number.
    pub fn of_photos(&self, parameters: &[(usize, usize)]) -> Vec<usize> {
        let unknown = |&(photo, number): &(usize, usize)| self.problem.model.of_block(photo).start + number;
        parameters.iter().map(unknown).collect()
    }

    /// Returns the owner of each parameter (0: photo, 1: shared camera, 2: shared parameter, 3: point), its index in the network, and the
    /// number of the parameter there.
    pub fn names(&self) -> Vec<[usize; 3]> {
        let model = &self.problem.model;
        let mut names = vec![[0; 3]; self.problem.initial.len()];
        for (owner, range) in (0..model.parameter_blocks()).flat_map(|block| model.owners(block)) {
            let (kind, index) = match owner {
                Owner::Photo(photo) => (0, photo),
                Owner::Camera(camera) => (1, camera),
                Owner::Common(common) => (2, common),
            };
            range.enumerate().for_each(|(number, unknown)| names[unknown] = [kind, index, number]);
        }
        for (place, &point) in self.points.iter().enumerate() {
            model.of_point(place).enumerate().for_each(|(k, unknown)| names[unknown] = [3, point, k]);
        }
        names
    }

    /// Returns, for each of `points` points, its index in the model; None if it is excluded.
    pub fn places(&self, points: usize) -> Vec<Option<usize>> {
        let mut place = vec![None; points];
        self.points.iter().enumerate().for_each(|(index, &point)| place[point] = Some(index));
        place
    }

    /// Returns the active ones of some points, each with its index in the model.
    pub fn taking_part(&self, points: &[usize]) -> Vec<(usize, usize)> {
        let count = self.points.iter().chain(points).max().map_or(0, |last| last + 1);
        let place = self.places(count);
        points.iter().filter_map(|&point| Some((point, place[point]?))).collect()
    }

    /// Returns an error if the problem needs more memory than the options allow.
    pub fn check_memory(&self, options: &Options, threads: &Threads) -> Result<(), NetworkError> {
        let needed = options.reserved + self.problem.system.memory(threads.count());
        match options.memory {
            Some(available) if needed > available => Err(NetworkError::Memory { needed, available }),
            _ => Ok(()),
        }
    }

    /// Returns true if the memory also suffices for group tests.
    pub fn may_keep(&self, options: &Options, threads: &Threads) -> bool {
        let system = &self.problem.system;
        let needed = options.reserved + system.memory(threads.count()) + system.memory_of_groups();
        options.memory.is_none_or(|available| needed <= available)
    }

    /// Returns the squared distance of each point from its nearest station at the initial values, and the median.
    pub fn first_distances(&self) -> Option<(Vec<f64>, f64)> {
        let squares = self.nearest_stations(&self.problem.initial);
        median(squares.clone()).map(|middle| (squares, middle))
    }

    /// Returns the squared distance of each point from its nearest station at given values.
    pub fn nearest_stations(&self, unknowns: &[f64]) -> Vec<f64> {
        let model = &self.problem.model;
        let photos = model.photos(&unknowns[model.parameter_unknowns()]);
        let of_point = |(at, images): (&[f64; 3], &[usize])| {
            let position = model.space.cartesian(*at);
            let square = |image: &Image| {
                photos[image.photo].orientation.pose().to_camera_frame(&position).norm_squared()
            };
            model.images[images[0]..images[1]].iter().map(square).fold(f64::INFINITY, f64::min)
        };
        model.coordinates(unknowns).zip(model.point_images.start.windows(2)).map(of_point).collect()
    }

    /// Replaces the initial values by an adjusted state.
    pub fn start_from(&mut self, state: &State) -> Result<(), NetworkError> {
        if state.unknowns.len() != self.problem.initial.len() {
            return Err(NetworkError::State);
        }
        self.problem.initial.clone_from(&state.unknowns);
        Ok(())
    }

    /// Returns the adjusted values for a continued adjustment; `count` is the number of all points.
    pub fn reached(&self, unknowns: &[f64], count: usize) -> Reached {
        let model = &self.problem.model;
        let mut all = vec![[f64::NAN; 3]; count];
        self.points.iter().zip(model.coordinates(unknowns)).for_each(|(&point, &at)| all[point] = at);
        Reached { points: all, parameters: unknowns[model.parameter_unknowns()].to_vec() }
    }
}

impl Network {
    /// Returns the problem without excluded points, at the initial or the reached values.
    ///
    /// # Errors
    /// Errors of [`Network::assemble`]; no point remains; memory is insufficient.
    pub(super) fn assembled(
        &self,
        options: &Options,
        left_out: &LeftOut,
        reached: Option<&Reached>,
        threads: &Threads,
    ) -> Result<Assembled, NetworkError> {
        let selected = threads.install(|| self.select(left_out, Interface::default()));
        if selected.points.is_empty() {
            return Err(NetworkError::Empty);
        }
        let assembled = threads.install(|| self.assemble(options, selected, reached))?;
        assembled.check_memory(options, threads)?;
        Ok(assembled)
    }

    /// Returns the problem of an adjusted state, at its initial values.
    pub(super) fn assembled_again(
        &self,
        options: &Options,
        state: &State,
        threads: &Threads,
    ) -> Result<Assembled, NetworkError> {
        self.check()?;
        let options = Options { ordering: state.ordering, ..*options };
        let assembled = self.assembled(
            &options,
            &self.left_out(vec![false; self.photos.len()], Some(state))?,
            None,
            threads,
        )?;
        let count = assembled.problem.layout().unknowns();
        if state.unknowns.len() != count || state.held.iter().any(|&unknown| unknown >= count) {
            return Err(NetworkError::State);
        }
        Ok(assembled)
    }

    /// Returns the problem of the selected points, at the initial or the reached values.
    ///
    /// # Errors
    /// Values too large for double precision, points without intersection, too many parameters.
    #[doc(hidden)]
    pub fn assemble(
        &self,
        options: &Options,
        mut selected: Selected,
        reached: Option<&Reached>,
    ) -> Result<Assembled, NetworkError> {
        let order = &selected.images.order;
        let images = parallel::map_in_place(order.len(), TOGETHER, &|place| self.images[order[place]]);
        let mut images_on = vec![0; self.photos.len()];
        images.iter().for_each(|image| images_on[image.photo] += 1);
        let used = self.used(&images_on);
        let undetermined_photos = selected.undetermined_photos.clone();
        let unused = |photo: usize| {
            !used[photo] && (options.hold_unused || undetermined_photos.binary_search(&photo).is_ok())
        };
        if reached.is_none() {
            self.check_rounding(&selected, |photo| !unused(photo))?;
        }
        let middle = selected.interface.middle.unwrap_or_else(|| self.middle());
        let origin = self.origin(middle);
        let mut model = self.bundle(&mut selected, images, images_on, middle)?;
        model.datum.minimum = options.minimum;
        model.screens = options.screens;
        // The classic methods step in angles.
        if !matches!(options.adjustment.method, Method::Full(_)) {
            let turns = |photo: usize| self.turns(photo) && !unused(photo) && !model.is_carried(photo);
            model.turning = (0..self.photos.len()).map(turns).collect();
        }
        let local = |pose: [f64; POSE]| match self.poses {
            PoseNumbers::Angles(_) => {
                std::array::from_fn(|k| if k < 3 { pose[k] - origin[k] } else { pose[k] })
            }
            PoseNumbers::Vectors => pose,
        };
        let values = reached.map_or_else(
            || self.parameter_values(&model, |photo| local(photo.pose)),
            |reached| reached.parameters.clone(),
        );
        let placed = model.without_points(&values);
        let start = match reached {
            Some(reached) => selected.points.iter().map(|&point| reached.points[point]).collect(),
            None => self.start(options.start, &selected, &model, &placed)?,
        };
        // Order: local points, photos and shared cameras, points that observations connect with other objects.
        let locals = model.locals;
        let unknowns = |points: &[[f64; 3]], parameters: &[f64]| {
            let (local, retained) = points.split_at(locals);
            [local.as_flattened(), parameters, retained.as_flattened()].concat()
        };
        if !model.image_corrections.is_empty() {
            model.activate_knots(&unknowns(&start, &values));
        }
        let of_points =
            |each: fn(&Point) -> [f64; 3]| -> Vec<[f64; 3]> { model.points.iter().map(each).collect() };
        let observed = self.parameter_values(&model, |photo| local(self.observed_pose(photo)));
        let parameter_sd = self.parameter_sd(&model, &selected.interface, unused);
        let (mut initial, mut prior, mut sd) = (vec![], vec![], vec![]);
        parallel::join(&mut || initial = unknowns(&start, &values), &mut || {
            parallel::join(
                &mut || prior = unknowns(&of_points(|point| point.coordinates), &observed),
                &mut || sd = unknowns(&of_points(|point| point.sd), &parameter_sd),
            );
        });
        let places = self.places(&model, &placed.photos, &start[model.locals..]);
        let observation_sd = observation_sd(&model);
        let held: Vec<bool> = sd.iter().map(|&sd| sd == 0.0).collect();
        let (outer, below) = selected.interface.blocks(&model, &selected.points)?;
        let layout = layout(&model, places)?.with_held(&held).as_part(outer, below)?;
        model.linearize_observations(&initial, &layout)?;
        let problem = Problem {
            observation_sd,
            system: System::new(layout, options.ordering)?,
            initial,
            prior,
            sd,
            model,
        };
        Ok(Assembled {
            problem,
            points: selected.points,
            dropped: selected.dropped,
            undetermined_photos: selected.undetermined_photos,
        })
    }

    /// Returns which photos are active; a frame is active if a photo on it is.
    fn used(&self, images_on: &[usize]) -> Vec<bool> {
        let mut used: Vec<bool> = images_on.iter().map(|&images| images > 0).collect();
        let on_frames = self.mounts.iter().filter_map(|mount| Some((mount.frame()?, mount.photo())));
        on_frames.for_each(|(frame, photo)| used[frame] |= images_on[photo] > 0);
        used
    }

    /// Returns the positions of the retained blocks for an ordering by position; `retained` are the points that are not local.
    fn places(&self, model: &Bundle, photos: &[PhotoState], retained: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let centres: Vec<[f64; 3]> = photos.iter().map(|photo| photo.orientation.centre().into()).collect();
        let cameras = model.places_of_cameras(&centres);
        let retained: Vec<[f64; 3]> = retained.iter().map(|&at| self.space.cartesian(at).into()).collect();
        let commons = model.places_of_commons(&centres, &retained);
        [centres, cameras, commons, retained].concat()
    }

    /// Returns the initial coordinates of the points.
    fn start(
        &self,
        start: Start,
        selected: &Selected,
        model: &Bundle,
        placed: &LinearizationPoint,
    ) -> Result<Vec<[f64; 3]>, NetworkError> {
        let given = || model.points.iter().map(|point| point.coordinates);
        if start == Start::Given && given().flatten().all(|value| !value.is_nan()) {
            let given: Vec<[f64; 3]> = given().collect();
            let distance = model.middle_distance(&placed.photos, Some(&given));
            self.check_resolution(selected, model, distance, start)?;
            return Ok(given);
        }
        let met = model.intersect(placed);
        let distance = model.middle_distance(&placed.photos, met.as_deref().ok());
        self.check_resolution(selected, model, distance, start)?;
        let mut met = met.map_err(|point| NetworkError::NoIntersection(selected.points[point]))?;
        if start == Start::Given {
            let known = met.iter_mut().zip(given()).filter(|(_, given)| given.iter().all(|x| !x.is_nan()));
            known.for_each(|(met, given)| *met = given);
        }
        Ok(met)
    }
}

impl Bundle {
    /// Computes the linear equations of single local points.
    ///
    /// # Errors
    /// Observations without finite values at the initial values.
    fn linearize_observations(&mut self, initial: &[f64], layout: &Layout) -> Result<(), NetworkError> {
        if self.observations.is_empty() {
            return Ok(());
        }
        let (linearization, mut buffer, mut found) = (self.evaluated(initial), RowBuffer::default(), vec![]);
        for (i, own) in self.observations.iter().enumerate() {
            let term = self.image_terms() + i;
            let mut rows = buffer.term(layout, term);
            self.observe_term(&linearization, term, &mut rows);
            let (constant, coefficients) = (&*rows.constant, [&*rows.local, &*rows.shared]);
            if !constant.iter().chain(coefficients.into_iter().flatten()).all(|value| value.is_finite()) {
                let (index, kind, fault) = (own.index, own.observation.kind(), Fault::NotFinite);
                return Err(NetworkError::Observation { index, kind, fault });
            }
            // Heights, planes and lines with fixed parameters, and control are linear in X, Y and Z.
            if let Some(point) = own.local().filter(|_| self.space == ObjectSpace::Rectangular) {
                let at = linearization.coordinates[point];
                let (constant, coefficients) = (constant.into(), coefficients[0].into());
                found.push(Linear { point, at, constant, coefficients });
            }
        }
        self.linear = found;
        Ok(())
    }
}

/// Returns the standard deviations of all observations; rows of additional observations are whitened (1).
fn observation_sd(model: &Bundle) -> Vec<f64> {
    let mut of_images = vec![[0.0; 2]; model.images.len()];
    parallel::each_chunk(&mut of_images, TOGETHER, &|part, own| {
        let images = &model.images[part * TOGETHER..];
        own.iter_mut().zip(images).for_each(|(sd, image)| *sd = image.sd);
    });
    let mut all = of_images.into_flattened();
    model.observations.iter().for_each(|active| all.extend(vec![1.0; active.root.nrows()]));
    all
}
