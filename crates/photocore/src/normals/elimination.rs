//! One local block: its equations gathered, its unknowns eliminated.

use std::cmp::Ordering::Greater;

use super::layout::Layout;
use super::symbolic::Symbolic;

/// Where the equations of a system come from.
///
/// The equations are `A x = l` with unit weight (each row divided by the standard deviation of its observation).
pub trait Equations: Sync {
    /// Writes the equations of one group of a local block; `rows` is zero on entry.
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>);
}

/// The rows of one group of equations, to be filled in. Matrices are row by row.
#[derive(Debug)]
pub struct GroupRows<'a> {
    /// Right-hand sides l (rows).
    pub constant: &'a mut [f64],
    /// Coefficients of the local block (rows x local unknowns).
    pub local: &'a mut [f64],
    /// Coefficients of the kept block (rows x its unknowns).
    pub kept: &'a mut [f64],
    /// Coefficients of the group's range of the border (rows x its length).
    pub border: &'a mut [f64],
}

/// Sorts the groups of every local block by the position of their kept blocks in the order of elimination.
#[derive(Debug)]
pub(crate) struct Incidence {
    pub groups: Vec<u32>,
    pub positions: Vec<u32>,
}

impl Incidence {
    pub fn new(layout: &Layout, symbolic: &Symbolic) -> Self {
        let mut sorted: Vec<(u32, u32)> = Vec::with_capacity(layout.groups());
        for local in 0..layout.locals() {
            let start = sorted.len();
            sorted.extend(
                layout.groups_of(local).map(|g| (symbolic.position(layout.kept_of(g)) as u32, g as u32)),
            );
            sorted[start..].sort_unstable();
        }
        let (positions, groups) = sorted.into_iter().unzip();
        Self { groups, positions }
    }
}

/// A kept block that a local block is tied to, and its coupling after elimination.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot {
    /// Its place in the order of elimination.
    pub position: usize,
    /// Its unknowns.
    pub dim: usize,
    /// Where its coupling V = L^-1 N_local,kept (local unknowns x dim, row by row) starts in [`Elimination::coupling`].
    pub coupling: usize,
    /// Its groups are `Elimination::groups[first..end]`.
    pub first: usize,
    /// End of its groups.
    pub end: usize,
}

/// Where the rows of one group start in the buffers of an [`Elimination`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupPlace {
    pub group: usize,
    pub constant: usize,
    pub local: usize,
    pub kept: usize,
    pub border: usize,
    pub border_first: usize,
    pub border_width: usize,
}

/// The equations of one local block and what its elimination leaves:
/// with N = L L^T its normal matrix, v = L^-1 n and V = L^-1 N_local,other.
///
/// The reduced normal equations lose V^T V, their right-hand side V^T v; the solution is x = L^-T (v - V x_other).
#[derive(Debug, Clone, Default)]
pub(crate) struct Elimination {
    pub groups: Vec<GroupPlace>,
    pub slots: Vec<Slot>,
    pub constants: Vec<f64>,
    pub local_rows: Vec<f64>,
    pub kept_rows: Vec<f64>,
    pub border_rows: Vec<f64>,
    /// L, row by row in a 3 x 3 frame.
    pub factor: [[f64; 3]; 3],
    pub reduced: [f64; 3],
    pub coupling: Vec<f64>,
    pub border_coupling: Vec<f64>,
    pub sum_of_squares: f64,
    pub deficient: bool,
}

/// A pivot smaller than this fraction of its diagonal element before elimination is rounding error: the unknown is not determined.
pub(crate) const PIVOT_TOLERANCE: f64 = 64.0 * f64::EPSILON;

