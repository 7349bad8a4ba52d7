//! An edit recomputes only the nodes downstream of it: the list of nodes that ran is compared with the graph.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use petgraph::visit::Dfs;
use shibo_engine::eval::{CancelToken, NodeState, NodeStats, Silent};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::Resolution;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const RESOLUTION: u32 = 384;

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/starter.ron")
}

fn graph(text: &str) -> Graph {
    let options = LoadOptions { resolution: Some(Resolution::Longer(RESOLUTION)), ..LoadOptions::default() };
    let loaded = load_text(&path(), text, &shibo_nodes::registry(), &options);
    loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

fn session(cache: Option<&Path>) -> Session {
    let settings = Settings { threads: 2, cache_dir: cache.map(Path::to_path_buf), ..Settings::default() };
    Session::new(shibo_nodes::registry(), &settings).unwrap()
}

fn render(session: &Session, graph: &Graph, out: &Path) -> Vec<NodeStats> {
    let request = RenderRequest { dir: out.to_path_buf(), ..RenderRequest::default() };
    session.render(graph, &request, &CancelToken::default(), &Silent).unwrap().nodes
}

fn computed(stats: &[NodeStats]) -> BTreeSet<String> {
    stats.iter().filter(|n| n.state == NodeState::Computed).map(|n| n.name.clone()).collect()
}

/// A node and its direct and indirect readers.
fn downstream(graph: &Graph, name: &str) -> BTreeSet<String> {
    let start = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == name).unwrap();
    let mut search = Dfs::new(&graph.nodes, start);
    let mut names = BTreeSet::new();
    while let Some(node) = search.next(&graph.nodes) {
        names.insert(graph.nodes[node].name.clone());
    }
    names
}

/// Computed nodes without the pointwise kinds, which are cheaper to recompute than to keep.
fn dear(stats: &[NodeStats]) -> BTreeSet<String> {
    const POINTWISE: [&str; 4] = ["Formula", "GradientMap", "Pillow", "AmbientOcclusion"];
    let dear = stats.iter().filter(|n| n.state == NodeState::Computed && !POINTWISE.contains(&n.kind.as_str()));
    dear.map(|n| n.name.clone()).collect()
}

#[test]
fn skips_unselected_switch_inputs() {
    let text = r#"(version: 1, canvas: (size_mm: 16, resolution: 64), params: { "which": Integer(default: 1, range: (0, 1)) }, nodes: {
        "points": PoissonPoints(pitch: 2),
        "links": ConnectNeighbors(points: "points"),
        "lines": PlaceWrinkles(lattice: "links"),
        "grooves": DrawWrinkles(segments: "lines", width: (0.3, 0.6), depth: 0.4),
        "noise": Perlin(size: 3),
        "chosen": Switch(inputs: ["grooves", "noise"], which: "$which"),
        "hide": Material(height: "grooves"),
        "board": Material(height: "noise"),
        "one": SwitchMaterial(inputs: ["hide", "board"], which: "$which"),
        "height": "= one.height",
        "both": "= chosen + height",
        "none": Switch(inputs: ["grooves", 0.5], which: "$which"),
        "result": "= both + none",
    }, outputs: { "result": "result" })"#;
    let out = tempfile::tempdir().unwrap();
    let run = |which: &str| {
        let options = LoadOptions { set: vec![("which".into(), which.into())], ..LoadOptions::default() };
        let loaded = load_text(&path(), text, &shibo_nodes::registry(), &options);
        let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
        computed(&render(&session(None), &graph, out.path()))
    };
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect::<BTreeSet<_>>();
    let leather = names(&["points", "links", "lines", "grooves"]);
    assert!(leather.is_subset(&run("0")), "{:?}", run("0"));
    assert!(leather.is_disjoint(&run("1")), "{:?}", run("1"));
}

/// Kinds that take much longer to compute than to write, on any machine: their results are always kept.
const DEAR: [&str; 1] = ["SimulateSprings"];

/// Edits of the starter graph: old text, new text, and the node that changes.
const EDITS: [(&str, &str, &str); 5] = [
    ("drag: 6", "drag: 5", "moved"),
    ("\"= $pitch * 0.45\")", "\"= $pitch * 0.5\")", "strokes"),
    ("0.07 * $pitch * dome", "0.08 * $pitch * dome", "height"),
    ("strength: 2", "strength: 3", "ao"),
    ("HeightToNormal(input: \"height\")", "HeightToNormal(input: \"height\", strength: 1.5)", "normal"),
];

