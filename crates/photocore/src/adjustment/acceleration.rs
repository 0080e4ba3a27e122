//! Geodesic acceleration: the second-order term of a step (Transtrum and Sethna 2012, "Improvements to the Levenberg-Marquardt algorithm
//! for nonlinear least-squares minimization").
//!
//! Where observations determine a combination of unknowns weakly, the sum of squares has a valley that bends, and straight steps along it
//! are short. With r the residuals, v the step and r_vv their second derivative along it, (N + damping) a = A^T r_vv, and v + a/2 follows
//! the valley by one order more. It takes no derivatives besides: r_vv = 2/h ((r(x + h v) - r(x)) / h + A v).

use super::equations::ObservationEquations;
use super::group_step::GroupStep;
use super::walk::Buffers;
use crate::normals::Equations;
use crate::{Threads, parallel};

/// The part h of the step at which residuals are compared with those that the linearized equations predict.
pub(super) const PART: f64 = 0.1;
/// Parts of the local blocks that are summed by themselves, at the most: the same for any number of threads.
const PARTS: usize = 64;
/// Local blocks of one at the least.
const AT_LEAST: usize = 64;

impl ObservationEquations<'_> {
    /// A^T r_vv over all unknowns; ties, which are few, are taken as straight.
    ///
    /// * `ahead`: r(x + h v), in the units of the observations.
    pub fn bending(&self, threads: &Threads, ahead: &[f64], step: &[f64]) -> Vec<f64> {
        let problem = self.problem();
        let layout = problem.layout();
        let first = layout.all_locals().end;
        let each = layout.locals().div_ceil(PARTS).max(AT_LEAST);
        let part = |start: usize| {
            let locals = start..(start + each).min(layout.locals());
            let mut own = Vec::with_capacity(locals.len() * layout.local_dim());
            let mut others = vec![0.0; layout.unknowns() - first];
            let mut buffers = Buffers::default();
            for local in locals {
                let begin = own.len();
                own.resize(begin + layout.local_dim(), 0.0);
                for group in layout.groups_of(local) {
                    let mut rows = buffers.rows(layout, group);
                    self.write(local, group, &mut rows);
                    let of_group = GroupStep::of(step, layout, local, group);
                    let retained = layout.retained_range(layout.retained_of(group)).start - first;
                    for row in 0..layout.rows() {
                        let observation = group * layout.rows() + row;
                        let difference =
                            ahead[observation] / self.deviation(observation) - rows.constant[row];
                        let bend = 2.0 / PART * (difference / PART + of_group.change(&rows, row));
                        add_row(&mut own[begin..], rows.local, row, of_group.local.len(), bend);
                        add_row(&mut others[retained..], rows.retained, row, of_group.retained.len(), bend);
                        let shared = &rows.shared[row * of_group.shared.len()..];
                        let columns = layout.shared_columns(group);
                        columns.zip(shared).for_each(|(k, a)| others[k - first] += a * bend);
                    }
                }
            }
            (own, others)
        };
        let starts: Vec<usize> = (0..layout.locals()).step_by(each).collect();
        let found: Vec<(Vec<f64>, Vec<f64>)> = threads.install(|| parallel::map_each(starts, &part));
        let mut right = Vec::with_capacity(layout.unknowns());
        found.iter().for_each(|(own, _)| right.extend_from_slice(own));
        right.resize(layout.unknowns(), 0.0);
        for (_, others) in &found {
            right[first..].iter_mut().zip(others).for_each(|(sum, value)| *sum += value);
        }
        right
    }
}

/// target += factor times a row of `width` coefficients.
fn add_row(target: &mut [f64], rows: &[f64], row: usize, width: usize, factor: f64) {
    let row = &rows[row * width..][..width];
    target.iter_mut().zip(row).for_each(|(sum, a)| *sum += a * factor);
}
