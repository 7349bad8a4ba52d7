//! Walnut around furniture: at borders of charts, both charts show the same wood to the byte of a picture.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use glam::{DVec2, UVec2};
use rayon::prelude::*;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::{Atlas, Field, Given, Grid, Pictures, Read, Stop, Tile, Value, Window, linear_to_srgb};
use std::path::Path;
use std::sync::Arc;

/// A turned handle, a ball, the seat of a chair, and a cube, each with the size of its canvas in mm.
const SHAPES: [(&str, &str, u32); 4] = [
    (
        "handle",
        "MeshShape(shape: Lathe, segments: 128, profile: [(0, 0), (9, 0.3), (14.5, 2), (17, 6), (16.2, 11), (12.4, 17), (11.2, 26), \
         (12.6, 44), (13.8, 62), (12.6, 82), (10.8, 98), (12.2, 106), (15.6, 111), (16.4, 116), (13.4, 120.5), (7, 122.6), (0, 123)])",
        172,
    ),
    ("ball", "MeshShape(shape: Sphere, segments: 96)", 150),
    ("seat", "LoadMesh(path: \"meshes/seat.glb\")", 730),
    ("cube", "MeshShape(shape: Cube)", 200),
];

/// The shipped walnut; rings alone, which do not depend on the orientation of the surface; and years.
const WOOD: &str = r##"
    "walnut": Use(graph: "walnut"),
    "pith": TrunkNodes(height: (0, 4000), count: 21, wander: 20, seed: 2),
    "trunk": FitSkeleton(curve: "pith"),
    "tree": EqualizeHeight(skeleton: "trunk"),
    "even": TrunkTime(tree: Tree(skeleton: "tree", elongation_speed: 210, thickening_speed: 3.4), age_boost: 0.6, age_fade: 25),
    "grown": VaryGrowth(time: "even", tree: "tree", eccentricity: 0.15, waves: [(4.6, 46, 360), (1.0, 14, 120), (0.16, 3, 30)]),
    "time": VaryGrowth(time: "grown", series: Generated, sigma: 0.35),
    "fiber": FiberSpace(time: "grown", tree: Tree(skeleton: "tree", elongation_speed: 210, thickening_speed: 3.4), wander: 3),
    "year": ColorPattern(stops: [(0, "#75543b"), (.10, "#7a583e"), (.4, "#795840"), (.78, "#6e4e37"), (.93, "#62442f"), (.975, "#5c3f2b"), (1, "#6e4e37")]),
    "rings": RingColor(time: "time", pattern: "year", fiber: "fiber", late_variation: 0.9, phase_variation: 0.25, feather: 0.09),
    "placed_walnut": PlaceInTree(solid: "walnut.wood.base_color", position: (0, 60, 1200), turn: (8, 20, 0)),
    "placed_rings": PlaceInTree(solid: "rings", position: (0, 60, 1200), turn: (8, 20, 0)),
    "placed_time": PlaceInTree(solid: "time", position: (0, 60, 1200), turn: (8, 20, 0)),
"##;

const BAKED: &str = r#"
    "surface_walnut": BakeSolid(atlas: "atlas", solid: "placed_walnut"),
    "surface_rings": BakeSolid(atlas: "atlas", solid: "placed_rings"),
    "space_walnut": BakeSolid(atlas: "atlas", solid: "placed_walnut", footprint: Space),
    "years": BakeSolid(atlas: "atlas", solid: "placed_time"),
"#;

struct Baked {
    session: Session,
    graph: Graph,
    atlas: Arc<Atlas>,
}

impl Baked {
    /// A shape with texels of `texel` mm.
    fn new((name, mesh, size): (&str, &str, u32), texel: f64) -> Self {
        let session = Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap();
        let charts = if name == "cube" { "Auto" } else { "New" };
        let resolution = f64::from(size) / texel;
        let text = format!(
            "(version: 1, imports: {{ \"walnut\": \"walnut.ron\" }}, canvas: (size_mm: {size}, resolution: {resolution:.0}, tile: None), \
             nodes: {{ {WOOD} \"mesh\": {mesh}, \"atlas\": MeshAtlas(mesh: \"mesh\", charts: {charts}), {BAKED} }})"
        );
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/wood_on_meshes.ron");
        let options = LoadOptions { working_dir: ".".into(), ..LoadOptions::default() };
        let loaded = load_text(&path, &text, session.registry(), &options);
        let errors: Vec<&str> = loaded.diagnostics.iter().filter(|d| !d.warning).map(|d| d.message.as_str()).collect();
        assert_eq!(errors, Vec::<&str>::new());
        let graph = loaded.graph.unwrap();
        let Value::Atlas(atlas) = value(&session, &graph, "atlas") else { panic!("no atlas") };
        Self { session, graph, atlas }
    }

    /// Values of a node at points of the canvas, each as wide as a pixel of the picture: as in `dump --at`, but without
    /// the tiles of a session, which are much larger than a point.
    fn at(&self, name: &str, points: &[DVec2]) -> Vec<Vec<f32>> {
        let Value::Field(field) = value(&self.session, &self.graph, name) else { panic!("{name} is no field") };
        let grid = self.graph.canvas.grid(self.graph.canvas.resolution);
        let one = |point: &DVec2| {
            let tile = alone(&field, &grid.centered_at(*point), Window::full(UVec2::ONE));
            (0..tile.channels()).map(|c| tile.plane(c)[0]).collect()
        };
        points.par_iter().map(one).collect()
    }

