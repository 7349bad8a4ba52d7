//! An empty crate: its `Cargo.toml` states features of libraries once for the whole workspace.
