//! Hypotheses: which error do the residuals show, and which error would remain undetected, and what would it change?
//!
//! The model l = A x + v is compared with l = A x + C d + v. For each hypothesis C d (one file per type) the statistic T, its estimate d, the
//! minimal detectable bias (MDB), and what an undetected error of that size does to the points: internal and external reliability
//! (Baarda 1968), for one observation and for an error that a whole set has in common.

mod attitudes;
mod cameras;
mod catalogue;
mod control;
mod effect;
mod form;
mod groups;
mod judged;
mod positions;
mod shutter;

use std::ops::ControlFlow;

use nalgebra::DVector;

pub use effect::Effect;
pub use judged::Judged;

use self::catalogue::Catalogue;
use self::effect::Sample;
use self::groups::single_errors;
use self::judged::Criteria;
use super::trial::Trial;
use super::{NetworkError, Subject};
use crate::Threads;
use crate::adjustment::{Leverages, Linearized, canonical_correlation};
use crate::geometry::{ObjectSpace, PoseNumbers};

/// What hypotheses need to know beside the network; nothing at all is possible for each.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    /// Velocity of each photo in the object space, per second or per any other unit of time; NaN if unknown.
    pub velocities: Vec<[f64; 3]>,
    /// Time of each photo, for a drift of positions; NaN if unknown.
    pub times: Vec<f64>,
    /// Set of positions (strip, day, receiver) of each photo.
    pub position_sets: Vec<Option<usize>>,
    /// Set of control (file, standard deviation, day) of each point.
    pub control_sets: Vec<Option<usize>>,
    /// For each camera the time of image coordinates x, y within the readout of the whole image, from -1/2 to 1/2: a x + b y + c.
    pub readouts: Vec<Option<[f64; 3]>>,
    /// Width of the image of each camera, in its unit; NaN if unknown.
    pub widths: Vec<f64>,
    /// Check points: their changes are reported.
    pub checks: Vec<usize>,
    /// Centre of scale, rotation and bending; the middle of the network if None.
    pub centre: Option<[f64; 3]>,
    /// Sum of squares and degrees of freedom if the unit weight is estimated; None if it is known.
    pub estimated: Option<(f64, f64)>,
    /// Significance level and power of the minimal detectable bias.
    pub detection: (f64, f64),
    /// Effects are counted from this number of standard deviations on.
    pub limit: f64,
    /// Number of groups whose effects are computed: those of the largest bias-to-noise ratios.
    pub effects: usize,
}

/// What a hypothesis is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// A group of observations, or one of its components.
    Group(Subject, Option<usize>),
    /// A set of the facts, or a camera; None for all.
    Set(Option<usize>),
}

/// An error that observations may have, tested and with its effect.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Code of the type: `control-heights`, `lever-arm`, `camera-f` ...
    pub code: &'static str,
    /// What it is about.
    pub about: About,
    /// Names of its parameters.
    pub parameters: Vec<&'static str>,
    /// Number of observations that depend on the parameters.
    pub observations: usize,
    /// Standard deviations of the parameters before the data are used; empty if unknown.
    pub plausible: Vec<f64>,
    /// Test and internal reliability, in the units of the parameters.
    pub judged: Judged,
    /// What an undetected error changes: one of the size of the MDB or, if there is none, of the plausible size. None if its bias-to-noise
    /// ratio excludes an effect above the limit.
    pub effect: Option<Effect>,
}

/// All hypotheses of an adjusted network.
#[derive(Debug, Clone)]
pub struct Hypotheses {
    /// Errors that sets have in common, then errors of groups and components.
    pub all: Vec<Hypothesis>,
    /// How many of them are errors of sets: the first ones.
    pub sets: usize,
    /// Correlation of the scores of two of these (the largest canonical one), row by row.
    pub correlations: Vec<f64>,
}

