//! Renders of graphs with solids on a mesh of the other program: each cut of a solid follows the mesh.
use super::shared::{Around, Shared};
use super::{Refusal, base64};
use crate::scene::{cutters, evaluated, instead};
use glam::{DVec2, DVec3};
use petgraph::graph::NodeIndex;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_engine::eval::{CancelToken, Keys, Silent};
use shibo_engine::session::{Failure, Look};
use shibo_graph::{Gate, Graph, Input, LoadOptions, load_text};
use shibo_kernel::ground::stop::Watch;
use shibo_kernel::mesh::layout::layout;
use shibo_value::files::Memory;
use shibo_value::{Atlas, Carried, Field, Key, Material, Mesh, Value};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Texels along a side of the grid that finds overlaps.
const LOOK: u32 = 512;
/// Largest distance from the pith in mm, and largest turn in degrees.
const FARTHEST: f64 = 1e7;
const MOST_TURN: f64 = 360.0;
/// The ranges of `spread` and `turn` of `BakeSolid`, in mm and degrees.
const MOST_SPREAD: f64 = 1e6;
const HALF_TURN: f64 = 180.0;

/// The unit of lengths in a file.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Unit {
    #[default]
    Mm,
    Cm,
    M,
}

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
enum Up {
    Y,
    #[default]
    Z,
}

/// The fields of `mesh`.
#[derive(Deserialize)]
pub(super) struct Request {
    /// A file `.obj` or `.glb`, or its name if `content` is given.
    file: String,
    /// The content in base64.
    #[serde(default)]
    content: Option<String>,
    #[serde(default)]
    unit: Unit,
    #[serde(default)]
    up: Up,
}

/// A mesh that was read.
pub(super) struct Loaded {
    file: String,
    gate: Gate,
    unit: Unit,
    up: Up,
}

/// The pieces of a mesh that are each cut from another place.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
enum By {
    None,
    #[default]
    Part,
    Piece,
}

/// Position of the mesh in the solid: its origin in mm, and turns about x, y and z in degrees.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Place {
    #[serde(default, rename = "move")]
    position: [f64; 3],
    #[serde(default)]
    turn: [f64; 3],
}

/// The field `on` of `render`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct On {
    pub(super) mesh: String,
    #[serde(default)]
    place: Place,
    #[serde(default)]
    by: By,
    /// Largest random shift of the pieces along x, y and z, in mm.
    #[serde(default)]
    spread: [f64; 3],
    /// Largest random rotation of the pieces about z, in degrees.
    #[serde(default)]
    turn: f64,
    /// Another seed cuts the pieces from other places.
    #[serde(default)]
    seed: u64,
}

impl On {
    /// Refuses numbers that no place and no cut has.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        let within = |numbers: [f64; 3], most: f64| numbers.iter().all(|number| number.abs() <= most);
        if !within(self.place.position, FARTHEST) || !within(self.place.turn, MOST_TURN) {
            return Err(Refusal::new("usage", format!("`move` is at most {FARTHEST} mm, `turn` at most {MOST_TURN}°")));
        }
        let all = |numbers: &[f64], most: f64| numbers.iter().all(|number| (0.0..=most).contains(number));
        if !all(&self.spread, MOST_SPREAD) || !all(&[self.turn], HALF_TURN) {
            let wanted = format!("`spread` of `on` is from 0 to {MOST_SPREAD} mm, its `turn` from 0 to {HALF_TURN}°");
            return Err(Refusal::new("usage", wanted));
        }
        Ok(())
    }

    /// Tells apart places and cuts, for keys.
    pub(super) fn text(&self) -> String {
        format!("{:?} {:?} {:?} {:?} {}", self.place, self.by, self.spread, self.turn, self.seed)
    }
}

