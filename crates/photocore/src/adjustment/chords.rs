//! Chords one after the other with one factor, each corrected by those before: where full steps swing or creep, near the end.
//!
//! With the factor N = L L^T of the last normal equations a chord from any values is p = N^-1 A^T l, A and l formed there: it is found from
//! y = L^-1 A^T l, and y^T y' is p^T N p'. What chords have shown ([`super::secants`]) therefore costs no pass over the observations. They fall
//! slowly because of what all of them leave out, and not because the factor is that of other values: a new one would not help.

use std::time::Instant;

use nalgebra::DMatrix;

use super::damped::ROUNDING;
use super::equations::ObservationEquations;
use super::options::{Iteration, NEGLIGIBLE, Phase, Stop};
use super::result::{AdjustError, unless_stopped};
use super::run::{Run, State, between};
use super::secants::Secants;
use crate::normals::dot;

/// Steps that change the unknowns by less than this multiple of their standard deviations leave the normal equations as they are; from farther
/// away chords lead higher.
const CLOSE: f64 = 0.5;
/// So many chords follow a step at the most, and are remembered;
const MOST: usize = 40;
/// so many leave this part of the first of them at the most: else normal equations of other values do better.
const LONG: usize = 10;
const FALL: f64 = 0.5;

/// Values with the chord from there.
struct Chord {
    values: Vec<f64>,
    sum_of_squares: f64,
    step: Vec<f64>,
    /// y = L^-1 A^T l, and its length.
    reduced: Vec<f64>,
    change: f64,
}

impl<'a> Run<'a, '_> {
    /// Whether a full step is followed by chords until these have led to the solution: where steps have shown that they do not fall.
    pub(super) fn is_followed(&self, state: &State<'a>, step: &Iteration) -> bool {
        step.damping == 0.0
            && step.largest_change < CLOSE
            && self.options.loss.is_none()
            && self.problem.model.steps_swing()
            && state.linearized.factor.has_cached()
            && (self.chord.is_some() || self.secants.correct() || self.is_slow(step))
    }

    /// The lowest values that chords lead to, the first of them from those given, and the length of the chord there; None where the first
    /// would begin higher than `best`.
    pub(super) fn followed(
        &mut self,
        state: &State<'a>,
        values: Vec<f64>,
        (best, stop): (f64, Stop),
    ) -> Result<Option<(Vec<f64>, f64)>, AdjustError> {
        let start = Instant::now();
        let (mut secants, mut differences) = (Secants::default(), Vec::<Vec<f64>>::new());
        let mut here = self.chord_at(state, values)?;
        if here.is_higher_than(best) {
            return Ok(None);
        }
        let (mut end, mut lowest) = ((here.values.clone(), here.change), here.sum_of_squares);
        let mut lengths = vec![here.change];
        while lengths.len() < MOST && falls(&lengths) && !is_enough(stop, &here) {
            let taken = here.corrected(&secants, &differences);
            let next = self.chord_at(state, self.problem.advanced(&here.values, &taken))?;
            // What a chord learns may lead higher before it leads lower: by no more than the last was to lower.
            if next.is_higher_than(lowest + here.change.powi(2)) {
                break;
            }
            if !next.is_higher_than(lowest) {
                (end, lowest) = ((next.values.clone(), next.change), lowest.min(next.sum_of_squares));
            }
            secants.keep(taken, minus(&next.step, &here.step), MOST);
            differences.push(minus(&next.reduced, &here.reduced));
            lengths.push(next.change);
            here = next;
        }
        self.seconds.solve += start.elapsed().as_secs_f64();
        Ok(Some(end))
    }

    /// The chord from given values.
    fn chord_at(&mut self, state: &State<'a>, values: Vec<f64>) -> Result<Chord, AdjustError> {
        let (problem, factor) = (self.problem, &state.linearized.factor);
        let at = self.threads.install(|| problem.model.at(&values));
        let sum_of_squares = self.objective_at(&values, &*at);
        let equations = ObservationEquations::evaluated(problem, at, &self.datum, None);
        let prior = problem.prior_equations(&problem.terms(&values), &self.datum);
        let (of, system) = ((&equations as _, &prior), &problem.system);
        let mut between = between(&mut *self.watch, Phase::Solve, problem.layout().locals());
        let found = system.reduce_chord(self.threads, factor, of, &prior.right, &mut between);
        let found = unless_stopped(found)?;
        let (reduced, change) = (found.reduced(), found.products[0].sqrt());
        let step = system.solve_reduced_rights(self.threads, factor, of, found, &[], &mut between);
        Ok(Chord { values, sum_of_squares, step: unless_stopped(step)?, reduced, change })
    }
}

impl Chord {
    /// Corrected by what those before have shown: by how much y was another after each.
    fn corrected(&self, secants: &Secants, differences: &[Vec<f64>]) -> Vec<f64> {
        if !secants.correct() {
            return self.step.clone();
        }
        let row = |k: usize| if k == 0 { &self.reduced } else { &differences[k - 1] };
        let count = differences.len() + 1;
        let shares = secants.shares(&DMatrix::from_fn(count, count, |i, j| dot(row(i), row(j))));
        shares.map_or_else(|| self.step.clone(), |shares| secants.corrected(&self.step, &shares))
    }

    /// Whether it begins higher than a sum of squares, rounding apart, which is more than the square of a chord that is negligible; also
    /// where something is not a number.
    fn is_higher_than(&self, sum_of_squares: f64) -> bool {
        let highest = sum_of_squares * (1.0 + ROUNDING);
        !(self.sum_of_squares <= highest || self.change <= NEGLIGIBLE && self.sum_of_squares.is_finite())
            || !self.change.is_finite()
    }
}

/// Whether full steps would end where a chord is as short.
fn is_enough(stop: Stop, chord: &Chord) -> bool {
    stop.at_change(chord.change) || stop.at_decrease(chord.change.powi(2), chord.sum_of_squares)
}

/// Whether chords of these lengths go on to fall.
fn falls(lengths: &[f64]) -> bool {
    let before = lengths.len().checked_sub(LONG + 1).map(|first| lengths[first]);
    before.is_none_or(|before| lengths[lengths.len() - 1] < FALL * before)
}

/// How far some numbers are from others.
fn minus(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}
