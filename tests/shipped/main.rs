//! Everything that ships: graphs, manuals, pictures and meshes.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
#[path = "../support/bless.rs"]
mod bless;
mod changes;
mod docs;
mod formulas;
#[path = "../support/golden.rs"]
mod golden;
mod graphs;
#[path = "../support/picture.rs"]
mod picture;
mod shipped_meshes;
mod tutorial;
