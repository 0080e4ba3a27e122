//! Cofactors f^T N^-1 g of linear functions of the unknowns.
//!
//! With local blocks l eliminated, N_ll = L_l L_l^T, V = L_l^-1 N_lo and N_r = L L^T for the others o. A function f is reduced to y =
//! L_l^-1 f_l and e = f_o - V^T y:
//!
//! f^T N^-1 g = y_f^T y_g + e_f^T N_r^-1 e_g = y_f^T y_g + z_f^T z_g,    z = L^-1 e.
//!
//! Forward substitution is sufficient, and the result is symmetric and positive semidefinite by construction.

use std::collections::HashMap;

use super::batch::Batch;
use super::eliminated::{Coupled, EliminatedBatch, Reduced as OfLocal};
use super::equations::Equations;
use super::factor::Factor;
use super::layout::Layout;
use super::products::Products;
use super::symbolic::Symbolic;
use super::system::{System, SystemError};
use super::vectorised::dot;
use super::workspace::zeros;
use crate::context::{Context, Control, Phase};
use crate::{Stopped, parallel};

/// Linear function of the unknowns: indices of unknowns with their coefficients.
pub type Function = Vec<(usize, f64)>;

/// Function with the local blocks eliminated.
#[derive(Debug, Clone, Default)]
pub(super) struct Reduced {
    /// e: positions in elimination order, ascending, with their values.
    pub entries: Vec<(usize, f64)>,
    /// y for each of its local blocks, ascending.
    locals: Vec<(usize, [f64; 3])>,
}

/// Reduced functions: the rows of a cofactor matrix, and its columns unless they are the same functions.
#[derive(Debug)]
pub struct Functions {
    rows: Vec<Reduced>,
    columns: Option<Vec<Reduced>>,
}

/// Number of local blocks per task.
const CHUNK: usize = 64;
/// Ratio of the numbers of rows and columns above which the few functions are solved completely, each for all of the others.
const FEW: usize = 8;
/// Number of simultaneous solutions.
const TOGETHER: usize = 16;

impl Factor {
    /// Eliminates the local blocks from linear functions.
    ///
    /// With `columns` None, cofactors of all pairs of `rows` are computed. `equations` must be those of the factor; functions
    /// must not contain fixed or constrained unknowns.
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn reduce(
        &self,
        equations: &dyn Equations,
        rows: &[Function],
        columns: Option<&[Function]>,
        context: &mut Context<'_>,
    ) -> Result<Functions, SystemError> {
        let system = &*self.system;
        equations.prior().check(&system.layout)?;
        let reduced = context.run(Phase::Invert, self.system.layout.locals(), |control| {
            let places = system.symbolic.places(&system.layout);
            let work = Reduction { system, equations, places: &places, control };
            let rows = work.reduced(rows);
            Some(Functions { rows, columns: columns.map(|columns| work.reduced(columns)) })
        });
        Ok(reduced?)
    }

    /// Returns the maximum size of the cofactor computation in bytes, including the matrix.
    pub fn memory_of(&self, functions: &Functions) -> usize {
        let (rows, columns) = (functions.rows.len(), functions.columns.as_ref().map_or(0, Vec::len));
        let matrix = rows * if functions.columns.is_some() { columns } else { rows };
        let others = match functions.few() {
            Some((few, _, _)) => few.len().min(TOGETHER) * self.system.symbolic.unknowns(),
            None => Products::new(&self.system.symbolic, &functions.rights()).numbers(),
        };
        size_of::<f64>() * (matrix + others)
    }

    /// Computes the cofactors f^T N^-1 g: a matrix row by row, bitwise identical for any number of threads.
    ///
    /// # Errors
    /// Interruption or lack of memory.
    pub fn cofactors_of(
        &self,
        functions: &Functions,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, Stopped> {
        context.run(Phase::Invert, self.system.layout.locals(), |control| {
            let rows = &functions.rows;
            let columns = functions.columns.as_ref().unwrap_or(rows);
            let mut matrix = control.allocated(zeros(rows.len() * columns.len()))?;
            match functions.few() {
                Some((few, many, transposed)) => {
                    let mut target = Target { matrix: &mut matrix, width: columns.len(), transposed };
                    self.solve_few(few, many, &mut target, control)?;
                }
                None => {
                    let split = functions.columns.is_some().then_some(rows.len());
                    let products = Products::new(&self.system.symbolic, &functions.rights());
                    products.add(self, split, &mut matrix, control)?;
                }
            }
            add_locals(&mut matrix, rows, columns);
            Some(matrix)
        })
    }

    /// Computes e_f^T N_r^-1 e_g by a complete solution for each of a few functions.
    fn solve_few(
        &self,
        few: &[Reduced],
        many: &[Reduced],
        target: &mut Target<'_>,
        control: &Control,
    ) -> Option<()> {
        let count = self.system.symbolic.unknowns();
        for (batch, functions) in few.chunks(TOGETHER).enumerate() {
            let mut solutions = control.allocated(zeros(functions.len() * count))?;
            for (solution, function) in solutions.chunks_exact_mut(count.max(1)).zip(functions) {
                function.entries.iter().for_each(|&(place, value)| solution[place] = value);
            }
            parallel::each_chunk(&mut solutions, count, &|_, solution| {
                if !control.stopped() {
                    self.solve_columns(solution);
                }
            });
            for (i, solution) in solutions.chunks_exact(count.max(1)).enumerate() {
                for (j, function) in many.iter().enumerate() {
                    let product = |&(place, value): &(usize, f64)| value * solution[place];
                    target.put(batch * TOGETHER + i, j, function.entries.iter().map(product).sum());
                }
            }
        }
        Some(())
    }
}

impl Functions {
    /// Returns the smaller side, the larger side, and whether the smaller one contains columns; None if the sizes are similar.
    fn few(&self) -> Option<(&[Reduced], &[Reduced], bool)> {
        let (rows, columns) = (&self.rows, self.columns.as_ref()?);
        if rows.len() * FEW <= columns.len() {
            Some((rows, columns, false))
        } else {
            (columns.len() * FEW <= rows.len()).then_some((columns, rows, true))
        }
    }

