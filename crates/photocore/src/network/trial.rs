//! Outlier detection: repeated adjustments without some observations, with a single symbolic analysis.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::error::NetworkError;
use super::input::{Network, Options, State};
use super::problem::Assembled;
use super::test_groups::TestGroups;
use crate::adjustment::{
    self, AdjustError, EquationOf, Leverages, Loss, Method, Model, PriorTerms, Requests, Status, Stop,
};
use crate::geometry::PoseNumbers;
use crate::{Context, Threads};

/// Repeated adjustments of a network without some of its observations.
#[derive(Debug)]
pub struct Trial {
    pub(super) assembled: Assembled,
    options: adjustment::Options,
    pub(super) groups: Arc<TestGroups>,
    /// Given standard deviations of the equations and parameters.
    pub(super) observation_sd: Vec<f64>,
    pub(super) sd: Vec<f64>,
    /// Index of each active point in the model.
    pub(super) place: Vec<Option<usize>>,
    pub(super) camera_of_photo: Vec<usize>,
    /// Parameters fixed as a minimal datum at the end of the adjustment.
    pub(super) held: Vec<usize>,
    found: Option<Leverages>,
    /// Whether `found` is the complete network at the end of its adjustment.
    stands: bool,
}

/// Converged network with its cofactors. Tests, and trials without some observations, start here without forming, factoring and inverting
/// again.
///
/// Its cofactors were computed before the last step, which changed no parameter by more than a thousandth of its standard deviation.
#[derive(Debug)]
pub struct Converged {
    assembled: Assembled,
    options: adjustment::Options,
    found: Leverages,
}

/// Excluded observations, points and photos.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Excluded {
    /// Whether each row is excluded, with the rows of all test groups concatenated.
    pub rows: Vec<bool>,
    /// Points excluded with all their images and observed coordinates.
    pub points: BTreeSet<usize>,
    /// Photos excluded with all their images and observed pose components.
    pub photos: BTreeSet<usize>,
}

impl Excluded {
    pub(super) fn set(&mut self, rows: impl IntoIterator<Item = usize>, is_excluded: bool) {
        rows.into_iter().for_each(|row| self.rows[row] = is_excluded);
    }
}

/// Result of a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Status of the iterations.
    pub status: Status,
    /// Number of iterations.
    pub iterations: usize,
    /// Weighted sum of squares of the active observations.
    pub sum_of_squares: f64,
    /// Number of active observations minus parameters.
    pub degrees_of_freedom: i64,
    /// Points that ran into a station.
    pub collapsed: Vec<usize>,
}

impl Converged {
    pub(super) fn new(assembled: Assembled, options: adjustment::Options, found: Leverages) -> Self {
        assembled.problem.system.release();
        Self { assembled, options, found }
    }

    /// Returns a trial of the network that was adjusted; [`Trial::linearize`] needs no computation.
    pub fn trial(self, network: &Network) -> Trial {
        let Self { mut assembled, options, found } = self;
        assembled.problem.initial.clone_from(&found.values);
        let held = found.held.clone();
        Trial::new(network, assembled, &options, held, Some(found))
    }
}

impl Network {
    /// Prepares trials of a network, from its initial values or from the final state of an adjustment with these options
    /// ([`super::Solution::state`]).
    ///
    /// # Errors
    /// Errors of [`Network::adjust`] before its first iteration; a state of another network.
    pub fn trial(
        &self,
        options: &Options,
        state: Option<&State>,
        threads: &Threads,
    ) -> Result<Trial, NetworkError> {
        let assembled = match state {
            Some(state) => {
                let mut assembled = self.assembled_again(options, state, threads)?;
                assembled.problem.initial.clone_from(&state.unknowns);
                assembled
            }
            None => {
                self.check()?;
                self.assembled(options, &self.left_out(self.untouched_photos(), None)?, None, threads)?
            }
        };
        let held = state.map_or(vec![], |state| state.held.clone());
        Ok(Trial::new(self, assembled, &options.adjustment, held, None))
    }
}

impl Trial {
    /// Returns a trial of an assembled network at its initial values, or with the results of the complete network.
    pub(super) fn new(
        network: &Network,
        assembled: Assembled,
        options: &adjustment::Options,
        held: Vec<usize>,
        found: Option<Leverages>,
    ) -> Self {
        let camera = |photo: usize| network.photos[photo].camera;
        let groups = TestGroups::new(&assembled, network.images.len(), &camera);
        let place = assembled.places(network.points.len());
        let mut own = *options;
        if let Method::Full(_) = own.method {
            own.method = Method::default();
        }
        Self {
            observation_sd: assembled.problem.observation_sd.clone(),
            sd: assembled.problem.sd.clone(),
            options: own,
            assembled,
            groups: Arc::new(groups),
            place,
            camera_of_photo: network.photos.iter().map(|photo| photo.camera).collect(),
            held,
            stands: found.is_some(),
            found,
        }
    }

