//! The fibre direction as a Jacobian field: texture synthesised along it follows the fibres.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{LoadOptions, load_text};
use shibo_value::{Tile, Value, Window};
use std::path::Path;

/// A trunk that bows, cut along its bow: its fibres run down the board's left half and up its right one.
const GRAPH: &str = r#"(
  canvas: (size_mm: 96, resolution: 192, tile: None),
  nodes: {
    "cells": Worley(size: 2.5, aspect: 5, angle: 0, jitter: 1),
    "grain": Remap(input: "cells.border", from: (0, 1.5), clamp: true),
    "exemplar": Exemplar(input: "grain", size_mm: 64, size: (128, 128)),
    "pith": TrunkNodes(nodes: [(-30, 0, 0), (0, 0, 48), (-30, 0, 96)]),
    "tree": FitSkeleton(curve: "pith", scheme: Local),
    "time": TrunkTime(tree: "tree"),
    "year": ColorPattern(),
    "rings": RingColor(time: "time", pattern: "year"),
    "fiber": FiberSpace(time: "time", tree: "tree"),
    "light": FiberShading(color: "rings", direction: "fiber.direction"),
    "x": CutPlane(solid: "light.x", preset: FlatSawn, distance: 30),
    "y": CutPlane(solid: "light.y", preset: FlatSawn, distance: 30),
    "angle": CutPlane(solid: "light.angle", preset: FlatSawn, distance: 30),
    "jacobian": JacobianFromVectors(x: "x", y: "y"),
    "coords": Synthesize(exemplar: "exemplar", jacobian: "jacobian", size: (144, 144)),
    "out": SampleExemplar(coords: "coords", input: "grain", jacobian: "jacobian"),
  },
)"#;

/// The picture of a node.
fn picture(session: &Session, name: &str) -> Tile {
    let loaded = load_text(Path::new("test.ron"), GRAPH, session.registry(), &LoadOptions::default());
    let messages: Vec<&str> = loaded.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(messages, Vec::<&str>::new());
    let graph = loaded.graph.unwrap();
    let node = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == name).unwrap();
    let cancel = CancelToken::default();
    let Value::Field(field) = session.value(&graph, (node, 0), &cancel, &Silent).unwrap() else { panic!() };
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    session.rasters(&graph, &field, &wanted, &cancel, &Silent).unwrap().0.remove(0)
}

/// The direction of least change in some columns of a picture, in degrees from +x towards +y.
fn direction(tile: &Tile, columns: std::ops::Range<usize>) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for y in 1..tile.height() - 1 {
        let [above, row, below] = [y - 1, y, y + 1].map(|y| tile.row(0, y));
        for x in columns.clone() {
            let (dx, dy) = (f64::from(row[x + 1] - row[x - 1]), f64::from(below[x] - above[x]));
            (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
        }
    }
    // The direction of strongest change.
    let across = 0.5 * (2.0 * xy).atan2(xx - yy);
    let along = across.to_degrees() + 90.0;
    if along > 90.0 { along - 180.0 } else { along }
}

#[test]
fn synthesised_grain_follows_the_fibres_of_a_tree() {
    let session = Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap();
    let exemplar = direction(&picture(&session, "grain"), 1..191);
    assert!(exemplar.abs() < 4.0, "the exemplar's grain lies along x: {exemplar}");
    let (angle, grain) = (picture(&session, "angle"), picture(&session, "out"));
    let mut seen = Vec::new();
    for columns in [10..80, 112..182] {
        let mean = (0..angle.height()).flat_map(|y| angle.row(0, y)[columns.clone()].to_vec());
        let (sum, n) = mean.fold((0.0, 0.0), |(sum, n), v| (sum + f64::from(v), n + 1.0));
        let (fibers, grain) = (sum / n, direction(&grain, columns));
        assert!((fibers - grain).abs() < 5.0, "fibres at {fibers}°, grain at {grain}°");
        seen.push(fibers);
    }
    assert!(seen[0] > 15.0 && seen[1] < -15.0, "the fibres bow: {seen:?}");
}