    /// About 600 points on borders between charts: the place in both charts on the canvas, and the angle of the bend in
    /// degrees. Ends of edges are left out, because a third chart may meet there.
    fn borders(&self) -> Vec<([DVec2; 2], f64)> {
        let atlas = &self.atlas;
        let mut edges = Vec::new();
        for n in 0..atlas.uvs.len() {
            for k in (0..3).filter(|k| !atlas.is_inner(n, *k)) {
                edges.extend(atlas.across(n, k).filter(|(m, _)| *m > n).map(|across| ((n, k), across)));
            }
        }
        let each = 600 / edges.len() + 1;
        let mut found = Vec::new();
        for ((n, k), (m, l)) in edges {
            let edge = |n: usize, k: usize| [1, 2].map(|d| atlas.uvs[n][(k + d) % 3].as_dvec2() * atlas.size_mm);
            let (here, there) = (edge(n, k), edge(m, l));
            let normals = [n, m].map(|n| atlas.mesh.cross(n).normalize());
            let bend = normals[0].dot(normals[1]).clamp(-1.0, 1.0).acos().to_degrees();
            for i in 0..each {
                let share = 0.3 + 0.4 * (i as f64 + 0.5) / each as f64;
                found.push(([here[0].lerp(here[1], share), there[1].lerp(there[0], share)], bend));
            }
        }
        found
    }
}

/// No prepared pictures: no wood needs any.
struct Nothing;

impl Pictures for Nothing {
    fn read(&self, _number: usize, _window: Window) -> Result<Tile, Stop> {
        Err(Stop::Cancelled)
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }
}

/// Computes a window of a field and the windows that it reads, nothing else.
fn alone(field: &Field, grid: &Grid, window: Window) -> Tile {
    let source = field.source();
    let prepared = source.prepare(grid, &Nothing).unwrap();
    let read = |read: &Read<'_>| Arc::new(alone(read.field, &read.grid, read.window));
    let mut tiles: Vec<Arc<Tile>> = source.inputs(grid, window).iter().map(read).collect();
    let later = source.later(grid, window);
    if !later.is_empty() {
        let narrow = source.narrow(&Given::new(&tiles, prepared.as_ref(), &|| false), grid, window);
        tiles.extend(later.iter().zip(narrow).map(|(bound, window)| read(&Read { window, ..*bound })));
    }
    let mut tile = Tile::new(*grid, window, field.channels());
    source.fill(&Given::new(&tiles, prepared.as_ref(), &|| false), &mut tile).unwrap();
    tile
}

fn value(session: &Session, graph: &Graph, name: &str) -> Value {
    let node = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == name).unwrap();
    session.value(graph, (node, 0), &CancelToken::default(), &Silent).unwrap()
}

/// The largest difference of two colours, in steps of an 8-bit picture.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    let byte = |v: f32| 255.0 * linear_to_srgb(v.clamp(0.0, 1.0));
    a.iter().zip(b).map(|(a, b)| (byte(*a) - byte(*b)).abs()).fold(0.0, f32::max)
}

/// Differences between the two sides of borders where the surface bends by less than `bend`: number of points, share
/// within 1 of 255, and the largest.
fn agreement(baked: &Baked, name: &str, bend: f64) -> (usize, f64, f32) {
    let borders: Vec<_> = baked.borders().into_iter().filter(|border| border.1 < bend).collect();
    let sides = [0, 1].map(|side| baked.at(name, &borders.iter().map(|border| border.0[side]).collect::<Vec<_>>()));
    let apart: Vec<f32> = sides[0].iter().zip(&sides[1]).map(|(a, b)| apart(a, b)).collect();
    let within = apart.iter().filter(|d| **d <= 1.0).count();
    (apart.len(), within as f64 / apart.len().max(1) as f64, apart.iter().fold(0.0, |most, d| most.max(*d)))
}

/// Rows B25 to B29: a cut of any form, anywhere in the tree. On a border, both charts agree within 1 of 255, and the
/// years within two roundings of 32-bit floats. Pores and rays of walnut depend on flat facets, not on smooth normals:
/// up to a thirtieth of their points differs by a little more.
#[test]
fn charts_show_the_same_walnut_at_their_borders() {
    let mut points = 0;
    for shape in SHAPES {
        // Rings of about 34 texels, and of 8.
        for (texel, looks) in [
            (0.1, [("surface_rings", 181.0, 1.0, 1.0), ("surface_walnut", 12.0, 0.975, 4.0)]),
            (0.4, [("surface_walnut", 12.0, 0.96, 4.5), ("space_walnut", 181.0, 1.0, 1.0)]),
        ] {
            let baked = Baked::new(shape, texel);
            for (name, bend, least, most) in looks {
                let (count, share, far) = agreement(&baked, name, bend);
                println!(
                    "{} {name}, texels of {texel} mm, bent by less than {bend}°: {count} points, {share} within 1, most {far}",
                    shape.0
                );
                points += count;
                assert!(count == 0 || (share >= least && far <= most), "{} {name} {texel}: {share} {far}", shape.0);
            }
            let borders = baked.borders();
            let years = [0, 1].map(|side| baked.at("years", &borders.iter().map(|b| b.0[side]).collect::<Vec<_>>()));
            let far = years[0].iter().zip(&years[1]).map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0, f32::max);
            println!("{}: years {far}", shape.0);
            assert!(far <= 2e-5, "{}: {far}", shape.0);
        }
    }
    assert!(points >= 5_000, "{points}");
}
