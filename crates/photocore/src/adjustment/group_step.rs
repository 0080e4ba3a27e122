//! What a step does to the observations of one group.

use crate::normals::{GroupRows, Layout, dot};

/// What a step does to the unknowns of one group.
pub(super) struct GroupStep<'s> {
    pub local: &'s [f64],
    pub retained: &'s [f64],
    pub shared: Vec<f64>,
}

impl<'s> GroupStep<'s> {
    pub fn of(step: &'s [f64], layout: &Layout, local: usize, group: usize) -> Self {
        Self {
            local: &step[layout.local_range(local)],
            retained: &step[layout.retained_range(layout.retained_of(group))],
            shared: layout.shared_columns(group).map(|unknown| step[unknown]).collect(),
        }
    }

    /// By how much it changes a row of the group: A v.
    pub fn change(&self, rows: &GroupRows<'_>, row: usize) -> f64 {
        let part = |values: &[f64], step: &[f64]| dot(&values[row * step.len()..][..step.len()], step);
        part(rows.local, self.local) + part(rows.retained, self.retained) + part(rows.shared, &self.shared)
    }
}
