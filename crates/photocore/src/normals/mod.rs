//! Block normal equations: formation, reduction, ordering, factorisation, solution and selected inverse.
//!
//! The vector of unknowns consists of *local* blocks of equal size (object points, stars) and *retained* blocks of any size (photos,
//! cameras, a comparator). Each group of equations involves one local block, one main retained block and optional shared ones. Terms are
//! equations among retained blocks. A system is processed in five steps:
//!
//! 1. [`Layout`]: the unknowns, and the blocks in each group of equations;
//! 2. [`System`]: the elimination order and the pattern of the factor ([`Symbolic`]), computed once for all iterations;
//! 3. [`System::factor`]: formation of the normal equations, elimination of the local blocks (Schur complement) and block Cholesky
//!    factorisation on dense panels, front by front;
//! 4. [`Factor::solve`]: solution for the right-hand side of the equations or for any others;
//! 5. [`Factor::invert`]: the selected inverse with all cofactors. [`Factor::reduce`] prepares the cofactors of linear functions.
//!
//! A system may be part of a larger one ([`Layout::as_part`]). Its outer retained blocks are not eliminated: their front, ordered last, is
//! assembled but not factored. It is the contribution to the parent system ([`Factor::take_contribution`]), which adds it to its own fronts
//! ([`Equations::contribution`]). The parent system returns the step and the inverse of the outer blocks as options of the later phases. A
//! system that is cut near the root of its elimination tree is so solved in parts, with the same result (Helmert 1880; Wolf 1978).
//!
//! ```
//! use photocore::{Context, Threads};
//! use photocore::normals::{Equations, FactorOptions, GroupRows, Layout, Ordering, Prior, SolveOptions, System};
//!
//! /// x_local - y_retained = 1 for every pair.
//! struct Differences {
//!     prior: Prior,
//! }
//!
//! impl Equations for Differences {
//!     fn write(&self, _local: usize, _group: usize, rows: &mut GroupRows<'_>) {
//!         (rows.constant[0], rows.local[0], rows.retained[0]) = (1.0, 1.0, -1.0);
//!     }
//!
//!     fn prior(&self) -> &Prior {
//!         &self.prior
//!     }
//! }
//!
//! // Three local and two retained unknowns; the first local one is held at zero by an equation of its own.
//! let layout = Layout::new(1, 1, &[1, 1], vec![0, 2, 4, 6], vec![0, 1, 0, 1, 0, 1])?;
//! let system = System::new(layout, Ordering::Auto)?;
//! let prior = Prior { weight: vec![1.0, 0.0, 0.0, 0.0, 0.0], right: vec![0.0; 5], between: vec![] };
//! let equations = Differences { prior };
//! let threads = Threads::new(1)?;
//! let mut context = Context::new(&threads);
//! let factor = system.factor(&equations, &FactorOptions::default(), &mut context)?;
//! let x = factor.solve(&equations, &SolveOptions::default(), &mut context)?;
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
mod factor;
mod front;
mod functions;
mod graph;
mod incidence;
mod invert;
mod layout;
mod memory;
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
mod workspace;

pub use cofactors::Cofactors;
pub use columns::{Chord, ReducedRights};
pub use contribution::{Contribution, packed};
pub use deficiency::Deficiency;
pub use dense::preallocate_product_buffers;
pub use equation_block::RowCofactors;
pub use equations::{Equations, GroupRows, Prior, RowBuffer};
pub use factor::{Factor, FactorOptions};
pub use functions::{Function, Functions};
pub use graph::Graph;
pub use invert::{Inversion, InvertOptions};
pub use layout::{Layout, LayoutError, Term};
pub use ordering::Ordering;
pub use panels::SelectedInverse;
pub use solve::SolveOptions;
pub use symbolic::{Operations, Symbolic};
pub use system::{System, SystemError};
pub(crate) use vectorised::{LANES, dot};
