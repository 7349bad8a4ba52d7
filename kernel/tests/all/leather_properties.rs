//! Properties of the leather kernels that hold for any numbers.
#![allow(clippy::cast_possible_truncation, reason = "the vectors are f64, the kernels f32")]

use glam::Vec2;
use proptest::prelude::*;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::window::{Frame, WindowExt};
use shibo_kernel::leather::bands::{self, BandSpec, Nuclei};
use shibo_kernel::leather::delaunay::delaunay;
use shibo_kernel::leather::links::{GridShape, Links, grid_links, radius_links, wrap};
use shibo_kernel::leather::points::{self, GridSpec};
use shibo_kernel::leather::poisson::{PoissonSpec, poisson, poisson_estimate};
use shibo_kernel::springs::{Integrator, Mass, Motion, Net, Outcome, SpringError, simulate};
use shibo_kernel::strokes::{Combine, Draw, NO_STROKE, Profile, Stroke, StrokeSet, StrokeStyle};
use shibo_value::Window;

const DISCS: PoissonSpec<'_> = PoissonSpec {
    size: Vec2::new(30.0, 20.0),
    pitch: 1.0,
    aspect: 1.0,
    angle: 0.5,
    periodic: true,
    factor: None,
    shape: None,
    most: 1.0,
};

/// The distance of two points, on the torus with `size`, in units in which the disc has radius 1.
fn gap(a: Vec2, b: Vec2, spec: &PoissonSpec<'_>) -> f32 {
    let mut d = b - a;
    if spec.periodic {
        d -= (d / spec.size).round() * spec.size;
    }
    let axis = Vec2::from_angle(spec.angle);
    Vec2::new(d.dot(axis) / spec.aspect, d.perp_dot(axis)).length() / (0.8 * spec.pitch)
}

#[test]
fn discs_keep_their_distance_and_fill_the_canvas() {
    for (aspect, periodic) in [(1.0, true), (1.0, false), (1.6, true), (2.2, true)] {
        let spec = PoissonSpec { aspect, periodic, ..DISCS };
        let points = poisson(&spec, Hash::new(3));
        assert_eq!(points, poisson(&spec, Hash::new(3)));
        assert!(points.iter().all(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(spec.size).all()));
        for (i, a) in points.iter().enumerate() {
            assert!(points[..i].iter().all(|b| gap(*a, *b, &spec) > 0.9999));
        }
        let share = points.len() as f64 / poisson_estimate(&spec);
        assert!((0.93..1.09).contains(&share), "aspect {aspect} periodic {periodic}: {share}");
    }
}

#[test]
fn follows_shape_of_discs_by_position() {
    // Long along x on the left, along y on the right, and round at the bottom.
    let shape = |p: Vec2| {
        let quarter = std::f32::consts::FRAC_PI_2;
        (if p.y.rem_euclid(20.0) < 14.0 { 3.0 } else { 1.0 }, if p.x.rem_euclid(30.0) < 15.0 { 0.0 } else { quarter })
    };
    let spec = PoissonSpec { shape: Some(&shape), aspect: 3.0, ..DISCS };
    let points = poisson(&spec, Hash::new(3));
    assert_eq!(points, poisson(&spec, Hash::new(3)));
    // Where discs are aligned with cells of 2.4 × 0.8 mm, a cell contains at most one point, by the definition.
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let mut d = b - a;
            d -= (d / spec.size).round() * spec.size;
            for p in [*a, a + d] {
                let (aspect, angle) = shape(p);
                let axis = Vec2::from_angle(angle);
                let gap = Vec2::new(d.dot(axis) / aspect, d.perp_dot(axis)).length();
                assert!(gap > 0.7999, "{a} {b}: {gap}");
            }
        }
    }
    // Most steps to the nearest neighbour lead across the discs; with round discs, half would.
    let across = |left: bool| {
        let inside = |p: &&Vec2| {
            (p.y > 2.0 && p.y < 12.0) && if left { p.x > 2.0 && p.x < 13.0 } else { p.x > 17.0 && p.x < 28.0 }
        };
        let nearest = |p: &Vec2| {
            let others = points.iter().filter(|q| *q != p).map(|q| (*q - *p).abs());
            others.min_by(|a, b| a.length().total_cmp(&b.length())).unwrap()
        };
        let steps: Vec<Vec2> = points.iter().filter(inside).map(nearest).collect();
        steps.iter().filter(|d| if left { d.y > d.x } else { d.x > d.y }).count() as f64 / steps.len() as f64
    };
    assert!(across(true) > 0.8 && across(false) > 0.8, "{} {}", across(true), across(false));
    let dense = points.iter().filter(|p| p.y > 15.0 && p.y < 19.0).count() as f64 / 4.0;
    let sparse = points.iter().filter(|p| p.y > 2.0 && p.y < 12.0).count() as f64 / 10.0;
    assert!(dense > 1.8 * sparse, "{dense} {sparse}");
}

