//! Editor features for graph files, as functions from a text and a position to an answer, independent of any protocol.
//!
//! `view` locates the values of any text, `file` finds sections and names in it, `expect` describes the
//! values allowed in each place, and `walk` combines the two. All other modules build on these. Nothing here
//! evaluates a picture or reads the environment. `server` alone knows a protocol.
#![allow(clippy::disallowed_methods, reason = "no picture that is written is made here")]
pub mod actions;
mod around;
pub mod calls;
mod capture;
pub mod colors;
mod complete;
mod count;
pub mod diagnose;
mod docs;
mod evaluate;
mod expect;
mod file;
pub mod fixes;
pub mod format;
pub mod forms;
mod formula;
mod functions;
mod habits;
pub mod hover;
pub mod inlay;
mod insert;
pub mod lens;
pub mod manual;
pub mod migrate;
pub mod names;
pub mod navigate;
pub mod news;
mod paths;
pub mod rename;
pub mod server;
mod signature;
mod spelling;
pub mod structure;
#[cfg(test)]
mod tests;
pub mod tokens;
mod types;
mod view;
mod walk;
mod workspace;
mod world;

pub use complete::{Completion, Sort, Topic, complete, manual};
pub use file::{File, Section};
#[cfg(test)]
use habits::Habits;
pub use signature::signature;
pub use workspace::{Workspace, identity};
pub use world::{Cx, World};
