//! The contract of nodes, checked on every registered kind, and on bad nodes, to show that the checks can fail.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use crate::common::bad;
use crate::common::facts::{declares_what_it_reads, reads_only_declared_facts, shown};
use crate::common::kinds::{
    STAND_INS, another, arguments, bytes, graph, it, load, made, needed, options, session, stand_in,
};
use glam::UVec2;
use rayon::prelude::*;
use shibo_engine::eval::{CancelToken, Keys, Silent};
use shibo_engine::graph::load_text;
use shibo_engine::node::{Fact, KindInfo, OutputType, ParamType, Role};
use shibo_engine::registry::{Family, Kind, Registry};
use shibo_engine::session::Failure;
use shibo_engine::value::{ChannelSet, Given, Read, Tile, Type, Value, Window};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

#[test]
fn every_type_can_be_made() {
    let registry = shibo_nodes::registry();
    // A `Picture` comes from a file, and regions are never a main output.
    for ty in Type::ALL.iter().filter(|ty| ![Type::Picture, Type::Ids].contains(ty)) {
        let (name, nodes) = made(&registry, *ty).unwrap();
        let graph = load(&registry, &format!("{STAND_INS} {nodes}"), UVec2::splat(8)).unwrap();
        let node = graph.nodes.node_weights().find(|node| format!("\"{}\"", node.name) == name).unwrap();
        assert_eq!(node.outputs[0], *ty);
    }
}

/// Runs a check on every kind and collects the complaints.
fn on_all(check: impl Fn(&Registry, &KindInfo) -> Result<(), String> + Sync) -> Vec<String> {
    let registry = shibo_nodes::registry();
    let infos: Vec<&KindInfo> = registry.kinds().map(|kind| registry.info(kind).unwrap()).collect();
    assert!(infos.len() > 20, "too few kinds for this to mean anything");
    infos.par_iter().filter_map(|info| check(&registry, info).err().map(|e| format!("{}: {e}", info.kind))).collect()
}

fn is_documented(_: &Registry, info: &KindInfo) -> Result<(), String> {
    let fields = info.fields.iter().chain(info.params().flat_map(|(_, param)| &param.fields));
    let mut missing: Vec<&str> = fields.filter(|f| f.doc.len() < 8).map(|f| f.name.as_str()).collect();
    let choices = info.params().flat_map(|(_, param)| &param.choices);
    missing.extend(choices.filter(|c| c.doc.is_empty()).map(|c| c.name.as_str()));
    let outputs = info.outputs.iter().filter(|o| o.doc.len() < 8).count();
    if info.doc.len() < 20 || !missing.is_empty() || outputs > 0 || info.outputs.is_empty() {
        return Err(format!("not documented: {missing:?}, {outputs} outputs"));
    }
    Ok(())
}

#[test]
fn every_kind_is_documented() {
    assert_eq!(on_all(is_documented), Vec::<String>::new());
}

/// Writing a parameter's default from the manual equals leaving it out: the same node, or the same error.
fn defaults_can_be_written(registry: &Registry, info: &KindInfo) -> Result<(), String> {
    let made = |field: &str, text: Option<&str>| {
        let (args, nodes) = arguments(registry, info, Some((field, text)))?;
        let node = format!("\"it\": {}({args}),", info.kind);
        let graph = load(registry, &format!("{STAND_INS} {nodes} {node}"), UVec2::splat(16))?;
        Ok::<_, String>(graph.nodes[it(&graph)].node.canonical())
    };
    for (field, param) in info.params() {
        let (written, left_out) = (made(&field.name, Some(&param.written)), made(&field.name, None));
        if written != left_out {
            return Err(format!("`{}: {}` is not the default: {written:?} {left_out:?}", field.name, param.written));
        }
        // Fails only where the manual says so.
        let stands_alone = needed(&info.kind).is_none_or(|(needed, _)| needed != field.name);
        if written.is_err() && stands_alone {
            return Err(format!("`{}: {}` is refused: {written:?}", field.name, param.written));
        }
        if param.required != (written.is_err() && param.ty == ParamType::Path) {
            return Err(format!("whether `{}` must be given is wrong", field.name));
        }
    }
    Ok(())
}

#[test]
fn manual_defaults_equal_omitted_parameters() {
    assert_eq!(on_all(defaults_can_be_written), Vec::<String>::new());
}

#[test]
fn defaults_give_finite_values_at_all_sizes() {
    let complaints = on_all(|registry, info| {
        // One session for all sizes, so that objects without a resolution are made once.
        let session = session(shibo_nodes::registry(), 1);
        for size in [UVec2::splat(24), UVec2::ONE, UVec2::new(1, 9)] {
            let graph = graph(registry, info, size, None)?;
            bytes(&session, &graph, 64).map_err(|complaint| format!("{complaint} at {size}"))?;
        }
        Ok(())
    });
    assert_eq!(complaints, Vec::<String>::new());
}

