//! Formation, reduction and Cholesky factorisation of the normal equations in one walk up the elimination tree
//! (multifrontal method, Duff and Reid 1983; Liu 1992).

use std::sync::Arc;
use std::time::Instant;

use faer::MatMut;

use super::assembly::{Formation, Sums};
use super::dense::{Pivots, factor_front};
use super::equations::{Equations, Prior};
use super::error::SystemError;
use super::front::Front;
use super::layout::Layout;
use super::options::FactorOptions;
use super::panels::{Handover, Panels};
use super::symbolic::Supernode;
use super::system::System;
use super::watch::{Between, Control, watched};
use super::workspace::Eliminated;
use crate::Threads;
use crate::parallel::lock;

/// The Cholesky factor L of the reduced normal equations.
#[derive(Debug)]
pub struct Factor {
    pub(super) panels: Panels,
    /// L^-1 n, in the order of elimination; of outer unknowns n as the others leave it.
    pub(super) right: Vec<f64>,
    /// What the elimination of the local blocks has left, for [`System::solve`]; empty where it is not cached.
    pub(super) eliminated: Eliminated,
    /// The fraction of the diagonal of the normal equations that was added to it.
    pub damping: f64,
    /// Diagonal of the normal equations before any elimination, in the order of elimination.
    pub(super) diagonal: Vec<f64>,
    /// Lost pivots, in the order of elimination.
    pub(super) lost: Vec<usize>,
    /// Pivots that may be nothing but rounding.
    doubtful: Vec<usize>,
    /// Sum of squares of the right-hand sides of all equations (priors not counted).
    pub sum_of_squares: f64,
    /// Decrease of the sum of squares that a full step predicts, priors and all unknowns counted.
    pub decrease: f64,
    /// Local blocks that their equations do not determine, ascending.
    pub deficient_locals: Vec<usize>,
    /// Share of the time of all threads that went into formation and reduction; the rest went into the factorisation.
    pub formation_share: f64,
}

/// What eliminating a supernode leaves to its parent: lower triangle over the coupled rows, right-hand side and diagonal.
struct Update {
    matrix: Vec<f64>,
    right: Vec<f64>,
    diagonal: Vec<f64>,
}

/// What a visit to a supernode leaves to the result.
struct Visited {
    sums: Sums,
    lost: Vec<usize>,
    doubtful: Vec<usize>,
    /// Own part of L^-1 n and of the diagonal.
    right: Vec<f64>,
    diagonal: Vec<f64>,
    formation: f64,
    factorisation: f64,
}

/// What rounding leaves of a combination of unknowns that the equations do not determine, relative to what those of each unknown by
/// itself would make of it, is less than a unit in the last place; weights that alone make a datum (GIANT's default of 60000 m for a
/// station) leave a hundred.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

impl System {
    /// Forms the normal equations, with the local blocks reduced out, and factors them. The result has the same bits for any number of
    /// threads: every value is summed by one thread, in an order that depends on the pattern only.
    ///
    /// Whether everything is determined is for the caller to ask: see [`Factor::deficient_locals`] and [`Factor::deficiency`].
    ///
    /// # Errors
    /// An interruption, no memory, lengths that contradict the layout.
    pub fn factor(
        &self,
        threads: &Threads,
        equations: &dyn Equations,
        prior: &Prior,
        options: &FactorOptions,
        between: Between<'_>,
    ) -> Result<Factor, SystemError> {
        prior.check(&self.layout)?;
        let FactorOptions { damping, cached } = *options;
        let factored = watched(threads, between, |control| {
            let caches = cached && self.caches;
            let formation = Formation { system: self, equations, prior, damping, caches, control };
            let mut given_up = Vec::new();
            loop {
                let factor = formation.factor(&given_up)?;
                if control.stopped() {
                    // Supernodes were passed over: there is no factor to look at.
                    return Some(factor);
                }
                let lost = factor.lost_after_all();
                if lost.is_empty() {
                    return Some(factor);
                }
                // What the columns after a lost pivot have made of it is worthless.
                given_up.extend(lost);
                factor.recycle(self);
            }
        });
        Ok(factored?)
    }
}

