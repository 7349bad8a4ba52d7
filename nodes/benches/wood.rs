//! Speed of the wood kernels and graphs: `cargo bench -p shibo-nodes --bench wood`. CPU seconds of the process, best of
//! several, one thread.
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::wood::branch::{Axis, Power, blend_all, blend_branches, branch_time};
use shibo_kernel::wood::fit::{Scheme, equalize, fit, point_at};
use shibo_kernel::wood::straight::Straight;
use shibo_kernel::wood::trunk::{Growth, Places, Rows, Trunk};
use std::hint::black_box;
use std::time::Instant;

/// CPU seconds of the process in nanoseconds where the system tells them; elsewhere the wall clock.
fn cpu(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let nanos: Option<f64> = text.split(' ').next().and_then(|n| n.parse().ok());
    nanos.map_or_else(|| start.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// The best and the mean CPU seconds of ten runs.
fn timed(mut work: impl FnMut()) -> (f64, f64) {
    let start = Instant::now();
    let mut times = Vec::new();
    // The clock of the process ticks in milliseconds: each of the ten is the mean of several.
    let one = Instant::now();
    work();
    let reps = (0.12 / one.elapsed().as_secs_f64().max(1e-6)).clamp(1.0, 1000.0).round();
    for _ in 0..10 {
        let before = cpu(start);
        let mut rep = 0.0;
        while rep < reps {
            work();
            rep += 1.0;
        }
        times.push((cpu(start) - before) / reps);
    }
    (times.iter().copied().fold(f64::INFINITY, f64::min), times.iter().sum::<f64>() / 10.0)
}

fn nodes(n: usize) -> Vec<DVec3> {
    let node = |i: usize| {
        let t = i as f64 / (n - 1) as f64;
        DVec3::new(30.0 * (t * 9.0).sin(), 20.0 * (t * 7.0).cos(), 1000.0 * t)
    };
    (0..n).map(node).collect()
}

/// A picture of 512² points: rows along x (level) or along z.
fn picture(level: bool) -> [Vec<f32>; 3] {
    let n = 512;
    let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
    for j in 0..n {
        for i in 0..n {
            let (a, b) = (i as f32 / n as f32, j as f32 / n as f32);
            let (across, up) = if level { (a, b) } else { (b, a) };
            x.push(300.0 * across - 150.0);
            y.push(25.0);
            z.push(1000.0 * up);
        }
    }
    [x, y, z]
}

fn branches(trunk: &[[DVec3; 4]], n: usize) -> Vec<Axis<f32>> {
    let branch = |i: usize| {
        let z = 900.0 * (i as f64 + 0.5) / n as f64;
        let turn = i as f64 * 2.4;
        let direction = DVec3::new(turn.cos(), turn.sin(), 0.7).normalize();
        Axis::new(point_at(trunk, z), direction, f64::INFINITY, z / 230.0, 230.0, 0.4)
    };
    (0..n).map(branch).collect()
}

fn main() {
    let growth = Growth { elongation: 230.0, thickening: 2.6, ground: 0.0, boost: 0.0, fade: 25.0 };
    let count = 512.0 * 512.0;
    println!(
        "growth time of 512 x 512 points, three branches (fig 14): ms, mean of ten; Mpx per CPU second, best of ten"
    );
    for n in [9, 33, 129] {
        let nodes = nodes(n);
        let trunk_points = equalize(&fit(&nodes, Scheme::Natural).expect("they rise")).expect("they rise").0;
        let trunk = Trunk::<f32>::new(&trunk_points);
        let three = branches(&trunk_points, 3);
        let straight = Straight::<f32>::new(&nodes, 230.0, 2.6);
        let mut out = vec![0.0_f32; 512 * 512];
        let mut other = out.clone();
        let mut line = format!("  {n:4} nodes:");
        for level in [false, true] {
            let [x, y, z] = picture(level);
            let at = Places { x: &x, y: &y, z: &z, rows: if level { Rows::Level(512) } else { Rows::Of(512) } };
            let (best, mean) = timed(|| {
                trunk.time(&at, &growth, &mut out);
                blend_branches(&three, &at, &mut out);
                black_box(&mut out);
            });
            let name = if level { "level rows" } else { "curved" };
            line += &format!(" {name} {:6.2} ms {:6.0} Mpx/s;", 1e3 * mean, count / best * 1e-6);
        }
        let [x, y, z] = picture(false);
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let (best, mean) = timed(|| {
            straight.times(&at, &mut out);
            branch_time(&three, &at, &mut other);
            blend_all(&mut out, &other, Power::Two);
            black_box(&mut out);
        });
        println!("{line} straight {:6.2} ms {:6.1} Mpx/s", 1e3 * mean, count / best * 1e-6);
    }
    println!("cost against branches, 9 nodes:");
    let trunk_points = equalize(&fit(&nodes(9), Scheme::Natural).expect("they rise")).expect("they rise").0;
    let trunk = Trunk::<f32>::new(&trunk_points);
    for n in [0, 1, 3, 10, 30] {
        let some = branches(&trunk_points, n);
        let [x, y, z] = picture(false);
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let mut out = vec![0.0_f32; 512 * 512];
        let (best, _) = timed(|| {
            trunk.time(&at, &growth, &mut out);
            blend_branches(&some, &at, &mut out);
            black_box(&mut out);
        });
        println!("  {n:3} branches: {:6.2} ns a point, {:6.0} Mpx/s", best / count * 1e9, count / best * 1e-6);
    }
    parts();
    boards();
}

/// What single kernels of the look cost.
fn parts() {
    use shibo_kernel::ground::simd::dispatch;
    use shibo_kernel::noise::noise3::Noise3;
    use shibo_kernel::wood::life::{Life, Variation, late_share};
    let [x, y, z] = picture(false);
    let mut out = vec![0.0_f32; x.len()];
    let noise = Noise3::new(Hash::new(1), 0);
    let (best, _) = timed(|| {
        dispatch(
            #[inline(always)]
            || {
                for (((out, x), y), z) in out.iter_mut().zip(&x).zip(&y).zip(&z) {
                    *out = noise.at(x * 0.1, y * 0.1, z * 0.01);
                }
            },
        );
        black_box(&mut out);
    });
    println!("noise in space: {:.2} ns a point", best / out.len() as f64 * 1e9);
    let pattern: Vec<[f32; 3]> = (0..256).map(|i| [0.9 - 0.002 * i as f32; 3]).collect();
    let life =
        Life::new(&pattern, 256, &late_share(&pattern, 256), 192, Variation { depth: 0.3, phase: 0.25 }, Hash::new(1));
    let (best, _) = timed(|| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = life.mean(i as f64 * 1e-4, 0.02, 0.011)[0];
        }
        black_box(&mut out);
    });
    println!("filtered ring colour: {:.2} ns a point", best / out.len() as f64 * 1e9);
}

