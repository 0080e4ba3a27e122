//! Observation equations and priors: the input of a formation.

use super::contribution::Contribution;
use super::layout::{Layout, LayoutError, Term};

/// Source of the equations of a system.
///
/// The equations are `A x = l` with unit weight (each row divided by the standard deviation of its observation).
pub trait Equations: Sync {
    /// Writes the equations of one group of a local block, every element of `rows`.
    fn write(&self, local: usize, group: usize, rows: &mut GroupRows<'_>);

    /// Writes the equations of one group per local block, in sequence; `groups` contains the group numbers. All groups have the same main
    /// block and the same shared blocks.
    fn write_batch(&self, locals: &[u32], groups: &[u32], rows: &mut GroupRows<'_>) {
        for (t, (&local, &group)) in locals.iter().zip(groups).enumerate() {
            self.write(local as usize, group as usize, &mut rows.part(t, locals.len()));
        }
    }

    /// Writes the equations of one term, every element of `rows` (see [`RowBuffer::term`]). Only called if the layout has terms.
    fn write_term(&self, _term: usize, _rows: &mut GroupRows<'_>) {}

    /// Returns the prior equations of single unknowns.
    fn prior(&self) -> &Prior;

    /// Returns the contribution of a child system, in the order of the layout. Only called if there are child systems.
    fn contribution(&self, _below: usize) -> Option<&Contribution<'_>> {
        None
    }
}

/// Memory for the rows of one group or term.
#[derive(Debug, Default)]
pub struct RowBuffer {
    constant: Vec<f64>,
    coefficients: [Vec<f64>; 3],
}

impl RowBuffer {
    /// Returns the rows of a group, with undefined contents.
    pub fn group(&mut self, layout: &Layout, group: usize) -> GroupRows<'_> {
        let main = layout.retained_dim(layout.retained_of(group));
        self.rows(layout.rows(), [layout.local_dim(), main, layout.shared_width(group)])
    }

    /// Returns the rows of a term, with undefined contents: coefficients of its local block, or of all retained blocks as shared ones.
    pub fn term(&mut self, layout: &Layout, term: usize) -> GroupRows<'_> {
        let Term { rows, local, retained } = &layout.terms()[term];
        let width = layout.unknowns_of(retained).count();
        self.rows(*rows, [local.map_or(0, |_| layout.local_dim()), 0, width])
    }

    /// Returns rows with the given numbers of coefficients of the local, the main and the shared blocks.
    pub(crate) fn rows(&mut self, rows: usize, widths: [usize; 3]) -> GroupRows<'_> {
        self.constant.resize(rows, 0.0);
        self.coefficients.iter_mut().zip(widths).for_each(|(part, width)| part.resize(rows * width, 0.0));
        let [local, retained, shared] = &mut self.coefficients;
        GroupRows { constant: &mut self.constant, local, retained, shared }
    }
}

/// Output rows of one group or term. Matrices are stored row by row.
#[derive(Debug)]
pub struct GroupRows<'a> {
    /// Right-hand sides l (rows).
    pub constant: &'a mut [f64],
    /// Coefficients of the local block (rows x local unknowns).
    pub local: &'a mut [f64],
    /// Coefficients of the main retained block (rows x its unknowns).
    pub retained: &'a mut [f64],
    /// Coefficients of the shared blocks, in order (rows x [`Layout::shared_width`]).
    pub shared: &'a mut [f64],
}

impl GroupRows<'_> {
    /// Returns the coefficients of a term; columns are the unknowns of its blocks, in order.
    pub fn of_term(&mut self) -> &mut [f64] {
        if self.local.is_empty() { self.shared } else { self.local }
    }

    /// Returns the rows of group `t` of `count` similar groups.
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

/// Returns part `t` of `count` equal parts.
#[inline(always)]
fn part(all: &mut [f64], t: usize, count: usize) -> &mut [f64] {
    let width = all.len() / count;
    &mut all[t * width..][..width]
}

/// Prior observations of unknowns: equations `x_i = constant_i` of a given weight. `weight` and `right` have one element per unknown.
#[derive(Debug, Clone, Default)]
pub struct Prior {
    /// Weight w of each unknown; 0 for a free unknown.
    pub weight: Vec<f64>,
    /// Weight times constant, w l.
    pub right: Vec<f64>,
    /// Weights between unknowns i > j of one retained block: (i, j, w), ascending.
    pub between: Vec<(usize, usize, f64)>,
}

impl Prior {
    /// Returns an error if a length differs from the layout.
    pub(super) fn check(&self, layout: &Layout) -> Result<(), LayoutError> {
        let Self { weight, right, .. } = self;
        LayoutError::unless_of_length("Prior::weight", weight.len(), layout.unknowns())?;
        LayoutError::unless_of_length("Prior::right", right.len(), layout.unknowns())
    }

    /// Returns the prior normal equations of a local block: undamped diagonal matrix and right-hand side.
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
