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
    /// The texts of an editor have changed, or the editor no longer follows.
    Texts,
    /// The program ends.
    Stop,
}
