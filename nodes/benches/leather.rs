//! Speed of the leather kernels. `cargo bench -p shibo-nodes --bench leather` prints rates, for springs also the share of
//! the memory bandwidth; `SHIBO_BENCH_REPORT=springs`, `strokes` or `points` prints those alone. Times are CPU
//! seconds of the whole process where the system tells them, so that other work on the machine matters less.
use shibo_nodes::kernel::hash::Hash;
use shibo_nodes::kernel::springs::{Net, simulate};
use shibo_nodes::kernel::strokes::{StrokeSet, StrokeStyle};

fn main() {
    match std::env::var("SHIBO_BENCH_REPORT").as_deref() {
        Ok("points") => report::points(),
        Ok("strokes") => report::strokes(),
        Ok(_) => report::springs(),
        Err(_) => {
            report::springs();
            report::strokes();
            report::points();
            divan::main();
        }
    }
}

/// A periodic list of 100 000 points, 60 steps.
#[divan::bench]
fn springs_list(bencher: divan::Bencher<'_, '_>) {
    let size = glam::Vec2::splat(316.0);
    let points = shibo_nodes::kernel::points::random(100_000, size, Hash::new(1));
    let links = shibo_nodes::kernel::delaunay::delaunay(&points, size, true);
    let k = vec![4.0; links.pairs.len()];
    let rest = vec![0.3; k.len()];
    let points: Vec<[f32; 2]> = points.iter().map(|p| p.to_array()).collect();
    let net = Net {
        links: &links.pairs,
        wraps: &links.wraps,
        size: size.to_array(),
        stiffness: &k,
        rest: &rest,
        ..Net::default()
    };
    bencher.bench_local(|| simulate(&points, &net, &report::motion(60), &mut |_| true));
}

/// 100 000 Gaussian strokes of about 140 pixels in tiles.
#[divan::bench]
fn strokes(bencher: divan::Bencher<'_, '_>) {
    let set = StrokeSet::new(&report::random_strokes(100_000), StrokeStyle::default(), None);
    bencher.bench_local(|| report::fill_all(&set, 256, 5));
}

/// Figures that want more than a time: rates and shares of a limit measured in the same run.
mod report {
    use glam::Vec2;
    use shibo_nodes::kernel::delaunay::delaunay;
    use shibo_nodes::kernel::hash::Hash;
    use shibo_nodes::kernel::lattice::{GridShape, grid_links};
    use shibo_nodes::kernel::poisson::{PoissonSpec, poisson, poisson_estimate};
    use shibo_nodes::kernel::springs::{BreakOn, Integrator, Motion, Net, simulate};
    use shibo_nodes::kernel::strokes::{Draw, Stroke, StrokeSet, StrokeStyle, Window};
    use std::hint::black_box;
    use std::time::Instant;

    /// CPU seconds of the process, in steps of 1/100 s; elsewhere than on Linux the wall clock.
    fn cpu(start: Instant) -> f64 {
        let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
        let fields: Vec<f64> =
            stat.rsplit(')').next().unwrap_or("").split(' ').map(|f| f.parse().unwrap_or(0.0)).collect();
        match fields[..] {
            [_, _, _, _, _, _, _, _, _, _, _, _, user, system, ..] => (user + system) / 100.0,
            _ => start.elapsed().as_secs_f64(),
        }
    }