/// Whole boards: every channel of a shipped graph.
fn boards() {
    use shibo_engine::eval::{CancelToken, Silent};
    use shibo_engine::graph::LoadOptions;
    use shibo_engine::session::{Session, Settings};
    use shibo_engine::value::{Channel, Value, Window};
    for name in ["walnut", "pine_knots", "oak_cuts"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../graphs/{name}.ron"));
        let mut best = f64::INFINITY;
        for _ in 0..2 {
            let settings = Settings { threads: 1, ..Settings::default() };
            let session = Session::new(shibo_nodes::registry(), &settings).expect("a session");
            let size = glam::UVec2::splat(2048);
            let options = LoadOptions { resolution: Some(size), ..LoadOptions::default() };
            let graph = session.load(&path, &options).graph.expect("a shipped graph");
            let (cancel, output) = (CancelToken::default(), &graph.outputs[0]);
            let before = process();
            let value = session.value(&graph, (output.node, output.output), &cancel, &Silent).expect("a material");
            let Value::Material(material) = value else { continue };
            for channel in [Channel::BaseColor, Channel::Normal] {
                let field = material.get(channel).expect("the channel").clone();
                let whole = [(graph.canvas.grid(size), Window::full(size))];
                black_box(session.rasters(&graph, &field, &whole, &cancel, &Silent).expect("a picture"));
            }
            best = best.min(process() - before);
        }
        println!("{name} 2048 x 2048, base colour and normal: {best:.2} CPU s");
    }
}

/// CPU seconds of all threads of the process, in steps of 1/100 s.
fn process() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat.rsplit(')').next().unwrap_or("").split(' ').map(|f| f.parse().unwrap_or(0.0)).collect();
    match fields[..] {
        [_, _, _, _, _, _, _, _, _, _, _, _, user, system, ..] => (user + system) / 100.0,
        _ => 0.0,
    }
}