impl Formation<'_> {
    /// Forms and factors; the pivots `given_up`, in the order of elimination, count as lost whatever they are. None without memory.
    fn factor(&self, given_up: &[usize]) -> Option<Factor> {
        let symbolic = &self.system.symbolic;
        let values = self.control.allocated(self.system.workspace.zeros(symbolic.values()))?;
        let mut panels = Panels { symbolic: Arc::clone(symbolic), values };
        let updates = Handover::new(symbolic.supernode_count());
        let visited = Handover::new(symbolic.supernode_count());
        let divided = panels.divide();
        let cached = self.room();
        self.system.tree.upward(&|index| {
            if !self.control.stopped()
                && let Some(found) =
                    self.visit(index, &mut lock(&divided[index]), &cached, &updates, given_up)
            {
                visited.put(index, found);
            }
        });
        drop(divided);
        let mut factor = Factor {
            panels,
            right: Vec::with_capacity(symbolic.unknowns()),
            eliminated: Vec::new(),
            damping: self.damping,
            diagonal: Vec::with_capacity(symbolic.unknowns()),
            lost: Vec::new(),
            doubtful: Vec::new(),
            sum_of_squares: 0.0,
            decrease: 0.0,
            deficient_locals: Vec::new(),
            formation_share: 1.0,
        };
        let (mut formation, mut factorisation) = (0.0, 0.0);
        let none = Front::new(0, 0, &mut [], Vec::new());
        let unplaced = self.assemble(&mut { none }, symbolic.supernode_count(), &cached)?;
        for (index, visited) in visited.into_values().flatten().enumerate() {
            factor.add(visited.sums, self.caches);
            if symbolic.open() != Some(index) {
                factor.decrease += visited.right.iter().map(|v| v * v).sum::<f64>();
            }
            factor.lost.extend(visited.lost);
            factor.doubtful.extend(visited.doubtful);
            factor.right.extend(visited.right);
            factor.diagonal.extend(visited.diagonal);
            formation += visited.formation;
            factorisation += visited.factorisation;
        }
        factor.add(unplaced, self.caches);
        if formation + factorisation > 0.0 {
            factor.formation_share = formation / (formation + factorisation);
        }
        factor.deficient_locals.sort_unstable();
        Some(factor)
    }

    /// Assembles and factors one front; what it leaves to its parent goes to `updates[index]`. None without memory.
    fn visit(
        &self,
        index: usize,
        panel: &mut [f64],
        cached: &Handover<Vec<f64>>,
        updates: &Handover<Update>,
        given_up: &[usize],
    ) -> Option<Visited> {
        let symbolic = &*self.system.symbolic;
        let s = &symbolic.supernodes()[index];
        let start = Instant::now();
        let update = self.control.allocated(self.system.workspace.lower_zeros(s.below()))?;
        let mut front = Front::new(s.width, s.height(), panel, update);
        for &child in &s.children {
            if let Some(update) = updates.take(child) {
                front.add(&update, &symbolic.rows_in_parent(child));
                self.system.workspace.put_back(update.matrix);
            }
        }
        let mut sums = self.assemble(&mut front, index, cached)?;
        sums.sum_of_squares += self.add_ties(&mut front, index);
        self.add_contributions(&mut front, index);
        let open = symbolic.open() == Some(index);
        if !open {
            self.add_prior(&mut front, index);
        }
        let formation = start.elapsed().as_secs_f64();
        let first = symbolic.first_unknown(index);
        let mut pivots = Pivots::default();
        if !open {
            let own = given_up.iter().filter_map(|&pivot| pivot.checked_sub(first));
            pivots = front.factor(&own.filter(|&column| column < s.width).collect::<Vec<_>>(), self.control);
        }
        let Front { width, update, mut right, mut diagonal, .. } = front;
        if s.parent.is_some() {
            let (right, diagonal) = (right.split_off(width), diagonal.split_off(width));
            updates.put(index, Update { matrix: update, right, diagonal });
        }
        Some(Visited {
            sums,
            lost: pivots.lost.into_iter().map(|column| first + column).collect(),
            doubtful: pivots.doubtful.into_iter().map(|column| first + column).collect(),
            right,
            diagonal,
            formation,
            factorisation: start.elapsed().as_secs_f64() - formation,
        })
    }

    /// Room for what is cached at each supernode: that of the formation before, where there was one.
    fn room(&self) -> Handover<Vec<f64>> {
        let cached = Handover::new(self.system.symbolic.supernode_count() + 1);
        if self.caches {
            let spare = self.system.workspace.take_eliminated().into_iter().enumerate();
            spare.for_each(|(index, room)| cached.put(index, room));
        }
        cached
    }
}

