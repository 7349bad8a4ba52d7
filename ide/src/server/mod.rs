//! The language server without a transport and without threads: it answers messages one after the other. `shibo lsp` runs it in
//! threads; [`Single`] runs it where there are none.
mod actions;
mod answer;
mod answers;
mod apply;
mod calls;
mod capabilities;
mod checker;
mod client;
mod commands;
mod convert;
mod dispatch;
mod host;
mod options;
mod single;
mod state;
mod text;
pub mod uris;

pub use checker::{Checker, Job};
pub use client::Client;
pub use host::{Command, Host, NoPictures};
pub use options::PictureForm;
pub use single::Single;
pub use state::{Beginning, Server};
pub use text::Encoding;
