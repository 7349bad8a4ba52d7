//! Evaluating single nodes in unit tests, without a graph.
use shibo_engine::diagnostics::Problem;
use shibo_engine::node::{Context, Node, Outputs};
use shibo_engine::value::{Canvas, Evaluator, Field, FieldSource, Grid, Reader, Stop, Tile, Tiling, Value, Window};
use std::sync::Arc;

/// The canvas of unit tests: 32 × 32 mm, 64 × 64 pixels, tiling in both directions.
pub(crate) fn canvas() -> Canvas {
    Canvas { size_mm: glam::DVec2::splat(32.0), resolution: glam::UVec2::splat(64), tile: Tiling::BOTH, seed: 1 }
}

/// An engine that computes whatever it is asked for, every time anew.
pub(crate) struct Plain;

/// What [`Plain`] lends to a field's code.
struct PlainReader {
    prepared: Option<Arc<Tile>>,
}

fn fill(field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
    let source: &dyn FieldSource = &**field.source();
    let prepared = source.prepare(grid, &Plain)?.map(Arc::new);
    let mut tile = Tile::new(*grid, window, field.channels());
    source.fill(&PlainReader { prepared }, &mut tile)?;
    Ok(tile)
}

impl Reader for PlainReader {
    fn read(&self, field: &Field, grid: &Grid, window: Window) -> Result<Arc<Tile>, Stop> {
        fill(field, grid, window).map(Arc::new)
    }

    fn prepared(&self) -> Option<&Arc<Tile>> {
        self.prepared.as_ref()
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }
}

impl Evaluator for Plain {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        fill(field, grid, window)
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }

    fn progress(&self, _done: u64, _total: u64) {}

    fn memory(&self) -> u64 {
        1 << 30
    }

    fn warn(&self, _problem: Problem) {}
}

/// A node's outputs, its ports being the slots 0, 1, … of `inputs` as they were connected by `port`.
pub(crate) fn outputs<N: Node>(node: &N, inputs: &[Value], canvas: &Canvas) -> Result<Outputs, Stop> {
    let kind = N::schema_name();
    node.evaluate(&Context { kind: &kind, canvas, inputs, files: &[], evaluator: &Plain })
}

/// A port connected to slot `n`.
#[allow(dead_code, reason = "the first nodes with ports use it")]
pub(crate) fn port<T>(n: u32) -> shibo_engine::node::In<T> {
    serde_json::from_value(n.into()).unwrap()
}

/// The main output of a node, rendered on [`canvas`].
pub(crate) fn render<N: Node>(node: &N, inputs: &[Value]) -> Tile {
    let canvas = canvas();
    let outputs = outputs(node, inputs, &canvas).unwrap();
    let Some(Value::Field(field)) = outputs.take("", true).cloned() else { panic!("the main output is no field") };
    raster(&field, &canvas)
}

/// A field, rendered on a canvas.
pub(crate) fn raster(field: &Field, canvas: &Canvas) -> Tile {
    fill(field, &canvas.grid(canvas.resolution), Window::full(canvas.resolution)).unwrap()
}
