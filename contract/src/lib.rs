//! The contract of nodes: rules that every kind of node must keep. Tests of a crate with nodes call [`complaints`].
//!
//! A check makes a graph whose node `it` is of the kind, with its required ports connected to small fields and objects. So a kind
//! of a pack must be valid with its default parameters.
#![allow(clippy::unwrap_used, reason = "only tests use this crate; they fail by panicking")]
pub mod checks;
pub mod facts;
pub mod kinds;

use shibo_node::KindInfo;
use shibo_node::registry::Registry;
use std::sync::Arc;

/// A check of one kind: an error says in words which rule the kind breaks.
pub type Check = fn(&Arc<Registry>, &KindInfo) -> Result<(), String>;

/// All checks that every kind must pass, by name.
pub const CHECKS: [(&str, Check); 11] = [
    ("is documented", checks::is_documented),
    ("manual states the defaults", checks::defaults_can_be_written),
    ("is finite at all sizes", checks::is_finite_at_all_sizes),
    ("is deterministic", checks::is_deterministic),
    ("points agree with pictures", checks::agrees_at_points),
    ("states the windows that it reads", checks::states_what_it_reads),
    ("sets every value of tiles that it overwrites", |registry, info| {
        checks::overwrites_if_it_says_so(registry, info).map(drop)
    }),
    ("parameters change the key", checks::reads_its_parameters),
    ("can be cancelled", checks::can_be_cancelled),
    ("has the channels that it announces", checks::has_announced_channels),
    ("declares the facts of the canvas that it reads", |registry, info| {
        facts::declares_what_it_reads(registry, info, None)?;
        facts::reads_only_declared_facts(registry, info)
    }),
];

/// Runs all [`CHECKS`] on the kinds of a family and returns the rules that they break, in words.
///
/// # Panics
/// If the registry has no such family.
pub fn complaints(registry: &Arc<Registry>, family: &str) -> Vec<String> {
    let kinds = registry.kinds().filter_map(|kind| registry.info(kind)).filter(|info| info.family == family);
    let kinds: Vec<&KindInfo> = kinds.collect();
    assert!(!kinds.is_empty(), "there is no family `{family}`");
    let checks = kinds.iter().flat_map(|info| CHECKS.map(|(name, check)| (*info, name, check)));
    let failed = checks.filter_map(|(info, name, check)| {
        check(registry, info).err().map(|error| format!("{}: {name}: {error}", info.kind))
    });
    failed.collect()
}
