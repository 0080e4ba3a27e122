//! Data snooping: detection and exclusion of gross errors, with one symbolic analysis for all adjustments.
//!
//! v are the residuals of a group of observations divided by their standard deviations, R their cofactors, Omega the weighted sum of
//! squares and f the degrees of freedom. With m the rank of R, an error of the group has
//!
//! T = v^T R^- v,    chi-square with m degrees of freedom,
//!
//! F = (T / m) / ((Omega - T) / (f - m)),    F(m, f - m) if the unit weight is unknown.
//!
//! Each round excludes the least probable groups whose p-value is below alpha / n, for n tests at the start (Bonferroni), each conditional
//! on the others of the round:
//!
//! v <- v - R_S R_SS^- v_S,    R <- R - R_S R_SS^- R_S^T
//!
//! for the excluded rows S (Hadi and Simonoff 1993). The network is then adjusted without them. An excluded group with d observed minus
//! predicted and the cofactors C of d returns if the p-value of d^T C^-1 d is not below the limit. Rounds end when nothing changes.
//!
//! * A group with alternatives of a likelihood ratio exp((T - T') / 2) below 20 is disputed: it is retained and reported with their odds,
//!   unless it is an image.
//! * A photo most of whose images are excluded is excluded as a whole.
//! * Many gross errors require a robust start. If the adjustment diverges, a consensus of the caller is the start.

mod choosing;
mod conditional;
mod consensus;
mod disputes;
mod exclusion;
mod groups;
mod log;
mod reinstatement;
mod robust_start;
mod rounds;
mod settings;
mod state;
mod tried;
mod unit_weight;
mod whole_photos;

#[cfg(test)]
mod tests;

pub use consensus::Consensus;
pub use log::{Consequence, Kept, Log, Predicted, Remark, Removal, Rival, Round, Standing};
pub use settings::{ControlParts, Settings};
pub use state::Snooping;
pub use tried::{Session, Tried};
