//! The nodes of Shibo, a folder per family, and the numeric kernels they stand on.
//!
//! A node is one file, plus one line in its family's list. Families do not know each other; what two of them need is in
//! [`kernel`] or in the engine's `value`.
pub mod filter;
pub mod generators;
pub mod kernel;
pub mod material;
pub mod space;
pub mod surface;

#[cfg(test)]
mod testing;

use shibo_engine::registry::Registry;

/// All nodes.
pub fn registry() -> Registry {
    Registry::new([generators::family(), filter::family(), space::family(), surface::family(), material::family()])
}
