//! Block normal equations: formed, reduced, ordered, factored, solved and selectively inverted.
//!
//! The unknowns stand in one vector: *local* blocks of equal size (object points, stars), then *kept* blocks of any size
//! (photographs), then a *border* of common unknowns (cameras). Each group of equations touches one local block, one kept
//! block and a range of the border. One pass over a system is
//!
//! 1. [`Layout`]: which unknowns there are and which group touches which of them;
//! 2. [`System`]: the order of elimination and the pattern of the factor ([`Symbolic`]), once for all iterations;
//! 3. [`System::form`]: the local blocks reduced out while the normal equations are formed;
//! 4. [`Normals::factor`]: block Cholesky on dense panels;
//! 5. [`System::solve`], [`Factor::into_selected_inverse`] and [`System::cofactors`].

mod cofactors;
mod dense;
mod dissection;
mod elimination;
mod factor;
mod floors;
mod form;
mod graph;
mod invert;
mod layout;
mod minimum_degree;
mod ordering;
mod panels;
mod solve;
mod symbolic;
mod system;
mod triangle;

pub use cofactors::Cofactors;
pub use elimination::{Equations, GroupRows};
pub use factor::{Deficiency, Factor};
pub use form::Normals;
pub use graph::Graph;
pub use invert::SelectedInverse;
pub use layout::{Layout, LayoutError};
pub use ordering::Ordering;
pub use solve::Solution;
pub use symbolic::{Operations, Symbolic};
pub use system::{Between, Prior, System};
