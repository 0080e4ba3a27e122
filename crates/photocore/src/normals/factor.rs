//! Block Cholesky factorisation, front by front (multifrontal, Liu 1992).

use std::sync::Arc;

use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::dense::factor_front;
use super::floors::Floors;
use super::form::Normals;
use super::panels::Panels;
use super::symbolic::Symbolic;

/// The Cholesky factor of the reduced normal equations, scaled to unit diagonal: D N D = L L^T.
#[derive(Debug)]
pub struct Factor {
    pub(crate) panels: Panels,
    pub(crate) scale: Vec<f64>,
    /// Right-hand side, in the order of elimination.
    pub(crate) right: Vec<f64>,
}

/// Unknowns that the equations do not determine.
#[derive(Debug)]
pub struct Deficiency {
    factor: Factor,
    /// Lost pivots, in the order of elimination.
    lost: Vec<usize>,
}

impl Deficiency {
    /// How many combinations of unknowns are not determined.
    pub fn defect(&self) -> usize {
        self.lost.len()
    }

    /// For each of them the kept blocks it moves (the border is the block after the last), ascending: the blocks that take
    /// at least a hundredth of the largest share in a null vector, each unknown in units of what its equations alone determine.
    pub fn blocks(&self) -> Vec<Vec<usize>> {
        let symbolic = &*self.factor.panels.symbolic;
        let vectors = self.lost.iter().map(|&pivot| {
            let mut vector = vec![0.0; symbolic.unknowns()];
            vector[pivot] = 1.0;
            self.factor.solve_backward(&mut vector);
            let share = |position: usize| {
                vector[symbolic.range(position)].iter().fold(0.0, |most: f64, value| most.max(value.abs()))
            };
            let largest = (0..symbolic.blocks()).map(share).fold(0.0, f64::max);
            let mut blocks: Vec<usize> = (0..symbolic.blocks())
                .filter(|&p| share(p) >= 0.01 * largest)
                .map(|p| symbolic.block(p))
                .collect();
            blocks.sort_unstable();
            blocks
        });
        vectors.collect()
    }
}

impl Normals {
    /// Scales to unit diagonal and factors.
    ///
    /// # Errors
    /// The unknowns that the equations do not determine.
    pub fn factor(self, pool: &ThreadPool) -> Result<Factor, Deficiency> {
        let scale: Vec<f64> = self
            .diagonal
            .iter()
            .map(|&n| if n > 0.0 && n.is_finite() { n.sqrt().recip() } else { 1.0 })
            .collect();
        let mut panels = self.panels;
        panels.scale(&scale);
        let symbolic = Arc::clone(&panels.symbolic);
        let lost = pool.install(|| factor_panels(&symbolic, &mut panels.values));
        let factor = Factor { panels, scale, right: self.right };
        if lost.is_empty() { Ok(factor) } else { Err(Deficiency { factor, lost }) }
    }
}

/// Factors all panels; returns the lost pivots in the order of elimination.
fn factor_panels(symbolic: &Symbolic, values: &mut [f64]) -> Vec<usize> {
    let floors = Floors::new(symbolic);
    let mut updates: Vec<Option<Mat<f64>>> = vec![None; symbolic.supernode_count()];
    let subtrees = floors.divide(symbolic, values, &mut updates);
    let found = subtrees.into_par_iter().map(|mut subtree| {
        let mut lost = Vec::new();
        let first = subtree.supernodes.start;
        for index in subtree.supernodes.clone() {
            let (panel, updates) = subtree.parts(symbolic, index);
            lost.extend(factor_supernode(symbolic, index, panel, updates, first));
        }
        lost
    });
    let mut lost: Vec<usize> = found.collect::<Vec<_>>().into_iter().flatten().collect();
    for &index in &floors.top {
        let panel = &mut values[symbolic.supernodes()[index].panel.clone()];
        lost.extend(factor_supernode(symbolic, index, panel, &mut updates, 0));
    }
    lost.sort_unstable();
    lost
}

/// Assembles and factors one front; its update for the parent is left in `updates[index - first]`.
fn factor_supernode(
    symbolic: &Symbolic,
    index: usize,
    panel: &mut [f64],
    updates: &mut [Option<Mat<f64>>],
    first: usize,
) -> Vec<usize> {
    let s = &symbolic.supernodes()[index];
    let mut panel = MatMut::from_column_major_slice_mut(panel, s.height(), s.width);
    let mut update = Mat::<f64>::zeros(s.below(), s.below());
    for &child in &s.children {
        if let Some(from) = updates[child - first].take() {
            let runs = symbolic.rows_in_parent(child);
            add_update(&from, &runs, panel.rb_mut(), update.as_mut());
        }
    }
    let lost = factor_front(panel, update.as_mut());
    if s.parent.is_some() {
        updates[index - first] = Some(update);
    }
    lost.into_iter().map(|column| symbolic.first_unknown(index) + column).collect()
}

/// Adds the update of a child to the front of its parent (extend-add), lower triangle only.
fn add_update(
    from: &Mat<f64>,
    runs: &[(usize, usize, usize)],
    mut panel: MatMut<'_, f64>,
    mut update: MatMut<'_, f64>,
) {
    let width = panel.ncols();
    for (at, &(from_column, to_column, columns)) in runs.iter().enumerate() {
        for k in 0..columns {
            let source = from.col(from_column + k);
            let (mut target, shift) = if to_column + k < width {
                (panel.rb_mut().col_mut(to_column + k), 0)
            } else {
                (update.rb_mut().col_mut(to_column + k - width), width)
            };
            for (later, &(from_row, to_row, rows)) in runs[at..].iter().enumerate() {
                let skip = if later == 0 { k } else { 0 };
                for i in skip..rows {
                    target[to_row + i - shift] += source[from_row + i];
                }
            }
        }
    }
}
