//! Settings of data snooping.

/// Parts of a control point, or of the weighted pose of a photo, that may be excluded alone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ControlParts {
    /// None: the whole is excluded.
    Whole,
    /// Plan, height or all of a control point with three components; otherwise single components.
    #[default]
    PlanAndHeight,
    /// Single components, or all of a control point.
    Components,
}

/// Settings of data snooping.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Settings {
    /// Joint level of all tests, or the false discovery rate.
    pub level: f64,
    /// Whether `level` is the false discovery rate: the limit increases with the exclusions.
    pub is_rate: bool,
    /// Whether the given standard deviations are correct: tests are chi-square, otherwise F.
    pub known: bool,
    /// Whether to start from a robust adjustment. None: if many observations are wrong, or the adjustment diverges.
    pub robust: Option<bool>,
    /// Maximum number of rounds.
    pub max_rounds: usize,
    /// Parts of control points and poses that may be excluded alone.
    pub control: ControlParts,
    /// Convergence limit of a round in a large network; see [`super::super::Trial::adjust`].
    pub rough: f64,
    /// Convergence limit if the cofactors of all rows are used, and for [`super::Snooping::adjust_exactly`].
    pub exact: f64,
    /// Maximum number of rows for which the cofactors of all rows are computed.
    pub max_rows: usize,
    /// Whether the pose of each photo is determined without images. Photos behind the last one are records of trajectories.
    pub is_supported: Vec<bool>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            level: 0.05,
            is_rate: false,
            known: true,
            robust: None,
            max_rounds: 20,
            control: ControlParts::default(),
            rough: 2.0,
            exact: 1e-7,
            max_rows: 1500,
            is_supported: vec![],
        }
    }
}
