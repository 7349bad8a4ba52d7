//! Speed of the leather kernels. `cargo bench -p shibo-kernel --bench leather` prints rates, for springs also the share
//! of the memory bandwidth, and the cost of a whole leather; `SHIBO_BENCH_REPORT=springs`, `strokes`, `points` or
//! `whole` prints only one of them. Times are CPU seconds of the whole process, so that other work on the machine
//! matters less.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::springs::{Net, simulate};
use shibo_kernel::strokes::{StrokeSet, StrokeStyle};

mod interleaved;

fn main() {
    match std::env::var("SHIBO_BENCH_REPORT").as_deref() {
        Ok("points") => report::points(),
        Ok("strokes") => report::strokes(),
        Ok("whole") => whole::print(),
        Ok(_) => report::springs(),
        Err(_) => {
            report::springs();
            report::strokes();
            report::points();
            whole::print();
            divan::main();
        }
    }
}

/// A periodic list of 100 000 points, 60 steps.
#[divan::bench]
fn springs_list(bencher: divan::Bencher<'_, '_>) {
    let size = glam::Vec2::splat(316.0);
    let points = shibo_kernel::leather::points::random(100_000, size, Hash::new(1));
    let links = shibo_kernel::leather::delaunay::delaunay(&points, size, true);
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

/// Figures other than times: rates, and shares of a limit measured in the same run.
mod report {
    use super::interleaved::{Work, interleaved, quartiles};
    use cpu_time::ProcessTime;
    use glam::Vec2;
    use shibo_kernel::ground::hash::Hash;
    use shibo_kernel::ground::window::{Frame, WindowExt};
    use shibo_kernel::leather::delaunay::delaunay;
    use shibo_kernel::leather::links::{GridShape, grid_links};
    use shibo_kernel::leather::poisson::{PoissonSpec, poisson, poisson_estimate};
    use shibo_kernel::springs::{BreakOn, Integrator, Motion, Net, SpringError, simulate};
    use shibo_kernel::strokes::{Draw, Stroke, StrokeSet, StrokeStyle};
    use shibo_value::Window;
    use std::hint::black_box;

    /// CPU seconds of `work`, of all threads together.
    pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
        let start = ProcessTime::now();
        let result = work();
        (result, start.elapsed().as_secs_f64())
    }

    /// Length of an array that is far larger than the caches.
    const LARGE: usize = 1 << 24;
    /// Bytes per number moved by [`triad`]: it reads three arrays and writes one.
    const MOVED: f64 = 16.0;

    /// `a = b + s c` over large arrays, on `threads` threads at once.
    fn triad<'w>(threads: usize) -> Work<'w> {
        Box::new(move |on| {
            let (mut a, b, c) = (vec![0.0f32; LARGE], vec![1.0f32; LARGE], vec![2.0f32; LARGE]);
            let part = LARGE / threads;
            let mut passes = 0;
            while on(passes) {
                std::thread::scope(|scope| {
                    for ((a, b), c) in a.chunks_mut(part).zip(b.chunks(part)).zip(c.chunks(part)) {
                        scope.spawn(move || a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + 0.5 * c));
                    }
                });
                black_box(&mut a);
                passes += 1;
            }
        })
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
            let window = Window::of(origin(n % tiles), origin(n / tiles), tile, tile);
            set.fill(&Frame::new(window, [1.0; 2]), Draw::Depth, &mut out);
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
                shape: None,
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

    /// A net, and the positions of its points.
    struct Case<'a> {
        name: &'a str,
        net: Net<'a, f32>,
        points: &'a [[f32; 2]],
    }

    impl Case<'_> {
        /// Endless steps on separate threads, so short that nothing moves noticeably.
        fn work(&self, threads: usize) -> Work<'_> {
            Box::new(move |on| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let motion = Motion { step: 1e-4, ..motion(u32::MAX) };
                let ended = pool.install(|| simulate(self.points, &self.net, &motion, &mut |step| on(step)));
                assert!(matches!(ended, Err(SpringError::Cancelled { .. })), "stable");
            })
        }

        /// Springs and steps per second on `threads` threads, given CPU seconds per step.
        fn rate(&self, threads: usize, seconds: f64) -> f64 {
            (self.net.links.len() * threads) as f64 / seconds
        }

        /// Seconds of a call without steps.
        fn setup(&self, threads: usize) -> f64 {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let run = || pool.install(|| simulate(self.points, &self.net, &motion(0), &mut |_| true));
            let times = (0..5).map(|_| timed(run).1);
            times.fold(f64::INFINITY, f64::min) / threads as f64
        }
    }

    /// Slices of each case.
    const ROUNDS: usize = 40;

    /// Prints the rate of the steps of a case, and its share of the rate at which memory could deliver `bytes` bytes
    /// per point and step: alone, and as a call of 100 steps with its setup.
    fn run(case: &Case<'_>, bytes: f64, threads: usize) {
        let times = interleaved(vec![case.work(threads), triad(threads)], ROUNDS);
        let per_point = case.net.links.len() as f64 / case.points.len() as f64;
        let bandwidth = |seconds: f64| MOVED * (LARGE * threads) as f64 / seconds;
        let limit = |seconds: f64| bandwidth(seconds) / bytes * per_point;
        let pairs = || times[0].iter().zip(&times[1]);
        let [low, share, high] = quartiles(pairs().map(|(&case_s, &s)| case.rate(threads, case_s) / limit(s)));
        let [_, step, _] = quartiles(times[0].iter().copied());
        let [_, pass, _] = quartiles(times[1].iter().copied());
        let steps = 100.0 * step / threads as f64;
        let whole = steps / (steps + case.setup(threads));
        println!(
            "{:22} threads {threads}: {:6.0} M spring-steps/s, {share:.2} ({low:.2} to {high:.2}) of the memory limit at {:.0} GB/s; 100 steps with setup {:.2}",
            case.name,
            case.rate(threads, step) * 1e-6,
            bandwidth(pass) * 1e-9,
            share * whole,
        );
    }

    /// Prints the rate of a list as a share of that of grids.
    fn compare(list: &Case<'_>, grids: [&Case<'_>; 2], threads: usize) {
        let cases = [list, grids[0], grids[1]];
        let times = interleaved(cases.map(|case| case.work(threads)).into(), ROUNDS);
        let [_, step, _] = quartiles(times[0].iter().copied());
        print!("{:22} threads {threads}: {:6.0} M spring-steps/s", list.name, list.rate(threads, step) * 1e-6);
        for (grid, of_grid) in grids.iter().zip(&times[1..]) {
            let pairs = times[0].iter().zip(of_grid);
            let [low, share, high] = quartiles(pairs.map(|(&s, &g)| list.rate(threads, s) / grid.rate(threads, g)));
            print!(", {share:.2} ({low:.2} to {high:.2}) of {}", grid.name);
        }
        println!();
    }

    /// Lengths per spring less 1, and a little more for some, so that neighbours differ.
    fn rest(lengths: &[f32]) -> Vec<f32> {
        lengths.iter().enumerate().map(|(l, length)| length - 1.0 + (l % 16) as f32 * 0.01).collect()
    }

    fn stiffness(count: usize) -> Vec<f32> {
        (0..count).map(|l| 2.0 + (l * 7919 % 1000) as f32 * 0.008).collect()
    }

    /// A million points with 8 neighbours, or with links of their own.
    pub(crate) fn springs() {
        println!("medians of {ROUNDS} slices of each, and quartiles; the memory limit is that of a = b + s c");
        for n in [1000, 150] {
            println!("{n} x {n} points");
            springs_of(n);
        }
    }

    /// Springs of about n² points: larger than the caches, and as in a leather.
    fn springs_of(n: usize) {
        let size = Vec2::splat(n as f32);
        let shape = GridShape { nx: n, ny: n, eight: true, periodic: false };
        let links = grid_links(shape);
        let places: Vec<Vec2> = (0..n * n).map(|i| Vec2::new((i % n) as f32, (i / n) as f32)).collect();
        let points: Vec<[f32; 2]> = places.iter().map(Vec2::to_array).collect();
        let lengths = links.lengths(&places, Vec2::ZERO);
        let (k, varied) = (stiffness(lengths.len()), rest(&lengths));
        let alike: Vec<f32> = lengths.iter().map(|l| l - 1.0).collect();
        let threshold = vec![40.0f32; k.len()];
        let fixed: Vec<bool> = points.iter().map(|p| p[0].min(p[1]) < 1.0 || p[0].max(p[1]) > n as f32 - 2.0).collect();
        let list = Net { links: &links.pairs, stiffness: &k, rest: &varied, fixed: &fixed, ..Net::default() };
        let spread = shibo_kernel::leather::points::random(n * n, size, Hash::new(1));
        let delaunay = delaunay(&spread, size, true);
        let (hexagons, edges) = shibo_kernel::leather::points::hexagons(size, 0.877, true);
        // Two springs per point; Delaunay has three, hexagons one and a half, and the grid of 8 neighbours four.
        let four = GridShape { eight: false, ..shape };
        let four_links = grid_links(four);
        let four_rest = rest(&four_links.lengths(&places, Vec2::ZERO));
        // Bytes per point: x y vx vy read and written, weight; stiffness and length in 4 directions, or in 2.
        let grid = Net { grid: Some(shape), ..list };
        let plus = Net {
            links: &four_links.pairs,
            stiffness: &k[..four_links.pairs.len()],
            rest: &four_rest,
            grid: Some(four),
            ..grid
        };
        let points = &points[..];
        let breaking = Net { threshold: &threshold, ..grid };
        let eight = Case { name: "grid, L per spring", net: grid, points };
        let four = Case { name: "grid, 4 neighbours", net: plus, points };
        for threads in [1, 2] {
            let by_direction = Net { rest: &alike, ..grid };
            run(&Case { name: "grid, L by direction", net: by_direction, points }, 36.0 + 16.0, threads);
            run(&eight, 36.0 + 32.0, threads);
            run(&Case { name: "grid, breakage", net: breaking, points }, 36.0 + 32.0, threads);
            run(&four, 36.0 + 16.0, threads);
            compare(&Case { name: "the grid as a list", net: list, points }, [&eight, &four], threads);
            let breaking = Net { threshold: &threshold, ..list };
            compare(&Case { name: "list, breakage", net: breaking, points }, [&eight, &four], threads);
            let honeycomb = shibo_kernel::leather::points::hexagon_grid(size, 0.877, true);
            let sets = [
                ("Delaunay", &spread, &delaunay, None),
                ("hexagons as a grid", &hexagons, &edges, honeycomb),
                ("hexagons as a list", &hexagons, &edges, None),
            ];
            for (name, places, links, grid) in sets {
                let points: Vec<[f32; 2]> = places.iter().map(Vec2::to_array).collect();
                let (k, rest) = (stiffness(links.pairs.len()), rest(&links.lengths(places, size)));
                let (links, wraps, size) = (&links.pairs[..], &links.wraps[..], size.to_array());
                let net = Net { links, wraps, size, stiffness: &k, rest: &rest, grid, ..Net::default() };
                compare(&Case { name, net, points: &points }, [&eight, &four], threads);
            }
        }
    }
}

