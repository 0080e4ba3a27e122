//! Log of data snooping: all exclusions and their reasons.

use super::super::test_groups::TestKind;
use super::super::trial::Excluded;
use crate::adjustment::Status;

/// State of a network without the excluded observations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Status of its adjustment.
    pub status: Status,
    /// Omega of the observations in use.
    pub sum_of_squares: f64,
    /// Their degrees of freedom f.
    pub degrees_of_freedom: i64,
}

/// Another group that may contain an error.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    /// Group.
    pub group: usize,
    /// T when the other group was selected.
    pub statistic: f64,
    /// Number of directions in which the error is detectable.
    pub dimension: usize,
    /// Likelihood ratio of the selected group and this one.
    pub odds: f64,
}

/// Reason for an exclusion, or further excluded observations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Consequence {
    /// The point of the group is not determined without it.
    PointUndetermined,
    /// A group of a point with a single ray.
    SingleRay(usize),
    /// The rays diverge.
    DivergentRays,
    /// Median test values of a photo and of all photos.
    Median(f64, f64),
    /// Number of excluded images of a photo, and of all its images.
    Singly(usize, usize),
    /// A consensus of the other photos contradicts the photo.
    Contradicted(usize),
}

/// Reason to retain a group although its test rejects it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// The network is not determined without it.
    Needed,
    /// A photo is not determined without it.
    PhotoUndetermined,
    /// Other groups explain the residuals as well.
    Disputed,
}

/// Excluded rows compared with the prediction from the other observations.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// T of the prediction.
    pub statistic: f64,
    /// Logarithm of its p-value.
    pub log_probability: f64,
    /// Observed minus predicted value of each row, in its unit; NaN for rows in use.
    pub error: Vec<f64>,
}

/// An excluded group of observations, a part of one, or a whole photo.
#[derive(Debug, Clone, PartialEq)]
pub struct Removal {
    /// Round, from 1; 0 before the first.
    pub round: usize,
    /// Group; for a photo, its first image.
    pub group: usize,
    /// Photo that is excluded with all its observations.
    pub photo: Option<usize>,
    /// Excluded rows; empty for a photo.
    pub rows: Vec<usize>,
    /// Number of directions in which the error is detectable.
    pub dimension: usize,
    /// T at the start of the round.
    pub first_statistic: f64,
    /// T conditional on earlier exclusions of the round.
    pub statistic: f64,
    /// F of this T.
    pub fisher: f64,
    /// Natural logarithm of the p-value.
    pub log_probability: f64,
    /// Limit of the p-value.
    pub limit: f64,
    /// Estimated errors of the rows, in their units.
    pub error: Vec<f64>,
    /// Standard deviations of these errors (a priori unit weight).
    pub error_sd: Vec<f64>,
    /// Smallest redundancy of a detectable direction.
    pub redundancy: f64,
    /// Groups that may contain the error instead.
    pub rivals: Vec<Rival>,
    /// Reasons, and further exclusions.
    pub consequences: Vec<Consequence>,
    /// Prediction from the other observations; None if the point or photo is excluded.
    pub prediction: Option<Predicted>,
    /// Round of the reinstatement.
    pub returned: Option<usize>,
    /// Reason to retain the group.
    pub kept: Option<Kept>,
}

impl Removal {
    /// Returns whether the group is excluded at the end.
    pub fn is_out(&self) -> bool {
        self.returned.is_none() && self.kept.is_none()
    }
}

/// A round of data snooping.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// Number from 1; 0 for a start without suspicious observations.
    pub number: usize,
    /// State at the start of the round.
    pub standing: Standing,
    /// Limit of the p-value below which a group is excluded.
    pub limit: f64,
    /// Exclusions, by their indices in the log.
    pub removed: Vec<usize>,
    /// Reinstatements, by their indices in the log.
    pub returned: Vec<usize>,
}

/// Remark on the course of data snooping.
#[derive(Debug, Clone, PartialEq)]
pub enum Remark {
    /// Standard deviations are too small: the factor of all of them, and of each type (see [`Log::factors`]).
    Factors {
        /// Factor from all test values.
        overall: f64,
        /// Types with their factors.
        by_type: Vec<(TestKind, f64)>,
    },
    /// Number of points that were excluded after a robust adjustment.
    Aside(usize),
    /// The maximum number of rounds is reached.
    NotEnded,
    /// Start from a consensus.
    Consensus {
        /// Whether all observations together had an adjustment.
        is_adjusted: bool,
        /// Number of images that the consensus excludes.
        images: usize,
        /// Number of images that agree with the others nevertheless.
        agreeing: usize,
    },
}

/// Result of data snooping.
#[derive(Debug, Clone)]
pub struct Log {
    /// All exclusions in order, with those that were reinstated or retained.
    pub removals: Vec<Removal>,
    /// Rounds; the last one is without exclusions.
    pub rounds: Vec<Round>,
    /// Remarks in order.
    pub remarks: Vec<Remark>,
    /// Excluded observations.
    pub out: Excluded,
    /// Number of tested groups at the start.
    pub tests: usize,
    /// State with all observations.
    pub before: Standing,
    /// State without the excluded ones.
    pub after: Standing,
    /// Robust factors of the standard deviations by type; empty if the given ones are used.
    pub factors: Vec<(TestKind, f64)>,
    /// Whether each group has rows in use at the end.
    pub active: Vec<bool>,
}