    /// Returns the test groups, in the order of all tests.
    pub fn groups(&self) -> &Arc<TestGroups> {
        &self.groups
    }

    /// Linearizes the complete network at the end of its adjustment.
    ///
    /// # Errors
    /// Undetermined parameters; an interruption, insufficient memory.
    pub fn linearize(&mut self, context: &mut Context<'_>) -> Result<Outcome, NetworkError> {
        let found = match self.found.take_if(|_| self.stands) {
            Some(found) => found,
            None => {
                self.take_out(&Excluded::default());
                let problem = &self.assembled.problem;
                Leverages::at(problem, problem.initial.clone(), self.held.clone(), context)
                    .map_err(|error| NetworkError::new(error, &self.assembled))?
            }
        };
        Ok(self.keep(found, Status::Converged, 0, vec![]))
    }

    /// Adjusts without the excluded observations, starting from the last trial.
    ///
    /// * `tolerance`: see [`Stop`]; with None, the tolerance of the options.
    ///
    /// # Errors
    /// Parameters that are undetermined without them; an interruption, insufficient memory. The last values remain.
    pub fn adjust(
        &mut self,
        out: &Excluded,
        tolerance: Option<f64>,
        context: &mut Context<'_>,
    ) -> Result<Outcome, NetworkError> {
        self.stands = false;
        self.take_out(out);
        let method = self.method(tolerance);
        let options = adjustment::Options { method, covariance: true, loss: None, ..self.options };
        let failed = |error| NetworkError::new(error, &self.assembled);
        let requests = Requests { by_groups: Some((&[], None)), ..Requests::default() };
        let adjusted = adjustment::adjust_with(&self.assembled.problem, &options, requests, context);
        let mut adjusted = adjusted.map_err(failed)?;
        let values = std::mem::take(&mut adjusted.unknowns);
        let Some(found) = Leverages::of(&mut adjusted, &values) else {
            return Err(failed(adjusted.undetermined.unwrap_or(AdjustError::NotFinite)));
        };
        Ok(self.keep(found, adjusted.status, adjusted.iterations.len(), adjusted.collapsed))
    }

    /// Adjusts with a robust loss, starting from the last trial, and stores the values. Returns the weight factors of each active image and
    /// observation, in the order of all tests; 1 for others. None if it diverges: then the start of the next trial is unchanged.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`].
    pub fn robust_weights(
        &mut self,
        loss: Loss,
        iterations: usize,
        context: &mut Context<'_>,
    ) -> Result<Option<Vec<f64>>, NetworkError> {
        let options = adjustment::Options {
            loss: Some(loss),
            covariance: false,
            max_iterations: iterations,
            ..self.options
        };
        self.stands = false;
        let problem = &self.assembled.problem;
        let found = adjustment::adjust(problem, &options, context)
            .map_err(|error| NetworkError::new(error, &self.assembled))?;
        if found.status == Status::Diverged {
            return Ok(None);
        }
        let (groups, all) = (problem.layout().groups(), found.weights.unwrap_or_default());
        let weight = |group: usize| match self.equation(self.groups.equations_of(group)[0]) {
            EquationOf::Group { group, .. } => all.get(group).copied(),
            EquationOf::Term { term, .. } => all.get(groups + term).copied(),
            EquationOf::Unknown(_) => None,
        };
        let weights = (0..self.groups.len()).map(|group| weight(group).unwrap_or(1.0)).collect();
        self.assembled.problem.initial = found.unknowns;
        Ok(Some(weights))
    }

    /// Returns the positions of all points of the network; NaN for excluded ones.
    pub fn points(&self) -> Vec<[f64; 3]> {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let mut all = vec![[f64::NAN; 3]; self.place.len()];
        for (&point, at) in self.assembled.points.iter().zip(model.coordinates(&problem.initial)) {
            all[point] = std::array::from_fn(|k| at[k] + model.origin[k]);
        }
        all
    }

    /// Returns the parameters of all photos: pose and own camera.
    pub fn photos(&self) -> Vec<Vec<f64>> {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let positions = if let PoseNumbers::Angles(_) = model.poses { 3 } else { 0 };
        let photo = |photo: usize| {
            let mut values = problem.initial[model.of_block(photo)].to_vec();
            (0..positions).for_each(|k| values[k] += model.origin[k]);
            values
        };
        (0..model.cameras.len()).map(photo).collect()
    }

    fn method(&self, tolerance: Option<f64>) -> Method {
        match (self.options.method, tolerance) {
            (method, None) => method,
            (Method::TrustRegion(Stop::Decrease(_)), Some(limit)) => {
                Method::TrustRegion(Stop::Decrease(limit))
            }
            (_, Some(limit)) => Method::Damped(Stop::Foreseen(limit)),
        }
    }

