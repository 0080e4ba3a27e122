//! The solution with an older factor for the right-hand sides that the equations have elsewhere.

use std::ops::ControlFlow;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::eliminated::{Coupled, OfHome, reduce};
use super::equations::{Equations, Prior, TieRows};
use super::factor::Factor;
use super::further::of_others;
use super::system::System;
use super::watch::{Between, Control, Stopped, watched};

impl System {
    /// N^-1 A^T l over all unknowns, in the order of the layout, N of the factor, A and l of equations and priors at other values of the
    /// unknowns: a chord step; and by how much it lowers the sum of squares of the equations there if N is their normal matrix. The same bits
    /// for any number of threads.
    ///
    /// For a factor that has kept what the elimination of the local blocks has left ([`Factor::has_kept`]). What systems below a part of
    /// a larger one have left is not in it.
    pub fn chord<E: Equations>(
        &self,
        pool: &ThreadPool,
        factor: &Factor,
        equations: &E,
        prior: &Prior,
        between: Between<'_>,
    ) -> ControlFlow<Stopped, (Vec<f64>, f64)> {
        watched(pool, between, |control| {
            let mut others = control.allocated(of_others(self, &prior.right))?;
            self.add_rights_of_ties(equations, &mut others);
            let at_home = |coupled: &mut Coupled, (index, kept): (usize, &Vec<f64>)| {
                self.rights_at_home(equations, prior, index, kept, coupled, control)
            };
            let homes = factor.eliminated.par_iter().enumerate();
            let found: Vec<OfHome> = homes.map_init(Coupled::default, at_home).collect();
            self.solve_reduced(factor, found, others, control)
        })
    }

    /// What the local blocks at home in a supernode have as right-hand sides, and what they leave to others.
    fn rights_at_home<E: Equations>(
        &self,
        equations: &E,
        prior: &Prior,
        index: usize,
        mut kept: &[f64],
        coupled: &mut Coupled,
        control: &Control,
    ) -> OfHome {
        let (mut stack, mut found) = (self.workspace.stack(), OfHome::default());
        for run in self.incidence.stacks_at(index).iter().take_while(|_| !control.stopped()) {
            stack.gather(self, equations, run);
            stack.rights_of_locals(&self.layout, prior, &mut found.own);
            let start = found.values.len();
            reduce(self, run, coupled, &mut kept, &mut found);
            stack.add_rights_of_others(&self.layout, &mut found.values[start..]);
            control.count(run.len());
        }
        self.workspace.put_back_stack(stack);
        found
    }

    /// Adds A^T l of ties to a right-hand side in the order of elimination.
    fn add_rights_of_ties<E: Equations>(&self, equations: &E, others: &mut [f64]) {
        let (layout, symbolic) = (&self.layout, &*self.symbolic);
        let (mut constant, mut coefficients) = (Vec::new(), Vec::new());
        for (index, tie) in layout.ties().iter().enumerate() {
            let of_block = |&block: &u32| symbolic.range(symbolic.position(block as usize));
            // The border is the last block.
            let last = symbolic.blocks().saturating_sub(1);
            let border = tie.border.clone().map(|k| symbolic.range(last).start + k as usize);
            let columns: Vec<usize> = tie.kept.iter().flat_map(of_block).chain(border).collect();
            constant.resize(tie.rows, 0.0);
            coefficients.resize(tie.rows * columns.len(), 0.0);
            equations
                .write_tie(index, &mut TieRows { constant: &mut constant, coefficients: &mut coefficients });
            for (row, constant) in coefficients.chunks_exact(columns.len()).zip(&constant) {
                columns.iter().zip(row).for_each(|(&column, a)| others[column] += a * constant);
            }
        }
    }
}
