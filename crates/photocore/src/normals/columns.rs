//! Right-hand sides of partitioned systems: forward reduction in each part, then back-substitution.
//!
//! Chord steps: solutions with an older factor for the right-hand sides at other values.

use super::eliminated::{Elimination, Reduced};
use super::equations::{Equations, RowBuffer};
use super::factor::Factor;
use super::layout::LayoutError;
use super::system::{System, SystemError};
use super::vectorised::{LANES, dot};
use crate::context::{Context, Control, Phase};
use crate::parallel;

/// Right-hand sides of a part, C per pass, after forward substitution of its eliminated unknowns: y = L^-1 r.
#[derive(Debug)]
pub struct ReducedRights<const C: usize = LANES> {
    /// Rows of the local blocks, as returned by [`Elimination::reduce`].
    pub(super) own: Vec<Vec<[f64; C]>>,
    /// Rows of the retained unknowns in elimination order, one right-hand side after the other; reduced right-hand sides of outer unknowns.
    pub(super) others: Vec<f64>,
    /// Products y^T y of all pairs, without outer unknowns; their sum over all parts is r^T N^-1 r.
    pub products: Vec<f64>,
    /// Numbers of retained unknowns and of outer unknowns.
    pub(super) counts: (usize, usize),
}

/// Modified Newton step with an older factor N = L L^T.
#[derive(Debug)]
pub struct Chord {
    /// Approximate solution N^-1 A^T l over all unknowns, in the order of the layout.
    pub step: Vec<f64>,
    /// y = L^-1 A^T l.
    pub reduced: Vec<f64>,
    /// y^T y, the predicted decrease of the sum of squares.
    pub decrease: f64,
}

impl<const C: usize> ReducedRights<C> {
    /// Returns the reduced right-hand sides of the outer unknowns, one after the other.
    pub fn left(&self) -> Vec<f64> {
        let (all, outer) = self.counts;
        self.others.chunks_exact(all.max(1)).flat_map(|column| &column[all - outer..]).copied().collect()
    }

    /// Returns all elements of y.
    pub fn reduced(&self) -> Vec<f64> {
        let own = self.own.iter().flat_map(|own| own.as_flattened());
        own.chain(&self.others).copied().collect()
    }

    /// Replaces the reduced right-hand sides of the outer unknowns with their solutions.
    fn put(&mut self, solutions: &[f64]) {
        let (all, outer) = self.counts;
        let columns = self.others.chunks_exact_mut(all.max(1));
        for (column, given) in columns.zip(solutions.chunks_exact(outer.max(1))) {
            column[all - outer..].copy_from_slice(&given[..outer]);
        }
    }
}

impl Factor {
    /// Reduces right-hand sides over all unknowns of a part, one after the other, with the arguments as in [`Factor::solve`].
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn reduce_rights(
        &self,
        equations: &dyn Equations,
        rights: &[f64],
        context: &mut Context<'_>,
    ) -> Result<ReducedRights, SystemError> {
        let system = &*self.system;
        equations.prior().check(&system.layout)?;
        system.layout.check_columns("rights", rights.len())?;
        let reduced = context.run(Phase::Solve, system.layout.locals(), |control| {
            let elimination = self.elimination(equations, control);
            let counts = (system.symbolic.unknowns(), system.symbolic.outer_unknowns());
            let mut others = control.allocated(system.of_others(rights))?;
            let found = elimination.reduce::<LANES>(rights);
            found.iter().for_each(|found| found.add_to(&mut others, counts.0));
            self.forward_columns(&mut others);
            let own = found.into_iter().map(|found| found.own).collect();
            let mut reduced = ReducedRights { own, others, products: vec![], counts };
            reduced.products = elimination.products(&reduced, rights.len() / system.layout.unknowns().max(1));
            Some(reduced)
        });
        Ok(reduced?)
    }

    /// Solves for all unknowns of a part, from reduced right-hand sides and the solutions of the outer unknowns.
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn solve_reduced_rights<const C: usize>(
        &self,
        equations: &dyn Equations,
        mut reduced: ReducedRights<C>,
        outer: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, SystemError> {
        let system = &*self.system;
        equations.prior().check(&system.layout)?;
        let required = reduced.products.len().isqrt() * system.symbolic.outer_unknowns();
        LayoutError::unless_of_length("outer", outer.len(), required)?;
        let solved = context.run(Phase::Solve, system.layout.locals(), |control| {
            let elimination = self.elimination(equations, control);
            reduced.put(outer);
            let ReducedRights { own, mut others, products, .. } = reduced;
            self.backward_columns(&mut others);
            elimination.complete(Some(own), &others, products.len().isqrt())
        });
        Ok(solved?)
    }
}

impl Elimination<'_> {
    /// Returns the products y^T y of all right-hand sides, row by row.
    fn products(&self, reduced: &ReducedRights, columns: usize) -> Vec<f64> {
        let (mut sums, (all, outer)) = (vec![0.0; columns * columns], reduced.counts);
        let mut add = |y: &dyn Fn(usize) -> f64| {
            for (i, row) in sums.chunks_exact_mut(columns).enumerate() {
                row.iter_mut().enumerate().for_each(|(j, sum)| *sum += y(i) * y(j));
            }
        };
        for ((_, batches), own) in self.parts().into_iter().zip(&reduced.own) {
            let mut rest = &own[..];
            for locals in batches.iter() {
                let count = locals.len() * self.system.layout.local_dim();
                let (here, after) = rest.split_at(count * columns.div_ceil(LANES));
                (0..count).for_each(|row| add(&|k| here[k / LANES * count + row][k % LANES]));
                rest = after;
            }
        }
        (0..all - outer).for_each(|row| add(&|k| reduced.others[k * all + row]));
        sums
    }
}