#[test]
fn follows_factor_of_discs_by_position() {
    let factor = |p: Vec2| if p.x < 15.0 { 1.0 } else { 2.0 };
    let points = poisson(&PoissonSpec { factor: Some(&factor), most: 2.0, ..DISCS }, Hash::new(3));
    let left = points.iter().filter(|p| p.x < 15.0).count();
    let ratio = left as f64 / (points.len() - left) as f64;
    assert!((3.0..5.0).contains(&ratio), "{ratio}");
}

#[test]
fn torus_triangulation_closes() {
    let points = poisson(&DISCS, Hash::new(1));
    let links = delaunay(&points, DISCS.size, true);
    assert_eq!(links.pairs.len(), 3 * points.len());
    assert!(links.lengths(&points, DISCS.size).iter().all(|&l| l < 1.8));
    // A grid: four points on each circle, and all copies must agree on the diagonal.
    let spec = GridSpec {
        size: Vec2::new(8.0, 6.0),
        pitch: Vec2::ONE,
        stagger: 0.0,
        jitter: 0.0,
        keep_border: false,
        periodic: true,
    };
    let grid = points::grid(&spec, Hash::new(0));
    assert_eq!(delaunay(&grid.points, spec.size, true).pairs.len(), 3 * 48);
}

#[test]
fn triangulation_survives_bad_points() {
    let line: Vec<Vec2> = (0..10).map(|i| Vec2::splat(i as f32)).collect();
    assert_eq!(delaunay(&line, Vec2::splat(10.0), false).pairs.len(), 9);
    let twins = [Vec2::ZERO, Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::NAN, Vec2::new(1e-42, -0.0)];
    assert_eq!(delaunay(&twins, Vec2::splat(2.0), false).pairs, [[0, 2], [0, 3], [2, 3]]);
    for count in 0..5 {
        let few = points::random(count, Vec2::ONE, Hash::new(9));
        for periodic in [false, true] {
            let links = delaunay(&few, Vec2::ONE, periodic);
            assert!(links.pairs.iter().flatten().all(|&p| (p as usize) < count));
        }
    }
}