    /// CPU seconds that `work` takes.
    fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
        let start = Instant::now();
        let before = cpu(start);
        let result = work();
        (result, cpu(start) - before)
    }

    /// Bytes per second of `a = b + s c` over arrays far larger than the caches, 4 streams counted (a is also read).
    fn triad() -> f64 {
        let n = 1 << 24;
        let (mut a, b, c) = (vec![0.0f32; n], vec![1.0f32; n], vec![2.0f32; n]);
        let mut best = f64::INFINITY;
        for _ in 0..7 {
            let start = Instant::now();
            for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
                *a = b + 0.5 * c;
            }
            black_box(&mut a);
            best = best.min(start.elapsed().as_secs_f64());
        }
        16.0 * n as f64 / best
    }

    pub(crate) fn motion(steps: u32) -> Motion<f32> {
        Motion {
            step: 0.05,
            steps,
            integrator: Integrator::Explicit,
            drag: 1.0,
            break_on: BreakOn::Either,
            settle: 0.0,
        }
    }

    /// Strokes of 16 by 2.7 pixels (σ = W/4, cut at .8 W) on `256 √count / 316` mm, a pixel being a mm.
    pub(crate) fn random_strokes(count: usize) -> Vec<Stroke> {
        let side = 1280.0 * (count as f32 / 100_000.0).sqrt();
        let hash = Hash::new(5);
        let stroke = |n: u64| {
            let at = Vec2::new(hash.unit_f32(4 * n), hash.unit_f32(4 * n + 1)) * side;
            let half = Vec2::from_angle(6.3 * hash.unit_f32(4 * n + 2)) * 8.0;
            Stroke { ends: [at - half, at + half], half_width: 2.7, depth: 0.5 + 0.5 * hash.unit_f32(4 * n + 3) }
        };
        (0..count as u64).map(stroke).collect()
    }

    /// Fills `tiles²` tiles; returns the share of pixels that are not 0.
    pub(crate) fn fill_all(set: &StrokeSet, tile: usize, tiles: usize) -> f64 {
        let mut out = vec![0.0; tile * tile];
        let mut touched = 0;
        for n in 0..tiles * tiles {
            let origin = |i: usize| i32::try_from(i * tile).expect("small");
            let window = Window {
                x: origin(n % tiles),
                y: origin(n / tiles),
                width: tile,
                height: tile,
                step: Vec2::ONE,
                origin: glam::DVec2::ZERO,
            };
            set.fill(&window, Draw::Depth, &mut out);
            touched += black_box(&mut out).iter().filter(|v| **v > 0.0).count();
        }
        touched as f64 / (tile * tile * tiles * tiles) as f64
    }

    pub(crate) fn strokes() {
        let strokes = random_strokes(1_000_000);
        let plain = StrokeStyle::default();
        let tapered = StrokeStyle { taper: 0.3, tip: 0.3, ..plain };
        let round = StrokeStyle { round_caps: true, ..plain };
        for (name, style) in [("square", plain), ("round", round), ("tapered", tapered)] {
            let (set, built) = timed(|| StrokeSet::new(&strokes, style, None));
            for tile in [256, 64] {
                let (share, filled) = timed(|| fill_all(&set, tile, 4096 / tile));
                println!(
                    "1 M Gaussian strokes of 16 x 8.6 px, {name:7} ends, tiles of {tile:3}: bins {built:.2} s, fill {filled:.2} s, {share:.2} covered"
                );
            }
        }
    }

    pub(crate) fn points() {
        for aspect in [1.0, 2.0] {
            let spec = PoissonSpec {
                size: Vec2::splat(1000.0),
                pitch: 1.0,
                aspect,
                angle: 0.4,
                periodic: true,
                factor: None,
                most: 1.0,
            };
            let (points, thrown) = timed(|| poisson(&spec, Hash::new(1)));
            let (links, linked) = timed(|| delaunay(&points, spec.size, true));
            println!(
                "poisson aspect {aspect}: {} points ({:.3} of the estimate) in {thrown:.2} s; delaunay {} links in {:.2} s",
                points.len(),
                points.len() as f64 / poisson_estimate(&spec),
                links.pairs.len(),
                linked
            );
        }
    }

    fn run(name: &str, threads: usize, net: &Net<'_, f32>, points: &[[f32; 2]], bytes: f64) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let time = |steps| {
            let start = Instant::now();
            let out = pool.install(|| simulate(points, net, &motion(steps), &mut |_| true)).expect("stable");
            black_box(out);
            start.elapsed().as_secs_f64()
        };
        let mut best = f64::INFINITY;
        let mut setup = f64::INFINITY;
        for _ in 0..3 {
            let none = time(1);
            setup = setup.min(none);
            best = best.min((time(41) - none) / 40.0);
        }
        let limit = triad() / bytes;
        let rate = net.links.len() as f64 / best;
        println!(
            "{name:28} threads {threads}: {:7.1} M spring-steps/s, setup {setup:.2} s; one-core triad limit {:7.1} M/s, share {:.2}, {:.2} x 135 M/s",
            rate * 1e-6,
            limit * net.links.len() as f64 / points.len() as f64 * 1e-6,
            rate / (limit * net.links.len() as f64 / points.len() as f64),
            rate / 135e6
        );
    }

    pub(crate) fn springs() {
        let n = 1000;
        let shape = GridShape { nx: n, ny: n, eight: true, periodic: false };
        let links = grid_links(shape);
        let points: Vec<[f32; 2]> = (0..n * n).map(|i| [(i % n) as f32, (i / n) as f32]).collect();
        let k: Vec<f32> = (0..links.pairs.len()).map(|l| 2.0 + (l * 7919 % 1000) as f32 * 0.008).collect();
        let rest: Vec<f32> = links.lengths(&points.iter().map(|&p| p.into()).collect::<Vec<_>>(), glam::Vec2::ZERO);
        let rest: Vec<f32> = rest.iter().map(|l| l - 1.0).collect();
        let varied: Vec<f32> = rest.iter().enumerate().map(|(l, r)| r + (l % 16) as f32 * 0.01).collect();
        let threshold = vec![40.0f32; rest.len()];
        let fixed: Vec<bool> = points.iter().map(|p| p[0].min(p[1]) < 1.0 || p[0].max(p[1]) > 998.0).collect();
        let base = Net { links: &links.pairs, stiffness: &k, rest: &rest, fixed: &fixed, ..Net::default() };
        println!("triad {:.1} GB/s", triad() * 1e-9);
        for threads in [1, 2] {
            // Bytes per point: x y vx vy read and written, weight, stiffness in 4 directions.
            let grid = Net { grid: Some(shape), ..base };
            run("grid, L by direction", threads, &grid, &points, 36.0 + 16.0);
            run("grid, L per spring", threads, &Net { rest: &varied, ..grid }, &points, 36.0 + 32.0);
            run("grid, breakage", threads, &Net { threshold: &threshold, ..grid }, &points, 36.0 + 16.0);
            // Lists: x v read, written elsewhere; ends, stiffness, rest of 4 springs.
            run("list", threads, &base, &points, 52.0 + 48.0);
            run("list, breakage", threads, &Net { threshold: &threshold, ..base }, &points, 52.0 + 64.0);
        }
    }
}