impl Factor {
    /// Computes the chord step for equations and priors at values that differ from the linearization point of the factor.
    ///
    /// Requires a whole system and cached local eliminations ([`Factor::has_cached`]).
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn chord(&self, equations: &dyn Equations, context: &mut Context<'_>) -> Result<Chord, SystemError> {
        let rights = self.reduce_chord(equations, &equations.prior().right, context)?;
        let (reduced, decrease) = (rights.reduced(), rights.products[0]);
        let step = self.solve_reduced_rights(equations, rights, &[], context)?;
        Ok(Chord { step, reduced, decrease })
    }

    /// Reduces the right-hand side A^T l + `rights` of equations and priors at values that differ from the factor's linearization point.
    /// Local blocks are eliminated with the given equations, other unknowns with the factor. Bitwise identical for any number of threads.
    /// Requires cached local eliminations.
    ///
    /// `rights` contains the priors; for a part also the contributions of child systems, and zeros for outer unknowns.
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn reduce_chord(
        &self,
        equations: &dyn Equations,
        rights: &[f64],
        context: &mut Context<'_>,
    ) -> Result<ReducedRights<1>, SystemError> {
        let system = &*self.system;
        equations.prior().check(&system.layout)?;
        LayoutError::unless_of_length("rights", rights.len(), system.layout.unknowns())?;
        let reduced = context.run(Phase::Solve, system.layout.locals(), |control| {
            let counts = (system.symbolic.unknowns(), system.symbolic.outer_unknowns());
            let mut others = control.allocated(system.of_others(rights))?;
            system.add_rights_of_terms(equations, &mut others);
            let at_node = |index: usize| system.rights_at_node(equations, index, control);
            let found: Vec<Reduced<1>> = parallel::map_each((0..self.eliminated.len()).collect(), &at_node);
            // In a fixed order, independent of the threads.
            found.iter().for_each(|found| found.add_to(&mut others, counts.0));
            self.forward_columns(&mut others);
            let own: Vec<Vec<[f64; 1]>> = found.into_iter().map(|found| found.own).collect();
            let square = |values: &[f64]| dot(values, values);
            let of_locals = own.iter().map(|own| square(own.as_flattened())).sum::<f64>();
            let products = vec![of_locals + square(&others[..counts.0 - counts.1])];
            Some(ReducedRights { own, others, products, counts })
        });
        Ok(reduced?)
    }
}

impl System {
    /// Returns the right-hand sides of the local blocks of a supernode, and their contributions to other unknowns. Normal matrices are
    /// formed again from the equations, which is faster than reading the cache of the factor.
    fn rights_at_node(&self, equations: &dyn Equations, index: usize, control: &Control) -> Reduced<1> {
        let (mut batch, mut found) = (self.workspace.batch(), Reduced::default());
        for run in self.incidence.batches_at(index).iter().take_while(|_| !control.stopped()) {
            batch.gather(equations, self, run);
            batch.eliminate_from_rights(&self.layout, equations.prior());
            if !batch.uncoupled {
                found.own.extend_from_slice(batch.reduced.as_chunks().0);
            }
            let start = found.values.len();
            batch.ranges(&self.symbolic).for_each(|range| found.room(0, range));
            batch.add_rights_of_others(&self.layout, found.values[start..].as_flattened_mut());
            self.count(run, control);
        }
        self.workspace.put_back_batch(batch);
        found
    }

    /// Adds A^T l of terms of retained blocks to a right-hand side in elimination order.
    fn add_rights_of_terms(&self, equations: &dyn Equations, others: &mut [f64]) {
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        let mut buffer = RowBuffer::default();
        for (index, term) in layout.terms().iter().enumerate().filter(|(_, term)| term.local.is_none()) {
            let of_block = |&block: &u32| symbolic.range(symbolic.position(block as usize));
            let columns: Vec<usize> = term.retained.iter().flat_map(of_block).collect();
            let mut written = buffer.term(layout, index);
            equations.write_term(index, &mut written);
            for (row, constant) in written.shared.chunks_exact(columns.len()).zip(&*written.constant) {
                columns.iter().zip(row).for_each(|(&column, a)| others[column] += a * constant);
            }
        }
    }
}
