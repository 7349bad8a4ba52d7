//! The graphs that come with the program, and the kinds of nodes.
use crate::environment;
use shibo_engine::registry::Registry;

pub(crate) use shibo_library::{EXAMPLE_FILES, graphs};

/// All nodes, and the graphs that come with the program.
pub(crate) fn registry() -> Registry {
    shibo_library::registry(environment::library_dir())
}