/// A run of a periodic grid with uneven springs.
fn periodic_run(grid: bool, threads: usize) -> Outcome<f32> {
    let shape = GridShape { nx: 60, ny: 70, eight: true, periodic: true };
    let spec = GridSpec {
        size: Vec2::new(60.0, 70.0),
        pitch: Vec2::ONE,
        stagger: 0.0,
        jitter: 0.6,
        keep_border: false,
        periodic: true,
    };
    let points: Vec<[f32; 2]> = points::grid(&spec, Hash::new(4)).points.iter().map(|p| p.to_array()).collect();
    let links = grid_links(shape);
    let hash = Hash::new(8);
    let k: Vec<f32> = (0..links.pairs.len() as u64).map(|l| 2.0 + 8.0 * hash.unit_f32(l)).collect();
    let rest = vec![0.2; k.len()];
    let threshold = vec![14.0; k.len()];
    let net = Net {
        links: &links.pairs,
        wraps: &links.wraps,
        size: [60.0, 70.0],
        stiffness: &k,
        rest: &rest,
        threshold: &threshold,
        grid: grid.then_some(shape),
        ..Net::default()
    };
    let motion = Motion { step: 0.05, steps: 20, drag: 1.0, ..motion() };
    let pool = rayon_pool(threads);
    pool.install(|| simulate(&points, &net, &motion, &mut |_| true)).expect("stable")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Rows of any length, fewer rows than a stride and more than a band, any links missing, in any order: the fast
    /// path must equal the general one, and a stride must equal single steps.
    #[test]
    fn matches_lists_on_grids(seed: u64, nx in 1usize..40, ny in 1usize..140, eight: bool, periodic: bool, steps in 1u32..11,
                       breaks: bool, left_out in 0.0f32..0.4, masses in 0usize..3) {
        let shape = GridShape { nx, ny, eight, periodic };
        let (hash, size) = (Hash::new(seed), Vec2::new(nx as f32, ny as f32));
        let place = |n: usize| {
            let moved = |k: u64| f64::from(0.4 * hash.unit_f32(2 * n as u64 + k));
            [(n % nx) as f64 + moved(0), (n / nx) as f64 + moved(1)]
        };
        let points: Vec<[f64; 2]> = (0..nx * ny).map(place).collect();
        let all = grid_links(shape);
        let drawn = |l: usize, n: u64| hash.with(7 + n).unit_f32(l as u64);
        let mut kept: Vec<usize> = (0..all.pairs.len()).filter(|&l| drawn(l, 0) >= left_out).collect();
        kept.sort_by(|&a, &b| drawn(a, 1).total_cmp(&drawn(b, 1)));
        let pairs: Vec<[u32; 2]> = kept.iter().map(|&l| all.pairs[l]).collect();
        let wraps: Vec<[i8; 2]> = kept.iter().filter_map(|&l| all.wraps.get(l).copied()).collect();
        let each = |n: u64, from: f64, to: f64| -> Vec<f64> {
            kept.iter().map(|&l| from + (to - from) * f64::from(drawn(l, n))).collect()
        };
        let (stiffness, rest, threshold) = (each(2, 1.0, 6.0), each(3, 0.2, 1.2), each(4, 1.0, 6.0));
        let fixed: Vec<bool> = (0..points.len()).map(|p| drawn(p, 5) < 0.1).collect();
        let heavy: Vec<f64> = (0..points.len()).map(|p| 0.5 + f64::from(drawn(p, 6))).collect();
        let live = |[x, y]: [f64; 2]| 1.0 + 0.5 * x.sin() + 0.2 * y.cos();
        let mass = [Mass::One, Mass::Each(&heavy), Mass::Live(&live)][masses];
        let net = Net {
            links: &pairs,
            wraps: &wraps,
            size: size.as_dvec2().to_array(),
            stiffness: &stiffness,
            rest: &rest,
            threshold: if breaks { &threshold } else { &[] },
            fixed: &fixed,
            mass,
            ..Net::default()
        };
        let motion = Motion { step: 0.05, steps, integrator: Integrator::Explicit, drag: 0.5, break_on: Default::default(), settle: 0.0 };
        let run = |grid: Option<GridShape>, settle: f64| {
            simulate(&points, &Net { grid, ..net }, &Motion { settle, ..motion }, &mut |_| true).expect("stable")
        };
        let (list, grid) = (run(None, 0.0), run(Some(shape), 0.0));
        prop_assert_eq!(&list.broken, &grid.broken);
        let all = |run: &Outcome<f64>| run.positions.iter().chain(&run.velocities).copied().collect::<Vec<_>>();
        for (a, b) in all(&list).into_iter().zip(all(&grid)) {
            prop_assert!((a[0] - b[0]).abs().max((a[1] - b[1]).abs()) < 1e-9, "{a:?} {b:?}");
        }
        // A run that may end at any step takes one step at a time.
        let single = run(Some(shape), 1e-300);
        prop_assert!(all(&single) == all(&grid) && single.broken == grid.broken);
    }
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
}

fn motion() -> Motion<f32> {
    Motion {
        step: 0.1,
        steps: 100,
        integrator: Integrator::Explicit,
        drag: 0.0,
        break_on: Default::default(),
        settle: 0.0,
    }
}

