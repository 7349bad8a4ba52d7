//! Messages to the watch loop.
use crate::serve::Values;

/// Message to the loop.
pub(super) enum Signal {
    /// Something happened in a folder.
    Touched {
        /// True if the event ended a save.
        closed: bool,
    },
    /// A page sets parameter values.
    Values(Values),
    /// The program ends.
    Stop,
}
