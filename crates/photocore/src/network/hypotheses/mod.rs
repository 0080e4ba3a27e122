//! Hypotheses: which error do the residuals show, and which error would remain undetected, and what would it change?
//!
//! The model l = A x + v is compared with l = A x + C d + v. For each hypothesis C d (one file per type) the statistic T, its estimate d, the
//! minimal detectable bias (MDB), and what an undetected error of that size does to the points: internal and external reliability
//! (Baarda 1968), for one observation and for an error that a whole set has in common.

mod assignment;
mod attitudes;
mod cameras;
mod catalogue;
mod control;
mod deformations;
mod distances;
mod effect;
mod evaluation;
mod facts;
mod form;
mod groups;
mod hypothesis;
mod judged;
mod photos;
mod places;
mod points;
mod positions;
mod shutter;

pub use effect::Effect;
pub use facts::Facts;
pub use hypothesis::{About, Hypotheses, Hypothesis};
pub use judged::Judged;