/// A leather of 60 x 60 mm from points to height and normal map, stage by stage, and the growth of its cost.
mod whole {
    use super::report::{motion, random_strokes, timed};
    use glam::Vec2;
    use shibo_kernel::ground::hash::Hash;
    use shibo_kernel::ground::window::{Frame, View, WindowExt};
    use shibo_kernel::leather::links::{Links, grid_links};
    use shibo_kernel::leather::points::{GridSpec, grid};
    use shibo_kernel::leather::segments::{SegmentSpec, place};
    use shibo_kernel::springs::{Motion, Net, simulate};
    use shibo_kernel::strokes::{Draw, Stroke, StrokeSet, StrokeStyle};
    use shibo_kernel::surface::normal::{HALO, NormalSpec, SlopeFilter, normal};
    use shibo_value::Window;
    use std::hint::black_box;

    const SIZE: f32 = 60.0;

    /// CPU seconds of lattice, simulation, strokes in bins, height, normals; and the number of strokes.
    fn leather(side: usize, steps: u32, resolution: usize) -> ([f64; 5], usize) {
        let size = Vec2::splat(SIZE);
        let hash = Hash::new(3);
        let spec =
            GridSpec { size, pitch: size / side as f32, stagger: 0.0, jitter: 1.0, keep_border: true, periodic: true };
        let ((shape, links, points, rest, k), lattice) = timed(|| {
            let found = grid(&spec, hash);
            let shape = found.shape(true, true);
            let links = grid_links(shape);
            let rest: Vec<f32> = links.lengths(&found.points, size).iter().map(|l| l - size.x / side as f32).collect();
            let k: Vec<f32> = (0..rest.len() as u64).map(|n| 1.0 + 9.0 * hash.unit_f32(n)).collect();
            let points: Vec<[f32; 2]> = found.points.iter().map(Vec2::to_array).collect();
            (shape, links, points, rest, k)
        });
        let net = Net {
            links: &links.pairs,
            wraps: &links.wraps,
            size: size.to_array(),
            stiffness: &k,
            rest: &rest,
            grid: Some(shape),
            ..Net::default()
        };
        let motion = Motion { drag: 6.0, ..motion(steps) };
        let (moved, simulated) = timed(|| simulate(&points, &net, &motion, &mut |_| true).expect("stable"));
        let (set, sorted) = timed(|| {
            let points: Vec<Vec2> = moved.positions.iter().map(|p| Vec2::from_array(*p)).collect();
            let spec = SegmentSpec { size, length_scale: 1.0, max_length: f32::INFINITY };
            let links = Links { pairs: links.pairs.clone(), wraps: links.wraps.clone() };
            let segments = place(&points, &links, &spec, |_| true);
            let width = |n: u64| 0.5 * size.x / side as f32 * (0.4 + 0.5 * hash.unit_f32(n));
            let stroke = |(n, s): (u64, &shibo_kernel::leather::segments::Segment)| Stroke {
                ends: s.ends,
                half_width: width(n),
                depth: 0.1,
            };
            let strokes: Vec<Stroke> = (0..).zip(&segments).map(stroke).collect();
            StrokeSet::new(&strokes, StrokeStyle { round_caps: true, ..StrokeStyle::default() }, Some(size))
        });
        let step = SIZE / resolution as f32;
        let (mut height, mut normals) = (vec![0.0f32; 258 * 258], [(); 3].map(|()| vec![0.0f32; 256 * 256]));
        let (mut filled, mut lit) = (0.0, 0.0);
        for tile in 0..(resolution / 256).pow(2) {
            let at = |n: usize| i32::try_from(n * 256).expect("small") - 1;
            let (x, y) = (at(tile % (resolution / 256)), at(tile / (resolution / 256)));
            let frame = Frame::new(Window { x, y, width: 258, height: 258 }, [f64::from(step); 2]);
            filled += timed(|| set.fill(&frame, Draw::Depth, &mut height)).1;
            let spec = NormalSpec {
                step: [f64::from(step); 2],
                strength: -1.0,
                y_up: true,
                encode: true,
                slope: SlopeFilter::Central,
            };
            let rect = Window { x: 0, y: 0, width: 256, height: 256 };
            let [nx, ny, nz] = &mut normals;
            lit += timed(|| normal(&View::new(&height, rect.with_halo([HALO; 2])), rect, &spec, [nx, ny, nz])).1;
            black_box(&normals);
        }
        ([lattice, simulated, sorted, filled, lit], links.pairs.len())
    }

