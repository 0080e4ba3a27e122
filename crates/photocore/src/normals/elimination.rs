//! One local block: its equations gathered, its unknowns eliminated.

use super::layout::Layout;
use super::symbolic::Symbolic;
use super::triangle::{Triangle, for_local_dim};

/// Where the equations of a system come from.
///
/// The equations are `A x = l` with unit weight (each row divided by the standard deviation of its observation).
pub trait Equations: Sync {
    /// Writes the equations of one group of a local block, every element of `rows`.
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
/// The reduced normal equations lose V^T V, their right-hand side V^T v.
#[derive(Debug, Clone, Default)]
pub(crate) struct Elimination {
    pub groups: Vec<GroupPlace>,
    pub slots: Vec<Slot>,
    pub constants: Vec<f64>,
    pub local_rows: Vec<f64>,
    pub kept_rows: Vec<f64>,
    pub border_rows: Vec<f64>,
    pub triangle: Triangle,
    /// v.
    pub reduced: [f64; 3],
    pub coupling: Vec<f64>,
    pub border_coupling: Vec<f64>,
    pub sum_of_squares: f64,
    pub deficient: bool,
    /// The unknowns of the local block, after [`Elimination::solve`].
    pub solution: [f64; 3],
}

/// Weight and right-hand side of the prior equations of each unknown of a local block.
pub(crate) type LocalPrior<'a> = (&'a [f64], &'a [f64]);

impl Elimination {
    /// Gathers the equations of a local block.
    #[inline(always)]
    pub fn gather(
        &mut self,
        layout: &Layout,
        incidence: &Incidence,
        equations: &impl Equations,
        local: usize,
    ) {
        let (rows, l) = (layout.rows(), layout.local_dim());
        self.place(layout, incidence, local);
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

    /// Finds the slots of a local block and the places of its groups in the buffers.
    fn place(&mut self, layout: &Layout, incidence: &Incidence, local: usize) {
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
        self.constants.resize(constant, 0.0);
        self.local_rows.resize(constant * l, 0.0);
        self.kept_rows.resize(kept, 0.0);
        self.border_rows.resize(border, 0.0);
        self.coupling.resize(coupling, 0.0);
        self.border_coupling.resize(l * layout.border_dim(), 0.0);
    }

    /// Eliminates the unknowns of the local block.
    #[inline(always)]
    pub fn eliminate(&mut self, layout: &Layout, prior: LocalPrior<'_>, damping: f64) {
        for_local_dim!(layout.local_dim(), L => {
            self.factor::<L>(prior, damping);
            self.couple::<L>(layout);
        });
    }

    /// Factors the normal matrix of the local block; `damping` is added to its diagonal as a fraction of it.
    #[inline(always)]
    fn factor<const L: usize>(&mut self, prior: LocalPrior<'_>, damping: f64) {
        let mut normal = [[0.0; L]; L];
        let mut right = [0.0; L];
        for d in 0..L {
            normal[d][d] = prior.0[d];
            right[d] = prior.1[d];
        }
        self.sum_of_squares = 0.0;
        for (row, constant) in self.local_rows.as_chunks::<L>().0.iter().zip(&self.constants) {
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
        self.deficient = !self.triangle.factor(&normal);
        self.triangle.forward::<L>(&mut right, 1);
        self.reduced[..L].copy_from_slice(&right);
    }

    /// Computes the coupling V to the kept blocks and the border.
    #[inline(always)]
    fn couple<const L: usize>(&mut self, layout: &Layout) {
        let rows = layout.rows();
        self.coupling.fill(0.0);
        for slot in &self.slots {
            let coupling = &mut self.coupling[slot.coupling..][..L * slot.dim];
            for place in &self.groups[slot.first..slot.end] {
                let local = &self.local_rows[place.local..][..rows * L];
                let kept = &self.kept_rows[place.kept..][..rows * slot.dim];
                match slot.dim {
                    6 => add_product::<L>(coupling, 6, 0, local, kept, 6),
                    dim => add_product::<L>(coupling, dim, 0, local, kept, dim),
                }
            }
            match slot.dim {
                6 => self.triangle.forward::<L>(coupling, 6),
                dim => self.triangle.forward::<L>(coupling, dim),
            }
        }
        let border = layout.border_dim();
        self.border_coupling.fill(0.0);
        for place in self.groups.iter().filter(|place| place.border_width > 0) {
            let local = &self.local_rows[place.local..][..rows * L];
            let common = &self.border_rows[place.border..][..rows * place.border_width];
            let (first, width) = (place.border_first, place.border_width);
            add_product::<L>(&mut self.border_coupling, border, first, local, common, width);
        }
        self.triangle.forward::<L>(&mut self.border_coupling, border);
    }

    /// Solves for the local block with the others in place: N x = A^T (l - A_other x_other), without the coupling.
    /// `solution` is in the order of elimination.
    #[inline(always)]
    pub fn solve<const L: usize>(
        &mut self,
        layout: &Layout,
        symbolic: &Symbolic,
        prior: LocalPrior<'_>,
        damping: f64,
        solution: &[f64],
    ) {
        self.factor::<L>(prior, damping);
        let mut right: [f64; L] = std::array::from_fn(|d| prior.1[d]);
        let border = &solution[solution.len() - layout.border_dim()..];
        for slot in &self.slots {
            let other = &solution[symbolic.range(slot.position)];
            for place in &self.groups[slot.first..slot.end] {
                let common = &border[place.border_first..][..place.border_width];
                for row in 0..layout.rows() {
                    let kept = &self.kept_rows[place.kept + row * slot.dim..][..slot.dim];
                    let common_row = &self.border_rows[place.border + row * place.border_width..];
                    let left =
                        self.constants[place.constant + row] - dot(kept, other) - dot(common_row, common);
                    let own = &self.local_rows[place.local + row * L..][..L];
                    (0..L).for_each(|d| right[d] += own[d] * left);
                }
            }
        }
        self.triangle.forward::<L>(&mut right, 1);
        self.triangle.backward::<L>(&mut right, 1);
        self.solution[..L].copy_from_slice(&right);
    }
}

/// target[d][first + c] += sum over rows of local[row][d] * other[row][c].
#[inline(always)]
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

#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