    fn keep(
        &mut self,
        found: Leverages,
        status: Status,
        iterations: usize,
        collapsed: Vec<usize>,
    ) -> Outcome {
        self.assembled.problem.initial.clone_from(&found.values);
        let points = &self.assembled.points;
        let outcome = Outcome {
            status,
            iterations,
            sum_of_squares: found.sum_of_squares(&self.assembled.problem),
            degrees_of_freedom: found.degrees_of_freedom(&self.assembled.problem),
            collapsed: collapsed.into_iter().map(|local| points[local]).collect(),
        };
        self.found = Some(found);
        outcome
    }

    /// Sets the weights of excluded rows to zero; excluded points and photos are fixed.
    fn take_out(&mut self, out: &Excluded) {
        let Assembled { problem, .. } = &mut self.assembled;
        problem.observation_sd.clone_from(&self.observation_sd);
        problem.sd.clone_from(&self.sd);
        for (&equation, _) in self.groups.equations().iter().zip(&out.rows).filter(|(_, out)| **out) {
            let equation = equation as usize;
            match equation.checked_sub(problem.observation_sd.len()) {
                None => problem.observation_sd[equation] = f64::INFINITY,
                Some(unknown) => problem.sd[unknown] = f64::INFINITY,
            }
        }
        for place in out.points.iter().filter_map(|&point| self.place[point]) {
            let model = &problem.model;
            problem.sd[model.of_point(place)].fill(0.0);
            let images = 2 * model.point_images.start[place]..2 * model.point_images.start[place + 1];
            problem.observation_sd[images].fill(f64::INFINITY);
        }
        for &photo in &out.photos {
            let model = &problem.model;
            problem.sd[model.of_block(photo)].fill(0.0);
            for image in (0..model.images.len()).filter(|&image| model.images[image].photo == photo) {
                problem.observation_sd[2 * image..2 * image + 2].fill(f64::INFINITY);
            }
        }
    }

    pub(super) fn found(&self) -> Result<&Leverages, NetworkError> {
        self.found.as_ref().ok_or(NetworkError::State)
    }

    /// Returns the adjusted network; afterwards the trial has no data for tests and adjustments.
    pub(super) fn end(&mut self) -> Option<Leverages> {
        (self.observation_sd, self.sd) = (vec![], vec![]);
        self.found.take()
    }

    /// Returns the prior terms of the parameters, with given standard deviations.
    pub(super) fn prior_terms(&self, sd: &[f64], values: &[f64]) -> PriorTerms {
        let problem = &self.assembled.problem;
        PriorTerms::new(problem.model.prior_terms(values, &problem.prior, sd), values, &problem.prior, sd)
    }

    /// Returns the observation of an equation of a test group.
    pub(super) fn equation(&self, equation: u32) -> EquationOf {
        let (problem, equation) = (&self.assembled.problem, equation as usize);
        let (layout, rows) = (problem.layout(), problem.layout().rows());
        if let Some(unknown) = equation.checked_sub(layout.equations()) {
            EquationOf::Unknown(unknown)
        } else if let Some(term) = layout.term_with(equation) {
            EquationOf::Term { term, row: equation - layout.equations_of_term(term).start }
        } else {
            let group = equation / rows;
            EquationOf::Group { group, local: problem.model.point_of(group), row: equation % rows }
        }
    }

    /// Returns true if an equation of a test group is active.
    pub(super) fn is_in(&self, equation: u32) -> bool {
        let problem = &self.assembled.problem;
        match (equation as usize).checked_sub(problem.observation_sd.len()) {
            None => problem.observation_sd[equation as usize].is_finite(),
            Some(unknown) => problem.is_weighted(unknown),
        }
    }

    /// Returns the index of an additional observation in the model; None for other test groups.
    pub(super) fn observation(&self, group: usize) -> Option<usize> {
        let image_terms = self.assembled.problem.model.image_terms();
        match self.equation(self.groups.equations_of(group)[0]) {
            EquationOf::Term { term, .. } => term.checked_sub(image_terms),
            _ => None,
        }
    }

    /// Returns the matrix from whitened errors of some rows of a group to their units.
    pub(super) fn units(&self, group: usize, rows: &[usize]) -> DMatrix<f64> {
        if let Some(index) = self.observation(group) {
            let root = &self.assembled.problem.model.observations[index].root;
            return root.select_rows(rows).select_columns(rows);
        }
        let deviations = &self.groups.deviations()[self.groups.rows(group)];
        let of_rows = rows.iter().map(|&row| deviations[row]);
        DMatrix::from_diagonal(&DVector::from_iterator(rows.len(), of_rows))
    }
}
