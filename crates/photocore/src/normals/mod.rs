//! Block normal equations: formed, reduced, ordered, factored, solved and selectively inverted.
//!
//! The unknowns stand in one vector: *local* blocks of equal size (object points, stars), then *kept* blocks of any size
//! (photographs), then a *border* of common unknowns (cameras). Each group of equations touches one local block, one kept
//! block and a range of the border; ties are equations among any kept blocks and the border. One pass over a system is
//!
//! 1. [`Layout`]: which unknowns there are and which group touches which of them;
//! 2. [`System`]: the order of elimination and the pattern of the factor ([`Symbolic`]), once for all iterations;
//! 3. [`System::factor`]: the normal equations formed, the local blocks reduced out and the rest factored (block Cholesky on dense
//!    panels), front by front;
//! 4. [`System::solve`], and [`System::solve_for`] for any other right-hand sides;
//! 5. [`System::invert`]: the selected inverse, and cofactors of everything.

mod cofactors;
mod dense;
mod dissection;
mod equations;
mod factor;
mod front;
mod graph;
mod incidence;
mod invert;
mod layout;
mod memory;
mod minimum_degree;
mod ordering;
mod panels;
mod solve;
mod solve_for;
mod stack;
mod symbolic;
mod system;
mod tie_equations;
mod ties;
mod tree;
mod triangle;
mod vectorised;
mod watch;
mod workspace;

pub use cofactors::Cofactors;
pub use equations::{Equations, GroupRows, Prior, TieRows};
pub use factor::{Deficiency, Factor};
pub use graph::Graph;
pub use invert::{Inversion, SelectedInverse};
pub use layout::{Layout, LayoutError, Tie};
pub use ordering::Ordering;
pub use symbolic::{Operations, Symbolic};
pub use system::System;
pub use watch::{Between, Stopped};