#[test]
fn edit_recomputes_downstream_nodes_in_memory() {
    let original = std::fs::read_to_string(path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    for (from, to, node) in EDITS {
        let session = session(None);
        let all = render(&session, &graph(&original), out.path());
        assert!(computed(&all).len() > 10);
        let edited = graph(&original.replacen(from, to, 1));
        let stats = render(&session, &edited, out.path());
        assert!(computed(&stats).contains(node), "{node} did not run again");
        let ran = dear(&stats);
        assert!(ran.is_subset(&downstream(&edited, node)), "after an edit of {node} these ran: {ran:?}");
    }
}

#[test]
fn edit_recomputes_downstream_nodes_in_another_process() {
    let original = std::fs::read_to_string(path()).unwrap().replacen("steps: 60", "steps: 1500", 1);
    let (out, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let first = render(&session(Some(cache.path())), &graph(&original), out.path());
    assert!(DEAR.iter().all(|kind| first.iter().any(|n| n.kind == *kind && n.state == NodeState::Computed)));
    for (from, to, node) in EDITS {
        let edited = graph(&original.replacen(from, to, 1));
        let stats = render(&session(Some(cache.path())), &edited, out.path());
        let below = downstream(&edited, node);
        assert!(computed(&stats).contains(node));
        // Cheap results may be computed again; results of these kinds never are.
        for other in stats.iter().filter(|n| n.state == NodeState::Computed && !below.contains(&n.name)) {
            assert!(!DEAR.contains(&other.kind.as_str()), "after an edit of {node}, `{}` ran again", other.name);
        }
    }
}

#[test]
fn reuses_results_after_undo() {
    let original = std::fs::read_to_string(path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let session = session(None);
    render(&session, &graph(&original), out.path());
    render(&session, &graph(&original.replacen("drag: 6", "drag: 5", 1)), out.path());
    assert_eq!(dear(&render(&session, &graph(&original), out.path())), BTreeSet::new());
}

#[test]
fn comments_order_names_and_spelling_change_nothing() {
    let original = std::fs::read_to_string(path()).unwrap();
    let (out, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    render(&session(Some(cache.path())), &graph(&original), out.path());
    let edited = original.replace("\"moved", "\"pulled").replace("step: 0.1,", "step: 0.100, /* small */");
    assert_ne!(edited, original);
    let stats = render(&session(Some(cache.path())), &graph(&edited), out.path());
    assert_eq!(computed(&stats), BTreeSet::new());
}

#[test]
fn reuses_simulations_at_another_resolution() {
    let original = std::fs::read_to_string(path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let session = session(None);
    render(&session, &graph(&original), out.path());
    let options = LoadOptions { resolution: Some(Resolution::Longer(2 * RESOLUTION)), ..LoadOptions::default() };
    let larger = load_text(&path(), &original, &shibo_nodes::registry(), &options).graph.unwrap();
    let ran = computed(&render(&session, &larger, out.path()));
    for node in ["points", "links", "springs", "moved", "relinked", "wrinkles"] {
        assert!(!ran.contains(node), "{node} ran again");
    }
    assert!(ran.contains("strokes"));
}

/// Fields share the objects they were made of. The memory of many graphs must not grow with their number.
#[test]
fn bounds_memory_of_objects_of_many_graphs() {
    let text = |seed: u32| {
        format!(
            "(version: 1, canvas: (size_mm: 60, resolution: 32, seed: {seed}), nodes: {{
              \"points\": PoissonPoints(pitch: 0.5), \"links\": ConnectNeighbors(points: \"points\"),
              \"lines\": PlaceWrinkles(lattice: \"links\"), \"grooves\": DrawWrinkles(segments: \"lines\", width: (0.3, 0.6), depth: 0.4),
            }}, outputs: {{ \"grooves\": \"grooves\" }})"
        )
    };
    let (memory, out) = (8 << 20, tempfile::tempdir().unwrap());
    let session =
        Session::new(shibo_nodes::registry(), &Settings { threads: 2, memory, ..Settings::default() }).unwrap();
    let mut alive = Vec::new();
    for seed in 1..=8 {
        render(&session, &graph(&text(seed)), out.path());
        alive.push(session.caches().memory.alive());
    }
    // Objects get a quarter of the memory; the objects of the graph rendered last come on top.
    let most = memory / 4 + alive[0];
    assert!(alive[0] > 1 << 20 && alive.iter().all(|bytes| *bytes <= most), "{alive:?} of {most}");
}
