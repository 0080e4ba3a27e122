//! Covariances of anything in an adjusted network with anything else, and the network in other datums, without adjusting again.

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, Matrix6, Matrix6xX};

use super::model::Owner;
use super::problem::Assembled;
use super::state::{InnerConstraints, NetworkDatum, State};
use super::suspects::Suspects;
use super::{Network, NetworkError, Options, Solution};
use crate::Threads;
use crate::adjustment::{Adjusted, Adjustment, Classes, CofactorError, Datum, Event, Linearized, Phase};
use crate::geometry::{AttitudeNumbers, Matrix3, POSE, PoseNumbers};
use crate::normals::Function;

/// Shares that are more than rounding.
const NOTABLE: f64 = 1e-6;

/// What has cofactors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// The six unknowns of a photo's pose as they are reported: with angles, where poses are in angles.
    Photo(usize),
    /// Its position, and the rotation step rho about its own axes: A -> A Exp(rho).
    PhotoStep(usize),
    /// The coordinates of a point.
    Point(usize),
    /// The parameters of a camera.
    Camera(usize),
    /// Unknowns that observations, or photos on frames, have in common; rotations are those about their own axes.
    Common(usize),
}

/// An adjusted network whose normal equations are factored: cofactors of anything with anything.
#[derive(Debug)]
pub struct Covariances {
    pub(super) assembled: Assembled,
    pub(super) linearized: Linearized,
    /// How many images the network has.
    pub(super) images: usize,
    /// How many observations beside these.
    pub(super) observations: usize,
    /// The place of each point among those that took part.
    pub(super) point: Vec<Option<usize>>,
    /// A photo of each camera.
    pub(super) photo_of_camera: Vec<Option<usize>>,
    /// The camera of each photo.
    pub(super) camera_of_photo: Vec<usize>,
    pub(super) suspects: OnceLock<Arc<Suspects>>,
    memory: Option<usize>,
}

