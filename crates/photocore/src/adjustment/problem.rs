//! Models, and problems: a model with its priors and standard deviations.

use std::sync::Arc;

use super::prior_terms::{PriorTerms, is_weighted};
use crate::normals::{GroupRows, Layout, LayoutError, System};

/// Functional model: computes observations from unknowns.
pub trait Model: Sync {
    /// Evaluates the model at the given unknowns (in the order of the layout); values shared by several observations are computed once.
    /// Called from a worker thread, as is [`Model::relocate`].
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a>;

    /// Applies a step to the unknowns; adds it by default. Override it if unknowns and columns of the partials differ, as for an attitude
    /// in angles with a rotation vector as step.
    fn advance(&self, unknowns: &mut [f64], step: &[f64]) {
        unknowns.iter_mut().zip(step).for_each(|(x, dx)| *x += dx);
    }

    /// Returns the step between two sets of unknowns: by default their difference (see [`Model::advance`]).
    fn step_between(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        to.iter().zip(from).map(|(to, from)| to - from).collect()
    }

    /// Returns the prior terms of correlated unknowns, or of unknowns with a special [`Model::advance`], at the given values. `prior` and
    /// `sd` are the arrays of the problem. All other weighted unknowns have terms of one unknown.
    fn prior_terms(&self, _values: &[f64], _prior: &[f64], _sd: &[f64]) -> PriorTerms {
        PriorTerms::default()
    }

    /// Recomputes the local unknowns from the others; returns false if the model does not support it. Far from the solution this often
    /// restores convergence.
    fn relocate(&self, _unknowns: &mut [f64]) -> bool {
        false
    }

    /// Returns the number of groups whose blocks at these values are outside the layout; the missing columns are omitted. If there are
    /// many, or if steps are short, the iterations end and the caller creates a new layout.
    fn pattern_violations(&self, _unknowns: &[f64]) -> usize {
        0
    }

    /// Whether the last steps converge only linearly, because second derivatives times residuals matter for weakly determined unknowns.
    /// Chord steps then save time (see [`super::Method::Damped`]).
    fn converges_linearly(&self) -> bool {
        false
    }

    /// Whether weakly determined combinations of unknowns may make full steps oscillate or creep. Full steps are then accelerated with
    /// previous ones, and shortened if the sum of squares rises.
    fn may_oscillate(&self) -> bool {
        false
    }

    /// Returns the datum transformations that observations and weights may leave free at the given values. The free ones are found
    /// numerically, and as many unknowns are constrained. None if a datum is known to exist.
    fn motions(&self, _unknowns: &[f64]) -> Option<Motions> {
        None
    }

    /// Whether the observations of groups are invariant under all motions unless unknowns are fixed. Only a sample of the groups is then
    /// tested.
    fn groups_leave_open(&self) -> bool {
        false
    }

    /// Returns all motions, even if observations and weights define the datum.
    fn all_motions(&self, unknowns: &[f64]) -> Option<Motions> {
        self.motions(unknowns)
    }

    /// Applies finite amounts of the motions to the unknowns. The default adds multiples of their vectors, which is exact for motions that
    /// are linear in the unknowns.
    fn move_along(&self, unknowns: &mut [f64], amounts: &[f64]) {
        let Some(motions) = self.motions(unknowns) else { return };
        let mut step = vec![0.0; unknowns.len()];
        for (vector, amount) in motions.vectors.iter().zip(amounts) {
            step.iter_mut().zip(vector).for_each(|(x, g)| *x += amount * g);
        }
        self.advance(unknowns, &step);
    }
}

/// [`Model`] evaluated at given values of the unknowns.
pub trait Evaluated: Send + Sync {
    /// Writes misclosures (observed minus computed) and partials of the computed values for one group of a local block, in the units of
    /// observations and unknowns.
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>);

    /// Writes [`Evaluated::observe`] for one group per local block, in sequence and with unit weight. `groups` contains their numbers, `sd`
    /// the standard deviations of all observations. All groups have the same main block and the same shared blocks. Returns false if not
    /// supported.
    fn observe_batch(
        &self,
        _locals: &[u32],
        _groups: &[u32],
        _sd: &[f64],
        _rows: &mut GroupRows<'_>,
    ) -> bool {
        false
    }

    /// Writes only the misclosures of [`Evaluated::observe`]; returns false if not supported.
    fn write_misclosure(&self, _local: usize, _group: usize, _constant: &mut [f64]) -> bool {
        false
    }

    /// Writes misclosures and partials of a term (see [`GroupRows::of_term`]). Only called if the layout has terms.
    fn observe_term(&self, _term: usize, _rows: &mut GroupRows<'_>) {}

    /// Returns ill-conditioned local blocks, and blocks that approach this state. Their information on one retained block exceeds all other
    /// information so far that rounding destroys the latter. Called after every damped step, with the unknowns before it.
    fn collapsed(&self, _before: &[f64]) -> Vec<usize> {
        vec![]
    }

    /// Returns local blocks that diverge to infinity: they would reduce the sum of squares slowly until the last iteration. Called in a
    /// trust region after a short step, with the unknowns before it.
    fn diverging(&self, _before: &[f64]) -> Vec<usize> {
        vec![]
    }

    /// Returns the effect of motions on the misclosures of a term, in unit weight, if the term observes a displacement of the moving space.
    /// The result is the number of the first motion with an effect, and one row per equation. Rotation and scale change the displacement,
    /// but not the sum of squares for isotropic weights. For other weights they do not determine the motion.
    fn carried(&self, _term: usize) -> Option<(usize, Vec<[f64; 7]>)> {
        None
    }
}