impl Elimination {
    /// Gathers the equations of local block `local` and eliminates its unknowns.
    ///
    /// `prior` holds weight and right-hand side of each of its unknowns; `damping` is added to the diagonal as a fraction of it.
    pub fn run(
        &mut self,
        layout: &Layout,
        incidence: &Incidence,
        equations: &impl Equations,
        local: usize,
        prior: (&[f64], &[f64]),
        damping: f64,
    ) {
        self.gather(layout, incidence, equations, local);
        match layout.local_dim() {
            3 => self.eliminate::<3>(layout, prior, damping),
            2 => self.eliminate::<2>(layout, prior, damping),
            _ => self.eliminate::<1>(layout, prior, damping),
        }
    }

    fn gather(&mut self, layout: &Layout, incidence: &Incidence, equations: &impl Equations, local: usize) {
        let (rows, l) = (layout.rows(), layout.local_dim());
        self.groups.clear();
        self.slots.clear();
        let (mut constant, mut kept, mut border, mut coupling) = (0, 0, 0, 0);
        for sorted in layout.groups_of(local) {
            let (group, position) = (incidence.groups[sorted] as usize, incidence.positions[sorted] as usize);
            let dim = layout.kept_dim(layout.kept_of(group));
            match self.slots.last_mut() {
                Some(slot) if slot.position == position => slot.end += 1,
                _ => {
                    let first = self.groups.len();
                    self.slots.push(Slot { position, dim, coupling, first, end: first + 1 });
                    coupling += l * dim;
                }
            }
            let range = layout.border_of(group);
            let (border_first, border_width) = (range.start, range.len());
            let own = constant * l;
            self.groups.push(GroupPlace {
                group,
                constant,
                local: own,
                kept,
                border,
                border_first,
                border_width,
            });
            constant += rows;
            kept += rows * dim;
            border += rows * border_width;
        }
        for (buffer, length) in [
            (&mut self.constants, constant),
            (&mut self.local_rows, constant * l),
            (&mut self.kept_rows, kept),
            (&mut self.border_rows, border),
            (&mut self.coupling, coupling),
            (&mut self.border_coupling, l * layout.border_dim()),
        ] {
            buffer.clear();
            buffer.resize(length, 0.0);
        }
        for slot in &self.slots {
            for place in &self.groups[slot.first..slot.end] {
                equations.write(
                    local,
                    place.group,
                    &mut GroupRows {
                        constant: &mut self.constants[place.constant..][..rows],
                        local: &mut self.local_rows[place.local..][..rows * l],
                        kept: &mut self.kept_rows[place.kept..][..rows * slot.dim],
                        border: &mut self.border_rows[place.border..][..rows * place.border_width],
                    },
                );
            }
        }
    }

    fn eliminate<const L: usize>(&mut self, layout: &Layout, prior: (&[f64], &[f64]), damping: f64) {
        let rows = layout.rows();
        let mut normal = [[0.0; L]; L];
        let mut right = [0.0; L];
        for d in 0..L {
            normal[d][d] = prior.0[d];
            right[d] = prior.1[d];
        }
        self.sum_of_squares = 0.0;
        for (row, constant) in self.local_rows.chunks_exact(L).zip(&self.constants) {
            for a in 0..L {
                right[a] += row[a] * constant;
                for b in 0..=a {
                    normal[a][b] += row[a] * row[b];
                }
            }
            self.sum_of_squares += constant * constant;
        }
        for d in 0..L {
            normal[d][d] *= 1.0 + damping;
        }
        self.deficient = !cholesky(&mut normal);
        let solve = |column: &mut [f64; L]| {
            for a in 0..L {
                for b in 0..a {
                    column[a] -= normal[a][b] * column[b];
                }
                column[a] /= normal[a][a];
            }
        };
        solve(&mut right);
        for a in 0..L {
            self.reduced[a] = right[a];
            for b in 0..L {
                self.factor[a][b] = normal[a][b];
            }
        }
        for slot in &self.slots {
            let coupling = &mut self.coupling[slot.coupling..][..L * slot.dim];
            for place in &self.groups[slot.first..slot.end] {
                let local = &self.local_rows[place.local..][..rows * L];
                let kept = &self.kept_rows[place.kept..][..rows * slot.dim];
                add_product::<L>(coupling, slot.dim, 0, local, kept, slot.dim);
            }
            for column in 0..slot.dim {
                let mut values = std::array::from_fn(|d| coupling[d * slot.dim + column]);
                solve(&mut values);
                (0..L).for_each(|d| coupling[d * slot.dim + column] = values[d]);
            }
        }
        let border = layout.border_dim();
        for place in self.groups.iter().filter(|place| place.border_width > 0) {
            let local = &self.local_rows[place.local..][..rows * L];
            let common = &self.border_rows[place.border..][..rows * place.border_width];
            add_product::<L>(
                &mut self.border_coupling,
                border,
                place.border_first,
                local,
                common,
                place.border_width,
            );
        }
        for column in 0..border {
            let mut values = std::array::from_fn(|d| self.border_coupling[d * border + column]);
            solve(&mut values);
            (0..L).for_each(|d| self.border_coupling[d * border + column] = values[d]);
        }
    }

