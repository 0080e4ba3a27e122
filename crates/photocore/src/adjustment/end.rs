//! Ends of the iterations.

use std::ops::ControlFlow;

use super::control::{Control, MOST_DAMPING, SHORT};
use super::options::Status;
use super::result::AdjustError;
use super::run::{End, Iterate, Next, Run};
use crate::Iteration;

/// Maximum change, in standard deviations, of a full step that confirms the convergence of damped steps.
const CONFIRMED: f64 = 1e-2;
/// Minimum change of an unknown in a weak combination: multiple of the overall change, scaled by the unknown's own equations.
const WEAK: f64 = 10.0;

impl<'a> Run<'a, '_> {
    /// Ends at the current values without another step. Cofactors belong to the reweighted equations without second-order term, because
    /// their weights can be reported.
    pub(super) fn stay(&mut self, state: Iterate<'a>, status: Status) -> Result<End<'a>, AdjustError> {
        let plain = state.linearized.factor.damping == 0.0 && !state.linearized.is_curved();
        self.curved = false;
        let state = if plain { state } else { self.form(state.recycle(), 0.0)? };
        let Some(error) = state.linearized.undetermined() else { return Ok(End::with(status, state)) };
        let status = if status == Status::Converged { status } else { Status::Diverged };
        Ok(End { undetermined: Some(error), ..End::at(status, state.recycle()) })
    }

    /// Ends with a full step. Cofactors refer to the equations before it, unless these contain the second-order term of a loss.
    pub(super) fn end_after(
        &mut self,
        state: Iterate<'a>,
        step: Vec<f64>,
        last: Iteration,
    ) -> Result<End<'a>, AdjustError> {
        if !state.linearized.is_curved() {
            return Ok(End::after(Status::Converged, state, step, last));
        }
        let values = self.problem.advanced(state.values(), &step);
        let before = state.recycle();
        let sum_of_squares = self.objective(&values);
        self.accept(Iteration { sum_of_squares, ..last }, &before, &values)?;
        self.curved = false;
        let state = self.form(values, 0.0)?;
        self.stay(state, Status::Converged)
    }

    /// Ends at the values before a failed step, because steps no longer lower the sum of squares. Stores the unknowns that failed full steps
    /// move most.
    pub(super) fn end_at_best(&mut self, before: Vec<f64>, control: &mut Control) -> Next<'a> {
        if let Some((_, moved)) = control.refused.take().filter(|_| !control.always()) {
            self.weak = moved;
        }
        self.rest(before, Status::Converged, false, control).map(ControlFlow::Break)
    }

    /// Ends without convergence.
    pub(super) fn exhausted(&mut self, state: Iterate<'a>, control: Control) -> Result<End<'a>, AdjustError> {
        let diverged = state.linearized.factor.damping > MOST_DAMPING;
        let status = if diverged { Status::Diverged } else { Status::NotConverged };
        if control.always() {
            return self.rest(state.recycle(), status, !diverged, &control);
        }
        if let Some((_, moved)) = control.refused.filter(|_| control.in_valley && !diverged) {
            self.weak = moved;
        }
        self.stay(state, status)
    }

    /// Ends at given values, with undamped equations for the cofactors.
    ///
    /// * `moving`: whether steps still change these values.
    pub(super) fn rest(
        &mut self,
        unknowns: Vec<f64>,
        status: Status,
        moving: bool,
        control: &Control,
    ) -> Result<End<'a>, AdjustError> {
        self.curved = false;
        if !control.always() {
            let state = self.form(unknowns, 0.0)?;
            return self.stay(state, status);
        }
        if self.datum.is_empty() {
            self.datum = self.problem.to_hold(&unknowns, self.context.threads);
        }
        let last = self.iterations.last();
        let in_valley = moving && last.is_some_and(|last| last.largest_change <= SHORT);
        let unconfirmed = control.failures > 0 && status == Status::Converged && self.weak.is_empty();
        if !(self.options.covariance || in_valley || unconfirmed) {
            return Ok(End::at(status, unknowns));
        }
        let state = self.form(unknowns, 0.0)?;
        let status = match in_valley || unconfirmed {
            true => self.confirmed(&state, status, (in_valley, unconfirmed))?,
            false => status,
        };
        if !self.options.covariance {
            return Ok(End::at(status, state.recycle()));
        }
        Ok(End { status, ..self.stay(state, status)? })
    }

    /// Returns the status of damped steps after a full step with a datum.
    ///
    /// If the iterations have ended in a valley, it stores the retained unknowns that this step moves much more than the observations
    /// justify (empty if only local ones move so). If full steps failed before, it must be short.
    fn confirmed(
        &mut self,
        state: &Iterate<'a>,
        status: Status,
        (in_valley, unconfirmed): (bool, bool),
    ) -> Result<Status, AdjustError> {
        let failed = if unconfirmed { Status::NotConverged } else { status };
        let Some(step) = self.step(state)? else { return Ok(failed) };
        let (change, factor) = (state.linearized.change(), &state.linearized.factor);
        let weak = in_valley && factor.largest_share(&step) > WEAK * change;
        let fails = !weak && unconfirmed && change > CONFIRMED;
        if weak || fails {
            self.weak = state.moved(&step);
        }
        Ok(if fails { failed } else { status })
    }
}
