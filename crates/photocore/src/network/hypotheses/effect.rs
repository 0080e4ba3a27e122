//! External reliability: what an undetected error changes of the points.

use nalgebra::{DMatrix, DVector, Vector3};

use super::super::trial::Trial;
use super::facts::Facts;
use crate::Threads;
use crate::adjustment::{AdditionalParameters, Leverages, Linearized};
use crate::geometry::ObjectSpace;

/// Local points whose changes are computed; of more points, those at equal intervals.
const SAMPLE: usize = 2000;

/// What an error changes of the points, by the coordinate of each that changes by most standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Points that change by more standard deviations than the limit; of large networks estimated from 2,000 points.
    pub points: usize,
    /// Change in standard deviations that two points at least exceed or reach which the error does not belong to.
    pub others: f64,
    /// The largest change in standard deviations.
    pub ratio: f64,
    /// The point and the coordinate of this change; None if nothing changes.
    pub at: Option<(usize, usize)>,
    /// The largest change of a coordinate, in the unit of the object space (heights only if that is geographic).
    pub change: f64,
    /// Changes of the check points of the facts; NaN for points that do not take part.
    pub checks: Vec<[f64; 3]>,
}

/// Points whose changes are computed.
pub(super) struct Sample<'a> {
    trial: &'a Trial,
    /// Local points of the model, each of which stands for `share` of them.
    locals: Vec<usize>,
    /// How many of them are counted, the first ones.
    counted: usize,
    share: f64,
    /// The point of the network and its standard deviations (a priori unit weight): local ones, then all others.
    points: Vec<(usize, Vector3<f64>)>,
    /// Where the check points are among these.
    checks: Vec<Option<usize>>,
    facts: &'a Facts,
}

/// Changes of unknowns by errors, a column per error.
pub(super) struct Changes {
    locals: Vec<DMatrix<f64>>,
    others: DMatrix<f64>,
}

impl<'a> Sample<'a> {
    pub fn new(trial: &'a Trial, found: &Leverages, facts: &'a Facts) -> Self {
        let (model, points) = (&trial.assembled.problem.model, &trial.assembled.points);
        let stride = model.locals.div_ceil(SAMPLE).max(1);
        let mut locals: Vec<usize> = (0..model.locals).step_by(stride).collect();
        let interval = locals.len().max(1);
        let places = facts.checks.iter().map(|&point| trial.place.get(point).copied().flatten());
        let places: Vec<Option<usize>> = places.collect();
        // Behind the others, which alone are counted.
        locals.extend(places.iter().flatten().filter(|&&place| place < model.locals));
        let of = |place: usize| {
            let q = trial.cofactors_of_point(found, place);
            (points[place], Vector3::from_fn(|k, _| q[(k, k)].max(0.0).sqrt()))
        };
        let share = model.locals as f64 / interval as f64;
        let find = |place: Option<usize>| {
            let place = place?;
            let behind = (place >= model.locals).then(|| locals.len() + place - model.locals);
            behind.or_else(|| (interval..locals.len()).find(|&k| locals[k] == place))
        };
        let checks = places.into_iter().map(find).collect();
        let points = locals.iter().copied().chain(model.locals..points.len()).map(of).collect();
        Self { trial, locals, counted: interval, share, points, checks, facts }
    }

    /// Changes by errors of parameters whose effects on unknowns that are not local are known.
    pub fn changes(
        &self,
        linearized: &Linearized,
        parameters: &dyn AdditionalParameters,
        effects: &DMatrix<f64>,
        errors: &[DVector<f64>],
        threads: &Threads,
    ) -> Changes {
        if errors.is_empty() {
            return Changes { locals: vec![], others: DMatrix::zeros(0, 0) };
        }
        let errors = DMatrix::from_columns(errors);
        let others = effects * &errors;
        let problem = &self.trial.assembled.problem;
        let parts = (others.as_view(), &errors);
        let locals = linearized.changes_of_locals(problem, parameters, parts, &self.locals, threads);
        Changes { locals, others }
    }

    /// Changes of the check points by a unit of each of the first parameters: three rows per point, NaN for points that do not take part.
    pub fn at_checks(
        &self,
        linearized: &Linearized,
        parameters: &dyn AdditionalParameters,
        effects: &DMatrix<f64>,
        count: usize,
        threads: &Threads,
    ) -> DMatrix<f64> {
        // Behind the check points are points whose changes are only reported.
        let checks = &self.checks[..self.facts.compared.min(self.checks.len())];
        let mut found = DMatrix::from_element(3 * checks.len(), count, f64::NAN);
        let (errors, first) = (DMatrix::identity(effects.ncols(), count), self.locals.len());
        let others = effects.columns(0, count);
        let model = &self.trial.assembled.problem.model;
        let mut locals = vec![];
        for (check, index) in checks.iter().enumerate().filter_map(|(check, at)| Some((check, (*at)?))) {
            match index.checked_sub(first) {
                None => locals.push((3 * check, self.locals[index])),
                Some(behind) => {
                    let place = model.of_point(model.locals + behind).start - 3 * model.locals;
                    found.rows_mut(3 * check, 3).copy_from(&others.rows(place, 3));
                }
            }
        }
        let (rows, places): (Vec<usize>, Vec<usize>) = locals.into_iter().unzip();
        let problem = &self.trial.assembled.problem;
        let parts = (others, &errors);
        let changes = linearized.changes_of_locals(problem, parameters, parts, &places, threads);
        rows.iter().zip(changes).for_each(|(&row, own)| found.rows_mut(row, 3).copy_from(&own.rows(0, 3)));
        found
    }

    /// The effect of one of these errors; `own` are the points that it belongs to, ascending.
    pub fn effect(&self, changes: &Changes, error: usize, own: &[usize]) -> Effect {
        let limit = self.facts.limit;
        let model = &self.trial.assembled.problem.model;
        let is_geographic = matches!(model.space, ObjectSpace::Geographic(_));
        let first_other = 3 * model.locals;
        let change = |index: usize, axis: usize| match index.checked_sub(self.locals.len()) {
            None => changes.locals[index][(axis, error)],
            Some(behind) => {
                let place = model.of_point(model.locals + behind).start - first_other;
                changes.others[(place + axis, error)]
            }
        };
        let at_check = |at: &Option<usize>| {
            at.map_or([f64::NAN; 3], |index| std::array::from_fn(|axis| change(index, axis)))
        };
        let checks: Vec<[f64; 3]> = self.checks.iter().map(at_check).collect();
        let mut effect = Effect { points: 0, others: 0.0, ratio: 0.0, at: None, change: 0.0, checks };
        let (mut points, mut most) = (0.0, 0.0);
        let retained = self.locals.len()..self.points.len();
        for index in (0..self.counted).chain(retained) {
            let (point, sd) = self.points[index];
            let mut largest = 0.0;
            for axis in 0..3 {
                let size = change(index, axis).abs();
                let ratio = if sd[axis] > 0.0 { size / sd[axis] } else { 0.0 };
                if ratio > effect.ratio {
                    (effect.ratio, effect.at) = (ratio, Some((point, axis)));
                }
                largest = f64::max(largest, ratio);
                if axis == 2 || !is_geographic {
                    effect.change = effect.change.max(size);
                }
            }
            if largest > limit {
                points += if index < self.counted { self.share } else { 1.0 };
            }
            if own.binary_search(&point).is_err() {
                // The second largest one.
                effect.others = effect.others.max(largest.min(most));
                most = most.max(largest);
            }
        }
        effect.points = points.round() as usize;
        effect
    }
}
