//! Speed of the leather kernels. `cargo bench -p shibo-nodes --bench leather`; `SHIBO_BENCH_REPORT=1` prints the
//! springs' share of the memory bandwidth instead.
fn main() {
    report::springs();
}

/// Figures that want more than a time: rates and shares of a limit measured in the same run.
mod report {
    use shibo_nodes::kernel::lattice::{GridShape, grid_links};
    use shibo_nodes::kernel::springs::{BreakOn, Integrator, Motion, Net, simulate};
    use std::hint::black_box;
    use std::time::Instant;

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

    fn run(name: &str, threads: usize, net: &Net<'_, f32>, points: &[[f32; 2]], bytes: f64) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let motion = |steps| Motion {
            step: 0.05,
            steps,
            integrator: Integrator::Explicit,
            drag: 1.0,
            break_on: BreakOn::Either,
            settle: 0.0,
        };
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