impl Front<'_> {
    /// Adds what a child leaves (extend-add), lower triangle only; `runs` says where its rows stand here.
    fn add(&mut self, child: &Update, runs: &[(usize, usize, usize)]) {
        let (width, height, below) = (self.width, self.height, self.height - self.width);
        let order = child.right.len();
        for (at, &(from_column, to_column, columns)) in runs.iter().enumerate() {
            for k in 0..columns {
                let column = to_column + k;
                self.right[column] += child.right[from_column + k];
                self.diagonal[column] += child.diagonal[from_column + k];
                let source = &child.matrix[(from_column + k) * order..][..order];
                let (target, shift) = if column < width {
                    (&mut self.panel[column * height..][..height], 0)
                } else {
                    (&mut self.update[(column - width) * below..][..below], width)
                };
                for (later, &(from_row, to_row, rows)) in runs[at..].iter().enumerate() {
                    let skip = if later == 0 { k } else { 0 };
                    let source = &source[from_row + skip..from_row + rows];
                    let target = &mut target[to_row + skip - shift..][..source.len()];
                    target.iter_mut().zip(source).for_each(|(sum, value)| *sum += value);
                }
            }
        }
    }

    /// Eliminates the own columns, from the right-hand side too; returns the pivots that need a closer look.
    fn factor(&mut self, given_up: &[usize], control: &Control) -> Pivots {
        let below = self.height - self.width;
        let panel = MatMut::from_column_major_slice_mut(self.panel, self.height, self.width);
        let update = MatMut::from_column_major_slice_mut(&mut self.update, below, below);
        let pivots = factor_front(panel, update, &self.diagonal, given_up, control);
        for (j, column) in self.panel.chunks_exact(self.height.max(1)).enumerate() {
            let value = self.right[j] / column[j];
            self.right[j] = value;
            let rest = self.right[j + 1..].iter_mut().zip(&column[j + 1..]);
            rest.for_each(|(right, factor)| *right -= factor * value);
        }
        pivots
    }
}

impl Factor {
    fn add(&mut self, sums: Sums, caches: bool) {
        self.sum_of_squares += sums.sum_of_squares;
        self.decrease += sums.decrease;
        self.deficient_locals.extend(sums.deficient);
        if caches {
            self.eliminated.push(sums.cached);
        }
    }

    /// Whether it has cached what the elimination of the local blocks has left.
    pub fn has_cached(&self) -> bool {
        !self.eliminated.is_empty()
    }

    /// Gives that back.
    pub fn forget(&mut self) {
        self.eliminated = Vec::new();
    }

    /// The unknowns that are not local and that a solution of the equations moves, ascending: those that take at least a tenth of
    /// the largest share, each in units of what its equations alone determine.
    pub fn moved(&self, system: &System, solution: &[f64]) -> Vec<usize> {
        let unknowns = self.unknowns(&system.layout).map(|unknown| solution[unknown]);
        self.taking_part(&system.layout, unknowns.collect())
    }

