//! Long-running programs: the page and server of `shibo watch`, and the language server.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod axe;
mod bodies;
mod cancel;
mod channels;
mod connection;
#[path = "../fuzz/damage.rs"]
mod damage;
mod editor;
mod fields;
mod follow;
mod formulas;
mod language;
mod light;
#[path = "../support/long_work.rs"]
mod long_work;
mod lsp;
mod narrow;
mod neovim;
mod noise;
mod own;
mod page;
mod panel;
mod photo;
mod progress;
mod protocol;
mod races;
mod repairs;
mod saves;
mod server;
mod stage;
mod switching;
mod view;
mod watching;
mod work;
