//! Covariances between any parameters of an adjusted network, and datum transformations without a new adjustment.

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, Matrix6, Matrix6xX};

use super::error::NetworkError;
use super::input::{InnerConstraints, Network, NetworkDatum, Options, State};
use super::model::Owner;
use super::problem::Assembled;
use super::solution::Solution;
use super::test_groups::TestGroups;
use crate::adjustment::{Adjusted, Adjustment, Classes, CofactorError, Datum, Linearized};
use crate::geometry::{AttitudeNumbers, Matrix3, POSE, PoseNumbers};
use crate::normals::Function;
use crate::{Context, Threads};

/// Smallest share that is not attributed to rounding.
const NOTABLE: f64 = 1e-6;

/// An object with cofactors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// Six reported pose parameters of a photo: with angles if the poses are in angles.
    Photo(usize),
    /// Position of a photo, and the rotation step rho about its own axes: A -> A Exp(rho).
    PhotoStep(usize),
    /// Coordinates of a point.
    Point(usize),
    /// Parameters of a camera.
    Camera(usize),
    /// Components of a shared parameter, with rotations about its own axes.
    Common(usize),
}

/// An adjusted network with factored normal equations, which provides cofactors of any parameters.
#[derive(Debug)]
pub struct Covariances {
    pub(super) assembled: Assembled,
    pub(super) linearized: Linearized,
    pub(super) images: usize,
    /// Number of additional observations.
    pub(super) observations: usize,
    /// Index of each point among the active ones.
    pub(super) point: Vec<Option<usize>>,
    pub(super) photo_of_camera: Vec<Option<usize>>,
    pub(super) camera_of_photo: Vec<usize>,
    pub(super) groups: OnceLock<Arc<TestGroups>>,
    memory: Option<usize>,
}

impl Network {
    /// Factors the normal equations of an adjusted network, in its datum or another one.
    ///
    /// `options` are the options of the adjustment, and `state` is its final state ([`Solution::state`]).
    ///
    /// # Errors
    /// A state of another network, undetermined parameters, an impossible datum, insufficient memory, an interruption.
    pub fn covariances(
        &self,
        options: &Options,
        state: &State,
        datum: Option<&NetworkDatum>,
        context: &mut Context<'_>,
    ) -> Result<Covariances, NetworkError> {
        if state.released {
            let free = State { released: false, ..state.clone() };
            return self.without_control().covariances(options, &free, datum, context);
        }
        let assembled = self.assembled_again(options, state, context.threads)?;
        let datum = datum.or(state.datum.as_ref());
        let (problem, adjusted) = (&assembled.problem, state.adjusted(options));
        let linearized = match datum {
            None => {
                let (values, held) = (state.unknowns.clone(), state.held.clone());
                Linearized::form(problem, adjusted.loss, values, held, context)
                    .and_then(Linearized::determined)
                    .map_err(|error| NetworkError::new(error, &assembled))?
            }
            Some(datum) => {
                let (datum, _) = self.datum(&assembled, datum)?;
                Linearized::in_datum(problem, adjusted, &datum, &state.unknowns, context)?
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
            groups: OnceLock::new(),
            memory: options.memory,
        })
    }

    /// Transforms an adjusted network to another datum without a new adjustment: values, cofactors, redundancy numbers.
    ///
    /// For inner constraints, minimal control and weights of poses are removed: they are only a choice of the datum, not observations.
    ///
    /// # Errors
    /// Errors of [`Network::covariances`].
    pub fn in_datum(
        &self,
        options: &Options,
        state: &State,
        datum: &NetworkDatum,
        context: &mut Context<'_>,
    ) -> Result<Solution, NetworkError> {
        let assembled = self.assembled_again(options, state, context.threads)?;
        let is_inner = matches!(datum, NetworkDatum::Inner(_));
        if state.released || is_inner && assembled.is_minimal(&state.unknowns, context.threads) {
            let free = self.without_control();
            let state = free.released(options, state, context.threads)?;
            let mut solution = free.in_datum(options, &state, datum, context)?;
            solution.state.released = true;
            return Ok(solution);
        }
        let (carried, reference) = self.datum(&assembled, datum)?;
        let reference = reference.as_ref().unwrap_or(&state.unknowns);
        let (problem, adjusted) = (&assembled.problem, state.adjusted(options));
        let linearized = Linearized::in_datum(problem, adjusted, &carried, reference, context)?;
        let found = linearized.inverted(problem, context)?;
        let adjustment = Adjustment::inverted(problem, adjusted.loss, found, context.threads);
        let lost = adjustment.lost.unwrap_or(0.0);
        let left_out = state.collapsed.clone();
        let mut solution =
            context.threads.install(|| Solution::new(self, options, &assembled, adjustment, left_out));
        solution.state.datum = Some(datum.clone());
        solution.datum.relative_error = lost;
        Ok(solution)
    }