    /// x = L^-T (v - V x_other) for the unknowns of the local block; `solution` is in the order of elimination.
    pub fn back_substitute(&self, layout: &Layout, symbolic: &Symbolic, solution: &[f64], x: &mut [f64]) {
        let l = layout.local_dim();
        let mut right = self.reduced;
        for slot in &self.slots {
            let other = &solution[symbolic.range(slot.position)];
            for d in 0..l {
                right[d] -= dot(&self.coupling[slot.coupling + d * slot.dim..][..slot.dim], other);
            }
        }
        let border = layout.border_dim();
        let common = &solution[solution.len() - border..];
        for d in 0..l {
            right[d] -= dot(&self.border_coupling[d * border..][..border], common);
        }
        self.solve_transposed(&mut right, l);
        x.copy_from_slice(&right[..l]);
    }

    /// Replaces x by N^-1 x = L^-T L^-1 x.
    pub fn solve_normal(&self, x: &mut [f64; 3], l: usize) {
        for a in 0..l {
            for b in 0..a {
                x[a] -= self.factor[a][b] * x[b];
            }
            x[a] /= self.factor[a][a];
        }
        self.solve_transposed(x, l);
    }

    /// Replaces x by L^-T x.
    pub fn solve_transposed(&self, x: &mut [f64; 3], l: usize) {
        for a in (0..l).rev() {
            for b in a + 1..l {
                x[a] -= self.factor[b][a] * x[b];
            }
            x[a] /= self.factor[a][a];
        }
    }
}

/// Cholesky factor in place of the lower triangle; false when a pivot is lost in rounding (it is then replaced by one).
fn cholesky<const L: usize>(n: &mut [[f64; L]; L]) -> bool {
    let mut regular = true;
    for j in 0..L {
        let diagonal = n[j][j];
        for k in 0..j {
            n[j][j] -= n[j][k] * n[j][k];
        }
        let lost = !matches!(n[j][j].partial_cmp(&(PIVOT_TOLERANCE * diagonal)), Some(Greater));
        if lost {
            regular = false;
            n[j][j] = 1.0;
        }
        n[j][j] = n[j][j].sqrt();
        for i in j + 1..L {
            for k in 0..j {
                n[i][j] -= n[i][k] * n[j][k];
            }
            n[i][j] /= n[j][j];
        }
    }
    regular
}

/// target[d][first + c] += sum over rows of local[row][d] * other[row][c].
#[inline]
fn add_product<const L: usize>(
    target: &mut [f64],
    stride: usize,
    first: usize,
    local: &[f64],
    other: &[f64],
    width: usize,
) {
    for (row, values) in local.chunks_exact(L).zip(other.chunks_exact(width)) {
        for d in 0..L {
            for (sum, value) in target[d * stride + first..][..width].iter_mut().zip(values) {
                *sum += row[d] * value;
            }
        }
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