#[test]
fn springs_do_not_depend_on_threads_or_path() {
    let list = periodic_run(false, 1);
    assert!(list == periodic_run(false, 3));
    let grid = periodic_run(true, 1);
    assert!(grid == periodic_run(true, 3));
    assert!(!list.broken.is_empty());
    assert!(list.broken == grid.broken);
    let far = |(a, b): (&[f32; 2], &[f32; 2])| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    let worst = list.positions.iter().zip(&grid.positions).map(far).fold(0.0, f32::max);
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn large_lists_meet_across_blocks() {
    // More points than a block holds, in random order.
    let points = points::random(9000, Vec2::splat(100.0), Hash::new(2));
    let links = delaunay(&points, Vec2::splat(100.0), true);
    let start: Vec<[f32; 2]> = points.iter().map(|p| p.to_array()).collect();
    let k = vec![3.0; links.pairs.len()];
    let rest = vec![0.5; k.len()];
    let net = Net {
        links: &links.pairs,
        wraps: &links.wraps,
        size: [100.0; 2],
        stiffness: &k,
        rest: &rest,
        ..Net::default()
    };
    let quiet = Motion { drag: 2.0, ..motion() };
    let out = simulate(&start, &net, &quiet, &mut |_| true).expect("stable");
    // Inner forces do not move the centre.
    let mean = |p: &[[f32; 2]], axis: usize| p.iter().map(|p| f64::from(p[axis])).sum::<f64>() / p.len() as f64;
    for axis in 0..2 {
        assert!((mean(&out.positions, axis) - mean(&start, axis)).abs() < 1e-4);
    }
    assert!(out.energy_growth < 1.0);
}

#[test]
fn stops_runs_when_cancelled_settled_or_diverging() {
    let points = [[0.0, 0.0], [2.0, 0.0]];
    let net = Net { links: &[[0, 1]], stiffness: &[1.0], rest: &[1.0], ..Net::default() };
    let cancelled = simulate(&points, &net, &motion(), &mut |step| step < 3);
    assert_eq!(cancelled, Err(SpringError::Cancelled { step: 3 }));
    let settling = Motion { settle: 1e-3, steps: 10_000, drag: 3.0, ..motion() };
    let settled = simulate(&points, &net, &settling, &mut |_| true).expect("settles");
    assert!(settled.steps > 20 && settled.steps < 500);
    assert!((settled.positions[1][0] - settled.positions[0][0] - 1.0).abs() < 1e-2);
    let wild = simulate(&points, &net, &Motion { step: 3.0, ..motion() }, &mut |_| true);
    assert!(matches!(wild, Err(SpringError::Diverged { .. })));
    let bad = Net { links: &[[0, 2]], ..net };
    assert_eq!(simulate(&points, &bad, &motion(), &mut |_| true), Err(SpringError::Link { link: 0 }));
    let same = [[1.0, 1.0], [1.0, 1.0]];
    let still = simulate(&same, &net, &motion(), &mut |_| true).expect("no force");
    assert_eq!(still.positions, same);
}

fn strokes(seed: u64, count: usize) -> Vec<Stroke> {
    let hash = Hash::new(seed);
    let stroke = |n: usize| {
        let r = |i: u64| hash.unit_f32(8 * n as u64 + i);
        let at = Vec2::new(r(0), r(1)) * 16.0;
        let half = Vec2::new(r(2) - 0.5, r(3) - 0.5) * 3.0;
        Stroke { ends: [at - half, at + half], half_width: 0.02 + 0.4 * r(4), depth: r(5) }
    };
    (0..count).map(stroke).collect()
}

fn frame(x: i32, y: i32, width: usize, height: usize, step: f32) -> Frame {
    Frame::new(Window::of(x, y, width, height), [f64::from(step); 2])
}

const PROFILES: [Profile; 5] =
    [Profile::Flat, Profile::Linear, Profile::Smooth, Profile::Gaussian { sigma: 0.25, cutoff: 0.8 }, Profile::Brush];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn windows_fit_together(seed: u64, x in -20i32..80, y in -20i32..80, w in 1usize..40, h in 1usize..40, p in 0usize..5,
                            c in 0usize..3, caps: bool, periodic: bool) {
        let combine = [Combine::Max, Combine::Add, Combine::Screen][c];
        let style = StrokeStyle { profile: PROFILES[p], taper: 0.3, tip: 0.3, round_caps: caps, combine, ..StrokeStyle::default() };
        let set = StrokeSet::new(&strokes(seed, 40), style, periodic.then_some(Vec2::splat(16.0)));
        let mut whole = vec![0.0; 160 * 160];
        set.fill(&frame(-40, -40, 160, 160, 0.2), Draw::Depth, &mut whole);
        let mut part = vec![0.0; w * h];
        set.fill(&frame(x, y, w, h, 0.2), Draw::Depth, &mut part);
        for j in 0..h {
            for i in 0..w {
                let at = (y + 40) as usize * 160 + j * 160 + (x + 40) as usize + i;
                prop_assert_eq!(part[j * w + i].to_bits(), whole[at].to_bits());
            }
        }
    }

    #[test]
    fn long_strokes_have_the_same_bits_in_any_window(seed: u64, x in 0i32..500, y in 0i32..300, power in -9i32..3,
                                                     p in 0usize..5, caps: bool, thin in 0.01f32..0.4) {
        // From horizontal or vertical, within a rounding error, to slanting; far longer than the window.
        let hash = Hash::new(seed);
        let stroke = |n: u64| {
            let r = |i: u64| hash.unit_f32(4 * n + i);
            let slant = (r(0) - 0.5) * 10f32.powi(power);
            let half = if r(1) < 0.5 { Vec2::new(90.0, 90.0 * slant) } else { Vec2::new(90.0 * slant, 90.0) };
            let at = Vec2::new(r(2), r(3)) * 60.0;
            Stroke { ends: [at - half, at + half], half_width: thin, depth: 1.0 }
        };
        let list: Vec<_> = (0..6).map(stroke).collect();
        let style = StrokeStyle { profile: PROFILES[p], round_caps: caps, ..StrokeStyle::default() };
        let set = StrokeSet::new(&list, style, None);
        let frame = |x, y, width, height| Frame {
            window: Window { x, y, width, height },
            origin: [-1.3, 0.2],
            step: [0.11, 0.17],
        };
        let mut whole = vec![0.0; 530 * 330];
        set.fill(&frame(0, 0, 530, 330), Draw::Depth, &mut whole);
        let mut part = vec![0.0; 30 * 30];
        set.fill(&frame(x, y, 30, 30), Draw::Depth, &mut part);
        for (n, value) in part.iter().enumerate() {
            let at = (y as usize + n / 30) * 530 + x as usize + n % 30;
            prop_assert_eq!(value.to_bits(), whole[at].to_bits());
        }
    }

    #[test]
    fn periodic_strokes_repeat(seed: u64, p in 0usize..5) {
        let style = StrokeStyle { profile: PROFILES[p], taper: 0.5, ..StrokeStyle::default() };
        let set = StrokeSet::new(&strokes(seed, 60), style, Some(Vec2::splat(16.0)));
        let mut here = vec![0.0; 64 * 64];
        let mut there = here.clone();
        set.fill(&frame(0, 0, 64, 64, 0.25), Draw::Depth, &mut here);
        set.fill(&frame(64, -128, 64, 64, 0.25), Draw::Depth, &mut there);
        prop_assert_eq!(&here, &there);
        prop_assert!(here.iter().all(|v| (0.0..=1.0).contains(v)));
    }

    #[test]
    fn wrapping_changes_no_link(seed: u64) {
        let size = Vec2::new(5.0, 4.0);
        let mut points = points::random(40, size, Hash::new(seed));
        let mut links = delaunay(&points, size, true);
        for (n, p) in (0u64..).zip(&mut points) {
            *p += (Vec2::new(Hash::new(seed).unit_f32(n), Hash::new(!seed).unit_f32(n)) - 0.5) * 12.0;
        }
        let before = links.lengths(&points, size);
        wrap(&mut points, &mut links, size);
        prop_assert!(points.iter().all(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(size).all()));
        for (a, b) in before.iter().zip(links.lengths(&points, size)) {
            prop_assert!((a - b).abs() < 1e-4);
        }
    }

    #[test]
    fn radius_links_are_all_near_pairs(seed: u64, periodic: bool, radius in 0.05f32..2.0) {
        let size = Vec2::new(5.0, 4.0);
        let points = points::random(30, size, Hash::new(seed));
        let found = radius_links(&points, radius, size, periodic);
        let mut expected = Vec::new();
        for i in 0..30u32 {
            for j in i + 1..30 {
                let mut d = points[j as usize] - points[i as usize];
                if periodic {
                    d -= (d / size).round() * size;
                }
                if d.length() <= radius - 1e-6 {
                    expected.push([i, j]);
                }
            }
        }
        prop_assert!(expected.iter().all(|e| found.pairs.binary_search(e).is_ok()));
        prop_assert!(found.lengths(&points, size).iter().all(|l| *l <= radius + 1e-5));
    }

    #[test]
    fn exp_is_exp(x in -87.0f32..88.0) {
        let expected = f64::from(x).exp();
        prop_assert!(((f64::from(math::exp(x)) - expected) / expected).abs() < 3e-7);
    }
}

