//! The graphs of the library, and the node kinds.
use crate::environment;
use shibo_engine::registry::Registry;

pub(crate) use shibo_library::{EXAMPLE_FILES, graphs};

/// Registry with all nodes and the graphs of the library.
pub(crate) fn registry() -> Registry {
    shibo_library::registry(environment::library_dir())
}
