//! Selected inversion: blocks of the inverse inside the pattern of the factor (Takahashi et al. 1973). It starts at the root of the
//! elimination tree and includes the cofactors of local blocks and equations.
//!
//! Unfactored front of the outer unknowns (see [`Contribution`]).

use std::sync::Arc;
use std::time::Instant;

use faer::{MatMut, MatRef};

use super::cofactors::{Cofactors, NodeCofactors, leverages_of_groups};
use super::contribution::{Contribution, packed, unpack};
use super::dense::invert_front;
use super::equations::Equations;
use super::factor::Factor;
use super::layout::LayoutError;
use super::panels::{Panels, PerSupernode, SelectedInverse};
use super::symbolic::Symbolic;
use super::system::{System, SystemError};
use crate::context::{Context, Control, Phase};
use crate::parallel::lock;

/// Options of the inversion.
#[derive(Debug, Clone, Copy, Default)]
pub struct InvertOptions<'a> {
    /// Inverse over the outer unknowns of a partial system: lower triangle, block by block, column by column.
    pub outer: &'a [f64],
    /// Whether to compute the leverage matrix of each group ([`Cofactors::groups`](super::Cofactors::groups)).
    pub by_groups: bool,
}

/// Cofactors with the selected inverse.
#[derive(Debug)]
pub struct Inversion {
    /// Cofactors of every unknown and every equation.
    pub cofactors: Cofactors,
    /// Blocks of the inverse inside the pattern of the factor.
    pub selected: SelectedInverse,
    /// Fraction of the computing time of all threads for the selected inverse; the rest is for the other cofactors.
    pub inversion_share: f64,
}

impl Factor {
    /// Computes all cofactors.
    ///
    /// `equations` must be those of the factor, and its damping must be zero.
    ///
    /// # Errors
    /// Interruption, lack of memory, or lengths that contradict the layout.
    pub fn invert(
        mut self,
        equations: &dyn Equations,
        options: &InvertOptions<'_>,
        context: &mut Context<'_>,
    ) -> Result<Inversion, SystemError> {
        equations.prior().check(&self.system.layout)?;
        let outer = packed(self.system.symbolic.outer_unknowns());
        LayoutError::unless_of_length("InvertOptions::outer", options.outer.len(), outer)?;
        self.forget();
        let Self { system, mut panels, diagonal, .. } = self;
        let total = system.layout.locals();
        context.run(Phase::Invert, total, |control| {
            let information = system.information(&diagonal);
            panels.reopen();
            Walk { system: &system, equations, options, control }.invert(panels, information)
        })?
    }
}

impl System {
    /// Takes over the memory of an inverse for the next factor; the inverse is empty afterwards.
    pub fn reuse(&self, inverse: &mut SelectedInverse) {
        self.workspace.put_back_panels(std::mem::take(&mut inverse.panels.values));
    }

    /// Converts the initial diagonal of the normal equations from elimination order to the order of the retained blocks in the layout.
    fn information(&self, diagonal: &[f64]) -> Vec<f64> {
        let retained = self.layout.all_retained();
        let mut information = vec![0.0; retained.len()];
        let positions = 0..self.symbolic.blocks();
        let unknowns = positions.flat_map(|position| self.symbolic.unknowns_at(&self.layout, position));
        let of_retained = unknowns.zip(diagonal).filter(|(unknown, _)| retained.contains(unknown));
        of_retained.for_each(|(unknown, &n)| information[unknown - retained.start] = n);
        information
    }
}

/// Inverse over the rows of one front (eliminated blocks, then coupled blocks), full square, column by column.
type Front = Arc<Vec<f64>>;

struct Walk<'a> {
    system: &'a System,
    equations: &'a dyn Equations,
    options: &'a InvertOptions<'a>,
    control: &'a Control,
}