impl Network {
    /// Prepares for covariances of an adjusted network, in the datum it is in or another.
    ///
    /// `options` are those of the adjustment, and `state` is where it ended ([`Solution::state`]).
    ///
    /// # Errors
    /// A state that is not of this network, a network that is not determined there, a datum that it cannot be taken to; no memory; an
    /// interruption.
    pub fn covariances(
        &self,
        options: &Options,
        state: &State,
        datum: Option<&NetworkDatum>,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Covariances, NetworkError> {
        if state.released {
            let free = State { released: false, ..state.clone() };
            return self.without_control().covariances(options, &free, datum, threads, watch);
        }
        let assembled = self.assembled_again(options, state, threads)?;
        let datum = datum.or(state.datum.as_ref());
        let linearized = {
            let mut between = forming(watch, &assembled);
            let adjusted = state.adjusted(options);
            match datum {
                None => {
                    let (values, held) = (state.unknowns.clone(), state.held.clone());
                    Linearized::form(&assembled.problem, adjusted.loss, values, held, threads, &mut between)
                        .and_then(Linearized::determined)
                        .map_err(|error| NetworkError::new(error, &assembled))?
                }
                Some(datum) => {
                    let (datum, _) = self.datum(&assembled, datum)?;
                    Linearized::in_datum(
                        &assembled.problem,
                        adjusted,
                        &datum,
                        &state.unknowns,
                        threads,
                        &mut between,
                    )?
                }
            }
        };
        let point = assembled.places(self.points.len());
        let mut photo_of_camera = vec![None; self.cameras.len()];
        self.photos.iter().enumerate().for_each(|(index, photo)| photo_of_camera[photo.camera] = Some(index));
        Ok(Covariances {
            assembled,
            linearized,
            images: self.images.len(),
            observations: self.observations.len(),
            point,
            photo_of_camera,
            camera_of_photo: self.photos.iter().map(|photo| photo.camera).collect(),
            suspects: OnceLock::new(),
            memory: options.memory,
        })
    }

    /// Takes an adjusted network to another datum without adjusting again: values, cofactors, redundancy numbers.
    ///
    /// Control and weights of poses that are exactly what a datum takes are given up for inner constraints: what they say is no
    /// observation but the choice of a datum.
    ///
    /// # Errors
    /// Those of [`Network::covariances`].
    pub fn in_datum(
        &self,
        options: &Options,
        state: &State,
        datum: &NetworkDatum,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, NetworkError> {
        let assembled = self.assembled_again(options, state, threads)?;
        let is_inner = matches!(datum, NetworkDatum::Inner(_));
        if state.released || is_inner && assembled.is_minimal(&state.unknowns, threads) {
            let free = self.without_control();
            let state = free.released(options, state, threads)?;
            let mut solution = free.in_datum(options, &state, datum, threads, watch)?;
            solution.state.released = true;
            return Ok(solution);
        }
        let (carried, reference) = self.datum(&assembled, datum)?;
        let reference = reference.as_ref().unwrap_or(&state.unknowns);
        let (problem, adjusted) = (&assembled.problem, state.adjusted(options));
        let found =
            {
                let mut between = forming(watch, &assembled);
                Linearized::in_datum(problem, adjusted, &carried, reference, threads, &mut between)?
                    .inverted(problem, threads, &mut between)?
            };
        let adjustment = Adjustment::inverted(problem, adjusted.loss, found, threads);
        let lost = adjustment.lost.unwrap_or(0.0);
        let left_out = state.collapsed.clone();
        let mut solution = threads.install(|| Solution::new(self, options, &assembled, adjustment, left_out));
        solution.state.datum = Some(datum.clone());
        solution.datum.relative_error = lost;
        Ok(solution)
    }

    /// What keeps an adjusted network from moving: for each kind of observation that does, the share of what a motion changes in its
    /// observations that remains when all unknowns move together, the greatest of all shifts, rotations and the scale. What a datum may
    /// be chosen for has none.
    ///
    /// # Errors
    /// A state that is not of this network.
    pub fn resistance(
        &self,
        options: &Options,
        state: &State,
        threads: &Threads,
    ) -> Result<Vec<(&'static str, f64)>, NetworkError> {
        let assembled = self.assembled_again(options, state, threads)?;
        let model = &assembled.problem.model;
        let mut names =
            vec!["image", "control", "position or attitude of a photo", "camera", "common unknown"];
        let mut class_of = |kind: &'static str| {
            names.iter().position(|&name| name == kind).unwrap_or_else(|| {
                names.push(kind);
                names.len() - 1
            })
        };
        let mut of_ties = vec![0; model.tied_images()];
        of_ties.extend(model.observations.iter().map(|tied| class_of(tied.observation.kind())));
        let mut of_unknowns = vec![1; assembled.problem.layout().unknowns()];
        for (owner, unknowns) in (0..model.stations()).flat_map(|block| model.owners(block)) {
            of_unknowns[unknowns].fill(match owner {
                Owner::Photo(_) => 2,
                Owner::Camera(_) => 3,
                Owner::Common(_) => 4,
            });
        }
        let classes = Classes { count: names.len(), of_ties: &of_ties, of_unknowns: &of_unknowns };
        let shares = assembled.problem.any().resistance(&state.unknowns, &classes, threads);
        let notable = names.into_iter().zip(shares).filter(|(_, share)| *share > NOTABLE);
        Ok(notable.collect())
    }

    /// The network without what is known of points and poses themselves.
    fn without_control(&self) -> Self {
        let mut free = self.clone();
        let mut held = vec![true; self.photos.len()];
        self.images.iter().for_each(|image| held[image.photo] = false);
        free.points.iter_mut().for_each(|point| point.sd = [f64::INFINITY; 3]);
        let photos = free.photos.iter_mut().zip(held).filter(|(_, held)| !held);
        photos.for_each(|(photo, _)| photo.sd = [f64::INFINITY; POSE]);
        free
    }

    /// The state in which a network that was controlled goes on without control: unknowns are held in its place.
    fn released(&self, options: &Options, state: &State, threads: &Threads) -> Result<State, NetworkError> {
        let state = State { released: false, ..state.clone() };
        if !state.held.is_empty() {
            return Ok(state);
        }
        let assembled = self.assembled_again(options, &state, threads)?;
        let held = assembled.problem.any().to_hold(&state.unknowns, threads);
        Ok(State { held, ..state })
    }

    /// What carries a datum, and the values that it stays near to; None where nothing is to move.
    fn datum(
        &self,
        assembled: &Assembled,
        datum: &NetworkDatum,
    ) -> Result<(Datum, Option<Vec<f64>>), NetworkError> {
        match datum {
            NetworkDatum::Inner(inner) => {
                self.check_carriers(inner, assembled)?;
                let (datum, reference) = assembled.datum(inner);
                Ok((datum, Some(reference)))
            }
            NetworkDatum::RelativeToPhoto(photo) => {
                if *photo >= self.photos.len() {
                    return Err(NetworkError::NoPhoto(*photo));
                }
                let model = &assembled.problem.model;
                // A photo on a frame stands and falls with that.
                let pose = model.of_block(model.carrier(*photo)).take(POSE);
                let carriers = pose.map(|unknown| (unknown, 1.0)).collect();
                Ok((assembled.relative(carriers), None))
            }
            NetworkDatum::RelativeToPoints(points) => {
                let inner = InnerConstraints { points: points.clone(), ..Default::default() };
                Ok((assembled.relative(assembled.datum(&inner).0.carriers), None))
            }
        }
    }
}

impl State {
    fn adjusted(&self, options: &Options) -> Adjusted<'_> {
        Adjusted { unknowns: &self.unknowns, held: &self.held, loss: options.adjustment.loss }
    }
}

