//! Models, and problems: a model with everything that is known beforehand.

use super::term::{Term, is_weighted};
use crate::normals::{GroupRows, Layout, LayoutError, System, TieRows};

/// How observations follow from unknowns.
pub trait Model: Sync {
    /// The model at the given unknowns (in the order of the layout): what several observations share is computed once. Called on a thread of
    /// the threads, as is [`Model::relocate`].
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a>;

    /// Applies a step to the unknowns. By default it is added; a model whose unknowns are not the numbers that the columns of its partials
    /// belong to (an attitude that is kept in angles and steps by a rotation) says here what a step makes of them.
    fn advance(&self, unknowns: &mut [f64], step: &[f64]) {
        unknowns.iter_mut().zip(step).for_each(|(x, dx)| *x += dx);
    }

    /// The step that leads from some values of the unknowns to others: by default their differences (see [`Model::advance`]).
    fn step_between(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        to.iter().zip(from).map(|(to, from)| to - from).collect()
    }

    /// What was known beforehand of unknowns that were observed together, or to which steps are not added (see [`Model::advance`]), at the
    /// given values, in ascending order. `prior` and `sd` are those of the problem. All other weighted unknowns have terms of one unknown.
    fn terms(&self, _values: &[f64], _prior: &[f64], _sd: &[f64]) -> Vec<Term> {
        vec![]
    }

    /// Computes the local unknowns afresh from the others, where the model knows how; false where it does not. Far from the
    /// solution this often leads back into the region where linearized steps do.
    fn relocate(&self, _unknowns: &mut [f64]) -> bool {
        false
    }

    /// How many groups touch other blocks at given values than the layout has: what is not there is left out of their equations. Iterations end
    /// where these are more than a few, or steps short, and whoever made the layout makes another.
    fn outgrown(&self, _unknowns: &[f64]) -> usize {
        0
    }

    /// Whether the last steps fall by a constant factor only, because second derivatives times residuals count where unknowns are determined
    /// weakly: a chord then pays (see [`super::Method::Damped`]).
    fn ends_slowly(&self) -> bool {
        false
    }

    /// Whether combinations of unknowns are held by so little that full steps may swing across the solution, or creep: they are then corrected
    /// by those before, and shortened where they lead higher.
    fn steps_swing(&self) -> bool {
        false
    }

    /// Motions of the whole that observations and weights may leave open at the given values. Which of them they do leave open is found by
    /// trying, and as many unknowns are held; None where it is known that they give a datum, which then costs nothing.
    fn motions(&self, _unknowns: &[f64]) -> Option<Motions> {
        None
    }

    /// Whether what is observed of groups is known to leave all motions open, where none of the unknowns is fixed. Some groups are then
    /// looked at for all.
    fn groups_leave_open(&self) -> bool {
        false
    }

    /// Its motions whether or not observations and weights give a datum.
    fn all_motions(&self, unknowns: &[f64]) -> Option<Motions> {
        self.motions(unknowns)
    }

    /// Moves the unknowns by amounts of its motions, which need not be small. By default along their vectors, which is exact where the
    /// motions are linear in the unknowns.
    fn move_along(&self, unknowns: &mut [f64], amounts: &[f64]) {
        let Some(motions) = self.motions(unknowns) else { return };
        let mut step = vec![0.0; unknowns.len()];
        for (vector, amount) in motions.vectors.iter().zip(amounts) {
            step.iter_mut().zip(vector).for_each(|(x, g)| *x += amount * g);
        }
        self.advance(unknowns, &step);
    }
}

