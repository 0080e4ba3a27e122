//! Block normal equations: formed, reduced, ordered, factored, solved and selectively inverted.
//!
//! The unknowns stand in one vector: *local* blocks of equal size (object points, stars), then *retained* blocks of any size (photographs,
//! cameras, a comparator). Each group of equations touches one local block, one main retained block and any further ones; ties are equations
//! among any retained blocks. One pass over a system is
//!
//! 1. [`Layout`]: which unknowns there are and which group touches which of them;
//! 2. [`System`]: the order of elimination and the pattern of the factor ([`Symbolic`]), once for all iterations;
//! 3. [`System::factor`]: the normal equations formed, the local blocks reduced out and the rest factored (block Cholesky on dense
//!    panels), front by front;
//! 4. [`System::solve`], for the right-hand side of the equations or any others;
//! 5. [`System::invert`]: the selected inverse, and cofactors of everything; [`System::reduce`] those of any linear functions.
//!
//! A system may be a part of a larger one ([`Layout::as_part`]): some retained blocks, the outer ones, stay when all others are eliminated. Their
//! front, ordered last, is assembled and left open, and is what the part leaves for the system above ([`Factor::take_contribution`]), into
//! whose fronts it goes like what a child leaves for its parent ([`Equations::contribution`]). The step and the inverse that
//! the system above has found for these blocks are options of the phases that go down. Cut near the top of its elimination tree, a system is
//! solved in pieces so, to the same result (Helmert 1880; Wolf 1978).
//!
//! ```
//! use std::ops::ControlFlow;
//!
//! use photocore::Threads;
//! use photocore::normals::{Equations, FactorOptions, GroupRows, Layout, Ordering, Prior, SolveOptions, System};
//!
//! /// x_local - y_retained = 1 for every pair.
//! struct Differences;
//!
//! impl Equations for Differences {
//!     fn write(&self, _local: usize, _group: usize, rows: &mut GroupRows<'_>) {
//!         (rows.constant[0], rows.local[0], rows.retained[0]) = (1.0, 1.0, -1.0);
//!     }
//! }
//!
//! // Three local and two retained unknowns; the first local one is held at zero by an equation of its own.
//! let layout = Layout::new(1, 1, &[1, 1], vec![0, 2, 4, 6], vec![0, 1, 0, 1, 0, 1])?;
//! let system = System::new(layout, Ordering::Auto)?;
//! let prior = Prior { weight: vec![1.0, 0.0, 0.0, 0.0, 0.0], right: vec![0.0; 5], between: vec![] };
//! let threads = Threads::new(1)?;
//! let mut go_on = |_| ControlFlow::Continue(());
//! let (factoring, solving) = (FactorOptions::default(), SolveOptions::default());
//! let factor = system.factor(&threads, &Differences, &prior, &factoring, &mut go_on)?;
//! let x = system.solve(&threads, &factor, &Differences, &prior, &solving, &mut go_on)?;
//! assert!(x.iter().zip([0.0, 0.0, 0.0, -1.0, -1.0]).all(|(x, expected)| (x - expected).abs() < 1e-12));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assembly;
mod batch;
mod cofactors;
mod columns;
mod contribution;
mod deficiency;
mod dense;
mod dissection;
mod eliminated;
mod equation_block;
mod equations;
mod error;
mod factor;
mod front;
mod functions;
mod graph;
mod incidence;
mod invert;
mod layout;
mod memory;
mod options;
mod ordering;
mod panels;
mod pattern;
mod products;
mod solve;
mod supernodes;
mod symbolic;
mod system;
mod tree;
mod triangle;
mod vectorised;
mod watch;
mod workspace;

pub use cofactors::{Cofactors, GroupCofactors};
pub use columns::{Chord, ReducedRights};
pub use contribution::{Contribution, packed};
pub use deficiency::Deficiency;
pub use dense::take_product_buffers;
pub use equation_block::LocalCofactors;
pub use equations::{Equations, GroupRows, Prior, TieRows};
pub use error::SystemError;
pub use factor::Factor;
pub use functions::{Function, Functions};
pub use graph::Graph;
pub use invert::Inversion;
pub use layout::{Layout, LayoutError, Tie};
pub use options::{FactorOptions, InvertOptions, SolveOptions};
pub use ordering::Ordering;
pub use panels::SelectedInverse;
pub use symbolic::{Operations, Symbolic};
pub use system::System;
pub(crate) use vectorised::dot;
pub use watch::Between;
