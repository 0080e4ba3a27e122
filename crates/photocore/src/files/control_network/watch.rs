//! Whether to go on.

use std::ops::ControlFlow;

use crate::Stopped;

use super::fault::Reason;

/// Asked now and then whether to go on.
pub type Watch<'a> = &'a mut dyn FnMut() -> ControlFlow<()>;

/// Points between two questions.
const PATIENCE: usize = 1024;

/// Asks at some points, by their numbers, whether to go on.
pub fn go_on(watch: &mut dyn FnMut() -> ControlFlow<()>, point: usize) -> Result<(), Reason> {
    match point.is_multiple_of(PATIENCE) && watch().is_break() {
        true => Err(Stopped::Interrupted.into()),
        false => Ok(()),
    }
}