#[test]
fn thin_strokes_fade_instead_of_breaking_up() {
    let thin = [Stroke { ends: [Vec2::new(1.0, 2.03), Vec2::new(15.0, 9.1)], half_width: 0.01, depth: 1.0 }];
    let style = StrokeStyle { profile: Profile::Flat, ..StrokeStyle::default() };
    let sum = |step: f32| {
        let n = (16.0 / step) as usize;
        let mut out = vec![0.0; n * n];
        StrokeSet::new(&thin, style, None).fill(&frame(0, 0, n, n, step), Draw::Depth, &mut out);
        out.iter().sum::<f32>() * step * step
    };
    let area = 0.02 * (thin[0].ends[1] - thin[0].ends[0]).length();
    for step in [0.5, 0.1, 0.02, 0.004] {
        assert!((sum(step) / area - 1.0).abs() < 0.05, "{step}: {} {area}", sum(step));
    }
}

#[test]
fn ids_name_the_deepest_stroke() {
    let two = [
        Stroke { ends: [Vec2::new(0.0, 2.0), Vec2::new(8.0, 2.0)], half_width: 1.0, depth: 0.5 },
        Stroke { ends: [Vec2::new(4.0, 0.0), Vec2::new(4.0, 8.0)], half_width: 1.0, depth: 1.0 },
    ];
    let set = StrokeSet::new(&two, StrokeStyle { profile: Profile::Flat, ..StrokeStyle::default() }, None);
    let (mut out, mut ids) = (vec![0.0; 64], vec![0; 64]);
    set.fill_with_ids(&|| false, &frame(0, 0, 8, 8, 1.0), &mut out, &mut ids);
    assert_eq!((ids[2 * 8 + 1], ids[2 * 8 + 4], ids[7 * 8]), (0, 1, NO_STROKE));
    assert_eq!((out[2 * 8 + 1], out[2 * 8 + 4], out[7 * 8]), (0.5, 1.0, 0.0));
}

