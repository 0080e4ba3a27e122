//! Options of the phases: factorisation, solution and inversion.

/// Options of the factorisation.
#[derive(Debug, Clone, Copy)]
pub struct FactorOptions {
    /// Fraction of the diagonal of the normal equations that is added to it.
    pub damping: f64,
    /// Whether local eliminations are cached for [`System::solve`](super::System::solve), so that equations are not evaluated again.
    /// Ignored if the cache would exceed the memory of the results.
    pub cached: bool,
}

impl FactorOptions {
    /// No damping and no cache: for a factor without solutions, or with cofactors first.
    pub const UNCACHED: Self = Self { damping: 0.0, cached: false };
}

impl Default for FactorOptions {
    fn default() -> Self {
        Self { damping: 0.0, cached: true }
    }
}

/// Options of the solution.
#[derive(Debug, Clone, Copy, Default)]
pub struct SolveOptions<'a> {
    /// Right-hand sides over all unknowns in the order of the layout, one after the other, e.g. for columns of the inverse or other datums.
    /// None selects the right-hand side of the equations.
    pub rights: Option<&'a [f64]>,
    /// Values of the outer unknowns of a partial system, block by block, for the right-hand side of the equations.
    pub outer: &'a [f64],
}

/// Options of the inversion.
#[derive(Debug, Clone, Copy, Default)]
pub struct InvertOptions<'a> {
    /// Inverse over the outer unknowns of a partial system: lower triangle, block by block, column by column.
    pub outer: &'a [f64],
    /// Whether to compute the leverage matrix of each group ([`Cofactors::groups`](super::Cofactors::groups)).
    pub by_groups: bool,
}
