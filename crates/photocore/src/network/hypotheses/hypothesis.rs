//! A hypothesis, tested and with its effect.

use super::super::GroupId;
use super::effect::Effect;
use super::judged::Judged;

/// What a hypothesis is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// A group of observations, or one of its components.
    Group(GroupId, Option<usize>),
    /// A set of the facts, or a camera; None for all.
    Set(Option<usize>),
}

/// An error that observations may have, tested and with its effect.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Code of the type: `control-heights`, `lever-arm`, `camera-f` ...
    pub code: &'static str,
    /// What it is about.
    pub about: About,
    /// Names of its parameters.
    pub parameters: Vec<&'static str>,
    /// Number of observations that depend on the parameters.
    pub observations: usize,
    /// Standard deviations of the parameters before the data are used; empty if unknown.
    pub plausible: Vec<f64>,
    /// Test and internal reliability, in the units of the parameters.
    pub judged: Judged,
    /// Standard deviation of the estimate if the error differs between photos; only of significant readout times.
    pub sd_between_photos: Option<f64>,
    /// What an undetected error changes: one of the size of the MDB or, if there is none, of the plausible size. None if its bias-to-noise
    /// ratio excludes an effect above the limit.
    pub effect: Option<Effect>,
    /// Changes of the coordinates of the check points by its parameters, row by row: of sets and, with [`Facts::by_component`](super::Facts), of
    /// groups with effects.
    pub at_checks: Vec<f64>,
}

/// All hypotheses of an adjusted network.
#[derive(Debug, Clone)]
pub struct Hypotheses {
    /// Errors that sets have in common, then errors of groups and components.
    pub all: Vec<Hypothesis>,
    /// How many of them are errors of sets: the first ones.
    pub sets: usize,
    /// Correlation of the scores of two of these (the largest canonical one), row by row.
    pub correlations: Vec<f64>,
}