impl Walk<'_> {
    /// Inverts all panels; None if memory is insufficient.
    fn invert(&self, mut panels: Panels, information: Vec<f64>) -> Option<Result<Inversion, SystemError>> {
        let symbolic = &*self.system.symbolic;
        let count = symbolic.supernode_count();
        // Front of the parent of each unprocessed supernode; a front is released after its last child.
        let above = PerSupernode::new(count);
        let at_node = PerSupernode::new(count);
        let divided = panels.divide();
        self.system.start();
        self.system.tree.downward(&|index| {
            if !self.control.stopped()
                && let Some(found) = self.visit(index, &mut lock(&divided[index]), &above)
            {
                at_node.put(index, found);
            }
        });
        drop(divided);
        let (mut inversion, mut rest) = (0.0, 0.0);
        let mut found = Vec::with_capacity(count + 1);
        for (at_node, seconds) in at_node.into_values().flatten() {
            found.push(at_node);
            inversion += seconds;
            rest += found[found.len() - 1].seconds;
        }
        found.push(self.at_node(count, &[], 0));
        let selected = SelectedInverse { panels };
        let of_blocks = match self.blocks(&selected) {
            Ok([retained, pairs]) => [retained, pairs, information],
            Err(error) => return Some(Err(error.into())),
        };
        let mut cofactors = Cofactors::collect(self.system, self.equations, self.control, &found, of_blocks)?;
        if self.options.by_groups {
            cofactors.groups = Some(leverages_of_groups(self.system, self.control, &found)?);
        }
        let inversion_share = if inversion > 0.0 { inversion / (inversion + rest) } else { 0.0 };
        Some(Ok(Inversion { cofactors, selected, inversion_share }))
    }

    /// Returns the diagonal blocks of the inverse for all retained blocks, one after the other, and the blocks of the pairs.
    fn blocks(&self, selected: &SelectedInverse) -> Result<[Vec<f64>; 2], LayoutError> {
        let layout = &self.system.layout;
        let (mut retained, mut pairs) = (vec![], vec![]);
        for block in 0..layout.retained() {
            retained.extend(selected.block(block, block)?);
        }
        for &[row, column] in layout.pairs() {
            pairs.extend(selected.block(row as usize, column as usize)?);
        }
        Ok([retained, pairs])
    }

    /// Inverts one panel from the front of its parent, and passes its own front to its children. Returns the cofactors of the local blocks
    /// at this supernode, and the time of the inversion in seconds. None if memory is insufficient.
    fn visit(
        &self,
        index: usize,
        panel: &mut [f64],
        above: &PerSupernode<Front>,
    ) -> Option<(NodeCofactors, f64)> {
        let symbolic = &*self.system.symbolic;
        let s = &symbolic.supernodes()[index];
        let start = Instant::now();
        let (height, width) = (s.height(), s.width);
        let workspace = &self.system.workspace;
        let mut front = self.control.allocated(workspace.any(height * height))?;
        if let Some(parent) = above.take(index) {
            take_coupled_rows(symbolic, index, &parent, &mut front);
            Arc::into_inner(parent).into_iter().for_each(|last| workspace.put_back(last));
        }
        if symbolic.open() == Some(index) {
            unpack(width, self.options.outer, panel);
        } else {
            let z = MatRef::from_column_major_slice(&front, height, height);
            let below = z.submatrix(width, width, height - width, height - width);
            let panel = MatMut::from_column_major_slice_mut(panel, height, width);
            invert_front(panel, below, workspace, self.control)?;
        }
        for (j, column) in panel.chunks_exact(height.max(1)).enumerate() {
            front[j * height + j..(j + 1) * height].copy_from_slice(&column[j..]);
            (j..height).for_each(|i| front[i * height + j] = column[i]);
        }
        let seconds = start.elapsed().as_secs_f64();
        let front = Arc::new(front);
        let at_node = self.at_node(index, &front, height);
        s.children.iter().for_each(|&child| above.put(child, Arc::clone(&front)));
        Arc::into_inner(front).into_iter().for_each(|last| workspace.put_back(last));
        Some((at_node, seconds))
    }

    fn at_node(&self, index: usize, front: &[f64], height: usize) -> NodeCofactors {
        let Self { system, equations, options, control } = *self;
        NodeCofactors::new(system, index, equations, control, front, height, options.by_groups)
    }
}

/// Copies the inverse over the coupled rows of a supernode from the front of its parent.
fn take_coupled_rows(symbolic: &Symbolic, index: usize, parent: &[f64], front: &mut [f64]) {
    let s = &symbolic.supernodes()[index];
    let Some(above) = s.parent else { return };
    let (height, order) = (s.height(), symbolic.supernodes()[above].height());
    let runs = symbolic.rows_in_parent(index);
    for &(to_column, from_column, columns) in &runs {
        for k in 0..columns {
            let source = &parent[(from_column + k) * order..][..order];
            let target = &mut front[(s.width + to_column + k) * height + s.width..][..height - s.width];
            for &(to_row, from_row, rows) in &runs {
                target[to_row..to_row + rows].copy_from_slice(&source[from_row..from_row + rows]);
            }
        }
    }
}

impl Factor {
    /// Returns the contribution to the outer unknowns, in the order of the layout, and releases their front. Empty for a whole system, and
    /// at the second call.
    pub fn take_contribution(&mut self) -> Contribution<'static> {
        let symbolic = &*self.panels.symbolic;
        let Some(open) = symbolic.open() else { return Contribution::default() };
        let (s, first) = (&symbolic.supernodes()[open], symbolic.first_unknown(open));
        if self.panels.values.len() < s.panel.end {
            return Contribution::default();
        }
        let mut matrix = Vec::with_capacity(packed(s.width));
        for (j, column) in self.panels.panel(open).chunks_exact(s.width.max(1)).enumerate() {
            matrix.extend_from_slice(&column[j..]);
        }
        self.panels.values.truncate(s.panel.start);
        self.panels.values.shrink_to_fit();
        Contribution {
            matrix: matrix.into(),
            right: self.right[first..].to_vec().into(),
            diagonal: self.diagonal[first..].to_vec().into(),
        }
    }
}

impl Panels {
    /// Allocates the released front of the outer unknowns again.
    pub fn reopen(&mut self) {
        self.values.resize(self.symbolic.values(), 0.0);
    }
}
