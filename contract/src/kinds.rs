//! Graphs with a node of any kind, its ports connected, and the node's outputs as bytes.
use glam::UVec2;
use shibo_engine::eval::{CancelToken, Silent, encode};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::Registry;
use shibo_node::{KindInfo, OutputType, ParamInfo, ParamType};
use shibo_value::{Accepts, Resolution, Tile, Type, Window};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// The folder of the workspace, which has the files that nodes read.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The picture for nodes that read one.
const PICTURE: &str = "library/examples/ramp.png";

/// The mesh for nodes that read one.
const MESH: &str = "library/examples/cube.obj";

/// The drawing for nodes that read one.
const DRAWING: &str = "library/examples/leaf.svg";

/// Options that load a graph at a resolution, with the workspace as working folder.
pub fn options(resolution: UVec2) -> LoadOptions {
    LoadOptions {
        resolution: Some(Resolution::Exact(resolution)),
        working_dir: FOLDER.into(),
        ..LoadOptions::default()
    }
}

/// Nodes that ports are connected to.
pub const STAND_INS: &str = r##"
    "gray": Perlin(size: 5),
    "rgb": GradientMap(input: "gray", stops: [(0.0, "#102030"), (1.0, "#f0c080")]),
    "normal": HeightToNormal(input: "gray"),
    "vector": VectorField(input: "gray"),
    "cells": Worley(size: 5),
    "points": PoissonPoints(pitch: 3),
    "lattice": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "lattice"),
    "segments": PlaceWrinkles(lattice: "lattice"),
    "path": Streamlines(),
    "curve": TrunkNodes(height: (-100, 100), count: 5),
    "skeleton": FitSkeleton(curve: "curve"),
    "pattern": ColorPattern(entries: 64),
    "solid": TrunkTime(tree: "skeleton"),
    "fiber": FiberSpace(time: "solid", tree: "skeleton"),
    "solid_color": RingColor(time: "solid", pattern: "pattern"),
    "material": Material(base_color: "rgb", roughness: 0.5, height: "gray"),
    "turned": JacobianFromAngleScale(angle: 20, scale: "stretch"),
    "stretch": Remap(input: "gray", to: (0.8, 1.3)),
    "exemplar": Exemplar(input: "rgb", size: (32, 32)),
    "coords": JitterCoords(coords: "start", amount: 4),
    "start": StartCoords(size: (8, 8), levels: 2),
    "mesh": MeshShape(shape: Torus, size: (20, 20, 10), radius: 4, segments: 16),
    "atlas": MeshAtlas(mesh: "mesh"),
    "frames": TangentField(mesh: "mesh", from: Around),
    "surface_net": ConnectMeshPoints(net: "sown"),
    "sown": MeshPoints(atlas: "atlas", pitch: 4),
"##;

/// The first output of each type among [`STAND_INS`].
fn stand_ins() -> &'static BTreeMap<Type, String> {
    static FOUND: OnceLock<BTreeMap<Type, String>> = OnceLock::new();
    FOUND.get_or_init(|| {
        let graph = load(&Arc::new(shibo_nodes::registry()), STAND_INS, UVec2::splat(64)).unwrap();
        let mut found = BTreeMap::new();
        for node in graph.nodes.node_weights() {
            for (output, ty) in node.node.outputs().iter().zip(&node.outputs) {
                found.entry(*ty).or_insert_with(|| format!("\"{}.{}\"", node.name, output.name));
            }
        }
        found
    })
}

/// The output that a port is connected to, and the nodes needed beside [`STAND_INS`].
pub fn stand_in(registry: &Arc<Registry>, port: Accepts) -> Result<(String, String), String> {
    let ty = match port {
        Accepts::One(ty) => ty,
        Accepts::Field | Accepts::EveryField | Accepts::Direction | Accepts::Number => Type::Gray,
        Accepts::FieldOrSolid | Accepts::EveryFieldOrSolid | Accepts::FieldOrMaterial => Type::Gray,
        Accepts::Color => Type::Rgb,
        Accepts::AnyNormal => Type::Normal,
        Accepts::AnyMaterial => Type::Material,
        Accepts::AnyVector => Type::Rgb,
        Accepts::AnySolid | Accepts::InSpace => Type::Solid,
    };
    match stand_ins().get(&ty) {
        Some(known) => Ok((known.clone(), String::new())),
        None => made(registry, ty),
    }
}

