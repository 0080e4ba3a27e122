//! What is asked of a system besides its equations, phase by phase.

/// How normal equations are factored.
#[derive(Debug, Clone, Copy)]
pub struct FactorOptions {
    /// Added to the diagonal of the normal equations as a fraction of it.
    pub damping: f64,
    /// Whether what the elimination of the local blocks leaves is cached for [`System::solve`](super::System::solve), where that takes no
    /// more memory than results will: no equation is written again then.
    pub cached: bool,
}

impl FactorOptions {
    /// Undamped, for a factor that is asked for no solution, or for cofactors first.
    pub const UNCACHED: Self = Self { damping: 0.0, cached: false };
}

impl Default for FactorOptions {
    fn default() -> Self {
        Self { damping: 0.0, cached: true }
    }
}

/// What normal equations are solved for.
#[derive(Debug, Clone, Copy, Default)]
pub struct SolveOptions<'a> {
    /// Right-hand sides over all unknowns in the order of the layout, one after the other: columns of the inverse, propagated functions,
    /// other datums. None for the one that the equations have.
    pub rights: Option<&'a [f64]>,
    /// The outer unknowns of a part of a larger system, block by block, where the right-hand side is that of the equations.
    pub outer: &'a [f64],
}

/// Which cofactors are computed.
#[derive(Debug, Clone, Copy, Default)]
pub struct InvertOptions<'a> {
    /// The inverse over the outer unknowns of a part of a larger system: a lower triangle, block by block, column by column.
    pub outer: &'a [f64],
    /// Whether to find what the equations of each group have to do with each other ([`Cofactors::groups`](super::Cofactors::groups)).
    pub by_groups: bool,
}
