//! A network tried without some of its observations: adjusted again and again, the symbolic analysis done once.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::problem::Assembled;
use super::state::State;
use super::suspects::{self, Home, Row, Subject, Suspect, Suspects};
use super::{Network, NetworkError, Options};
use crate::Threads;
use crate::adjustment::{self, AdjustError, Leverages, Loss, Method, Status, Stop, Terms, Watch};
use crate::geometry::PoseNumbers;

/// A network tried without some of its observations.
#[derive(Debug)]
pub struct Trial {
    pub(super) assembled: Assembled,
    options: adjustment::Options,
    pub(super) suspects: Arc<Suspects>,
    /// Where the square block of each suspect starts; one more at the end.
    pub(super) block_starts: Vec<usize>,
    /// Standard deviations as given: of the equations, of the unknowns.
    pub(super) observation_sd: Vec<f64>,
    pub(super) sd: Vec<f64>,
    /// The place in the model of each point that takes part.
    pub(super) place: Vec<Option<usize>>,
    /// The suspects at each local point, by its place.
    pub(super) on_place: Vec<Vec<usize>>,
    /// The camera of each photo.
    pub(super) camera_of_photo: Vec<usize>,
    /// What was held for a datum where the adjustment has ended.
    pub(super) held: Vec<usize>,
    found: Option<Leverages>,
    /// Whether that is the network as its adjustment has ended, with everything in it.
    stands: bool,
}

/// A network where its adjustment has converged, kept with its cofactors: tests of it, and trials without some observations, begin there
/// without forming, factoring and inverting once more.
///
/// Its cofactors are those of the adjustment: before the last step, which has moved no unknown by more than a thousandth of its standard
/// deviation.
#[derive(Debug)]
pub struct Converged {
    assembled: Assembled,
    options: adjustment::Options,
    found: Leverages,
}

/// What is out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Out<'a> {
    /// Of each row of the suspects, one suspect after the other, whether it is out.
    pub rows: &'a [bool],
    /// Points that are out with all their images and components.
    pub points: &'a [usize],
    /// Photos that are out with all their images and components.
    pub photos: &'a [usize],
}

/// How a trial has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How the iterations have.
    pub status: Status,
    /// How many there were.
    pub iterations: usize,
    /// Weighted sum of squares of what takes part.
    pub sum_of_squares: f64,
    /// Observations that take part minus unknowns.
    pub degrees_of_freedom: i64,
    /// Points that have run into a station.
    pub collapsed: Vec<usize>,
}

impl Converged {
    pub(super) fn new(assembled: Assembled, options: adjustment::Options, found: Leverages) -> Self {
        assembled.problem.system.release();
        Self { assembled, options, found }
    }

    /// Prepares for trials of the network, which is the one that was adjusted; [`Trial::stand`] is done already.
    pub fn trial(self, network: &Network) -> Trial {
        let Self { mut assembled, options, found } = self;
        assembled.problem.initial.clone_from(&found.values);
        let held = found.held.clone();
        Trial::new(network, assembled, &options, held, Some(found))
    }
}

impl Network {
    /// Prepares for trials of a network: from its initial values on, or from where an adjustment with these options has ended
    /// ([`super::Solution::state`]).
    ///
    /// # Errors
    /// Those of [`Network::adjust`] before its first iteration; a state that is not of this network.
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
    /// Of an assembled network at its initial values, or as it was found there with everything in it.
    pub(super) fn new(
        network: &Network,
        assembled: Assembled,
        options: &adjustment::Options,
        held: Vec<usize>,
        found: Option<Leverages>,
    ) -> Self {
        let camera = |photo: usize| network.photos[photo].camera;
        let suspects = Suspects::new(&assembled, network.images.len(), &camera);
        let mut block_starts = vec![0];
        for suspect in &suspects.all {
            block_starts.push(block_starts[block_starts.len() - 1] + suspect.rows.len().pow(2));
        }
        let place = assembled.places(network.points.len());
        let locals = assembled.problem.model.locals;
        let mut on_place: Vec<Vec<usize>> = vec![vec![]; locals];
        for (index, suspect) in suspects.all.iter().enumerate() {
            match suspect.home {
                Home::Group { point, .. } => on_place[point].push(index),
                Home::Point(place) if place < locals => on_place[place].push(index),
                _ => {}
            }
        }
        let mut own = *options;
        if let Method::Full(_) = own.method {
            own.method = Method::default();
        }
        Self {
            observation_sd: assembled.problem.observation_sd.clone(),
            sd: assembled.problem.sd.clone(),
            options: own,
            assembled,
            suspects: Arc::new(suspects),
            block_starts,
            place,
            on_place,
            camera_of_photo: network.photos.iter().map(|photo| photo.camera).collect(),
            held,
            stands: found.is_some(),
            found,
        }
    }

    /// The groups of observations, in the order of all tests.
    pub fn suspects(&self) -> &Arc<Suspects> {
        &self.suspects
    }

    /// Takes the network as it stands where its adjustment has ended, with everything in it.
    ///
    /// # Errors
    /// Values that leave unknowns undetermined; an interruption, no memory.
    pub fn stand(&mut self, threads: &Threads, watch: Watch<'_>) -> Result<Outcome, NetworkError> {
        let found = match self.found.take_if(|_| self.stands) {
            Some(found) => found,
            None => {
                self.take_out(Out::default());
                let problem = &self.assembled.problem;
                Leverages::at(problem, problem.initial.clone(), self.held.clone(), threads, watch)
                    .map_err(|error| NetworkError::new(error, &self.assembled))?
            }
        };
        Ok(self.keep(found, Status::Converged, 0, vec![]))
    }