    /// Returns the observation types that fix the datum, each with its greatest sensitivity to shifts, rotations and scale. The sensitivity
    /// is the share of the changes of its observations that a joint change of all parameters cannot compensate.
    /// It is zero for degrees of freedom of the datum.
    ///
    /// # Errors
    /// A state of another network.
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
        let mut of_terms = vec![0; model.image_terms()];
        of_terms.extend(model.observations.iter().map(|active| class_of(active.observation.kind())));
        let mut of_unknowns = vec![1; assembled.problem.layout().unknowns()];
        for (owner, unknowns) in (0..model.parameter_blocks()).flat_map(|block| model.owners(block)) {
            of_unknowns[unknowns].fill(match owner {
                Owner::Photo(_) => 2,
                Owner::Camera(_) => 3,
                Owner::Common(_) => 4,
            });
        }
        let classes = Classes { count: names.len(), of_terms: &of_terms, of_unknowns: &of_unknowns };
        let shares = assembled.problem.any().resistance(&state.unknowns, &classes, threads);
        let notable = names.into_iter().zip(shares).filter(|(_, share)| *share > NOTABLE);
        Ok(notable.collect())
    }

    /// Returns the network without prior information of points and poses.
    fn without_control(&self) -> Self {
        let mut free = self.clone();
        let mut held = vec![true; self.photos.len()];
        self.images.iter().for_each(|image| held[image.photo] = false);
        free.points.iter_mut().for_each(|point| point.sd = [f64::INFINITY; 3]);
        let photos = free.photos.iter_mut().zip(held).filter(|(_, held)| !held);
        photos.for_each(|(photo, _)| photo.sd = [f64::INFINITY; POSE]);
        free
    }

    /// Returns the state for the network without control: a minimal datum replaces the control.
    fn released(&self, options: &Options, state: &State, threads: &Threads) -> Result<State, NetworkError> {
        let state = State { released: false, ..state.clone() };
        if !state.held.is_empty() {
            return Ok(state);
        }
        let assembled = self.assembled_again(options, &state, threads)?;
        let held = assembled.problem.any().to_hold(&state.unknowns, threads);
        Ok(State { held, ..state })
    }

    /// Returns the datum parameters, and the reference values; None if no values change.
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
                // The datum of a photo on a frame is the frame.
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

impl Covariances {
    /// Returns the cofactors (a priori unit weight) of all parameters of `rows`, with each other or with `columns`.
    ///
    /// # Errors
    /// A missing or excluded object, insufficient memory, an interruption.
    pub fn cofactors(
        &self,
        rows: &[Of],
        columns: Option<&[Of]>,
        context: &mut Context<'_>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let rows = self.unknowns(rows)?;
        let columns = columns.map(|columns| self.unknowns(columns)).transpose()?;
        self.of_functions(&rows, columns.as_deref(), context)
    }

    /// Returns J Q J^T for partials J of functions of the parameters of `of`: one row per function.
    ///
    /// # Errors
    /// Errors of [`Covariances::cofactors`]; rows of wrong length.
    pub fn propagate(
        &self,
        partials: &[f64],
        of: &[Of],
        context: &mut Context<'_>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let functions = self.functions(partials, of)?;
        self.of_functions(&functions, None, context)
    }

    /// Returns linear functions of the parameters of `of`, from one row of partials each.
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

    /// Returns Q h of such functions h, over all parameters, in the minimal datum.
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
            let context = &mut Context::new(threads);
            let found = self.linearized.solve_for(problem, &right, context);
            found.map_err(|error| NetworkError::new(error, &self.assembled))
        };
        self.functions(partials, of)?.iter().map(solve).collect()
    }

    fn of_functions(
        &self,
        rows: &[Function],
        columns: Option<&[Function]>,
        context: &mut Context<'_>,
    ) -> Result<DMatrix<f64>, NetworkError> {
        let problem = &self.assembled.problem;
        let found = self.linearized.cofactors(problem, rows, columns, self.memory, context);
        let found = found.map_err(|error| match error {
            CofactorError::Adjust(error) => NetworkError::new(error, &self.assembled),
            refused => NetworkError::Cofactors(refused),
        })?;
        Ok(match columns {
            Some(columns) => DMatrix::from_row_slice(rows.len(), columns.len(), &found),
            // The matrix is symmetric and may be large: it is not copied.
            None => DMatrix::from_vec(rows.len(), rows.len(), found),
        })
    }

    /// Returns the number of parameters of an object.
    ///
    /// # Errors
    /// A missing or excluded object.
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

    /// Returns the parameters of an object, as functions of the parameters of the adjustment.
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
                    // Cofactors of fixed parameters are zero.
                    None => vec![vec![]; model.cameras[photo].parameters().len()],
                })
            }
        }
    }

    /// Returns the pose of a mounted photo, as functions of the parameters of all its blocks.
    fn mounted(&self, photo: usize, step: bool) -> Vec<Function> {
        let model = &self.assembled.problem.model;
        let unknowns = &self.linearized.values()[model.parameter_unknowns()];
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

    /// Returns the partials of the reported angles, or of the rotation step, by the last three parameters of a photo. NaN for undetermined
    /// angles, if phi is 90 degrees.
    fn attitude(&self, photo: usize, step: bool) -> Matrix3 {
        let model = &self.assembled.problem.model;
        let PoseNumbers::Angles(sense) = model.poses else { return Matrix3::identity() };
        let pose = &self.linearized.values()[model.of_block(photo)];
        let (numbers, angles) = (AttitudeNumbers::OmegaPhiKappa(sense), [pose[3], pose[4], pose[5]]);
        match (model.rotation_vector_sense(photo).is_some(), step) {
            (true, true) | (false, false) => Matrix3::identity(),
            (false, true) => numbers.rates(angles),
            (true, false) => numbers.by_step(angles).unwrap_or_else(|| Matrix3::repeat(f64::NAN)),
        }
    }
}