fn is_deterministic(registry: &dyn Fn() -> Registry, info: &KindInfo) -> Result<(), String> {
    let graph = graph(&registry(), info, UVec2::new(300, 280), None)?;
    let reference = bytes(&session(registry(), 1), &graph, 300)?;
    for (threads, side) in [(8, 300), (2, 77)] {
        if bytes(&session(registry(), threads), &graph, side)? != reference {
            return Err(format!("other bytes on {threads} threads by windows of {side}"));
        }
    }
    Ok(())
}

#[test]
fn the_same_bytes_on_any_threads_and_in_any_windows() {
    assert_eq!(on_all(|_, info| is_deterministic(&shibo_nodes::registry, info)), Vec::<String>::new());
}

/// A field evaluated at the centre of a pixel, on a grid of one pixel, agrees with the picture there.
fn agrees_at_points(registry: &Registry, info: &KindInfo) -> Result<(), String> {
    let size = UVec2::splat(96);
    let graph = graph(registry, info, size, None)?;
    let (session, grid) = (session(shibo_nodes::registry(), 1), graph.canvas.grid(size));
    let (token, node) = (CancelToken::default(), it(&graph));
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &token, &Silent).map_err(|f| format!("{f:?}"))?;
        // Ids of regions have no values in between.
        for field in value.fields().into_iter().filter(|field| field.ty() != Type::Ids) {
            let points = [(5, 7), (40, 61), (95, 0), (17, 88)];
            let mut wanted = vec![(grid, Window::full(size))];
            let one = Window { x: 0, y: 0, width: 1, height: 1 };
            wanted.extend(points.iter().map(|&(x, y)| (grid.centered_at(grid.center(x, y)), one)));
            let (tiles, _) = session.rasters(&graph, &field, &wanted, &token, &Silent).map_err(|f| format!("{f:?}"))?;
            for (&(x, y), point) in points.iter().zip(&tiles[1..]) {
                let (x, y) = (usize::try_from(x).unwrap(), usize::try_from(y).unwrap());
                for channel in 0..field.channels() {
                    let (a, b) = (tiles[0].row(channel, y)[x], point.row(channel, 0)[0]);
                    if (a - b).abs() > 2e-2 * a.abs().max(1.0) {
                        return Err(format!("output {output} is {a} at ({x}, {y}), but {b} when asked for alone"));
                    }
                }
            }
        }
    }
    Ok(())
}

#[test]
fn points_agree_with_pictures() {
    assert_eq!(on_all(agrees_at_points), Vec::<String>::new());
}

/// True if a read contains all pixels of a window. One repeat of a field that tiles contains all.
fn covers(read: &Read<'_>, window: &Window) -> bool {
    let (tiling, period) = (read.field.tiling(), read.grid.period.unwrap_or(UVec2::MAX));
    let (x, y) = (tiling.x && read.window.width >= period.x, tiling.y && read.window.height >= period.y);
    let within = Window {
        x: if x { read.window.x } else { window.x },
        width: if x { read.window.width } else { window.width },
        y: if y { read.window.y } else { window.y },
        height: if y { read.window.height } else { window.height },
    };
    read.window.contains(&within)
}

/// The engine's assumptions: a field states the same fields and grids for all windows, and a part of a window needs no
/// more than the whole. Undeclared reads need no test: a field is given nothing else.
fn states_what_it_reads(registry: &dyn Fn() -> Registry, info: &KindInfo) -> Result<(), String> {
    let size = UVec2::new(300, 280);
    let graph = graph(&registry(), info, size, None)?;
    let (session, grid, node) = (session(registry(), 1), graph.canvas.grid(size), it(&graph));
    let whole = Window { x: -40, y: -7, width: 400, height: 300 };
    let parts = [(-40, -7, 1, 1), (-3, 5, 37, 11), (100, 292, 260, 1), (0, 0, 256, 256)];
    let parts = parts.map(|(x, y, width, height)| Window { x, y, width, height });
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &CancelToken::default(), &Silent);
        let mut open: Vec<_> = value.map_err(|f| format!("{f:?}"))?.fields().into_iter().map(|f| (f, grid)).collect();
        let mut seen = BTreeSet::new();
        while let Some((field, grid)) = open.pop() {
            if !seen.insert(format!("{:?} {:?}", field.id(), grid.id())) {
                continue;
            }
            let stated = |window| {
                let source = field.source();
                source.inputs(&grid, window).into_iter().chain(source.later(&grid, window)).collect::<Vec<_>>()
            };
            let most = stated(whole);
            for part in parts {
                let reads = stated(part);
                let same = |(a, b): (&Read<'_>, &Read<'_>)| a.field.id() == b.field.id() && a.grid.id() == b.grid.id();
                if reads.len() != most.len() || !reads.iter().zip(&most).all(same) {
                    return Err(format!("output {output} reads other fields for {part:?}"));
                }
                if let Some((read, _)) = reads.iter().zip(&most).find(|(a, b)| !covers(b, &a.window)) {
                    return Err(format!("output {output} reads {:?} for {part:?}, more than for all", read.window));
                }
            }
            open.extend(most.iter().map(|read| (read.field.clone(), read.grid)));
        }
    }
    Ok(())
}