#[test]
fn nuclei_cover_the_canvas() {
    let spec =
        BandSpec { size: Vec2::new(40.0, 30.0), pitch: 4.0, angle: [0.3, 0.6], width: [1.0, 2.0], length: [5.0, 9.0] };
    let near = |bands: &[bands::Band]| bands.iter().filter(|b| b.centre.max_element() < 2.0).count();
    let cover = bands::place(&spec, Nuclei::Cover, false, Hash::new(1));
    assert!(near(&cover) > 0);
    assert_eq!(near(&bands::place(&spec, Nuclei::Claim, false, Hash::new(1))), 0);
    let periodic = bands::place(&spec, Nuclei::Cover, true, Hash::new(1));
    assert_eq!(periodic.len(), 10 * 8);
    assert!(periodic.iter().all(|b| b.centre.cmpge(Vec2::ZERO).all() && b.centre.cmple(spec.size).all()));
}

#[test]
fn empty_input_gives_empty_output() {
    assert_eq!(delaunay(&[], Vec2::ONE, true), Links::default());
    let mut out = [1.0; 4];
    StrokeSet::new(&[], StrokeStyle::default(), Some(Vec2::ONE)).fill(&frame(0, 0, 2, 2, 0.5), Draw::Mask, &mut out);
    assert_eq!(out, [0.0; 4]);
    let still = simulate::<f32>(&[], &Net::default(), &motion(), &mut |_| true).expect("nothing to do");
    assert!(still.positions.is_empty());
}