/// A node, with its ports connected, of the first kind whose main output has this type.
pub fn made(registry: &Arc<Registry>, ty: Type) -> Result<(String, String), String> {
    let mut infos = registry.kinds().filter_map(|kind| registry.info(kind));
    let makes = |info: &&KindInfo| {
        let main = info.outputs[0].ty;
        let makes = main == OutputType::Fixed(ty) || (ty == Type::Material && main.is_material());
        makes && info.ports().all(|(_, port)| port.ty != Accepts::One(ty))
    };
    let info = infos.find(makes).ok_or_else(|| format!("no kind makes {ty} of something else"))?;
    let (args, nodes) = arguments(registry, info, None)?;
    Ok((format!("\"made_{ty}\""), format!("{nodes} \"made_{ty}\": {}({args}),", info.kind)))
}

/// Arguments that a kind needs to be valid.
pub fn needed(kind: &str) -> Option<(&'static str, String)> {
    match kind {
        "PointList" => Some(("points", "[(3, 4), (10, 7), (5, 12), (13, 13), (8, 2)]".into())),
        "Path" => Some(("points", "[(-2, 3), (6, 11), (14, 3)]".into())),
        "Relief" => Some(("height", "\"gray\"".into())),
        "Material" => Some(("base_color", "\"rgb\"".into())),
        "LayerMaterials" => {
            Some(("layers", "[(material: \"material\"), (material: \"material\", mask: \"gray\", by: Height)]".into()))
        }
        "DistanceTime" => Some(("seeds", "[(3, 4, 0), (11, 9, 0)]".into())),
        "DeformSolid" => Some(("steps", "[(work: Drill)]".into())),
        "CoordsFromField" => Some(("input", "\"vector\"".into())),
        "LoadMesh" => Some(("path", format!("\"{MESH}\""))),
        "Image" => Some(("path", format!("\"{PICTURE}\""))),
        "Svg" => Some(("path", format!("\"{DRAWING}\""))),
        "DisplaceMesh" => Some(("pitch", "0.25".into())),
        _ => None,
    }
}

/// The arguments of a kind with its ports connected and one parameter changed or left out, and the nodes needed beside
/// [`STAND_INS`].
pub fn arguments(
    registry: &Arc<Registry>,
    info: &KindInfo,
    change: Option<(&str, Option<&str>)>,
) -> Result<(String, String), String> {
    let (mut args, mut nodes) = (Vec::new(), String::new());
    for (field, port) in info.ports().filter(|(_, port)| port.required) {
        let (text, more) = stand_in(registry, port.ty)?;
        args.push(if port.list { format!("{}: [{text}]", field.name) } else { format!("{}: {text}", field.name) });
        if !nodes.contains(&more) {
            nodes.push_str(&more);
        }
    }
    if let Some((field, text)) = needed(&info.kind).filter(|(field, _)| change.is_none_or(|c| c.0 != *field)) {
        args.push(format!("{field}: {text}"));
    }
    args.extend(change.and_then(|(field, text)| Some(format!("{field}: {}", text?))));
    Ok((args.join(", "), nodes))
}

/// A graph of these nodes.
pub fn load(registry: &Arc<Registry>, nodes: &str, size: UVec2) -> Result<Graph, String> {
    let text = format!("(canvas: (size_mm: 16, resolution: 64, seed: 3), nodes: {{ {nodes} }})");
    let path = Path::new(FOLDER).join("contract.ron");
    let loaded = load_text(&path, &text, registry, &options(size));
    let errors: Vec<&str> = loaded.diagnostics.iter().filter(|d| !d.warning).map(|d| d.message.as_str()).collect();
    loaded.graph.ok_or_else(|| errors.join("; "))
}

