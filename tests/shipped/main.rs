//! Everything that ships: graphs, manuals, pictures and meshes.
#[path = "../support/bless.rs"]
mod bless;
mod docs;
#[path = "../support/golden.rs"]
mod golden;
mod graphs;
#[path = "../support/picture.rs"]
mod picture;
mod shipped_meshes;
mod tutorial;
