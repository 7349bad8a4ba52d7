//! Layers that a mask hides are not computed: the tiles of each layer are counted.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{LoadOptions, load_text};
use std::path::Path;

/// Tiles computed for each of the nodes `of`, in a picture of 4 × 4 tiles.
fn tiles(nodes: &str, output: &str, of: &[&str]) -> Vec<u64> {
    let text = format!(
        "(version: 1, canvas: (size_mm: 64, resolution: 1024, tile: Both), nodes: {{ \
         \"ramp\": Gradient(shape: Linear), \"half\": Threshold(input: \"ramp\", level: 0.5, softness: 0), {nodes} }}, \
         outputs: {{ \"it\": \"{output}\" }})"
    );
    let session = Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap();
    let loaded = load_text(Path::new("hidden.ron"), &text, session.registry(), &LoadOptions::default());
    let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let out = tempfile::tempdir().unwrap();
    let request = RenderRequest { dir: out.path().to_path_buf(), once: true, ..RenderRequest::default() };
    let report = session.render(&graph, &request, &CancelToken::default(), &Silent).unwrap();
    of.iter().map(|name| report.nodes.iter().find(|node| node.name == *name).unwrap().tiles).collect()
}

/// Allowed ratio of the tiles computed for all layers to the visible ones.
const MOST: f64 = 1.3;

#[test]
fn a_blend_computes_the_tiles_that_show() {
    let nodes = "\"x\": Perlin(size: 3), \"a\": Blur(input: \"x\", radius: 0.05), \
        \"y\": Perlin(size: 4), \"b\": Blur(input: \"y\", radius: 0.05), \
        \"it\": Blend(base: \"a\", top: \"b\", mask: \"half\")";
    let computed = tiles(nodes, "it", &["a", "b"]);
    let sum: u64 = computed.iter().sum();
    assert!(sum as f64 <= MOST * 16.0 && computed.iter().all(|tiles| *tiles >= 8), "{computed:?}");
}

#[test]
fn materials_compute_the_tiles_that_show() {
    let nodes = "\"x\": Perlin(size: 3), \"a\": Blur(input: \"x\", radius: 0.05), \
        \"y\": Perlin(size: 4), \"b\": Blur(input: \"y\", radius: 0.05), \
        \"m\": Material(roughness: \"a\", metallic: \"a\"), \"n\": Material(roughness: \"b\", coat: \"b\"), \
        \"it\": BlendMaterials(base: \"m\", top: \"n\", mask: \"half\")";
    let computed = tiles(nodes, "it", &["a", "b"]);
    let sum: u64 = computed.iter().sum();
    assert!(sum as f64 <= MOST * 16.0 && computed.iter().all(|tiles| *tiles >= 8), "{computed:?}");
}

#[test]
fn skips_heights_where_mask_is_opaque_or_empty() {
    // By height, the mask decides everywhere: each height is read only where its layer shows, and never for the weight.
    let nodes = "\"x\": Perlin(size: 3), \"a\": Blur(input: \"x\", radius: 0.05), \
        \"y\": Perlin(size: 4), \"b\": Blur(input: \"y\", radius: 0.05), \
        \"m\": Material(height: \"a\", roughness: 0.2), \"n\": Material(height: \"b\", roughness: 0.9), \
        \"w\": BlendMaterials(base: \"m\", top: \"n\", mask: \"half\", by: Height), \
        \"it\": \"= w.roughness\"";
    let computed = tiles(nodes, "it", &["a", "b"]);
    assert!(computed.iter().sum::<u64>() <= 8, "{computed:?}");
}

#[test]
fn ground_under_opaque_stamps_is_not_computed() {
    // A stamp of 40 mm in the middle covers four of the 16 tiles.
    let nodes = "\"x\": Perlin(size: 3), \"a\": Blur(input: \"x\", radius: 0.05), \
        \"m\": Material(roughness: 0.2), \"n\": Material(roughness: \"a\"), \"p\": PointList(points: [(32, 32)]), \
        \"w\": ScatterMaterial(material: \"m\", ground: \"n\", points: \"p\", size: 40, heights: Over), \
        \"it\": \"= w.roughness\"";
    assert_eq!(tiles(nodes, "it", &["a"]), [12]);
}
