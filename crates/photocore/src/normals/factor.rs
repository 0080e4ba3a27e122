//! Formation, reduction and Cholesky factorisation of the normal equations in one traversal of the elimination tree (multifrontal method,
//! Duff and Reid 1983; Liu 1992).

use std::sync::Arc;
use std::time::Instant;

use faer::MatMut;

use super::assembly::{Formation, Sums};
use super::dense::{Pivots, factor_front};
use super::equations::Equations;
use super::front::Front;
use super::panels::{Panels, PerSupernode};
use super::symbolic::Supernode;
use super::system::{System, SystemError};
use super::workspace::Eliminated;
use crate::context::{Context, Control, Phase};
use crate::parallel::lock;

/// Options of the factorisation.
#[derive(Debug, Clone, Copy)]
pub struct FactorOptions {
    /// Fraction of the diagonal of the normal equations that is added to it.
    pub damping: f64,
    /// Whether local eliminations are cached for [`Factor::solve`], so that equations are not evaluated again.
    /// Ignored if the cache would exceed the memory of the results.
    pub cached: bool,
}

impl FactorOptions {
    /// No damping and no cache: for a factor without solutions, or with cofactors first.
    pub const UNCACHED: Self = Self { damping: 0.0, cached: false };
}

impl Default for FactorOptions {
    fn default() -> Self {
        Self { damping: 0.0, cached: true }
    }
}

/// Cholesky factor L of the reduced normal equations.
#[derive(Debug, Clone)]
pub struct Factor {
    /// The system of the factored normal equations.
    pub(super) system: Arc<System>,
    pub(super) panels: Panels,
    /// L^-1 n, in elimination order; for outer unknowns the reduced right-hand side.
    pub(super) right: Vec<f64>,
    /// Local eliminations for [`Factor::solve`]; empty without a cache.
    pub(super) eliminated: Eliminated,
    /// Fraction of the diagonal of the normal equations that was added to it.
    pub damping: f64,
    /// Diagonal of the normal equations before any elimination, in elimination order.
    pub(super) diagonal: Vec<f64>,
    /// Lost pivots, in elimination order.
    pub(super) lost: Vec<usize>,
    /// Pivots that may be rounding errors, each behind its ratio to the diagonal.
    doubtful: Vec<(f64, usize)>,
    /// Sum of squares of the right-hand sides of all equations, without priors.
    pub sum_of_squares: f64,
    /// Predicted decrease of the sum of squares by a full step, including priors and all unknowns.
    pub decrease: f64,
    /// Local blocks that their equations do not determine, ascending.
    pub deficient_locals: Vec<usize>,
    /// Fraction of the computing time of all threads for formation and reduction; the rest is for the factorisation.
    pub formation_share: f64,
}

/// Update matrix of a supernode for its parent: lower triangle over the coupled rows, right-hand side and diagonal.
struct Update {
    matrix: Vec<f64>,
    right: Vec<f64>,
    diagonal: Vec<f64>,
}

/// Result of a visit to a supernode.
struct Visited {
    sums: Sums,
    lost: Vec<usize>,
    doubtful: Vec<(f64, usize)>,
    /// Parts of L^-1 n and of the diagonal for the eliminated blocks.
    right: Vec<f64>,
    diagonal: Vec<f64>,
    formation: f64,
    factorisation: f64,
}

/// Threshold for an undetermined combination of unknowns: its information relative to the equations of each unknown alone. Rounding errors
/// are less than one unit in the last digit. Priors that only define the datum (GIANT's default of 60000 m for a station) give a hundred.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Number of combinations that are computed together.
const TOGETHER: usize = 16;

/// Maximum number of doubtful pivots that are tested: those with the smallest ratio to their diagonal elements.
const MOST_DOUBTFUL: usize = 32 * TOGETHER;

/// Maximum number of factorisations without lost pivots. Each reveals further combinations, because columns after a lost pivot are invalid.
const MOST_PASSES: usize = 8;

