//! A render with `once` frees tiles as it goes: it computes no tile twice, writes the same files and holds much less
//! memory.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use glam::UVec2;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_graph::{LoadOptions, load};
use shibo_value::Resolution;
use std::path::Path;

/// Tiles computed, bytes held at the end, and files written by a render of a shipped graph.
fn render(name: &str, resolution: u32, once: bool) -> (u64, u64, Vec<Vec<u8>>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs").join(name);
    let options =
        LoadOptions { resolution: Some(Resolution::Exact(UVec2::splat(resolution))), ..LoadOptions::default() };
    let graph = load(&path, &shibo_nodes::registry(), &options).graph.unwrap();
    let settings = Settings { threads: 1, ..Settings::default() };
    let session = Session::new(shibo_nodes::registry(), &settings).unwrap();
    let out = tempfile::tempdir().unwrap();
    let request = RenderRequest { dir: out.path().to_path_buf(), once, ..RenderRequest::default() };
    let report = session.render(&graph, &request, &CancelToken::default(), &Silent).unwrap();
    let files = report.files.iter().map(|file| std::fs::read(file).unwrap()).collect();
    (report.nodes.iter().map(|node| node.tiles).sum(), session.caches().memory.bytes(), files)
}

/// Bytes held at the end, without and with `once`. The size is no multiple of a tile, and there are several bands.
fn compare(name: &str) -> (u64, u64) {
    let (kept, once) = (render(name, 1100, false), render(name, 1100, true));
    assert_eq!(kept.0, once.0, "{name} computes tiles again that were let go of");
    assert!(kept.2 == once.2, "{name} has other pictures");
    (kept.1, once.1)
}

#[test]
fn frees_tiles_without_recomputing_them() {
    // A graph that tiles, with wide filters and warps; one with distances; one with cuts of solids.
    for name in ["calf.ron", "brick_wall.ron", "oak_cuts.ron"] {
        let (kept, once) = compare(name);
        assert!(once < kept, "{name}: {once} of {kept} bytes");
    }
}

#[test]
fn frees_most_tiles_of_a_board() {
    let (kept, once) = compare("walnut.ron");
    assert!(once * 2 < kept, "{once} of {kept} bytes");
}
