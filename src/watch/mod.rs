//! `shibo watch`: a page that shows a graph, and follows every save of it.
//!
//! It has three parts: a loop (`follow`) that tracks the files and reads the graph, a thread that evaluates the newest
//! graph (`evaluate`), and the server of the page. They share the [`Stage`](crate::serve::Stage).
mod command;
mod editor;
mod evaluate;
mod files;
mod folders;
mod follow;
mod load;
mod settle;
mod status_reporter;

pub(crate) use command::{WatchArgs, run};