impl System {
    /// Forms the normal equations, eliminates the local blocks and factors the rest. Results are bitwise identical for any number of
    /// threads: every value is summed by one thread, in an order that depends only on the pattern.
    ///
    /// The caller must check whether all unknowns are determined: see [`Factor::deficient_locals`] and [`Factor::deficiency`].
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn factor(
        self: &Arc<Self>,
        equations: &dyn Equations,
        options: &FactorOptions,
        context: &mut Context<'_>,
    ) -> Result<Factor, SystemError> {
        equations.prior().check(&self.layout)?;
        let FactorOptions { damping, cached } = *options;
        let factored = context.run(Phase::Form, self.layout.locals(), |control| {
            let caches = cached && self.caches;
            let formation = Formation { system: self, equations, damping, caches, control };
            let (mut given_up, mut passes) = (Vec::new(), 0);
            loop {
                let factor = formation.factor(&given_up)?;
                passes += 1;
                if passes == MOST_PASSES || control.stopped() {
                    // After a stop supernodes were skipped, and the factor is invalid.
                    return Some(factor);
                }
                let lost = factor.lost_after_all();
                if lost.is_empty() {
                    return Some(factor);
                }
                // Columns after a lost pivot are invalid, because the pivot was used.
                given_up.extend(lost);
                factor.recycle();
            }
        });
        Ok(factored?)
    }
}

impl Formation<'_> {
    /// Forms and factors; the pivots `given_up`, in elimination order, are always regarded as lost. None if memory is insufficient.
    fn factor(&self, given_up: &[usize]) -> Option<Factor> {
        let symbolic = &self.system.symbolic;
        let values = self.control.allocated(self.system.workspace.panels(symbolic.values()))?;
        let mut panels = Panels { symbolic: Arc::clone(symbolic), values };
        let updates = PerSupernode::new(symbolic.supernode_count());
        let visited = PerSupernode::new(symbolic.supernode_count());
        let divided = panels.divide();
        let cached = self.room();
        self.system.start();
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
            system: Arc::clone(self.system),
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

    /// Assembles and factors one front; stores its update matrix in `updates[index]`. None if memory is insufficient.
    fn visit(
        &self,
        index: usize,
        panel: &mut [f64],
        cached: &PerSupernode<Vec<f64>>,
        updates: &PerSupernode<Update>,
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
        sums.sum_of_squares += self.add_terms(&mut front, index);
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
        } else {
            self.system.workspace.put_back(update);
        }
        Some(Visited {
            sums,
            lost: pivots.lost.into_iter().map(|column| first + column).collect(),
            doubtful: pivots.doubtful.into_iter().map(|(ratio, column)| (ratio, first + column)).collect(),
            right,
            diagonal,
            formation,
            factorisation: start.elapsed().as_secs_f64() - formation,
        })
    }

    /// Returns buffers for the cache of each supernode, reused from an earlier formation if possible.
    fn room(&self) -> PerSupernode<Vec<f64>> {
        let cached = PerSupernode::new(self.system.symbolic.supernode_count() + 1);
        if self.caches {
            let spare = self.system.workspace.take_eliminated().into_iter().enumerate();
            spare.for_each(|(index, room)| cached.put(index, room));
        }
        cached
    }
}

