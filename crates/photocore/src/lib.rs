//! Photogrammetric least-squares adjustment with the covariance of every result.
//!
//! The crate has four layers; each layer uses only the layers below it:
//!
//! * [`network`]: simultaneous adjustment of cameras, photos, points and observations;
//! * [`adjustment`]: iteration, weights, convergence and statistics, independent of photogrammetry;
//! * [`normals`]: ordering, reduction, factorisation, solution and selected inverse of block normal equations;
//! * [`geometry`]: poses, cameras, projection, ellipsoid and refraction as pure functions with partial derivatives.
//!
//! Vectors and matrices are [`nalgebra`] types. The crate does not read files, print or use global state.
//!
//! # From a network to covariances
//!
//! The main types of the adjustment of a block with fixed cameras, in the order of the computation. Other types are parts of these or serve
//! special cases.
//!
//! | step | layer | types |
//! | --- | --- | --- |
//! | input | `network` | `Network`, `Options` |
//! | threads, progress, cancellation | crate | `Context` |
//! | active points, photos and images | `network` | `Selected` |
//! | parameters and observation equations | `network` | `Bundle`, `Assembled` |
//! | pattern of the normal equations | `normals` | `Layout`, `Symbolic`, `Incidence`, `System` |
//! | least-squares problem | `adjustment` | `Problem`, `PriorTerms` |
//! | iterations | `adjustment` | `Run`, `Linearized` |
//! | values at given parameters | `network` | `LinearizationPoint` |
//! | image, pose and point | `geometry` | `Camera`, `Orientation`, `Point` |
//! | weighted equations | `adjustment` | `Evaluated`, `ObservationEquations` |
//! | rows and normal matrices | `normals` | `GroupRows`, `Prior`, `Batch`, `Front`, `Formation` |
//! | factor and inverse | `normals` | `Factor`, `SelectedInverse`, `Cofactors` |
//! | results | `adjustment` | `Adjustment`, `Leverages` |
//! | results in the terms of the network | `network` | `Solution` |
//!
//! # Cofactors
//!
//! With the inverse normal matrix Q, the query for cofactors f^T Q g of any functions f and g of the unknowns is
//! [`adjustment::Linearized::cofactors`]. Every other computation of cofactors has a reason:
//!
//! | quantity | function | reason |
//! | --- | --- | --- |
//! | blocks of Q in the pattern of the factor; a Q a^T of each observation | [`normals::Factor::invert`] | all of them in one traversal |
//! | a Q a^T of pairs of equations, also of excluded ones | [`adjustment::Leverages::of_locals`], [`adjustment::Leverages::of_rows`] | from the selected inverse, without a solution |
//! | Q h over all unknowns | [`adjustment::Linearized::solve_for`] | a vector, not a matrix of functions |
//! | R z of errors z | [`adjustment::Linearized::project`] | R is not stored |
//! | redundancy matrix of additional parameters | [`adjustment::Linearized::additional`] | right-hand sides of all observations, formed while points are eliminated |
//! | Q in another datum | `adjustment::transformation` | changes any of these results without another factor |
//! | Q of the outer blocks of a part | [`normals::InvertOptions`] | the parent system, which may be elsewhere, computes it |

pub mod adjustment;
mod context;
pub mod geometry;
pub mod network;
pub mod normals;
mod parallel;

/// Functions that other crates of this project use; they may change at any time.
#[doc(hidden)]
pub mod internal {
    pub use crate::adjustment::{ObservationEquations, Reweighting, Transformation, median, moved};
    pub use crate::geometry::principal_axes;
    pub use crate::network::{Assembled, Selected, meet};
    pub use crate::parallel::map;
}

pub use context::{Context, Event, Iteration, Phase};
pub use nalgebra;
pub use parallel::{Stopped, Threads};

/// Compiles and runs the example in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
