//! The contract of nodes, checked on every registered kind, and on bad nodes, to show that the checks can fail.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use crate::bad;
use glam::UVec2;
use rayon::prelude::*;
use shibo_contract::checks::{
    agrees_at_points, can_be_cancelled, defaults_can_be_written, has_announced_channels, is_deterministic,
    is_documented, is_finite_at_all_sizes, overwrites_if_it_says_so, reads_its_parameters, states_what_it_reads,
};
use shibo_contract::facts::{declares_what_it_reads, reads_only_declared_facts};
use shibo_contract::kinds::{STAND_INS, bytes, graph, it, load, made, options, session};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::Failure;
use shibo_graph::load_text;
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Fact, KindInfo};
use shibo_value::Type;
use std::path::Path;
use std::sync::Arc;

#[test]
fn every_type_can_be_made() {
    let registry = Arc::new(shibo_nodes::registry());
    // A `Picture` comes from a file, regions are never a main output, and a `SolidMaterial` is a `Material` of solids.
    for ty in Type::ALL.iter().filter(|ty| ![Type::Picture, Type::Ids, Type::SolidMaterial].contains(ty)) {
        let (name, nodes) = made(&registry, *ty).unwrap();
        let graph = load(&registry, &format!("{STAND_INS} {nodes}"), UVec2::splat(8)).unwrap();
        let node = graph.nodes.node_weights().find(|node| format!("\"{}\"", node.name) == name).unwrap();
        assert_eq!(node.outputs[0], *ty);
    }
}

/// Runs a check on every kind and collects the complaints.
fn on_all(check: impl Fn(&Arc<Registry>, &KindInfo) -> Result<(), String> + Sync) -> Vec<String> {
    let registry = Arc::new(shibo_nodes::registry());
    let infos: Vec<&KindInfo> = registry.kinds().map(|kind| registry.info(kind).unwrap()).collect();
    assert!(infos.len() > 20, "too few kinds for this to mean anything");
    infos.par_iter().filter_map(|info| check(&registry, info).err().map(|e| format!("{}: {e}", info.kind))).collect()
}

#[test]
fn every_kind_is_documented() {
    assert_eq!(on_all(is_documented), Vec::<String>::new());
}

#[test]
fn manual_defaults_equal_omitted_parameters() {
    assert_eq!(on_all(defaults_can_be_written), Vec::<String>::new());
}

#[test]
fn defaults_give_finite_values_at_all_sizes() {
    assert_eq!(on_all(is_finite_at_all_sizes), Vec::<String>::new());
}

#[test]
fn the_same_bytes_on_any_threads_and_in_any_windows() {
    assert_eq!(on_all(is_deterministic), Vec::<String>::new());
}

#[test]
fn points_agree_with_pictures() {
    assert_eq!(on_all(agrees_at_points), Vec::<String>::new());
}

#[test]
fn fields_state_what_they_read() {
    assert_eq!(on_all(states_what_it_reads), Vec::<String>::new());
}

#[test]
fn overwriting_fields_set_every_value() {
    let registry = Arc::new(shibo_nodes::registry());
    let all = registry.kinds().filter_map(|kind| registry.info(kind));
    let found: Result<Vec<usize>, String> =
        all.map(|info| overwrites_if_it_says_so(&registry, info).map_err(|e| format!("{}: {e}", info.kind))).collect();
    assert!(found.unwrap().iter().sum::<usize>() > 20, "too few fields for this to mean anything");
}

#[test]
fn changing_a_parameter_changes_the_key() {
    assert_eq!(on_all(reads_its_parameters), Vec::<String>::new());
}

#[test]
fn cancelling_stops_every_node() {
    assert_eq!(on_all(can_be_cancelled), Vec::<String>::new());
}

#[test]
fn materials_have_the_channels_that_are_announced() {
    assert_eq!(on_all(has_announced_channels), Vec::<String>::new());
}

