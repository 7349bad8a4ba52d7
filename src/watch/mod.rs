//! `shibo watch`: a page that shows a graph, and follows every save of it.
//!
//! It has three parts: a loop (`follow`) that tracks the files and reads the graph, a thread that evaluates the newest
//! graph (`evaluate`), and the server of the page. They share the [`Stage`](crate::serve::Stage).
mod args;
mod command;
mod editor;
mod evaluate;
mod files;
mod folders;
mod follow;
mod load;
mod settle;
mod signal;
mod status_reporter;

pub(crate) use args::WatchArgs;
pub(crate) use command::run;
pub(crate) use files::Files as FileSet;