#[test]
fn fields_state_what_they_read() {
    assert_eq!(on_all(|_, info| states_what_it_reads(&shibo_nodes::registry, info)), Vec::<String>::new());
}

/// A field that declares to overwrite its tiles gives the same result for any previous content.
fn overwrites_if_it_says_so(registry: &Registry, info: &KindInfo) -> Result<usize, String> {
    let size = UVec2::new(70, 60);
    let graph = graph(registry, info, size, None)?;
    let (grid, window) = (graph.canvas.grid(size), Window { x: 3, y: 1, width: 61, height: 50 });
    let node = it(&graph);
    let (session, token) = (session(shibo_nodes::registry(), 1), CancelToken::default());
    let (mut found, mut seen) = (0, BTreeSet::new());
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(&graph, (node, output), &token, &Silent).map_err(|f| format!("{f:?}"))?;
        let mut open: Vec<_> = shown(&value).into_iter().map(|f| (f, grid, window)).collect();
        while let Some((field, grid, window)) = open.pop() {
            let source = field.source();
            let wanted = source.inputs(&grid, window);
            open.extend(wanted.iter().map(|read| (read.field.clone(), read.grid, read.window)));
            let new = seen.insert(format!("{:?} {:?} {window:?}", field.id(), grid.id()));
            if !field.overwrites() || !new || window.is_empty() {
                continue;
            }
            let mut tiles = Vec::new();
            for read in &wanted {
                let one = [(read.grid, read.window)];
                let made = session.rasters(&graph, read.field, &one, &token, &Silent).map_err(|f| format!("{f:?}"))?;
                tiles.extend(made.0.into_iter().map(Arc::new));
            }
            let filled = |with: f32| {
                let mut tile = Tile::new(grid, window, field.channels());
                tile.data_mut().fill(with);
                source.fill(&Given::new(&tiles, None, &|| false), &mut tile).map_err(|stop| format!("{stop:?}"))?;
                Ok::<_, String>(tile.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>())
            };
            if filled(0.0)? != filled(f32::NAN)? {
                return Err(format!("output {output} reads what was in a tile, or leaves it there"));
            }
            found += 1;
        }
    }
    Ok(found)
}

#[test]
fn overwriting_fields_set_every_value() {
    let registry = shibo_nodes::registry();
    let all = registry.kinds().filter_map(|kind| registry.info(kind));
    let found: Result<Vec<usize>, String> =
        all.map(|info| overwrites_if_it_says_so(&registry, info).map_err(|e| format!("{}: {e}", info.kind))).collect();
    assert!(found.unwrap().iter().sum::<usize>() > 20, "too few fields for this to mean anything");
}

fn reads_its_parameters(registry: &Registry, info: &KindInfo) -> Result<(), String> {
    let key = |change: Option<(&str, &str)>| {
        let graph = graph(registry, info, UVec2::splat(16), change)?;
        let keys = Keys::of(&graph).map_err(|e| format!("{e:?}"))?;
        let last = graph.nodes[it(&graph)].outputs.len() - 1;
        Ok::<_, String>(keys.output(it(&graph), last))
    };
    let plain = key(None)?;
    for field in &info.fields {
        let Role::Param(param) = &field.role else { continue };
        let Some(value) = another(param) else { continue };
        // Contradicting parameters are covered by other tests.
        let Ok(changed) = key(Some((&field.name, &value))) else { continue };
        if changed == plain {
            return Err(format!("`{}: {value}` has the key of the default", field.name));
        }
    }
    Ok(())
}

#[test]
fn changing_a_parameter_changes_the_key() {
    assert_eq!(on_all(reads_its_parameters), Vec::<String>::new());
}

fn can_be_cancelled(_: &Registry, info: &KindInfo) -> Result<(), String> {
    let graph = graph(&shibo_nodes::registry(), info, UVec2::splat(64), None)?;
    let token = CancelToken::default();
    token.cancel();
    match session(shibo_nodes::registry(), 1).value(&graph, (it(&graph), 0), &token, &Silent) {
        Err(Failure::Cancelled) => Ok(()),
        other => Err(format!("{other:?} although cancelled")),
    }
}

#[test]
fn cancelling_stops_every_node() {
    assert_eq!(on_all(can_be_cancelled), Vec::<String>::new());
}