impl Loaded {
    /// Reads the mesh; also returns the answer, without the name of the mesh.
    pub(super) fn new(request: Request, shared: &Shared) -> Result<(Self, Json), Refusal> {
        let gate = match &request.content {
            None => shared.tools.gate.clone(),
            Some(content) => {
                let wrong = || Refusal::new("bad-request", "the content of the mesh is not base64");
                Gate::of(Memory::default().with(&request.file, base64::decode(content).ok_or_else(wrong)?))
            }
        };
        let loaded = Self { file: request.file, gate, unit: request.unit, up: request.up };
        let nodes = "\"atlas\": MeshAtlas(mesh: \"mesh\", charts: Given)";
        let graph = loaded.graph(shared, (DVec2::splat(1000.0), 0), nodes)?;
        let value = |name: &str| {
            let at = (node(&graph, name), 0);
            let made = shared.session.value(&graph, at, &CancelToken::default(), &Silent);
            made.map_err(|failure| loaded.refusal(shared, failure, &graph))
        };
        let mesh = Mesh::unwrap(value("mesh")?).ok_or_else(missing)?;
        let has_uvs = !mesh.uvs.is_empty();
        let overlaps = match has_uvs {
            true => Atlas::unwrap(value("atlas")?).and_then(|atlas| layout(&atlas, LOOK, &Watch::never()).overlap),
            false => None,
        };
        let [low, high] = mesh.bounds();
        let answer = json!({
            "triangles": mesh.triangles.len(),
            "uv": has_uvs,
            "overlaps": overlaps.map_or(0.0, |(share, _)| share),
            "size_mm": (high - low).max_element(),
            "density_mm": density(&mesh).to_array(),
        });
        Ok((loaded, answer))
    }

    /// A graph with the node `mesh` and others, for a canvas of this size and seed.
    fn graph(&self, shared: &Shared, (size, seed): (DVec2, u64), nodes: &str) -> Result<Graph, Refusal> {
        let path = Json::from(self.file.as_str());
        let unit = match self.unit {
            Unit::Mm => "Mm",
            Unit::Cm => "Cm",
            Unit::M => "M",
        };
        let text = format!(
            "(version: 1, canvas: (size_mm: ({}, {}), resolution: 64, seed: {seed}), nodes: {{ \
             \"mesh\": LoadMesh(path: {path}, unit: {unit}, up: {:?}), {nodes} }}, outputs: {{}})",
            size.x, size.y, self.up
        );
        let options = LoadOptions { gate: self.gate.clone(), ..LoadOptions::default() };
        let loaded = load_text(Path::new("mesh.ron"), &text, shared.session.registry(), &options);
        loaded.graph.ok_or_else(|| {
            let errors: Vec<_> = loaded.diagnostics.into_iter().filter(|one| !one.warning).collect();
            Refusal::of_graph(&shared.tools, &self.file, &errors, &loaded.sources)
        })
    }

    fn refusal(&self, shared: &Shared, failure: Failure, graph: &Graph) -> Refusal {
        Refusal::of_failure(&shared.tools, &self.file, failure, &graph.sources)
    }

    /// A graph that cuts solids along the mesh, for a canvas of this size and seed.
    pub(super) fn cut(&self, around: &Around<'_>, on: &On, (size, seed): (DVec2, u64)) -> Result<Cut, Refusal> {
        let shared = around.shared;
        let Place { position: [x, y, z], turn: [a, b, c] } = on.place;
        let [along_x, along_y, along_z] = on.spread;
        let nodes = format!(
            "\"atlas\": MeshAtlas(mesh: \"mesh\", overlap: Refuse), \
             \"placed\": PlaceInTree(solid: \"#808080\", position: ({x:?}, {y:?}, {z:?}), turn: ({a:?}, {b:?}, {c:?})), \
             \"cut\": BakeSolid(atlas: \"atlas\", solid: \"placed\", by: {:?}, \
             spread: ({along_x:?}, {along_y:?}, {along_z:?}), turn: {:?}, seed: {})",
            on.by, on.turn, on.seed
        );
        let graph = self.graph(shared, (size, seed), &nodes)?;
        let keys = shared.session.keys(&graph).map_err(|failure| self.refusal(shared, failure, &graph))?;
        let at = (node(&graph, "atlas"), 0);
        let atlas = shared.session.value(&graph, at, around.cancel, around.observer);
        let atlas = atlas.map_err(|failure| self.refusal(shared, failure, &graph))?;
        Ok(Cut {
            graph,
            key: keys.output(at.0, at.1),
            atlas: Atlas::unwrap(atlas).ok_or_else(missing)?,
            how: format!("{} {seed}", on.text()),
        })
    }
}