    /// The largest share of an unknown that is not local in a solution of the equations, in units of what its equations alone determine.
    pub fn largest_share(&self, system: &System, solution: &[f64]) -> f64 {
        let mut shares: Vec<f64> = self.unknowns(&system.layout).map(|unknown| solution[unknown]).collect();
        self.scale(&mut shares);
        shares.iter().fold(0.0, |most, value| value.abs().max(most))
    }

    /// The unknowns that take part in a vector over the unknowns that are not local, in the order of elimination.
    pub(super) fn taking_part(&self, layout: &Layout, mut vector: Vec<f64>) -> Vec<usize> {
        self.scale(&mut vector);
        let largest = vector.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let shares = self.unknowns(layout).zip(&vector);
        let mut found: Vec<usize> =
            shares.filter(|(_, value)| value.abs() >= 0.1 * largest).map(|(unknown, _)| unknown).collect();
        found.sort_unstable();
        found
    }

    /// The unknowns that are not local, in the order of elimination.
    pub(super) fn unknowns<'a>(&'a self, layout: &'a Layout) -> impl Iterator<Item = usize> + 'a {
        let symbolic = &*self.panels.symbolic;
        (0..symbolic.blocks()).flat_map(|position| symbolic.unknowns_at(layout, position))
    }

    /// The unknowns, none of them local, that neither an equation nor a weight touches, ascending.
    pub fn without_effect(&self, layout: &Layout) -> Vec<usize> {
        let diagonal = self.unknowns(layout).zip(&self.diagonal);
        let mut found: Vec<usize> =
            diagonal.filter(|&(_, &n)| n == 0.0).map(|(unknown, _)| unknown).collect();
        found.sort_unstable();
        found
    }

    /// Natural logarithm of the determinant of the normal equations, the local unknowns reduced out; None where it is zero.
    pub fn log_determinant(&self) -> Option<f64> {
        let logarithm = |(index, s): (usize, &Supernode)| {
            let columns = self.panels.panel(index).chunks_exact(s.height().max(1)).enumerate();
            columns.map(|(j, column)| 2.0 * column[j].ln()).sum::<f64>()
        };
        let supernodes = self.panels.symbolic.closed().iter().enumerate();
        self.lost.is_empty().then(|| supernodes.map(logarithm).sum())
    }

    /// Takes each unknown in units of what its equations alone determine.
    pub(super) fn scale(&self, vector: &mut [f64]) {
        for (value, &diagonal) in vector.iter_mut().zip(&self.diagonal) {
            *value *= if diagonal > 0.0 && diagonal.is_finite() { diagonal.sqrt() } else { 1.0 };
        }
    }

    /// Gives its memory back to the system that it is of, for the next one.
    pub fn recycle(self, system: &System) {
        system.workspace.put_back(self.panels.values);
        system.workspace.put_back_eliminated(self.eliminated);
    }

    /// The doubtful pivots that are nothing but rounding.
    ///
    /// With x = L^-T e the combination of unknowns that a pivot stands for, x^T N x = 1, and what the equations of each unknown by
    /// itself would make of it is the sum of n_ii x_i^2. A pivot alone does not tell: where the combination hardly moves its
    /// unknown, rounding leaves a large fraction of that unknown's diagonal element.
    fn lost_after_all(&self) -> Vec<usize> {
        let is_lost = |&pivot: &usize| {
            let x = self.combination(pivot);
            let separately: f64 = x.iter().zip(&self.diagonal).map(|(x, n)| x * x * n).sum();
            separately.recip() < ROUNDING
        };
        self.doubtful.iter().copied().filter(is_lost).collect()
    }

    /// L^-T e: the combination of unknowns that a pivot stands for.
    pub(super) fn combination(&self, pivot: usize) -> Vec<f64> {
        let mut x = vec![0.0; self.right.len()];
        x[pivot] = 1.0;
        self.solve_backward(&mut x);
        x
    }
}
