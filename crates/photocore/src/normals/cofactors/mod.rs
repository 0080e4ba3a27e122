//! Cofactors of all unknowns and adjusted equations, from the selected inverse.

mod coupled_inverse;

use std::ops::Range;
use std::time::Instant;

use self::coupled_inverse::CoupledInverse;
use super::equations::{Equations, RowBuffer};
use super::incidence::Batches;
use super::layout::Layout;
use super::system::System;
use super::vectorised::dot;
use super::workspace::zeros;
use crate::context::Control;
use crate::parallel;

pub(super) use coupled_inverse::NodeCofactors;

/// Cofactors: required blocks of the inverse normal matrix. All blocks are square, row by row.
#[derive(Debug, Clone)]
pub struct Cofactors {
    /// Blocks of the local blocks, one after the other.
    pub local: Vec<f64>,
    /// Blocks of the retained blocks, one after the other.
    pub retained: Vec<f64>,
    /// Leverage a Q a^T of each equation a x = l, in the order of groups and rows, then of terms and rows. One minus the leverage is the
    /// redundancy number of an observation.
    pub equations: Vec<f64>,
    /// Leverage matrices a Q a^T of terms, square blocks row by row, one after the other.
    pub terms: Vec<f64>,
    /// Blocks of the requested pairs of retained blocks, one after the other.
    pub pairs: Vec<f64>,
    /// Leverage matrices a Q a^T of all pairs of equations in each group, row by row, if requested. The identity minus this matrix is the
    /// cofactor matrix of residuals of unit weight.
    pub groups: Option<Vec<f64>>,
    /// Diagonal of the normal equations of all retained unknowns before any elimination, including priors. It is the reciprocal cofactor of
    /// an unknown if all others are fixed.
    pub information: Vec<f64>,
}

impl Cofactors {
    /// Collects the results of each supernode, and last of local blocks without equations. Adds `retained` and `pairs` of the inverse, and
    /// the information. None if memory is insufficient.
    pub(super) fn collect(
        system: &System,
        equations: &dyn Equations,
        control: &Control,
        found: &[NodeCofactors],
        [retained, pairs, information]: [Vec<f64>; 3],
    ) -> Option<Self> {
        let layout = &system.layout;
        let (rows, l) = (layout.rows(), layout.local_dim());
        let mut local = control.allocated(zeros(layout.locals() * l * l))?;
        let mut leverages = control.allocated(zeros(layout.equations()))?;
        for (index, at_node) in found.iter().enumerate() {
            let mut values = at_node.equations.chunks_exact(rows.max(1));
            let mut blocks = at_node.local.chunks_exact(l * l).peekable();
            for &unit in system.incidence.units_at(index) {
                if let Some(cofactors) = blocks.next_if(|_| !layout.is_uncoupled(unit as usize)) {
                    local[unit as usize * l * l..][..l * l].copy_from_slice(cofactors);
                }
                for (&group, values) in
                    system.incidence.groups_of(layout, unit as usize).iter().zip(&mut values)
                {
                    leverages[layout.equations_of_group(group as usize)].copy_from_slice(values);
                }
            }
        }
        let mut terms = control.allocated(zeros(layout.term_blocks().end))?;
        let mut put = |order: &mut dyn Iterator<Item = usize>, mut values: &[f64]| {
            for term in order {
                let (own, rest) = values.split_at(layout.term_block(term).len());
                terms[layout.term_block(term)].copy_from_slice(own);
                let diagonal = own.iter().step_by(layout.terms()[term].rows + 1);
                let target = leverages[layout.equations_of_term(term)].iter_mut();
                target.zip(diagonal).for_each(|(to, &leverage)| *to = leverage);
                values = rest;
            }
        };
        for (index, at_node) in found.iter().enumerate() {
            put(&mut system.terms.at(index).iter().map(|&term| term as usize), &at_node.terms);
        }
        let of_locals = (0..layout.terms().len()).filter(|&term| layout.terms()[term].local.is_some());
        put(&mut { of_locals }, &leverages_of_local_terms(layout, equations, &local));
        Some(Self { local, retained, equations: leverages, terms, pairs, groups: None, information })
    }
}