    fn rights(&self) -> Vec<&[(usize, f64)]> {
        self.rows.iter().chain(self.columns.iter().flatten()).map(|function| &function.entries[..]).collect()
    }
}

/// Matrix that is written row by row or column by column.
struct Target<'a> {
    matrix: &'a mut [f64],
    width: usize,
    transposed: bool,
}

impl Target<'_> {
    fn put(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if self.transposed { (j, i) } else { (i, j) };
        self.matrix[row * self.width + column] = value;
    }
}

/// Adds y_f^T y_g for all functions.
fn add_locals(matrix: &mut [f64], rows: &[Reduced], columns: &[Reduced]) {
    let mut by_local: HashMap<usize, Vec<(usize, &[f64; 3])>> = HashMap::new();
    for (j, function) in columns.iter().enumerate() {
        function.locals.iter().for_each(|(local, y)| by_local.entry(*local).or_default().push((j, y)));
    }
    for (row, function) in matrix.chunks_exact_mut(columns.len().max(1)).zip(rows) {
        for (local, own) in &function.locals {
            for (j, y) in by_local.get(local).into_iter().flatten() {
                row[*j] += dot(own, *y);
            }
        }
    }
}

impl Symbolic {
    /// Returns the position of every retained unknown in elimination order; the first retained unknown has index 0.
    fn places(&self, layout: &Layout) -> Vec<usize> {
        let mut places = vec![0; self.unknowns()];
        let first = layout.all_locals().end;
        for position in 0..self.blocks() {
            for (unknown, place) in self.unknowns_at(layout, position).zip(self.range(position)) {
                places[unknown - first] = place;
            }
        }
        places
    }
}

struct Reduction<'a> {
    system: &'a System,
    equations: &'a dyn Equations,
    places: &'a [usize],
    control: &'a Control,
}

/// Terms of functions in a local block: index of the function and coefficients.
type Taken = Vec<(usize, [f64; 3])>;

/// Reduced function at a local block: its index, y, and contributions to e.
type Found = (usize, [f64; 3], Vec<(usize, f64)>);

impl Reduction<'_> {
    fn reduced(&self, functions: &[Function]) -> Vec<Reduced> {
        let layout = &self.system.layout;
        let (end, dim) = (layout.all_locals().end, layout.local_dim());
        let mut reduced = vec![Reduced::default(); functions.len()];
        let mut taken: HashMap<usize, Taken> = HashMap::new();
        for (index, function) in functions.iter().enumerate() {
            for &(unknown, coefficient) in function.iter().filter(|(_, coefficient)| *coefficient != 0.0) {
                if unknown >= end {
                    reduced[index].entries.push((self.places[unknown - end], coefficient));
                    continue;
                }
                let of_local = taken.entry(unknown / dim).or_default();
                if of_local.last().is_none_or(|last| last.0 != index) {
                    of_local.push((index, [0.0; 3]));
                }
                if let Some((_, coefficients)) = of_local.last_mut() {
                    coefficients[unknown % dim] += coefficient;
                }
            }
        }
        let mut taken: Vec<(usize, Taken)> = taken.into_iter().collect();
        taken.sort_by_key(|own| own.0);
        let found = parallel::map_each(taken.chunks(CHUNK).collect(), &|taken| self.at_locals(taken));
        for (local, found) in found.into_iter().flatten() {
            for (index, y, entries) in found {
                reduced[index].locals.push((local, y));
                reduced[index].entries.extend(entries);
            }
        }
        parallel::each_chunk(&mut reduced, TOGETHER, &|_, functions| {
            functions.iter_mut().for_each(|function| unite(&mut function.entries));
        });
        reduced
    }

    fn at_locals(&self, taken: &[(usize, Taken)]) -> Vec<(usize, Vec<Found>)> {
        let layout = &self.system.layout;
        let (mut batch, mut coupled) = (Batch::default(), Coupled::default());
        let mut at_local = |(local, taken): &(usize, Taken)| {
            batch.gather(self.equations, self.system, &[*local as u32]);
            batch.eliminate(layout, self.equations.prior(), 0.0);
            self.control.count(1);
            let batch = EliminatedBatch::new(self.system, &mut batch, &mut coupled);
            let of_function = |&(index, mut y): &(usize, [f64; 3])| {
                let (own, mut found) = (&mut y[..layout.local_dim()], OfLocal::<1>::default());
                found.own.extend_from_slice(own.as_chunks().0);
                batch.reduce(layout, 0, 0, &mut found);
                own.copy_from_slice(found.own.as_flattened());
                (index, y, found.entries())
            };
            (*local, taken.iter().map(of_function).collect())
        };
        taken.iter().take_while(|_| !self.control.stopped()).map(&mut at_local).collect()
    }
}

/// Sorts entries by position and sums duplicates.
fn unite(entries: &mut Vec<(usize, f64)>) {
    entries.sort_by_key(|&(place, _)| place);
    entries.dedup_by(|next, retained| {
        let same = next.0 == retained.0;
        if same {
            retained.1 += next.1;
        }
        same
    });
}
