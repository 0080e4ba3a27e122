//! Rounds of data snooping: select, exclude, adjust, test again.

use super::super::NetworkError;
use super::consensus::Consensus;
use super::groups::Groups;
use super::log::{Log, Remark, Round, Standing};
use super::settings::Settings;
use super::state::Snooping;
use super::tried::{Session, Tried};
use crate::adjustment::Status;

impl Snooping {
    /// Adjusts and tests all observations, or those of a consensus if they have no adjustment together.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`](super::super::Trial::adjust).
    pub fn new(
        network: &mut Session<'_>,
        settings: Settings,
        consensus: Option<&Consensus>,
    ) -> Result<Self, NetworkError> {
        let groups = Groups::new(network.trial, &settings);
        let Some(consensus) = consensus else { return Self::begin(network, groups, settings, None) };
        let out = groups.excluded_by(consensus);
        let mut new = Self::begin(network, groups, settings, Some(out))?;
        new.decide(network, consensus, false)?;
        Ok(new)
    }

    /// Continues from another start: the result of a consensus, which excludes some observations.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`](super::super::Trial::adjust).
    pub fn restart(&mut self, network: &mut dyn Tried, consensus: &Consensus) -> Result<(), NetworkError> {
        self.decide(network, consensus, true)
    }

    /// Returns whether the residuals are too large, before any exclusion: errors of whole sets of observations may be the reason. The global
    /// test decides; if the unit weight is unknown, whether a round would exclude any group.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`](super::super::Trial::adjust).
    pub fn may_have_common_errors(&self, network: &mut dyn Tried) -> Result<bool, NetworkError> {
        if !self.removals.is_empty() || self.standing.status != Status::Converged {
            return Ok(false);
        }
        // Errors in common hardly change the sum of squares of a large network.
        if self.unit().is_rejected(1.0) == Some(true) {
            return Ok(true);
        }
        Ok(!self.choosing(self.allowed(), 0, true).choose(network)?.is_empty())
    }

    /// Adjusts without the exclusions to the convergence limit of tests of sets.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`](super::super::Trial::adjust).
    pub fn adjust_exactly(&mut self, network: &mut dyn Tried) -> Result<Standing, NetworkError> {
        let (out, exact) = (self.out.clone(), self.settings.exact);
        let adjusted = self.adjust_to(network, out, exact)?;
        adjusted.map_err(NetworkError::from)?;
        Ok(self.standing)
    }

    /// Excludes groups in rounds until nothing changes.
    ///
    /// # Errors
    /// Errors of [`Trial::adjust`](super::super::Trial::adjust).
    pub fn run(&mut self, network: &mut dyn Tried) -> Result<(), NetworkError> {
        self.exclude_bad_photos(network)?;
        if self.needs_robust_start() {
            self.start_robustly(network)?;
        } else {
            self.set_scales();
        }
        for number in 1..=self.settings.max_rounds {
            if !self.round(network, number)? {
                return Ok(());
            }
        }
        self.remarks.push(Remark::NotEnded);
        Ok(())
    }

    /// Executes a round; returns whether anything has changed.
    fn round(&mut self, network: &mut dyn Tried, number: usize) -> Result<bool, NetworkError> {
        let (standing, before) = (self.standing, self.tests.clone());
        let excluded = self.removals.iter().filter(|entry| entry.is_out()).count();
        let choices = self.choosing(self.allowed(), excluded, true).choose(network)?;
        // In a large network, earlier exclusions are reinstated in the adjustment that excludes others.
        let mut returned = if self.groups.is_small { vec![] } else { self.agreeing(network)? };
        let removed = self.apply(network, self.entries(&choices, number), &returned)?;
        self.note_return(&returned, number);
        let mut removed = self.without_disputed(network, removed, &choices, &before)?;
        if self.groups.is_small {
            returned = self.reinstate(network, number)?;
        }
        removed.extend(self.exclude_photos(network, number)?);
        let goes_on = !removed.is_empty() || !returned.is_empty();
        self.note_round(number, standing, removed, returned, excluded);
        Ok(goes_on)
    }

    pub(super) fn note_round(
        &mut self,
        number: usize,
        standing: Standing,
        removed: Vec<usize>,
        returned: Vec<usize>,
        excluded: usize,
    ) {
        let limit = self.level.limit(excluded);
        self.rounds.push(Round { number, standing, limit, removed, returned });
    }

    /// Returns the log with the predictions of the excluded observations.
    pub fn finish(mut self) -> Log {
        for (place, entry) in self.removals.iter_mut().enumerate().filter(|own| own.1.is_out()) {
            entry.prediction = self.predicted.remove(&place);
        }
        Log {
            removals: self.removals,
            rounds: self.rounds,
            remarks: self.remarks,
            out: self.out,
            tests: self.level.tests,
            before: self.before,
            after: self.standing,
            factors: self.factors,
            active: self.tests.groups.iter().map(|own| own.active).collect(),
        }
    }
}
