//! A pack: kinds of nodes in a crate of their own. Graph files use them as they use the nodes of Shibo, with checks, caches, tiles,
//! the manual and the language server. Nothing in Shibo names this crate.
//!
//! - A node is one file and one line in [`family`].
//! - `src/main.rs` makes the command with these nodes, `python/` the Python module.
//! - `build.rs` makes [`CODE`], so a cache never returns results of an older version.
//! - `tests/contract.rs` checks the rules that every node must keep.
mod terraces;
mod zones;

use shibo_engine::registry::{Family, Kind, Registry};
pub use terraces::Terraces;
pub use zones::Zones;

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// The nodes of this pack.
pub fn family() -> Family {
    let kinds = vec![Kind::of::<Zones>(), Kind::of::<Terraces>()];
    Family { name: "Example pack", doc: "Nodes of another crate.", kinds }
}

/// All nodes of Shibo and of this pack, and Shibo's graphs.
pub fn registry() -> Registry {
    shibo_library::registry_with([family()]).with_code(CODE)
}
