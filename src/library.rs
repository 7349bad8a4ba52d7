//! The registry of this process: the kinds of nodes, and the graphs that can be imported by name.
use crate::environment;
use shibo_bridge::Tools;
use shibo_engine::eval::CancelToken;
use shibo_graph::Gate;
use shibo_ide::migrate;
use shibo_node::registry::Registry;
use std::sync::{Arc, OnceLock};

pub(crate) use shibo_library::{EXAMPLE_FILES, Graph, graphs};

/// Makes the registry. A process has one command and so one registry; unit tests take that of Shibo.
static MAKE: OnceLock<fn() -> Registry> = OnceLock::new();

/// Sets what makes the registry. The first call of a process counts.
pub(crate) fn set(make: fn() -> Registry) {
    MAKE.get_or_init(|| make);
}

/// Registry with all nodes and the graphs of the library.
pub(crate) fn registry() -> Registry {
    let registry = MAKE.get_or_init(|| shibo_library::registry)();
    registry.with_successor(migrate::successor).with_retired_fields(migrate::is_retired_field)
}

/// The registry and the folders for imports, for the operations of the bridge.
pub(crate) fn tools() -> Tools {
    static TOOLS: OnceLock<Tools> = OnceLock::new();
    let tools = || {
        let registry = Arc::new(registry());
        Tools {
            registry,
            import_paths: environment::import_paths().to_vec(),
            gate: Gate::default(),
            cancel: CancelToken::default(),
        }
    };
    TOOLS.get_or_init(tools).clone()
}
