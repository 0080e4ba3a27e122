//! Errors of single groups of observations except images, and of their components: a control point or one of its coordinates, a distance, the
//! position of a photo.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::super::group_tests::Tested;
use super::super::suspects::{Home, Subject, Suspect};
use super::super::trial::Trial;
use super::catalogue::Catalogue;
use super::facts::Facts;
use super::hypothesis::{About, Hypothesis};
use super::judged::{Criteria, Judged};
use crate::adjustment::{EquationOf, Leverages};
use crate::{Threads, parallel};

/// Size of an error that is reported if no error of any size is detected, in standard deviations of its observation.
const LARGE: f64 = 1000.0;
/// Least number of groups of a thread.
const AT_LEAST: usize = 16;

/// A hypothesis on a group, or on one of its components.
pub(super) struct Single<'a> {
    pub hypothesis: Hypothesis,
    pub suspect: Suspect<'a>,
    /// The error whose effect is reported: equations of unit weight with their shares.
    pub error: Vec<(EquationOf, f64)>,
    /// Errors of unit weight in the units of the observations, by column.
    units: DMatrix<f64>,
}

impl Single<'_> {
    /// Adds the error to a catalogue, or an error of each component: their columns, with the shares of the error.
    pub fn add(&self, catalogue: &mut Catalogue<'_>, by_component: bool) -> Vec<(usize, f64)> {
        if !by_component {
            return vec![(catalogue.add_single(&self.error), 1.0)];
        }
        let mut add = |&(equation, share)| (catalogue.add_single(&[(equation, 1.0)]), share);
        self.error.iter().map(&mut add).collect()
    }

    /// Takes over changes of the check points by errors of unit weight of each component.
    pub fn compare(&mut self, changes: &DMatrix<f64>) {
        let back = self.units.clone().try_inverse();
        let changes = back.filter(|own| own.nrows() == changes.ncols()).map(|own| changes * own);
        self.hypothesis.at_checks = changes.map_or(vec![], |own| own.transpose().as_slice().to_vec());
    }
}

/// The errors of groups.
pub(super) fn single_errors<'a>(
    trial: &'a Trial,
    found: &Leverages,
    criteria: &Criteria,
    threads: &Threads,
) -> Vec<Single<'a>> {
    let Some(groups) = found.cofactors.groups.as_deref() else { return vec![] };
    let terms = trial.terms(&trial.assembled.problem.sd, &found.values);
    let is_single = |suspect: &Suspect<'_>| !matches!(suspect.subject, Subject::Image(_));
    let suspects: Vec<Suspect<'_>> = trial.suspects.all().filter(is_single).collect();
    let part = |some: Range<usize>| -> Vec<Single<'a>> {
        let tested = suspects[some].iter().filter_map(|&suspect| {
            let tested = trial.test(&suspect, (found, groups), &terms, None)?;
            Some(trial.errors_of(suspect, &tested, criteria))
        });
        tested.flatten().collect()
    };
    threads.install(|| parallel::by_parts(suspects.len(), AT_LEAST, &part))
}

/// The hypotheses whose effects are computed.
pub(super) fn worst(singles: &[Single<'_>], facts: &Facts) -> Vec<usize> {
    let ratio = |k: usize| singles[k].hypothesis.judged.bias_to_noise;
    let solved = (0..singles.len()).filter(|&k| is_whole(&singles[k].hypothesis) && ratio(k) > facts.limit);
    let mut solved: Vec<usize> = solved.collect();
    solved.sort_by(|&i, &j| ratio(j).total_cmp(&ratio(i)));
    solved.truncate(facts.effects);
    solved
}

/// Whether a hypothesis is on all components of its group: an error of one of them moves no more than the worst of these.
fn is_whole(own: &Hypothesis) -> bool {
    matches!(own.about, About::Group(_, None))
}

fn code(subject: Subject) -> &'static str {
    match subject {
        Subject::Image(_) => "image",
        Subject::Control(_) => "control-point",
        Subject::Position(_) => "position",
        Subject::Attitude(_) => "attitude",
        Subject::Observation(_) => "observation",
        Subject::Camera(_) => "camera",
        Subject::Common(_) => "unknown",
    }
}

impl Trial {
    /// The errors of a group: of all its components, then of each.
    fn errors_of<'a>(&self, suspect: Suspect<'a>, tested: &Tested, criteria: &Criteria) -> Vec<Single<'a>> {
        let size = suspect.rows.len();
        let active: Vec<usize> = (0..size).filter(|&k| !tested.residual[k].is_nan()).collect();
        let redundancy = DMatrix::from_row_slice(size, size, &tested.cofactors);
        let residual = DVector::from_column_slice(&tested.residual);
        let mut sets = vec![(None, active.clone())];
        if active.len() > 1 {
            sets.extend(active.iter().map(|&k| (Some(suspect.rows[k].1 as usize), vec![k])));
        }
        let of = |(component, rows): (Option<usize>, Vec<usize>)| {
            let score = residual.select_rows(&rows);
            let block = redundancy.select_rows(&rows).select_columns(&rows);
            // In unit weight C selects rows.
            let count = rows.len();
            let judged =
                Judged::new(&score, &DMatrix::identity(count, count), &block, &vec![LARGE; count], criteria);
            let shares = rows.iter().zip(judged.error.iter().flatten());
            let error = shares.map(|(&k, &value)| (self.equation(&suspect, k), value)).collect();
            let units = self.units(&suspect, &rows.iter().map(|&k| suspect.rows[k]).collect::<Vec<_>>());
            let hypothesis = Hypothesis {
                code: code(suspect.subject),
                about: About::Group(suspect.subject, component),
                parameters: vec![],
                observations: count,
                plausible: vec![],
                judged: judged.in_units(&units),
                sd_between_photos: None,
                effect: None,
                at_checks: vec![],
            };
            Single { hypothesis, suspect, error, units }
        };
        sets.into_iter().map(of).collect()
    }

    /// The equation of a row of a suspect that is no image of a local point.
    fn equation(&self, suspect: &Suspect<'_>, row: usize) -> EquationOf {
        let layout = self.assembled.problem.layout();
        let equation = suspect.rows[row].0 as usize;
        match (self.unknown_of(suspect.rows[row]), suspect.home) {
            (Some(unknown), _) => EquationOf::Unknown(unknown),
            (None, Home::Tie(tie)) => {
                let first = layout.groups() * layout.rows() + layout.tie_rows(tie).start;
                EquationOf::Tie { tie, row: equation - first }
            }
            (None, _) => {
                let local = if let Home::Group { point, .. } = suspect.home { point } else { 0 };
                EquationOf::Group { group: equation / layout.rows(), local, row: equation % layout.rows() }
            }
        }
    }

    /// The points of the network that the observations of a suspect belong to.
    pub(super) fn points_of(&self, suspect: &Suspect<'_>) -> Vec<usize> {
        match (suspect.subject, suspect.home) {
            (Subject::Control(point), _) => vec![point],
            (Subject::Observation(_), Home::Tie(tie)) => {
                let model = &self.assembled.problem.model;
                let touched = &model.observations[tie - model.tied_images()].touches.points;
                touched.iter().map(|&place| self.assembled.points[place]).collect()
            }
            _ => vec![],
        }
    }
}
