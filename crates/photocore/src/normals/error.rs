//! Why a phase of a system has no result.

use thiserror::Error;

use super::layout::LayoutError;
use crate::Stopped;

/// Why a phase of a system has no result.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SystemError {
    /// The work was stopped: by whoever watched it, or for want of memory.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The input contradicts the layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
