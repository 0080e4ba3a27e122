//! Errors of the phases of a system.

use thiserror::Error;

use super::layout::LayoutError;
use crate::Stopped;

/// Error of a phase of a system.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SystemError {
    /// The work was stopped by the progress callback or for lack of memory.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The input contradicts the layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
