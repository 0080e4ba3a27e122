//! Products z_f^T z_g of solutions z = L^-1 e, in one traversal from the leaves of the elimination tree.
//!
//! A right-hand side that starts at a supernode is nonzero only there and at its ancestors, which it shares with other subtrees. Rows of a
//! supernode are not needed after their products are computed. A front is therefore the largest part of a solution in memory.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, MatRef, Par};

use super::factor::Factor;
use super::symbolic::Symbolic;
use super::workspace::zeros;
use crate::context::Control;
use crate::parallel;

/// Right-hand sides, sorted by their first supernode.
pub(super) struct Products<'a> {
    symbolic: &'a Symbolic,
    count: usize,
    /// Supernode, column, row of the front, value; ascending.
    entries: Vec<(usize, usize, usize, f64)>,
}

/// Update of a supernode for its parent: nonzero columns, and their values in the coupled rows, column by column.
struct Update {
    columns: Vec<usize>,
    values: Vec<f64>,
}

/// Number of columns per solution of a front, and size of the tiles of the products.
const TOGETHER: usize = 32;

impl<'a> Products<'a> {
    /// Sorts right-hand sides, given as ascending positions in elimination order with their values.
    pub fn new(symbolic: &'a Symbolic, rights: &[&[(usize, f64)]]) -> Self {
        let mut supernode_of = vec![0; symbolic.unknowns()];
        for index in 0..symbolic.supernode_count() {
            let (first, width) = (symbolic.first_unknown(index), symbolic.supernodes()[index].width);
            supernode_of[first..first + width].fill(index);
        }
        let mut entries: Vec<(usize, usize, usize, f64)> = Vec::new();
        for (column, right) in rights.iter().enumerate() {
            entries.extend(right.iter().map(|&(place, value)| {
                let index = supernode_of[place];
                (index, column, place - symbolic.first_unknown(index), value)
            }));
        }
        entries.sort_by_key(|&(index, column, row, _)| (index, column, row));
        Self { symbolic, count: rights.len(), entries }
    }

    /// Returns the maximum number of values in fronts and updates.
    pub fn numbers(&self) -> usize {
        let supernodes = self.symbolic.supernodes();
        let mut begun = vec![0; supernodes.len()];
        for entries in self.entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            begun[entries[0].0] += 1;
        }
        let (mut waiting, mut most) = (0, 0);
        for (index, s) in supernodes.iter().enumerate() {
            let of_children: usize = s.children.iter().map(|&child| begun[child]).sum();
            begun[index] = (begun[index] + of_children).min(self.count);
            most = most.max(waiting + (s.height() + s.below()) * begun[index]);
            waiting += s.below() * begun[index];
            waiting -=
                s.children.iter().map(|&child| supernodes[child].below() * begun[child]).sum::<usize>();
        }
        most
    }

    /// Adds the products to a matrix, row by row: of all pairs of columns, or of columns before `split` with columns from `split`.
    pub fn add(
        &self,
        factor: &Factor,
        split: Option<usize>,
        matrix: &mut [f64],
        control: &Control,
    ) -> Option<()> {
        let supernodes = self.symbolic.supernodes();
        let mut updates: Vec<Option<Update>> = supernodes.iter().map(|_| None).collect();
        let mut rest = &self.entries[..];
        for (index, s) in supernodes.iter().enumerate() {
            if control.stopped() {
                return None;
            }
            let (own, others) = rest.split_at(rest.partition_point(|entry| entry.0 == index));
            rest = others;
            let children: Vec<(usize, Update)> =
                s.children.iter().filter_map(|&child| Some((child, updates[child].take()?))).collect();
            let mut columns: Vec<usize> =
                children.iter().flat_map(|(_, update)| &update.columns).copied().collect();
            columns.extend(own.iter().map(|entry| entry.1));
            columns.sort_unstable();
            columns.dedup();
            if columns.is_empty() {
                continue;
            }
            let mut front = control.allocated(zeros(s.height() * columns.len()))?;
            self.assemble(&mut front, s.height(), &columns, own, &children);
            drop(children);
            let (top, below) = factor.panel(index);
            parallel::each_chunk(&mut front, TOGETHER * s.height(), &|_, values| {
                let count = values.len() / s.height();
                let all = MatMut::from_column_major_slice_mut(values, s.height(), count);
                let (mut solved, coupled) = all.split_at_row_mut(s.width);
                solve_lower_triangular_in_place(top, solved.as_mut(), Par::Seq);
                matmul(coupled, Accum::Add, below, solved.as_ref(), -1.0, Par::Seq);
            });
            let solved =
                MatRef::from_column_major_slice(&front, s.height(), columns.len()).subrows(0, s.width);
            Tiles { columns: &columns, solved, split, count: self.count }.add(matrix);
            if s.parent.is_some() {
                let mut values = control.allocated(zeros(s.below() * columns.len()))?;
                let coupled = front.chunks_exact(s.height()).map(|column| &column[s.width..]);
                values
                    .chunks_exact_mut(s.below())
                    .zip(coupled)
                    .for_each(|(values, coupled)| values.copy_from_slice(coupled));
                updates[index] = Some(Update { columns, values });
            }
        }
        if split.is_none() {
            mirror(matrix, self.count);
        }
        Some(())
    }

    /// Adds right-hand sides that start at a supernode, and updates of its children, to its front.
    fn assemble(
        &self,
        front: &mut [f64],
        height: usize,
        columns: &[usize],
        own: &[(usize, usize, usize, f64)],
        children: &[(usize, Update)],
    ) {
        let place = |column: usize| columns.partition_point(|&other| other < column) * height;
        own.iter().for_each(|&(_, column, row, value)| front[place(column) + row] += value);
        for (child, update) in children {
            let (runs, below) =
                (self.symbolic.rows_in_parent(*child), self.symbolic.supernodes()[*child].below());
            for (&column, values) in update.columns.iter().zip(update.values.chunks_exact(below)) {
                let target = &mut front[place(column)..][..height];
                for &(from, to, count) in &runs {
                    let pairs = target[to..to + count].iter_mut().zip(&values[from..from + count]);
                    pairs.for_each(|(sum, value)| *sum += value);
                }
            }
        }
    }
}

