//! Cost of reading meshes: `cargo bench -p shibo-nodes --bench mesh -- FILE…`, the minimum of several runs, in CPU time
//! of one thread.
use shibo_node::{Call, DynNode};
use shibo_nodes::mesh::LoadMesh;
use shibo_value::diagnostics::Problem;
use shibo_value::{Canvas, Evaluator, Field, Grid, Stop, Tile, Tiling, Value, Window};
use std::time::Instant;

/// An engine that makes no fields: loading needs none.
struct Bare;

impl Evaluator for Bare {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        Ok(Tile::new(*grid, window, field.channels()))
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

/// Seconds this thread has run, or wall time where the system does not report it.
fn cpu_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn main() {
    let canvas =
        Canvas { size_mm: glam::DVec2::splat(100.0), resolution: glam::UVec2::splat(64), tile: Tiling::NONE, seed: 1 };
    let start = Instant::now();
    for path in std::env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        let files = [("path", (&path).into())];
        let call = Call { kind: "LoadMesh", canvas: &canvas, inputs: &[], files: &files, evaluator: &Bare };
        let (mut best, mut triangles) = ([f64::INFINITY; 2], 0);
        for _ in 0..5 {
            let before = cpu_seconds(start);
            let checked = DynNode::check_files(&LoadMesh::default(), &files);
            best[0] = best[0].min(cpu_seconds(start) - before);
            if let Some(problem) = checked.first() {
                println!("{path}: {problem}");
                break;
            }
            let before = cpu_seconds(start);
            let outputs = DynNode::evaluate(&LoadMesh::default(), &call);
            best[1] = best[1].min(cpu_seconds(start) - before);
            if let Ok(Some(Value::Mesh(mesh))) = outputs.as_ref().map(|outputs| outputs.take("mesh", true)) {
                triangles = mesh.triangles.len();
            }
        }
        println!("{path}: {triangles} triangles, checked in {:.3} s, loaded in {:.3} s", best[0], best[1]);
    }
}