    /// The best of three, for each stage separately.
    fn best(side: usize, steps: u32, resolution: usize) -> ([f64; 5], usize) {
        let runs = [(); 3].map(|()| leather(side, steps, resolution));
        let fastest = |stage: usize| runs.iter().map(|run| run.0[stage]).fold(f64::INFINITY, f64::min);
        (std::array::from_fn(fastest), runs[0].1)
    }

    pub(crate) fn print() {
        println!("60 x 60 mm of leather, CPU seconds:");
        println!("points  steps  strokes  pixels  lattice  simulation    bins  height  normals     all");
        let cases =
            [(75, 120, 2048), (150, 120, 2048), (300, 120, 2048), (150, 120, 1024), (150, 120, 4096), (150, 240, 1024)];
        for (side, steps, resolution) in cases {
            let ([lattice, simulated, sorted, filled, lit], strokes) = best(side, steps, resolution);
            let all = lattice + simulated + sorted + filled + lit;
            println!(
                "{side:4}\u{b2} {steps:7} {strokes:8} {resolution:6}\u{b2} {lattice:8.3} {simulated:11.3} {sorted:7.3} {filled:7.3} {lit:8.3} {all:7.3}"
            );
        }
        for count in [125_000, 250_000, 500_000, 1_000_000] {
            let strokes = random_strokes(count);
            let (set, sorted) = timed(|| StrokeSet::new(&strokes, StrokeStyle::default(), None));
            let tiles = (16.0 * (count as f64 / 1e6).sqrt()).ceil();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small whole number")]
            let (_, filled) = timed(|| super::report::fill_all(&set, 256, tiles as usize));
            let each = (sorted + filled) / count as f64 * 1e9;
            println!(
                "{count:8} strokes of 140 px, as dense: bins {sorted:.3} s, height {filled:.3} s, {each:.0} ns a stroke"
            );
        }
    }
}