/// Cuts of solids along an atlas.
pub(super) struct Cut {
    graph: Graph,
    key: Key,
    pub(super) atlas: Arc<Atlas>,
    how: String,
}

impl Cut {
    /// A name of the cut: equal names mean equal places of texels in the solid.
    pub(super) fn key(&self) -> Key {
        Key::of("on a mesh", &[self.key.as_bytes(), self.how.as_bytes()])
    }

    /// The value of an output with every upstream cut along the mesh; `None` if it has no cut.
    pub(super) fn of(
        &self,
        look: &Look<'_>,
        (graph, keys): (&Graph, &Keys),
        at: (NodeIndex, usize),
        around: &Around<'_>,
    ) -> Result<Option<Value>, Failure> {
        let mut others = HashMap::new();
        for (index, slot) in cutters(graph, at.0) {
            let Input::Wire { node: from, output } = graph.nodes[index].inputs[slot] else { continue };
            let Some(solid) = look.value(from, output)? else { continue };
            let key = |name: &str| Key::of(name, &[self.key().as_bytes(), keys.output(from, output).as_bytes()]);
            let first = |name: &str, inputs: &[Value]| {
                let cutter = &self.graph.nodes[node(&self.graph, name)];
                let made = evaluated(look, cutter, inputs, &|_| key(name))?;
                made.into_iter().next().flatten().ok_or_else(|| Failure::Usage(format!("`{name}` made nothing")))
            };
            let placed = first("placed", &[solid])?;
            let cut = first("cut", &[Atlas::wrap(self.atlas.clone()), placed])?;
            others.insert((index, 0), cut);
        }
        let value = instead(look, graph, &|node, output| keys.output(node, output), at, (&others, self.key()))?;
        let registry = around.shared.session.registry();
        let filled = |field: &Field| registry.with_gutter(field, &self.atlas);
        Ok(value.map(|value| match value {
            Value::Field(field) => Value::Field(filled(&field)),
            Value::Material(material) => {
                let channels = material.channels().iter().map(|(channel, field)| (*channel, filled(field)));
                Value::Material(Arc::new(Material::new(channels)))
            }
            other => other,
        }))
    }
}

/// The lengths on the surface, in mm, of one unit of u and of v: medians over the triangles. 0 without UVs.
fn density(mesh: &Mesh) -> DVec2 {
    let mut lengths = [Vec::new(), Vec::new()];
    for (triangle, uvs) in mesh.uvs.iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        let [ta, tb, tc] = uvs.map(|uv| uv.as_dvec2());
        let (one, other, du, dv) = (b - a, c - a, tb - ta, tc - ta);
        let area = du.perp_dot(dv);
        if area.abs() > 1e-18 {
            let along: [DVec3; 2] = [(one * dv.y - other * du.y) / area, (other * du.x - one * dv.x) / area];
            lengths.iter_mut().zip(along).for_each(|(lengths, along)| lengths.push(along.length()));
        }
    }
    let median = |mut lengths: Vec<f64>| {
        lengths.sort_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied().unwrap_or(0.0)
    };
    let [u, v] = lengths.map(median);
    DVec2::new(u, v)
}

/// A node of a graph that was made here.
fn node(graph: &Graph, name: &str) -> NodeIndex {
    graph.nodes.node_indices().find(|index| graph.nodes[*index].name == name).unwrap_or_default()
}

fn missing() -> Refusal {
    Refusal::new("defect", "the mesh was not made")
}
