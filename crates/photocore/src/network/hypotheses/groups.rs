//! Errors of single groups of observations except images, and of their components: a control point or one of its coordinates, a distance, the
//! position of a photo.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::super::suspects::{Home, Row, Subject, Suspect};
use super::super::trial::Trial;
use super::effect::Sample;
use super::facts::Facts;
use super::hypothesis::{About, Hypothesis};
use super::judged::{Criteria, Judged};
use crate::Threads;
use crate::adjustment::{AdditionalParameters, Equation, EquationOf, Leverages, Linearized, Shared};
use crate::normals::Layout;

/// Size of an error that is reported if no error of any size is detected, in standard deviations of its observation.
const LARGE: f64 = 1000.0;

/// An error of unit weight: equations with their shares of it.
type Error = Vec<(EquationOf, f64)>;

/// The errors of groups; `linearized` is at the adjusted values.
pub(super) fn single_errors(
    trial: &Trial,
    found: &Leverages,
    linearized: &Linearized,
    sample: &Sample<'_>,
    (facts, criteria): (&Facts, &Criteria),
    threads: &Threads,
) -> Vec<Hypothesis> {
    let Some(groups) = found.cofactors.groups.as_ref() else { return vec![] };
    let terms = trial.terms(&trial.assembled.problem.sd, &found.values);
    let (mut all, mut errors) = (vec![], vec![]);
    let suspects = trial.suspects.all.iter();
    for suspect in suspects.filter(|suspect| !matches!(suspect.subject, Subject::Image(_))) {
        let Some(tested) = trial.test(suspect, found, groups, &terms) else { continue };
        let size = suspect.rows.len();
        let active: Vec<usize> = (0..size).filter(|&k| !tested.residual[k].is_nan()).collect();
        let redundancy = DMatrix::from_row_slice(size, size, &tested.cofactors);
        let residual = DVector::from_column_slice(&tested.residual);
        let mut sets = vec![(None, active.clone())];
        if active.len() > 1 {
            sets.extend(active.iter().map(|&k| (Some(suspect.rows[k].1), vec![k])));
        }
        for (component, rows) in sets {
            let score = residual.select_rows(&rows);
            let block = redundancy.select_rows(&rows).select_columns(&rows);
            // In unit weight C selects rows.
            let count = rows.len();
            let judged =
                Judged::new(&score, &DMatrix::identity(count, count), &block, &vec![LARGE; count], criteria);
            let unit = judged.error.clone().unwrap_or_default();
            let shares = rows.iter().zip(&unit).map(|(&k, &value)| (trial.equation(suspect, k), value));
            errors.push((trial.points_of(suspect), shares.collect::<Error>()));
            let units = trial.units(suspect, &rows.iter().map(|&k| suspect.rows[k]).collect::<Vec<_>>());
            all.push(Hypothesis {
                code: code(suspect.subject),
                about: About::Group(suspect.subject, component),
                parameters: vec![],
                observations: rows.len(),
                plausible: vec![],
                judged: judged.in_units(&units),
                effect: None,
            });
        }
    }
    let mut solved: Vec<usize> =
        (0..all.len()).filter(|&k| is_whole(&all[k]) && all[k].judged.bias_to_noise > facts.limit).collect();
    solved.sort_by(|&i, &j| all[j].judged.bias_to_noise.total_cmp(&all[i].judged.bias_to_noise));
    solved.truncate(facts.effects);
    let columns = UnitErrors::new(solved.iter().map(|&k| &errors[k].1), trial.assembled.problem.layout());
    let problem = &trial.assembled.problem;
    let sums = linearized.additional(problem, &columns, threads);
    let count = solved.len();
    let units: Vec<DVector<f64>> =
        (0..count).map(|k| DVector::from_fn(count, |i, _| f64::from(u8::from(i == k)))).collect();
    let changes = sample.changes(&columns, &sums.effects, &units, threads);
    for (column, &k) in solved.iter().enumerate() {
        all[k].effect = Some(sample.effect(&changes, column, &errors[k].0, facts.limit));
    }
    all
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

/// Errors of some equations, a column each.
struct UnitErrors {
    count: usize,
    locals: Vec<usize>,
    columns: HashMap<EquationOf, Vec<(usize, f64)>>,
}

impl UnitErrors {
    fn new<'e>(errors: impl Iterator<Item = &'e Error>, layout: &Layout) -> Self {
        let (mut count, mut columns): (usize, HashMap<EquationOf, Vec<(usize, f64)>>) = (0, HashMap::new());
        for error in errors {
            for &(of, value) in error {
                columns.entry(of).or_default().push((count, value));
            }
            count += 1;
        }
        let of = |of: &EquationOf| match *of {
            EquationOf::Unknown(unknown) => Some(unknown / 3).filter(|&local| local < layout.locals()),
            EquationOf::Group { local, .. } => Some(local),
            EquationOf::Tie { tie, .. } => layout.ties()[tie].local.map(|local| local as usize),
        };
        let mut locals: Vec<usize> = columns.keys().filter_map(of).collect();
        locals.sort_unstable();
        locals.dedup();
        Self { count, locals, columns }
    }
}

impl AdditionalParameters for UnitErrors {
    fn count(&self) -> usize {
        self.count
    }

    fn locals(&self) -> Option<Vec<usize>> {
        Some(self.locals.clone())
    }

    fn partials(&self, equation: &Equation<'_>, _: &mut Shared, partials: &mut Vec<(usize, f64)>) {
        partials.extend(self.columns.get(&equation.of).into_iter().flatten());
    }
}

impl Trial {
    /// The equation of a row of a suspect that is no image of a local point.
    fn equation(&self, suspect: &Suspect, row: usize) -> EquationOf {
        let layout = self.assembled.problem.layout();
        match (suspect.rows[row].0, suspect.home) {
            (Row::Unknown(unknown), _) => EquationOf::Unknown(unknown),
            (Row::Equation(equation), Home::Tie(tie)) => {
                let first = layout.groups() * layout.rows() + layout.tie_rows(tie).start;
                EquationOf::Tie { tie, row: equation - first }
            }
            (Row::Equation(equation), _) => {
                let local = if let Home::Group { point, .. } = suspect.home { point } else { 0 };
                EquationOf::Group { group: equation / layout.rows(), local, row: equation % layout.rows() }
            }
        }
    }

    /// The points of the network that the observations of a suspect belong to.
    fn points_of(&self, suspect: &Suspect) -> Vec<usize> {
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