impl Front<'_> {
    /// Adds the update matrix of a child (extend-add), lower triangle only; `runs` maps its rows to rows of this front.
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

    /// Eliminates the columns of the supernode, including the right-hand side; returns the irregular pivots.
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

    /// Whether the factor contains the cache of local eliminations.
    pub fn has_cached(&self) -> bool {
        !self.eliminated.is_empty()
    }

    /// Releases the cache of local eliminations.
    pub fn forget(&mut self) {
        self.eliminated = Vec::new();
    }

    /// Returns the retained unknowns that a solution moves, ascending: shares of at least one tenth of the largest. Unknowns are scaled by
    /// the precision from their own equations alone.
    pub fn moved(&self, solution: &[f64]) -> Vec<usize> {
        self.taking_part(&mut self.unknowns().map(|unknown| solution[unknown]).collect::<Vec<f64>>())
    }

    /// Returns the largest share of a retained unknown in a solution, scaled by the precision from its own equations alone.
    pub fn largest_share(&self, solution: &[f64]) -> f64 {
        let mut shares: Vec<f64> = self.unknowns().map(|unknown| solution[unknown]).collect();
        self.scale(&mut shares);
        shares.iter().fold(0.0, |most, value| value.abs().max(most))
    }

    /// Returns the unknowns with large shares in a vector over the retained unknowns in elimination order.
    pub(super) fn taking_part(&self, vector: &mut [f64]) -> Vec<usize> {
        self.scale(vector);
        let largest = vector.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let shares = self.unknowns().zip(&*vector);
        let mut found: Vec<usize> =
            shares.filter(|(_, value)| value.abs() >= 0.1 * largest).map(|(unknown, _)| unknown).collect();
        found.sort_unstable();
        found
    }

    /// Returns the retained unknowns, in elimination order.
    pub(super) fn unknowns(&self) -> impl Iterator<Item = usize> + '_ {
        let System { layout, symbolic, .. } = &*self.system;
        (0..symbolic.blocks()).flat_map(|position| symbolic.unknowns_at(layout, position))
    }

    /// Returns the retained unknowns without any equation or prior, ascending.
    pub fn without_effect(&self) -> Vec<usize> {
        let diagonal = self.unknowns().zip(&self.diagonal);
        let mut found: Vec<usize> =
            diagonal.filter(|&(_, &n)| n == 0.0).map(|(unknown, _)| unknown).collect();
        found.sort_unstable();
        found
    }

    /// Natural logarithm of the determinant of the reduced normal equations; None if it is zero.
    pub fn log_determinant(&self) -> Option<f64> {
        let logarithm = |(index, s): (usize, &Supernode)| {
            let columns = self.panels.panel(index).chunks_exact(s.height().max(1)).enumerate();
            columns.map(|(j, column)| 2.0 * column[j].ln()).sum::<f64>()
        };
        let supernodes = self.panels.symbolic.closed().iter().enumerate();
        self.lost.is_empty().then(|| supernodes.map(logarithm).sum())
    }

    /// Scales each unknown by the precision from its own equations alone.
    pub(super) fn scale(&self, vector: &mut [f64]) {
        for (value, &diagonal) in vector.iter_mut().zip(&self.diagonal) {
            *value *= if diagonal > 0.0 && diagonal.is_finite() { diagonal.sqrt() } else { 1.0 };
        }
    }

    /// Whether it is copied for hypotheses before it is inverted (see [`System::copies_factor`]).
    pub fn is_small(&self) -> bool {
        self.system.copies_factor()
    }

    /// Returns its memory to the workspace of the system for reuse.
    pub fn recycle(self) {
        self.system.workspace.put_back_panels(self.panels.values);
        self.system.workspace.put_back_eliminated(self.eliminated);
    }

    /// Returns the doubtful pivots that are rounding errors.
    ///
    /// For the combination x = L^-T e of a pivot, x^T N x = 1. The equations of each unknown alone would give the sum of n_ii x_i^2. The
    /// pivot itself is not conclusive: if the combination hardly changes its unknown, a large fraction of the diagonal element is rounding
    /// error.
    fn lost_after_all(&self) -> Vec<usize> {
        let mut doubtful: Vec<(f64, usize)> = self.doubtful.clone();
        doubtful.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        doubtful.truncate(MOST_DOUBTFUL);
        let mut pivots: Vec<usize> = doubtful.into_iter().map(|(_, pivot)| pivot).collect();
        pivots.sort_unstable();
        let mut lost = vec![];
        self.each_combination(&pivots, |pivot, x| {
            let separately: f64 = x.iter().zip(&self.diagonal).map(|(x, n)| x * x * n).sum();
            lost.extend((separately.recip() < ROUNDING).then_some(pivot));
        });
        lost
    }

    /// Calls `take` with some pivots, ascending, and L^-T e of each: its combination of unknowns.
    pub(super) fn each_combination(&self, pivots: &[usize], mut take: impl FnMut(usize, &mut [f64])) {
        let count = self.right.len().max(1);
        for together in pivots.chunks(TOGETHER) {
            let mut columns = vec![0.0; together.len() * count];
            together.iter().enumerate().for_each(|(k, pivot)| columns[k * count + pivot] = 1.0);
            self.backward_columns(&mut columns);
            together.iter().zip(columns.chunks_exact_mut(count)).for_each(|(&pivot, x)| take(pivot, x));
        }
    }
}
