//! Models, and problems: a model with everything that is known beforehand.

use crate::normals::{Equations, GroupRows, Layout, Prior, System};

/// How observations follow from unknowns.
pub trait Model: Sync {
    /// What several observations share, computed once for each set of values of the unknowns.
    type Prepared: Send + Sync;

    /// Prepares for the given unknowns (in the order of the layout). Called on a thread of the pool, as is [`Model::relocate`].
    fn prepare(&self, unknowns: &[f64]) -> Self::Prepared;

    /// Writes observed minus computed, and the partials of the computed values, of one group of observations of a local
    /// block, in the units of observations and unknowns.
    fn observe(&self, prepared: &Self::Prepared, local: usize, group: usize, rows: &mut GroupRows<'_>);

    /// Computes the local unknowns afresh from the others, where the model knows how; false where it does not. Far from the
    /// solution this often leads back into the region where linearized steps do.
    fn relocate(&self, _unknowns: &mut [f64]) -> bool {
        false
    }
}

/// A model with everything that is known beforehand.
#[derive(Debug)]
pub struct Problem<M> {
    /// How observations follow from unknowns.
    pub model: M,
    /// The unknowns and groups, ordered.
    pub system: System,
    /// Standard deviation of each observation, in the order of groups and rows.
    pub observation_sd: Vec<f64>,
    /// Initial value of each unknown.
    pub initial: Vec<f64>,
    /// Observed value of each unknown whose standard deviation is finite.
    pub prior: Vec<f64>,
    /// Standard deviation of each unknown: infinite when free, zero when fixed.
    pub sd: Vec<f64>,
}

impl<M> Problem<M> {
    /// The unknowns and groups.
    pub fn layout(&self) -> &Layout {
        self.system.layout()
    }

    /// Whether an unknown counts as an observation: neither free nor fixed.
    pub fn is_weighted(&self, unknown: usize) -> bool {
        self.sd[unknown] > 0.0 && self.sd[unknown].is_finite()
    }

    /// Square of (observed - computed) / standard deviation of an unknown; zero unless it is weighted.
    pub fn prior_square(&self, unknown: usize, value: f64) -> f64 {
        if self.is_weighted(unknown) {
            ((self.prior[unknown] - value) / self.sd[unknown]).powi(2)
        } else {
            0.0
        }
    }

    /// The equations of the unknowns themselves at the given values. A fixed unknown has an equation of its own,
    /// x = 0 with unit weight, and no other (see [`Linearized`]).
    pub(super) fn prior_equations(&self, values: &[f64]) -> Prior {
        let weight: Vec<f64> =
            self.sd.iter().map(|&sd| if sd == 0.0 { 1.0 } else { (sd * sd).recip() }).collect();
        let right = (0..values.len())
            .map(|i| if self.is_weighted(i) { weight[i] * (self.prior[i] - values[i]) } else { 0.0 })
            .collect();
        Prior { weight, right }
    }
}

/// The equations of a problem at given values of the unknowns: weighted to unit weight, without fixed unknowns.
pub(super) struct Linearized<'a, M: Model> {
    problem: &'a Problem<M>,
    prepared: M::Prepared,
    any_fixed: bool,
}

impl<'a, M: Model> Linearized<'a, M> {
    pub fn new(problem: &'a Problem<M>, values: &[f64]) -> Self {
        let any_fixed = problem.sd.contains(&0.0);
        Self { problem, prepared: problem.model.prepare(values), any_fixed }
    }
}

impl<M: Model> Equations for Linearized<'_, M> {
    #[inline(always)]
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let layout = self.problem.layout();
        self.problem.model.observe(&self.prepared, local, group, rows);
        let count = layout.rows();
        for row in 0..count {
            let sd = self.problem.observation_sd[group * count + row];
            rows.constant[row] /= sd;
            let weight = sd.recip();
            for part in [&mut *rows.local, &mut *rows.kept, &mut *rows.border] {
                let width = part.len() / count;
                part[row * width..][..width].iter_mut().for_each(|value| *value *= weight);
            }
        }
        if self.any_fixed {
            let start = layout.border_range().start;
            let border = layout.border_of(group);
            let columns = [
                (&mut *rows.local, layout.local_range(local)),
                (&mut *rows.kept, layout.kept_range(layout.kept_of(group))),
                (&mut *rows.border, start + border.start..start + border.end),
            ];
            for (part, range) in columns {
                let width = range.len();
                for (k, _) in range.enumerate().filter(|(_, unknown)| self.problem.sd[*unknown] == 0.0) {
                    (0..count).for_each(|row| part[row * width + k] = 0.0);
                }
            }
        }
    }
}
