//! Editor features for graph files, as functions from a text and a position to an answer, independent of any protocol.
//!
//! [`view`] locates the values of any text, [`mod@file`] finds sections and names in it, [`expect`] describes the
//! values allowed in each place, and [`walk`] combines the two. All other modules build on these. Nothing here
//! evaluates a picture.
pub(crate) mod actions;
pub(crate) mod colors;
mod complete;
pub(crate) mod diagnose;
mod docs;
mod evaluate;
mod expect;
mod file;
pub(crate) mod format;
mod habits;
pub(crate) mod hover;
pub(crate) mod inlay;
pub(crate) mod lens;
mod names;
pub(crate) mod navigate;
pub(crate) mod rename;
mod signature;
pub(crate) mod structure;
#[cfg(test)]
mod tests;
pub(crate) mod tokens;
mod types;
mod view;
mod walk;
mod workspace;
mod world;

pub(crate) use complete::{Completion, Sort, Topic, complete, manual};
pub(crate) use file::{File, Section};
#[cfg(test)]
use habits::Habits;
pub(crate) use signature::signature;
pub(crate) use workspace::{Workspace, identity};
pub(crate) use world::{Cx, World};