/// Tells of what is going on.
fn forming(
    watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    assembled: &Assembled,
) -> impl FnMut(usize) -> ControlFlow<()> {
    let total = assembled.problem.layout().locals();
    move |done| watch(Event::Progress { phase: Phase::Form, done, total })
}

impl Covariances {
    /// The cofactors (a priori unit weight) of every two unknowns of what `rows` names, or of those with what `columns` names.
    ///
    /// # Errors
    /// Something that is not there or was left out, more memory than there may be, an interruption.
    pub fn cofactors(
        &self,
        rows: &[Of],
        columns: Option<&[Of]>,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let rows = self.unknowns(rows)?;
        let columns = columns.map(|columns| self.unknowns(columns)).transpose()?;
        self.of_functions(&rows, columns.as_deref(), threads, watch)
    }

    /// J Q J^T, for partials J of functions of the unknowns of what is named: a row for each function.
    ///
    /// # Errors
    /// Those of [`Covariances::cofactors`]; rows that are not as long as there are unknowns.
    pub fn propagate(
        &self,
        partials: &[f64],
        of: &[Of],
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let functions = self.functions(partials, of)?;
        self.of_functions(&functions, None, threads, watch)
    }

    /// Linear functions of the unknowns of what is named, a row of partials for each.
    fn functions(&self, partials: &[f64], of: &[Of]) -> Result<Vec<Function>, NetworkError> {
        let unknowns = self.unknowns(of)?;
        if unknowns.is_empty() || !partials.len().is_multiple_of(unknowns.len()) {
            return Err(NetworkError::Partials { unknowns: unknowns.len(), numbers: partials.len() });
        }
        let function = |row: &[f64]| -> Function {
            let parts = row.iter().zip(&unknowns).filter(|(partial, _)| **partial != 0.0);
            parts
                .flat_map(|(partial, own)| {
                    own.iter().map(move |&(unknown, value)| (unknown, partial * value))
                })
                .collect()
        };
        Ok(partials.chunks_exact(unknowns.len()).map(function).collect())
    }

    /// Q h of such functions h, over all unknowns, in the datum of what was held.
    pub(super) fn solutions(
        &self,
        partials: &[f64],
        of: &[Of],
        threads: &Threads,
    ) -> Result<Vec<Vec<f64>>, NetworkError> {
        let problem = &self.assembled.problem;
        let solve = |function: &Function| {
            let mut right = vec![0.0; problem.layout().unknowns()];
            function.iter().for_each(|&(unknown, value)| right[unknown] += value);
            let go_on = &mut |_| ControlFlow::Continue(());
            let found = self.linearized.solve_for(problem, &right, threads, go_on);
            found.map_err(|error| NetworkError::new(error, &self.assembled))
        };
        self.functions(partials, of)?.iter().map(solve).collect()
    }

    fn of_functions(
        &self,
        rows: &[Function],
        columns: Option<&[Function]>,
        threads: &Threads,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let problem = &self.assembled.problem;
        let total = problem.layout().locals();
        let mut between = |done| watch(Event::Progress { phase: Phase::Invert, done, total });
        let found = self.linearized.cofactors(problem, rows, columns, self.memory, threads, &mut between);
        let found = found.map_err(|error| match error {
            CofactorError::Adjust(error) => NetworkError::new(error, &self.assembled),
            refused => NetworkError::Cofactors(refused),
        })?;
        Ok(match columns {
            Some(columns) => DMatrix::from_row_slice(rows.len(), columns.len(), &found),
            // Symmetric: it may be large, and is not copied.
            None => DMatrix::from_vec(rows.len(), rows.len(), found),
        })
    }

    /// How many unknowns something has.
    ///
    /// # Errors
    /// It is not there, or was left out.
    pub fn width(&self, of: Of) -> Result<usize, NetworkError> {
        Ok(self.unknowns_of(of)?.len())
    }