/// Collects the leverage matrices of groups from each supernode, and last of local blocks without equations; None if memory is insufficient.
pub(super) fn leverages_of_groups(
    system: &System,
    control: &Control,
    found: &[NodeCofactors],
) -> Option<Vec<f64>> {
    let layout = &system.layout;
    let size = layout.rows() * layout.rows();
    let mut leverages = control.allocated(zeros(layout.groups() * size))?;
    for (index, at_node) in found.iter().enumerate() {
        let units = system.incidence.units_at(index).iter();
        let groups = units.flat_map(|&unit| system.incidence.groups_of(layout, unit as usize));
        for (&group, own) in groups.zip(at_node.leverages.chunks_exact(size.max(1))) {
            leverages[group as usize * size..][..size].copy_from_slice(own);
        }
    }
    Some(leverages)
}

/// Minimum number of local blocks at a supernode for several threads.
const MANY: usize = 256;

impl NodeCofactors {
    /// Computes the cofactors at a supernode. `front` is the inverse over the rows of its front, full square, of order `height`.
    pub fn new(
        system: &System,
        index: usize,
        equations: &dyn Equations,
        control: &Control,
        front: &[f64],
        height: usize,
        by_group: bool,
    ) -> Self {
        let start = Instant::now();
        let layout = &system.layout;
        let batches = system.incidence.batches_at(index);
        let others = || CoupledInverse::new(by_group);
        let part = |others: &mut CoupledInverse, batches: Batches<'_>| {
            let (mut batch, mut part) = (system.workspace.batch(), Self::default());
            for run in batches.iter().take_while(|_| !control.stopped()) {
                batch.gather(equations, system, run);
                batch.eliminate(layout, equations.prior(), 0.0);
                others.gather(&batch, front, height);
                others.cofactors(&batch, layout, &mut part);
                system.count(run, control);
            }
            system.workspace.put_back_batch(batch);
            part
        };
        let mut found = if batches.units() < MANY {
            part(&mut others(), batches)
        } else {
            let parts = parallel::map_each_with(batches.parts(MANY / 16), others, part);
            parts.into_iter().fold(Self::default(), |mut all, part| {
                all.local.extend(part.local);
                all.equations.extend(part.equations);
                all.leverages.extend(part.leverages);
                all
            })
        };
        found.terms = terms_at_node(system, index, equations, front, height);
        found.seconds = start.elapsed().as_secs_f64();
        found
    }
}

/// Computes a Q a^T of the equations of each term of a local block, one square block per term; `cofactors` are those of the local blocks.
fn leverages_of_local_terms(layout: &Layout, equations: &dyn Equations, cofactors: &[f64]) -> Vec<f64> {
    let l = layout.local_dim();
    let part = |terms: Range<usize>| {
        let (mut buffer, mut found) = (RowBuffer::default(), Vec::new());
        for term in terms {
            let Some(local) = layout.terms()[term].local else { continue };
            let q = &cofactors[local as usize * l * l..][..l * l];
            let mut rows = buffer.term(layout, term);
            equations.write_term(term, &mut rows);
            for own in rows.local.chunks_exact(l) {
                let mut product = [0.0; 3];
                product.iter_mut().zip(q.chunks_exact(l)).for_each(|(sum, row)| *sum = dot(row, own));
                found.extend(rows.local.chunks_exact(l).map(|other| dot(&product[..l], other)));
            }
        }
        found
    };
    let count = if layout.has_local_terms() { layout.terms().len() } else { 0 };
    parallel::by_parts(count, MANY, &part)
}

/// Computes a Q a^T of the equations of each term at a supernode, one square block per term.
fn terms_at_node(
    system: &System,
    index: usize,
    equations: &dyn Equations,
    front: &[f64],
    height: usize,
) -> Vec<f64> {
    let (mut buffer, mut found) = (RowBuffer::default(), Vec::new());
    for &term in system.terms.at(index) {
        let (columns, rows) = system.term_in_front(index, equations, term as usize, &mut buffer);
        for (own, _) in &rows {
            // a Q for the columns of the term.
            let by_column = |&column: &usize| {
                columns.iter().zip(own).map(|(&row, value)| front[column * height + row] * value).sum::<f64>()
            };
            let product: Vec<f64> = columns.iter().map(by_column).collect();
            found.extend(rows.iter().map(|(other, _)| dot(&product, other)));
        }
    }
    found
}
