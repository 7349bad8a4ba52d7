//! Fields at points: computed exactly if that is cheap, otherwise read from shared pictures.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]
#![allow(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "small numbers")]

use crate::evaluating::registry;
use glam::DVec2;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::{Field, Halo, Key, Tile, Tiling, Type, Value, Window};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A picture of 512² pixels of 1 mm.
fn graph(nodes: &str, output: &str) -> Graph {
    let text = format!(
        "(canvas: (size_mm: 512, resolution: 512, tile: Both), nodes: {{ {nodes} }}, outputs: {{ \"out\": \"{output}\" }})"
    );
    let loaded = load_text(Path::new("points.ron"), &text, &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", &loaded.diagnostics[..1]))
}

fn session() -> Session {
    Session::new(registry(), &Settings { threads: 2, memory: 256 << 20, ..Settings::default() }).unwrap()
}

/// A field of the x of each pixel in mm, and a count of its computed pixels.
fn counted() -> (Field, Arc<AtomicU64>) {
    let pixels = Arc::new(AtomicU64::new(0));
    let count = pixels.clone();
    let field = Field::generate(Type::Gray, Tiling::BOTH, move |out: &mut Tile, _| {
        count.fetch_add(out.window.len() as u64, Ordering::Relaxed);
        let (grid, window, width) = (out.grid, out.window, out.width());
        for (k, value) in out.plane_mut(0).iter_mut().enumerate() {
            *value = grid.center(window.x + (k % width) as i32, window.y).x as f32;
        }
        Ok(())
    });
    (field.keyed(Key::of("counted", &[])), pixels)
}

/// Copies the central pixel, but reads `halo` pixels to every side.
fn middle(of: Field, halo: usize) -> Field {
    let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
        for row in 0..out.height() {
            let width = out.width();
            out.row_mut(0, row).copy_from_slice(&input.row(0, row + halo)[halo..halo + width]);
        }
        Ok(())
    };
    Field::map(Type::Gray, [of], Halo::px(halo), fill).keyed(Key::of("middle", &[&halo.to_le_bytes()]))
}

/// A thousand points on a line.
fn points() -> Vec<DVec2> {
    (0..1000).map(|k| DVec2::new(0.25 + f64::from(k) * 0.51, 3.5)).collect()
}

fn values(session: &Session, graph: &Graph, field: &Field, points: &[DVec2]) -> Result<Vec<f32>, Failure> {
    session.at_points(graph, field, points, &CancelToken::default(), &Silent)
}

#[test]
fn computes_only_the_pixels_around_points() {
    let (source, pixels) = counted();
    let (session, graph) = (session(), graph("\"n\": Ramp()", "n"));
    let found = values(&session, &graph, &middle(source, 1), &points()).unwrap();
    assert!(found.iter().zip(points()).all(|(value, point)| (f64::from(*value) - point.x).abs() < 1e-4));
    assert_eq!((found.len(), pixels.load(Ordering::Relaxed)), (1000, 9000));
}

#[test]
fn shares_pictures_for_large_halos() {
    let (source, pixels) = counted();
    let (session, graph) = (session(), graph("\"n\": Ramp()", "n"));
    let found = values(&session, &graph, &middle(source, 100), &points()).unwrap();
    // Values of the pixels that contain the points, from a picture computed once.
    assert!(found.iter().zip(points()).all(|(value, point)| f64::from(*value) == point.x.floor() + 0.5));
    assert!(pixels.load(Ordering::Relaxed) <= 512 * 512, "{pixels:?}");
    let far = values(&session, &graph, &middle(counted().0, 100), &[DVec2::ZERO, DVec2::splat(1e12)]);
    let Err(Failure::Usage(told)) = far else { panic!("{far:?}") };
    assert!(told.contains("point 2 at (1000000000000, 1000000000000) mm lies too far"), "{told}");
    assert_eq!(values(&session, &graph, &middle(counted().0, 100), &[]), Ok(Vec::new()));
}

/// Some fields read the whole canvas as a picture, which a small grid around a point does not have.
#[test]
fn takes_whole_pictures_from_the_canvas() {
    let (session, graph) = (session(), graph("\"n\": Ramp(), \"out\": Centre(input: \"n\")", "out"));
    let output = &graph.outputs[0];
    let cancel = CancelToken::default();
    let Value::Field(field) = session.value(&graph, (output.node, output.output), &cancel, &Silent).unwrap() else {
        panic!("no field")
    };
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    let picture = session.rasters(&graph, &field, &wanted, &cancel, &Silent).unwrap().0.remove(0);
    let found = values(&session, &graph, &field, &points()).unwrap();
    for (value, point) in found.iter().zip(points()) {
        assert_eq!(*value, picture.row(0, 3)[point.x as usize], "{point}");
    }
}