/// The errors of sets that are possible for a network.
fn catalogue<'a>(trial: &'a Trial, found: &Leverages, facts: &'a Facts) -> Catalogue<'a> {
    let mut catalogue = Catalogue::new(trial, found, facts);
    let (bundle, points) = (catalogue.bundle, catalogue.control_points(trial));
    control::add(&mut catalogue, &points);
    cameras::add(&mut catalogue, trial);
    // Poses that are made of several blocks, or are vectors, have no unknowns of their own that could be displaced.
    if bundle.mounts.is_empty() && matches!(bundle.poses, PoseNumbers::Angles(_)) {
        attitudes::add(&mut catalogue);
        if bundle.space == ObjectSpace::Rectangular {
            positions::add(&mut catalogue);
            form::add(&mut catalogue, &points);
            shutter::add(&mut catalogue, trial);
        }
    }
    catalogue
}

impl Trial {
    /// Tests all hypotheses of the catalogue at the adjusted values, and computes what an undetected error would change.
    ///
    /// Errors of sets are tested by their scores and solutions with one factor, errors of groups by the selected inverse; groups are those
    /// of [`super::Suspects`] except image observations, which [`Trial::tests`] has.
    ///
    /// # Errors
    /// Nothing was adjusted before; an interruption, no memory.
    pub fn hypotheses(&self, facts: &Facts, threads: &Threads) -> Result<Hypotheses, NetworkError> {
        let (found, problem) = (self.found()?, &self.assembled.problem);
        let go_on = &mut |_| ControlFlow::Continue(());
        let failed = |error| NetworkError::new(error, &self.assembled);
        let (values, held) = (found.values.clone(), found.held.clone());
        let linearized = Linearized::form(problem, None, values, held, threads, go_on).map_err(failed)?;
        let criteria = Criteria::new(facts);
        let sample = Sample::new(self, found, &linearized, &facts.checks);

        let catalogue = catalogue(self, found, facts);
        let sums = linearized.additional(problem, &catalogue, threads);
        let (mut all, mut columns, mut errors) = (vec![], vec![], vec![]);
        for cause in &catalogue.causes {
            let seen: Vec<usize> = (0..cause.columns.len())
                .filter(|&k| sums.squares[(cause.columns[k], cause.columns[k])] > 0.0)
                .collect();
            if seen.is_empty() {
                continue;
            }
            let own: Vec<usize> = seen.iter().map(|&k| cause.columns[k]).collect();
            let plausible: Vec<f64> = seen.iter().filter_map(|&k| cause.plausible.get(k).copied()).collect();
            let judged = Judged::new(
                &DVector::from_iterator(own.len(), own.iter().map(|&k| sums.score[k])),
                &sums.squares.select_rows(&own).select_columns(&own),
                &sums.redundancy.select_rows(&own).select_columns(&own),
                &plausible,
                &criteria,
            );
            let mut error = DVector::zeros(sums.score.len());
            own.iter().zip(judged.error.iter().flatten()).for_each(|(&k, &value)| error[k] = value);
            errors.push(error);
            all.push(Hypothesis {
                code: cause.code,
                about: About::Set(cause.set),
                parameters: seen.iter().map(|&k| cause.parameters[k]).collect(),
                observations: own.iter().map(|&k| sums.observations[k]).max().unwrap_or(0),
                plausible,
                judged,
                effect: None,
            });
            columns.push(own);
        }
        let changes = sample.changes(&catalogue, &sums.effects, &errors, threads);
        for (k, own) in all.iter_mut().enumerate().filter(|(_, own)| own.judged.error.is_some()) {
            own.effect = Some(sample.effect(&changes, k, &[], facts.limit));
        }
        let sets = all.len();
        let block = |i: &[usize], j: &[usize]| -> Vec<f64> {
            i.iter()
                .flat_map(|&i| j.iter().map(move |&j| (i, j)))
                .map(|place| sums.redundancy[place])
                .collect()
        };
        let correlation = |(i, j): (usize, usize)| {
            let (i, j): (&[usize], &[usize]) = (&columns[i], &columns[j]);
            canonical_correlation(&block(i, i), &block(j, j), &block(i, j))
        };
        let pairs = (0..sets).flat_map(|i| (0..sets).map(move |j| (i, j)));
        let correlations = pairs.map(correlation).collect();
        all.extend(single_errors(self, found, &linearized, &sample, (facts, &criteria), threads));
        Ok(Hypotheses { all, sets, correlations })
    }
}