#[test]
fn a_long_simulation_stops_when_asked() {
    let text = format!(
        "(canvas: (size_mm: 100), nodes: {{ {STAND_INS} \"many\": GridPoints(pitch: 0.2), \
         \"links\": ConnectNeighbors(points: \"many\", neighbors: Eight), \"net\": DefineSprings(lattice: \"links\"), \
         \"it\": SimulateSprings(springs: \"net\", steps: 100000, drag: 4) }})"
    );
    let registry = Arc::new(shibo_nodes::registry());
    let graph = load_text(Path::new("long.ron"), &text, &registry, &options(UVec2::splat(64))).graph.unwrap();
    // Far from the end: the simulation asks once in several steps.
    let token = CancelToken::counting(300);
    let result = session(&registry, 2).value(&graph, (it(&graph), 0), &token, &Silent);
    assert!(matches!(result, Err(Failure::Cancelled)), "{result:?}");
    assert!(token.asked() < 400, "asked {} times, 300 of them before it was stopped", token.asked());
}

#[test]
fn verify_accepts_deterministic_nodes() {
    let registry = Arc::new(shibo_nodes::registry());
    for kind in ["SimulateSprings", "DrawWrinkles", "Warp", "Relief"] {
        let graph = graph(&registry, registry.info(kind).unwrap(), UVec2::splat(64), None).unwrap();
        let found = session(&registry, 2).verify(&graph, &CancelToken::default(), &Silent);
        assert_eq!(found, Ok(Vec::new()), "{kind}");
    }
}

#[test]
fn nodes_declare_the_facts_they_depend_on() {
    assert_eq!(on_all(|registry, info| declares_what_it_reads(registry, info, None)), Vec::<String>::new());
}

#[test]
fn no_node_reads_an_undeclared_fact() {
    assert_eq!(on_all(reads_only_declared_facts), Vec::<String>::new());
}

/// All nodes, and the bad ones.
fn with_bad_nodes() -> Registry {
    let bad = vec![
        Kind::of::<bad::Impure>(),
        Kind::of::<bad::Unwindowed>(),
        Kind::of::<bad::Infinite>(),
        Kind::of::<bad::Curious>(),
        Kind::of::<bad::Greedy>(),
        Kind::of::<bad::Contrary>(),
    ];
    let mut families = shibo_nodes::families();
    families.push(Family { name: "Bad", doc: "Nodes that break the rules.", kinds: bad });
    Registry::new(families)
}

#[test]
fn checks_find_bad_nodes() {
    let registry = Arc::new(with_bad_nodes());
    let info = |kind: &str| registry.info(kind).unwrap();
    assert!(is_documented(&registry, info("Impure")).is_err());
    assert!(is_deterministic(&registry, info("Impure")).is_err());
    assert!(is_deterministic(&registry, info("Unwindowed")).is_err());
    assert!(states_what_it_reads(&registry, info("Contrary")).is_err());
    let greedy = graph(&registry, info("Greedy"), UVec2::splat(8), None).unwrap();
    let refused = bytes(&session(&registry, 1), &greedy, 8).unwrap_err();
    assert!(refused.contains("reads more than it states"), "{refused}");
    let curious = graph(&registry, info("Curious"), UVec2::splat(8), None).unwrap();
    let refused = bytes(&session(&registry, 1), &curious, 8).unwrap_err();
    assert!(refused.contains("`Curious` reads the size of the canvas, which it does not declare"), "{refused}");
    // Declaring one fact less simulates a read that the engine missed: the check finds it.
    for (kind, fact) in [("Perlin", Fact::Seed), ("Perlin", Fact::Tile), ("RandomPoints", Fact::Size)] {
        let declared: Vec<Fact> = Fact::ALL.into_iter().filter(|other| *other != fact).collect();
        assert!(declares_what_it_reads(&registry, info(kind), Some(&declared)).is_err(), "{kind} {fact:?}");
        assert_eq!(declares_what_it_reads(&registry, info(kind), Some(&Fact::ALL)), Ok(()));
    }
    let infinite = graph(&registry, info("Infinite"), UVec2::splat(8), None).unwrap();
    assert!(bytes(&session(&registry, 1), &infinite, 8).is_err());
    let impure = graph(&registry, info("Impure"), UVec2::splat(64), None).unwrap();
    let found = session(&registry, 1).verify(&impure, &CancelToken::default(), &Silent).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].message.contains("`it`"), "{}", found[0].message);
}