/// A [`Model`] at given values of the unknowns.
pub trait Evaluated: Send + Sync {
    /// Writes observed minus computed, and the partials of the computed values, of one group of observations of a local
    /// block, in the units of observations and unknowns.
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>);

    /// Writes what [`Evaluated::observe`] does of one group each of several local blocks, one after the other, in unit weight: `groups` says
    /// which, `sd` are the standard deviations of all observations. All have the same main block, and as much in common with others. False
    /// where the model has no way for them together.
    fn observe_alike(
        &self,
        _locals: &[u32],
        _groups: &[u32],
        _sd: &[f64],
        _rows: &mut GroupRows<'_>,
    ) -> bool {
        false
    }

    /// Writes observed minus computed alone, as [`Evaluated::observe`] does; false where the model does not know how.
    fn misclose(&self, _local: usize, _group: usize, _constant: &mut [f64]) -> bool {
        false
    }

    /// What [`Evaluated::observe`] writes, of the observations of a tie. Not called where the layout has no ties.
    fn observe_tie(&self, _tie: usize, _rows: &mut TieRows<'_>) {}

    /// Local blocks that the iterations have led to where they harm all others: what they say of one retained block is so much more than
    /// all others say together that rounding takes what these say; and those that are on their way there. Asked after every damped
    /// step, with the unknowns before it.
    fn collapsed(&self, _before: &[f64]) -> Vec<usize> {
        vec![]
    }

    /// Local blocks that nothing keeps from leaving for infinity, and that are on their way there: what little they lower the sum of squares by
    /// would take all iterations. Asked in a trust region after a short step, with the unknowns before it.
    fn run_off(&self, _before: &[f64]) -> Vec<usize> {
        vec![]
    }

    /// What motions make of observed minus computed of a tie, in unit weight, where that is a displacement in the space that moves: the number of
    /// the first of the motions that can move it, then a row for each equation. A displacement turns and grows with everything else; that
    /// changes the equations, but not what they sum up to where all directions weigh the same, and it tells nothing of the motion where
    /// they do not.
    fn carried(&self, _tie: usize) -> Option<(usize, Vec<[f64; 7]>)> {
        None
    }
}

/// Motions of a network as a whole, which its observations may leave open.
#[derive(Debug, Clone)]
pub struct Motions {
    /// How each moves the unknowns, by a small amount: vectors of their length, in the units of the columns of the partials (see
    /// [`Model::advance`]).
    pub vectors: Vec<Vec<f64>>,
    /// The unknowns that had best be held for a datum, the best first. Those that others hold already are passed over.
    pub preferred: Vec<usize>,
}

/// A model with everything that is known beforehand.
#[derive(Debug)]
pub struct Problem<M: ?Sized> {
    /// The unknowns and groups, ordered.
    pub system: System,
    /// Standard deviation of each observation, in the order of groups and rows, then of ties and rows; infinite to exclude it.
    pub observation_sd: Vec<f64>,
    /// Initial value of each unknown.
    pub initial: Vec<f64>,
    /// Observed value of each unknown whose standard deviation is finite.
    pub prior: Vec<f64>,
    /// Standard deviation of each unknown: infinite when free, zero when fixed.
    pub sd: Vec<f64>,
    /// How observations follow from unknowns.
    pub model: M,
}

/// A problem of whatever model: what is done with problems is compiled once for all of them, and a reference to one of a model is one to this.
pub type AnyProblem<'m> = Problem<dyn Model + 'm>;

impl<M: ?Sized> Problem<M> {
    /// The unknowns and groups.
    pub fn layout(&self) -> &Layout {
        self.system.layout()
    }

    /// Which unknowns are fixed, or held beside those.
    pub(super) fn fixed(&self, held: &[usize]) -> Vec<bool> {
        let mut fixed: Vec<bool> = self.sd.iter().map(|&sd| sd == 0.0).collect();
        held.iter().for_each(|&unknown| fixed[unknown] = true);
        fixed
    }

    /// Whether an unknown counts as an observation: neither free nor fixed.
    pub fn is_weighted(&self, unknown: usize) -> bool {
        is_weighted(self.sd[unknown])
    }
}

impl<M: Model> Problem<M> {
    /// The problem, whatever its model.
    pub fn any(&self) -> &AnyProblem<'_> {
        self
    }
}

impl AnyProblem<'_> {
    /// An error unless all lengths, and that of given values of the unknowns, are those of the layout.
    pub(super) fn check_lengths(&self, values: &[f64]) -> Result<(), LayoutError> {
        let (equations, unknowns) = (self.layout().equations(), self.layout().unknowns());
        LayoutError::unless_of_length("Problem::observation_sd", self.observation_sd.len(), equations)?;
        LayoutError::unless_of_length("Problem::initial", self.initial.len(), unknowns)?;
        LayoutError::unless_of_length("Problem::prior", self.prior.len(), unknowns)?;
        LayoutError::unless_of_length("Problem::sd", self.sd.len(), unknowns)?;
        LayoutError::unless_of_length("values", values.len(), unknowns)
    }

    /// The unknowns after a step.
    pub(super) fn advanced(&self, unknowns: &[f64], step: &[f64]) -> Vec<f64> {
        let mut values = unknowns.to_vec();
        self.model.advance(&mut values, step);
        values
    }
}