/// Products of the columns of one front.
struct Tiles<'a> {
    columns: &'a [usize],
    solved: MatRef<'a, f64>,
    split: Option<usize>,
    count: usize,
}

impl Tiles<'_> {
    /// Adds the products; if there is one set of columns, only on and below the diagonal.
    fn add(&self, matrix: &mut [f64]) {
        let Self { columns, split, count, .. } = *self;
        let rows = split.map_or(columns.len(), |split| columns.partition_point(|&column| column < split));
        let width = count - split.unwrap_or(0);
        if rows == 0 || width == 0 {
            return;
        }
        let first = columns[0];
        let mut wanted = columns[..rows].iter().peekable();
        let mut targets: Vec<&mut [f64]> = Vec::with_capacity(rows);
        for (row, target) in (first..).zip(matrix[first * width..].chunks_exact_mut(width)) {
            match wanted.peek() {
                None => break,
                Some(&&next) if next == row => {
                    wanted.next();
                    targets.push(target);
                }
                Some(_) => {}
            }
        }
        parallel::each_chunk(&mut targets, TOGETHER, &|tile, targets| {
            let begin = tile * TOGETHER;
            let (start, end) = split.map_or((0, begin + targets.len()), |_| (rows, columns.len()));
            for at in (start..end).step_by(TOGETHER) {
                let wide = TOGETHER.min(end - at);
                let mut product = Mat::<f64>::zeros(targets.len(), wide);
                let (left, right) =
                    (self.solved.subcols(begin, targets.len()), self.solved.subcols(at, wide));
                matmul(product.as_mut(), Accum::Replace, left.transpose(), right, 1.0, Par::Seq);
                for (i, target) in targets.iter_mut().enumerate() {
                    for j in 0..wide {
                        target[columns[at + j] - split.unwrap_or(0)] += product[(i, j)];
                    }
                }
            }
        });
    }
}

/// Copies the lower triangle of a square matrix to the upper one.
fn mirror(matrix: &mut [f64], count: usize) {
    for i in 0..count {
        for j in 0..i {
            matrix[j * count + i] = matrix[i * count + j];
        }
    }
}
