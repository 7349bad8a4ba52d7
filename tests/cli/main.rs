//! The command, driven end to end, and rules of the whole.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
#![allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions")]
mod broken_graphs;
mod cache;
mod canvas;
mod check;
mod common;
mod compose;
mod contract;
mod deep;
mod dump;
mod export;
mod faults;
mod fmt;
mod gltf;
mod hidden;
mod hostile_meshes;
mod incremental;
mod interrupt;
mod job;
mod leather;
mod meshes;
mod mips;
mod nodes;
mod obj;
mod once;
mod parts;
mod picture_files;
#[path = "../../engine/tests/all/pictures/mod.rs"]
mod pictures;
mod render;
mod rest;
mod rows;
mod shared;
mod structure;
mod support;
mod sweep;
mod synthesis;
mod synthesis_given;
mod synthesis_rows;
mod synthesis_surface;
mod tools;
mod wood;
mod wood_given;
mod wood_grain;
mod wood_on_meshes;
mod wood_pieces;