    fn unknowns(&self, of: &[Of]) -> Result<Vec<Function>, NetworkError> {
        let mut all = Vec::new();
        for &each in of {
            all.extend(self.unknowns_of(each)?);
        }
        Ok(all)
    }

    /// The unknowns of something, as functions of those of the adjustment.
    fn unknowns_of(&self, of: Of) -> Result<Vec<Function>, NetworkError> {
        let model = &self.assembled.problem.model;
        let themselves = |unknowns: std::ops::Range<usize>| unknowns.map(|unknown| vec![(unknown, 1.0)]);
        match of {
            Of::Photo(photo) | Of::PhotoStep(photo) => {
                if photo >= model.cameras.len() {
                    return Err(NetworkError::NoPhoto(photo));
                }
                let step = matches!(of, Of::PhotoStep(_));
                if model.is_carried(photo) {
                    return Ok(self.mounted(photo, step));
                }
                let first = model.of_block(photo).start;
                let numbers = self.attitude(photo, step);
                let turned = |k: usize| (0..3).map(|m| (first + 3 + m, numbers[(k, m)])).collect();
                Ok(themselves(first..first + 3).chain((0..3).map(turned)).collect())
            }
            Of::Common(common) => {
                let own = model.commons.get(common).ok_or(NetworkError::NoCommon(common))?;
                let width = own.kind.unknowns().len();
                let Some(range) = model.of_common(common) else { return Ok(vec![vec![]; width]) };
                let by_unknowns = own.at(&self.linearized.values()[range.clone()]).about_own_axes();
                let row = |i: usize| range.clone().zip(by_unknowns.row(i).iter().copied()).collect();
                Ok((0..width).map(row).collect())
            }
            Of::Point(point) => {
                let index = self.point.get(point).ok_or(NetworkError::NoPoint(point))?;
                let index = index.ok_or(NetworkError::LeftOut(point))?;
                Ok(themselves(model.of_point(index)).collect())
            }
            Of::Camera(camera) => {
                let photo = *self.photo_of_camera.get(camera).ok_or(NetworkError::CameraIndex(camera))?;
                let Some(photo) = photo else { return Ok(vec![]) };
                Ok(match model.blocks.of_camera[photo] {
                    Some(block) => themselves(model.of_block(block)).collect(),
                    None if model.has_own_camera(photo) => {
                        themselves(model.of_block(photo)).skip(POSE).collect()
                    }
                    // What is held has cofactors of zero.
                    None => vec![vec![]; model.cameras[photo].parameters().len()],
                })
            }
        }
    }

    /// The pose of a photo that is mounted, by the unknowns of all blocks that it is made of.
    fn mounted(&self, photo: usize, step: bool) -> Vec<Function> {
        let model = &self.assembled.problem.model;
        let unknowns = &self.linearized.values()[model.of_stations()];
        let Some(composed) = model.composed(photo, unknowns) else { return vec![] };
        let reported =
            || model.reported(&composed.orientation).1.unwrap_or_else(|| Matrix6::repeat(f64::NAN));
        let to = if step { Matrix6::identity() } else { reported() };
        let of_block = |(block, by): (usize, Matrix6xX<f64>)| (model.of_block(block).start, to * by);
        let parts: Vec<(usize, Matrix6xX<f64>)> = composed.parts().into_iter().map(of_block).collect();
        let row = |k: usize| -> Function {
            let of = |(first, by): &(usize, Matrix6xX<f64>)| -> Function {
                (*first..).zip(by.row(k).iter().copied()).collect()
            };
            parts.iter().flat_map(of).collect()
        };
        (0..POSE).map(row).collect()
    }

    /// What leads from the last three unknowns of a photo to its angles as they are reported, or to its rotation step; NaN for angles
    /// that are not determined, phi being 90 degrees.
    fn attitude(&self, photo: usize, step: bool) -> Matrix3 {
        let model = &self.assembled.problem.model;
        let PoseNumbers::Angles(sense) = model.poses else { return Matrix3::identity() };
        let pose = &self.linearized.values()[model.of_block(photo)];
        let (numbers, angles) = (AttitudeNumbers::OmegaPhiKappa(sense), [pose[3], pose[4], pose[5]]);
        match (model.turning_sense(photo).is_some(), step) {
            (true, true) | (false, false) => Matrix3::identity(),
            (false, true) => numbers.rates(angles),
            (true, false) => numbers.by_step(angles).unwrap_or_else(|| Matrix3::repeat(f64::NAN)),
        }
    }
}