/// A graph whose node `it` is a `kind` with its ports connected and one parameter changed.
pub fn graph(
    registry: &Arc<Registry>,
    info: &KindInfo,
    size: UVec2,
    change: Option<(&str, &str)>,
) -> Result<Graph, String> {
    let (args, nodes) = arguments(registry, info, change.map(|(field, text)| (field, Some(text))))?;
    let node = format!("\"it\": {}({args}),", info.kind);
    load(registry, &format!("{STAND_INS} {nodes} {node}"), size).map_err(|errors| format!("{node} {errors}"))
}

/// A session without a cache folder.
///
/// # Panics
/// If threads cannot be started.
pub fn session(registry: &Arc<Registry>, threads: usize) -> Session {
    Session::new(registry.clone(), &Settings { threads, ..Settings::default() }).unwrap()
}

/// The node `it`.
///
/// # Panics
/// If the graph has none.
pub fn it(graph: &Graph) -> petgraph::graph::NodeIndex {
    graph.nodes.node_indices().find(|i| graph.nodes[*i].name == "it").unwrap()
}

/// All outputs of a node as bytes; fields are assembled from windows of at most `side` pixels.
pub fn bytes(session: &Session, graph: &Graph, side: u32) -> Result<Vec<u8>, String> {
    let fail = |failure: Failure| format!("{failure:?}");
    let (node, size) = (it(graph), graph.canvas.resolution);
    let grid = graph.canvas.grid(size);
    let mut all = Vec::new();
    for output in 0..graph.nodes[node].outputs.len() {
        let value = session.value(graph, (node, output), &CancelToken::default(), &Silent).map_err(fail)?;
        all.extend(encode(&value).unwrap_or_default());
        for field in value.fields() {
            let mut whole = Tile::new(grid, Window::full(size), field.channels());
            let mut windows = Vec::new();
            for y in (0..size.y).step_by(side as usize) {
                for x in (0..size.x).step_by(side as usize) {
                    let (width, height) = (side.min(size.x - x), side.min(size.y - y));
                    windows.push((grid, Window { x: x.cast_signed(), y: y.cast_signed(), width, height }));
                }
            }
            let token = CancelToken::default();
            let (tiles, _) = session.rasters(graph, &field, &windows, &token, &Silent).map_err(fail)?;
            tiles.iter().for_each(|tile| whole.copy_from(tile, 0, 0));
            if let Some(bad) = whole.data().iter().find(|v| !v.is_finite()) {
                return Err(format!("output {output} has the value {bad}"));
            }
            all.extend(whole.data().iter().flat_map(|v| v.to_bits().to_le_bytes()));
        }
    }
    Ok(all)
}

/// RON for a value of a parameter other than its default.
pub fn another(param: &ParamInfo) -> Option<String> {
    let number = |default: f64| {
        let (min, max) = (param.bounds.min.unwrap_or(-1e6), param.bounds.max.unwrap_or(1e6));
        let up = default * 1.25 + 0.1;
        if up <= max { up } else { 0.5 * (default + min) }
    };
    let whole = |default: f64| if default < param.bounds.max.unwrap_or(1e6) { default + 1.0 } else { default - 1.0 };
    let default = param.default.as_f64();
    let list = |i: usize| param.default.get(i).and_then(serde_json::Value::as_f64);
    match param.ty {
        ParamType::Number => Some(format!("{:?}", number(default.unwrap_or(0.5)))),
        ParamType::Integer => Some(format!("{}", whole(default.unwrap_or(1.0)))),
        ParamType::Bool => Some((!param.default.as_bool()?).to_string()),
        ParamType::Choice => {
            let mut others = param.choices.iter().filter(|choice| !choice.has_arguments);
            others.find(|choice| choice.name != param.written).map(|choice| choice.name.clone())
        }
        ParamType::Range => match (list(0), list(1)) {
            (Some(lo), Some(hi)) => Some(format!("({lo:?}, {:?})", number(hi).max(lo))),
            _ => Some("0.5".into()),
        },
        ParamType::Linear | ParamType::Xy => Some(format!("({:?}, {:?})", list(0)?, number(list(1)?))),
        ParamType::Color => Some("(0.11, 0.07, 0.05)".into()),
        _ => None,
    }
}
