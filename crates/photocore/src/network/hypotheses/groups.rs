//! Errors of single groups of observations except images, and of their components: a control point or one of its coordinates, a distance, the
//! position of a photo.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::super::group_tests::TestOfRow;
use super::super::test_groups::TestKind;
use super::super::trial::Trial;
use super::catalogue::Catalogue;
use super::facts::Facts;
use super::hypothesis::{About, Hypothesis};
use super::judged::{Criteria, Judged};
use crate::adjustment::EquationOf;
use crate::{Threads, parallel};

/// Size of an error that is reported if no error of any size is detected, in standard deviations of its observation.
const LARGE: f64 = 1000.0;
/// Least number of groups of a thread.
const AT_LEAST: usize = 16;

/// A hypothesis on a group, or on one of its components.
pub(super) struct Single {
    pub hypothesis: Hypothesis,
    pub group: usize,
    /// The error whose effect is reported: equations of unit weight with their shares.
    pub error: Vec<(EquationOf, f64)>,
    /// Errors of unit weight in the units of the observations, by column.
    units: DMatrix<f64>,
}

impl Single {
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
pub(super) fn single_errors(trial: &Trial, criteria: &Criteria, threads: &Threads) -> Vec<Single> {
    let groups = &trial.groups;
    let first = groups.of_kind(TestKind::Image).end;
    let Ok(tests) = trial.tests_of(first..groups.len(), false, threads) else { return vec![] };
    let [rows, blocks] = [groups.row_starts()[first], groups.block_starts()[first]];
    let errors_of = |k: usize| {
        let rows = groups.row_starts()[first + k] - rows..groups.row_starts()[first + k + 1] - rows;
        let block = &tests.cofactors[groups.block_starts()[first + k] - blocks..][..rows.len().pow(2)];
        trial.errors_of(first + k, (&tests.rows[rows], block), criteria)
    };
    let part = |some: Range<usize>| -> Vec<Single> {
        some.filter(|&k| tests.groups[k].active).flat_map(errors_of).collect()
    };
    threads.install(|| parallel::by_parts(tests.groups.len(), AT_LEAST, &part))
}

/// The hypotheses whose effects are computed.
pub(super) fn worst(singles: &[Single], facts: &Facts) -> Vec<usize> {
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

fn code(kind: TestKind) -> &'static str {
    match kind {
        TestKind::Image => "image",
        TestKind::Control => "control-point",
        TestKind::Position => "position",
        TestKind::Attitude => "attitude",
        TestKind::Observation => "observation",
        TestKind::Camera => "camera",
        TestKind::Common => "unknown",
    }
}

impl Trial {
    /// The errors of a tested group: of all its components, then of each.
    fn errors_of(
        &self,
        group: usize,
        (tested, cofactors): (&[TestOfRow], &[f64]),
        criteria: &Criteria,
    ) -> Vec<Single> {
        let (size, id, rows) = (tested.len(), self.groups.ids()[group], self.groups.rows(group));
        let components = &self.groups.components()[rows];
        let residual = DVector::from_iterator(size, tested.iter().map(|row| row.residual));
        let active: Vec<usize> = (0..size).filter(|&k| !residual[k].is_nan()).collect();
        let redundancy = DMatrix::from_row_slice(size, size, cofactors);
        let mut sets = vec![(None, active.clone())];
        if active.len() > 1 {
            sets.extend(active.iter().map(|&k| (Some(components[k] as usize), vec![k])));
        }
        let of = |(component, rows): (Option<usize>, Vec<usize>)| {
            let score = residual.select_rows(&rows);
            let block = redundancy.select_rows(&rows).select_columns(&rows);
            // In unit weight C selects rows.
            let count = rows.len();
            let judged =
                Judged::new(&score, &DMatrix::identity(count, count), &block, &vec![LARGE; count], criteria);
            let equation = |row: usize| self.equation(self.groups.equations_of(group)[row]);
            let shares = rows.iter().zip(judged.error.iter().flatten());
            let error = shares.map(|(&row, &value)| (equation(row), value)).collect();
            let units = self.units(group, &rows);
            let hypothesis = Hypothesis {
                code: code(id.kind),
                about: About::Group(id, component),
                parameters: vec![],
                observations: count,
                plausible: vec![],
                judged: judged.in_units(&units),
                sd_between_photos: None,
                effect: None,
                at_checks: vec![],
            };
            Single { hypothesis, group, error, units }
        };
        sets.into_iter().map(of).collect()
    }

    /// The points of the network that the observations of a group belong to.
    pub(super) fn points_of(&self, group: usize) -> Vec<usize> {
        match self.groups.kind(group) {
            TestKind::Control => self.groups.point(group).into_iter().collect(),
            TestKind::Observation => {
                let own =
                    self.observation(group).map(|index| &self.assembled.problem.model.observations[index]);
                let touched = own.into_iter().flat_map(|own| &own.touches.points);
                touched.map(|&place| self.assembled.points[place]).collect()
            }
            _ => vec![],
        }
    }
}