    /// Adjusts without what is out, from where the last trial has ended.
    ///
    /// * `tolerance`: see [`Stop`]; that of the options where it is None.
    ///
    /// # Errors
    /// Unknowns that are not determined without; an interruption, no memory. The last values stay.
    pub fn adjust(
        &mut self,
        out: Out<'_>,
        tolerance: Option<f64>,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Outcome, NetworkError> {
        self.stands = false;
        self.take_out(out);
        let method = self.method(tolerance);
        let options = adjustment::Options { method, covariance: true, loss: None, ..self.options };
        let failed = |error| NetworkError::new(error, &self.assembled);
        let adjusted =
            adjustment::adjust_by_groups(&self.assembled.problem, &options, (&[], None), threads, watch);
        let mut adjusted = adjusted.map_err(failed)?;
        let values = std::mem::take(&mut adjusted.unknowns);
        let Some(found) = Leverages::of(&mut adjusted, &values) else {
            return Err(failed(adjusted.undetermined.unwrap_or(AdjustError::NotFinite)));
        };
        Ok(self.keep(found, adjusted.status, adjusted.iterations.len(), adjusted.collapsed))
    }

    /// Adjusts with a robust loss from where the last trial has ended, and stays there: the factors by which it has changed the weights
    /// of each image and observation that takes part, in the order of all tests; 1 for others. None where it diverges: then its weights
    /// say nothing, and the next trial begins where this one has.
    ///
    /// # Errors
    /// Those of [`Trial::adjust`].
    pub fn resist(
        &mut self,
        loss: Loss,
        iterations: usize,
        threads: &Threads,
        watch: Watch<'_>,
    ) -> Result<Option<Vec<f64>>, NetworkError> {
        let options = adjustment::Options {
            loss: Some(loss),
            covariance: false,
            max_iterations: iterations,
            ..self.options
        };
        self.stands = false;
        let problem = &self.assembled.problem;
        let found = adjustment::adjust(problem, &options, threads, watch)
            .map_err(|error| NetworkError::new(error, &self.assembled))?;
        if found.status == Status::Diverged {
            return Ok(None);
        }
        let (groups, all) = (problem.layout().groups(), found.weights.unwrap_or_default());
        let weight = |suspect: &Suspect| match suspect.home {
            Home::Group { group, .. } => all.get(group).copied(),
            Home::Tie(tie) => all.get(groups + tie).copied(),
            Home::Point(_) | Home::Block(_) => None,
        };
        let weights = self.suspects.all.iter().map(|suspect| weight(suspect).unwrap_or(1.0)).collect();
        self.assembled.problem.initial = found.unknowns;
        Ok(Some(weights))
    }

    /// Where all points of the network are; NaN for those that do not take part.
    pub fn points(&self) -> Vec<[f64; 3]> {
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let mut all = vec![[f64::NAN; 3]; self.place.len()];
        for (&point, at) in self.assembled.points.iter().zip(model.coordinates(&problem.initial)) {
            all[point] = std::array::from_fn(|k| at[k] + model.origin[k]);
        }
        all
    }

    /// The values of the unknowns of all photos as they are given: pose, and camera where it is the photo's own.
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

    /// Weights of zero for what is out; points and photos that are out stay where they are.
    fn take_out(&mut self, out: Out<'_>) {
        let Assembled { problem, .. } = &mut self.assembled;
        problem.observation_sd.clone_from(&self.observation_sd);
        problem.sd.clone_from(&self.sd);
        let rows = self.suspects.all.iter().flat_map(|suspect| suspect.rows.iter());
        for (&(row, _), _) in rows.zip(out.rows).filter(|(_, out)| **out) {
            match row {
                Row::Equation(equation) => problem.observation_sd[equation] = f64::INFINITY,
                Row::Unknown(unknown) => problem.sd[unknown] = f64::INFINITY,
            }
        }
        for place in out.points.iter().filter_map(|&point| self.place[point]) {
            let model = &problem.model;
            problem.sd[model.of_point(place)].fill(0.0);
            let images = 2 * model.point_images.start[place]..2 * model.point_images.start[place + 1];
            problem.observation_sd[images].fill(f64::INFINITY);
        }
        for &photo in out.photos {
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

    /// What was known beforehand of the unknowns, with the given standard deviations.
    pub(super) fn terms<'a>(&'a self, sd: &'a [f64], values: &'a [f64]) -> Terms<'a> {
        let problem = &self.assembled.problem;
        Terms::new(&problem.model, values, &problem.prior, sd)
    }

    /// Whether a row takes part.
    pub(super) fn is_in(&self, row: Row) -> bool {
        match row {
            Row::Equation(equation) => self.assembled.problem.observation_sd[equation].is_finite(),
            Row::Unknown(unknown) => self.assembled.problem.is_weighted(unknown),
        }
    }

    pub(super) fn deviation(&self, suspect: &Suspect, row: (Row, usize)) -> f64 {
        suspects::deviation(&self.assembled.problem.model, suspect, row, (&self.observation_sd, &self.sd))
    }

    /// What leads from errors of unit weight of some rows of a suspect to their units.
    pub(super) fn units(&self, suspect: &Suspect, rows: &[(Row, usize)]) -> DMatrix<f64> {
        let model = &self.assembled.problem.model;
        if let (Subject::Observation(_), Home::Tie(tie)) = (suspect.subject, suspect.home) {
            let root = &model.observations[tie - model.tied_images()].root;
            let components: Vec<usize> = rows.iter().map(|&(_, component)| component).collect();
            return root.select_rows(&components).select_columns(&components);
        }
        let sd = rows.iter().map(|&row| self.deviation(suspect, row));
        DMatrix::from_diagonal(&DVector::from_iterator(rows.len(), sd))
    }
}