#[test]
fn materials_have_the_channels_that_are_announced() {
    let registry = shibo_nodes::registry();
    let makes = |info: &&KindInfo| info.outputs.iter().any(|output| output.ty == OutputType::Fixed(Type::Material));
    let kinds: Vec<&KindInfo> = registry.kinds().filter_map(|kind| registry.info(kind)).filter(makes).collect();
    assert!(!kinds.is_empty());
    for info in kinds {
        // With required ports only, and with each optional port.
        let optional = info.ports().filter(|(_, port)| !port.required && !port.list);
        let changes = optional.map(|(field, port)| Some((field.name.as_str(), stand_in(&registry, port.ty).unwrap())));
        for change in std::iter::once(None).chain(changes) {
            // The sources for optional ports are among the stand-ins of every graph.
            let change = change.as_ref().map(|(field, (text, _))| (*field, text.as_str()));
            let graph = graph(&registry, info, UVec2::splat(64), change).unwrap();
            let made =
                session(shibo_nodes::registry(), 1).value(&graph, (it(&graph), 0), &CancelToken::default(), &Silent);
            let Ok(Value::Material(material)) = made else { panic!("{}: {made:?}", info.kind) };
            let there: ChannelSet = material.channels().iter().map(|(channel, _)| *channel).collect();
            assert_eq!(graph.nodes[it(&graph)].channels, there, "{} {change:?}", info.kind);
        }
    }
}

#[test]
fn a_long_simulation_stops_when_asked() {
    let text = format!(
        "(canvas: (size_mm: 100), nodes: {{ {STAND_INS} \"many\": GridPoints(pitch: 0.2), \
         \"links\": ConnectNeighbors(points: \"many\", neighbors: Eight), \"net\": DefineSprings(lattice: \"links\"), \
         \"it\": SimulateSprings(springs: \"net\", steps: 100000, drag: 4) }})"
    );
    let registry = shibo_nodes::registry();
    let graph = load_text(Path::new("long.ron"), &text, &registry, &options(UVec2::splat(64))).graph.unwrap();
    // Far from the end: the simulation asks once in several steps.
    let token = CancelToken::counting(300);
    let result = session(registry, 2).value(&graph, (it(&graph), 0), &token, &Silent);
    assert!(matches!(result, Err(Failure::Cancelled)), "{result:?}");
    assert!(token.asked() < 400, "asked {} times, 300 of them before it was stopped", token.asked());
}

#[test]
fn verify_accepts_deterministic_nodes() {
    let registry = shibo_nodes::registry();
    for kind in ["SimulateSprings", "DrawWrinkles", "Warp", "Relief"] {
        let graph = graph(&registry, registry.info(kind).unwrap(), UVec2::splat(64), None).unwrap();
        let found = session(shibo_nodes::registry(), 2).verify(&graph, &CancelToken::default(), &Silent);
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
    let registry = with_bad_nodes();
    let info = |kind: &str| registry.info(kind).unwrap();
    assert!(is_documented(&registry, info("Impure")).is_err());
    assert!(is_deterministic(&with_bad_nodes, info("Impure")).is_err());
    assert!(is_deterministic(&with_bad_nodes, info("Unwindowed")).is_err());
    assert!(states_what_it_reads(&with_bad_nodes, info("Contrary")).is_err());
    let greedy = graph(&registry, info("Greedy"), UVec2::splat(8), None).unwrap();
    let refused = bytes(&session(with_bad_nodes(), 1), &greedy, 8).unwrap_err();
    assert!(refused.contains("reads more than it states"), "{refused}");
    let curious = graph(&registry, info("Curious"), UVec2::splat(8), None).unwrap();
    let refused = bytes(&session(with_bad_nodes(), 1), &curious, 8).unwrap_err();
    assert!(refused.contains("`Curious` reads the size of the canvas, which it does not declare"), "{refused}");
    // Declaring one fact less simulates a read that the engine missed: the check finds it.
    for (kind, fact) in [("Perlin", Fact::Seed), ("Perlin", Fact::Tile), ("RandomPoints", Fact::Size)] {
        let declared: Vec<Fact> = Fact::ALL.into_iter().filter(|other| *other != fact).collect();
        assert!(declares_what_it_reads(&registry, info(kind), Some(&declared)).is_err(), "{kind} {fact:?}");
        assert_eq!(declares_what_it_reads(&registry, info(kind), Some(&Fact::ALL)), Ok(()));
    }
    let infinite = graph(&registry, info("Infinite"), UVec2::splat(8), None).unwrap();
    assert!(bytes(&session(with_bad_nodes(), 1), &infinite, 8).is_err());
    let impure = graph(&registry, info("Impure"), UVec2::splat(64), None).unwrap();
    let found = session(with_bad_nodes(), 1).verify(&impure, &CancelToken::default(), &Silent).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].message.contains("`it`"), "{}", found[0].message);
}
