//! A second step with the same factor: the chord method (Kelley 1995, "Iterative Methods for Linear and Nonlinear Equations", chapter 5).
//!
//! Gauss-Newton steps leave out the second derivatives of the observations times their residuals. Where unknowns are determined well this is
//! nothing, and steps fall quadratically; where photos share cameras that are calibrated, combinations of these with attitudes, positions and
//! heights are determined weakly, and steps fall at last by a constant factor, 30 to 50 in practice. A chord step from the values reached,
//! N_k^-1 A^T l with A and l formed there, falls by as much as the next full step would: it needs no normal matrix but those of the local
//! blocks, and no new factor.

use std::time::Instant;

use super::equations::ObservationEquations;
use super::history::History;
use super::options::{Iteration, Phase};
use super::result::{AdjustError, unless_stopped};
use super::run::{Run, State, between};

impl<'a> Run<'a, '_> {
    /// The values that a step leads to, and a chord after it where that pays.
    pub(super) fn stepped(
        &mut self,
        state: &State<'a>,
        step: &[f64],
        iteration: &Iteration,
    ) -> Result<Vec<f64>, AdjustError> {
        self.chord = None;
        let (values, factor) = (self.problem.advanced(state.values(), step), &state.linearized.factor);
        if !(factor.has_cached() && self.is_for_chord(iteration)) {
            return Ok(values);
        }
        let (problem, start) = (self.problem, Instant::now());
        let at = self.threads.install(|| problem.model.at(&values));
        let equations = ObservationEquations::evaluated(problem, at, &self.datum, None);
        let prior = problem.prior_equations(&problem.terms(&values), &self.datum);
        let mut between = between(&mut *self.watch, Phase::Solve, problem.layout().locals());
        let chord = problem.system.chord(self.threads, factor, (&equations, &prior), &mut between);
        self.seconds.solve += start.elapsed().as_secs_f64();
        let (chord, decrease) = unless_stopped(chord)?;
        let change = decrease.sqrt();
        if !History::is_chord(change, iteration.largest_change) {
            return Ok(values);
        }
        self.chord = Some(change);
        Ok(problem.advanced(&values, &chord))
    }

    fn is_for_chord(&self, step: &Iteration) -> bool {
        step.damping == 0.0
            && self.options.loss.is_none()
            && self.problem.model.ends_slowly()
            && self.history().is_for_chord(step.largest_change)
    }

    /// What the steps so far say of the next.
    pub(super) fn history(&self) -> History<'_> {
        let unknowns = self.problem.layout().unknowns();
        History { iterations: &self.iterations, chord: self.chord, unknowns }
    }
}
