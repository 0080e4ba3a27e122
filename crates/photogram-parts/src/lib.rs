//! Networks that are adjusted in parts: Helmert blocking (Helmert 1880; Wolf 1978), on the engine of [`photocore`].
//!
//! The parts are the nodes of the elimination tree of a network that is cut near its root. [`Node`] is one of them; a driver, which may
//! use several machines, passes contributions from children to parents, and steps and cofactors from parents to children.
//! [`held_for_datum`] and [`parts_in_datum`] define the datum of the whole network.

mod datum;
mod interface;
mod node;

pub use datum::{AdjustedInParts, DatumColumns, DatumOfPart, UnknownName, held_for_datum, parts_in_datum};
pub use node::{FormedNode, Node};
