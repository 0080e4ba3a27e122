//! Where the equations of a system come from.

use super::contribution::Contribution;
use super::layout::{Layout, LayoutError};

/// Where the equations of a system come from.
///
/// The equations are `A x = l` with unit weight (each row divided by the standard deviation of its observation).
pub trait Equations: Sync {
    /// Writes the equations of one group of a local block, every element of `rows`.
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>);

    /// Writes those of one group each of several local blocks, one after the other: `groups` says which. All are alike: they have the same
    /// main block, and as much in common with others.
    fn write_alike(&self, locals: &[u32], groups: &[u32], rows: &mut GroupRows<'_>) {
        for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
            self.write(local as usize, group as usize, &mut rows.part(t, locals.len()));
        }
    }

    /// Writes the equations of one tie, every element of `rows`. Not called where the layout has no ties.
    fn write_tie(&self, _tie: usize, _rows: &mut TieRows<'_>) {}

    /// What a system below has left, in the order of the layout. Not called where there is none.
    fn contribution(&self, _below: usize) -> Option<&Contribution<'_>> {
        None
    }
}

/// The rows of one tie, to be filled in.
#[derive(Debug)]
pub struct TieRows<'a> {
    /// Right-hand sides l (rows).
    pub constant: &'a mut [f64],
    /// Coefficients, row by row: those of its retained blocks in their order.
    pub coefficients: &'a mut [f64],
}

/// The rows of one group of equations, to be filled in. Matrices are row by row.
#[derive(Debug)]
pub struct GroupRows<'a> {
    /// Right-hand sides l (rows).
    pub constant: &'a mut [f64],
    /// Coefficients of the local block (rows x local unknowns).
    pub local: &'a mut [f64],
    /// Coefficients of the main retained block (rows x its unknowns).
    pub retained: &'a mut [f64],
    /// Coefficients of what the group has in common with others (rows x [`Layout::shared_width`]): those of its shared blocks in
    /// their order.
    pub shared: &'a mut [f64],
}

impl GroupRows<'_> {
    /// Those of one of so many groups that are alike.
    #[inline(always)]
    pub(crate) fn part(&mut self, t: usize, count: usize) -> GroupRows<'_> {
        GroupRows {
            constant: part(self.constant, t, count),
            local: part(self.local, t, count),
            retained: part(self.retained, t, count),
            shared: part(self.shared, t, count),
        }
    }
}

/// One of so many equal parts.
#[inline(always)]
fn part(all: &mut [f64], t: usize, count: usize) -> &mut [f64] {
    let width = all.len() / count;
    &mut all[t * width..][..width]
}

/// Weights of the unknowns themselves: equations `x_i = constant_i` of the given weight. The first two have the length of the
/// vector of unknowns.
#[derive(Debug, Clone, Default)]
pub struct Prior {
    /// Weight w of each unknown; 0 leaves it free.
    pub weight: Vec<f64>,
    /// Weight times constant, w l.
    pub right: Vec<f64>,
    /// Weights between unknowns i > j of one retained block: (i, j, w), ascending.
    pub between: Vec<(usize, usize, f64)>,
}

impl Prior {
    /// An error unless both lengths are those of a layout.
    pub(super) fn check(&self, layout: &Layout) -> Result<(), LayoutError> {
        let Self { weight, right, .. } = self;
        LayoutError::unless_of_length("Prior::weight", weight.len(), layout.unknowns())?;
        LayoutError::unless_of_length("Prior::right", right.len(), layout.unknowns())
    }

    /// The normal equations of the unknowns of one local block themselves: diagonal, with the damping still to come, and
    /// right-hand side.
    #[inline(always)]
    pub(super) fn of_local<const L: usize>(
        &self,
        layout: &Layout,
        local: usize,
    ) -> ([[f64; L]; L], [f64; L]) {
        let first = layout.local_range(local).start;
        let mut normal = [[0.0; L]; L];
        (0..L).for_each(|d| normal[d][d] = self.weight[first + d]);
        (normal, std::array::from_fn(|d| self.right[first + d]))
    }
}