/// Motions of a whole network (datum transformations) that its observations may leave free.
#[derive(Debug, Clone)]
pub struct Motions {
    /// Derivatives of the unknowns by each motion: one vector over all unknowns per motion, in the units of the columns of the partials
    /// (see [`Model::advance`]).
    pub vectors: Vec<Vec<f64>>,
    /// Unknowns to constrain for a datum, in order of preference. Redundant ones are skipped.
    pub preferred: Vec<usize>,
}

/// Adjustment problem: a model with its priors and standard deviations.
#[derive(Debug)]
pub struct Problem<M: ?Sized> {
    /// The ordered layout.
    pub system: Arc<System>,
    /// Standard deviation of each observation, in the order of groups and rows, then of terms and rows; infinite for an excluded one.
    pub observation_sd: Vec<f64>,
    /// Initial value of each unknown.
    pub initial: Vec<f64>,
    /// Observed value of each unknown whose standard deviation is finite.
    pub prior: Vec<f64>,
    /// Standard deviation of each unknown: infinite when free, zero when fixed.
    pub sd: Vec<f64>,
    /// The functional model.
    pub model: M,
}

/// Problem with any model. Functions of problems are compiled once for this type; a reference to a specific problem coerces to it.
pub type AnyProblem<'m> = Problem<dyn Model + 'm>;

impl<M: ?Sized> Problem<M> {
    /// Returns the layout.
    pub fn layout(&self) -> &Layout {
        self.system.layout()
    }

    /// Number of equations: rows of groups and of terms, then one per unknown as an observation of itself, which is empty unless weighted.
    pub fn equations(&self) -> usize {
        self.observation_sd.len() + self.sd.len()
    }

    /// Returns a flag per unknown: whether it is fixed or in `held`.
    pub(super) fn fixed(&self, held: &[usize]) -> Vec<bool> {
        let mut fixed: Vec<bool> = self.sd.iter().map(|&sd| sd == 0.0).collect();
        held.iter().for_each(|&unknown| fixed[unknown] = true);
        fixed
    }

    /// Whether an unknown is weighted: neither free nor fixed.
    pub fn is_weighted(&self, unknown: usize) -> bool {
        is_weighted(self.sd[unknown])
    }
}

impl<M: Model> Problem<M> {
    /// Returns the problem with its model type erased.
    pub fn any(&self) -> &AnyProblem<'_> {
        self
    }
}

impl AnyProblem<'_> {
    /// Returns the prior terms at given values.
    pub fn prior_terms(&self, values: &[f64]) -> PriorTerms {
        PriorTerms::new(self.model.prior_terms(values, &self.prior, &self.sd), values, &self.prior, &self.sd)
    }

    /// Returns an error unless all arrays and `values` have the lengths of the layout.
    pub(super) fn check_lengths(&self, values: &[f64]) -> Result<(), LayoutError> {
        let (equations, unknowns) = (self.layout().equations(), self.layout().unknowns());
        LayoutError::unless_of_length("Problem::observation_sd", self.observation_sd.len(), equations)?;
        LayoutError::unless_of_length("Problem::initial", self.initial.len(), unknowns)?;
        LayoutError::unless_of_length("Problem::prior", self.prior.len(), unknowns)?;
        LayoutError::unless_of_length("Problem::sd", self.sd.len(), unknowns)?;
        LayoutError::unless_of_length("values", values.len(), unknowns)
    }

    /// Returns the unknowns after a step.
    pub(super) fn advanced(&self, unknowns: &[f64], step: &[f64]) -> Vec<f64> {
        let mut values = unknowns.to_vec();
        self.model.advance(&mut values, step);
        values
    }
}
