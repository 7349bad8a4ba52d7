//! Messages to the watch loop.
use crate::serve::Values;
use std::path::PathBuf;

/// Message to the loop.
pub(super) enum Signal {
    /// Something happened in a folder.
    Touched {
        /// True if the event ended a save.
        closed: bool,
    },
    /// A page sets values.
    Values(Values),
    /// A page shows another graph.
    Open(PathBuf),
    /// The program ends.
    Stop,
}
