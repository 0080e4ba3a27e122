//! A network where its adjustment has ended, kept with its cofactors: tests of it, and trials without some observations, begin there
//! without forming, factoring and inverting once more.

use super::Network;
use super::problem::Assembled;
use super::trial::Trial;
use crate::adjustment::{self, Tried};

/// A network where its adjustment has converged.
///
/// Its cofactors are those of the adjustment: before the last step, which has moved no unknown by more than a thousandth of its standard
/// deviation.
#[derive(Debug)]
pub struct Settled {
    assembled: Assembled,
    options: adjustment::Options,
    found: Tried,
}

impl Settled {
    pub(super) fn new(assembled: Assembled, options: adjustment::Options, found: Tried) -> Self {
        assembled.problem.system.release();
        Self { assembled, options, found }
    }

    /// Prepares for trials of the network, which is the one that was adjusted; [`Trial::stand`] is done already.
    pub fn trial(self, network: &Network) -> Trial {
        let Self { mut assembled, options, found } = self;
        assembled.problem.initial.clone_from(&found.values);
        let held = found.held.clone();
        Trial::new(network, assembled, &options, held, Some(found))
    }
}
