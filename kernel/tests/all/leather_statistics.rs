//! The wrinkle method at its usual size, 100 × 100 points, against statistics computed independently.

use glam::Vec2;
use serde_json::Value;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::window::{Frame, WindowExt};
use shibo_kernel::leather::bands::{self, BandSpec};
use shibo_kernel::leather::lines::{Raster, Reduction, Sample};
use shibo_kernel::leather::links::grid_links;
use shibo_kernel::leather::points::{self, GridSpec};
use shibo_kernel::leather::segments::{self, SegmentSpec};
use shibo_kernel::springs::{Motion, Net, simulate};
use shibo_kernel::strokes::{Draw, Profile, Stroke, StrokeSet, StrokeStyle};
use shibo_value::Window;

/// Side of the work area: 99 pitches.
const SIDE: f32 = 99.0;
/// Side of the pictures in pixels.
const PIXELS: usize = 800;

fn picture(strokes: &[Stroke]) -> Vec<f32> {
    let style = StrokeStyle { profile: Profile::Flat, min_width: 0.0, antialias: false, ..StrokeStyle::default() };
    let step = f64::from(SIDE / PIXELS as f32);
    let mut out = vec![0.0; PIXELS * PIXELS];
    let frame = Frame::new(Window::of(0, 0, PIXELS, PIXELS), [step; 2]);
    StrokeSet::new(strokes, style, None).fill(&frame, Draw::Depth, &mut out);
    out
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len().max(1) as f64
}

/// The quantile of the values at `share`.
fn quantile(values: &[f32], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let at = (share * (sorted.len() - 1) as f64) as usize;
    f64::from(sorted[at])
}

/// Strength and direction in degrees of the main direction of the segments, by their doubled angles.
fn orientation(ends: &[[Vec2; 2]]) -> (f64, f64) {
    let (mut x, mut y, mut total) = (0.0f64, 0.0f64, 0.0f64);
    for [a, b] in ends {
        let d = (*b - *a).as_dvec2();
        let length = d.length();
        if length > 0.0 {
            x += (d.x * d.x - d.y * d.y) / length;
            y += 2.0 * d.x * d.y / length;
            total += length;
        }
    }
    (x.hypot(y) / total, 0.5 * y.atan2(x).to_degrees())
}

/// Runs a case; each of its random sequences has its own seed, counted from that of the case.
fn check(case: &Value, name: &str) {
    let number = |v: &Value| v.as_f64().expect("a number");
    let pair = |v: &Value| [0, 1].map(|i| narrow(&v[i]));
    let parameters = &case["parameters"];
    let seed = parameters["seed"].as_u64().expect("a seed");
    let near = |what: &str, found: f64, expected: f64, tolerance: f64| {
        assert!((found / expected - 1.0).abs() <= tolerance, "{name}: {what} is {found}, expected {expected}");
    };
    let spec = GridSpec {
        size: Vec2::splat(SIDE),
        pitch: Vec2::ONE,
        stagger: 0.0,
        jitter: narrow(&parameters["jitter_times_d"]),
        keep_border: true,
        periodic: false,
    };
    let grid = points::grid(&spec, Hash::new(seed));
    let regular = points::grid(&GridSpec { jitter: 0.0, ..spec }, Hash::new(seed));
    let links = grid_links(grid.shape(true, false));
    assert_eq!((grid.points.len(), links.pairs.len()), (10_000, 39_402));

    let spec = BandSpec {
        size: Vec2::splat(SIDE),
        pitch: narrow(&parameters["F"]),
        angle: pair(&parameters["theta"]),
        width: pair(&parameters["U"]),
        length: pair(&parameters["H"]),
    };
    let nuclei = bands::claim(spec.pitch, 17, 17, Hash::new(seed + 1));
    let field = picture(&bands::strokes(&bands::bands(&nuclei, &spec, Hash::new(seed + 2))));
    near("coverage", mean(&field), number(&case["reference_coverage"]), 1e-4);

    let area = Raster { values: &field, width: PIXELS, height: PIXELS, size: Vec2::splat(SIDE), periodic: false };
    let size = Vec2::splat(SIDE);
    let ends: Vec<_> = (0..links.pairs.len()).map(|l| links.ends(l, &grid.points, size)).collect();
    let scalars = area.along_all(&ends, Sample::Line, Reduction::Mean);
    let [soft, stiff] = pair(&parameters["k"]);
    let stiffness: Vec<f32> = scalars.iter().map(|s| soft + (stiff - soft) * s).collect();
    let rest: Vec<f32> = links.lengths(&regular.points, size).iter().map(|l| l - 1.0).collect();
    let fixed = points::border(&regular.points, size, 0.0);
    let threshold = parameters["Fth"].as_f64().map_or(Vec::new(), |_| vec![narrow(&parameters["Fth"]); rest.len()]);
    let start: Vec<[f32; 2]> = grid.points.iter().map(|p| p.to_array()).collect();
    let net = Net {
        links: &links.pairs,
        stiffness: &stiffness,
        rest: &rest,
        fixed: &fixed,
        threshold: &threshold,
        grid: Some(grid.shape(true, false)),
        ..Net::default()
    };
    let steps = u32::try_from(parameters["K"].as_u64().expect("a count")).expect("a small count");
    let motion = Motion { step: narrow(&parameters["delta"]), steps, ..STILL };
    let outcome = simulate(&start, &net, &motion, &mut |_| true).expect("stable");

    let moved: Vec<Vec2> = outcome.positions.iter().map(|p| Vec2::from_array(*p)).collect();
    let shifts: Vec<f32> = moved.iter().zip(&regular.points).map(|(a, b)| (*a - *b).length()).collect();
    near("mean displacement", mean(&shifts), number(&case["mean_displacement"]), 0.03);
    let lengths = links.lengths(&moved, size);
    near("segment length", mean(&lengths), number(&case["segment_length_mean"]), 0.03);
    for (i, share) in [0.05, 0.5, 0.95, 0.99].into_iter().enumerate() {
        let expected = number(&case["segment_length_p05_p50_p95_p99"][i]);
        near("a quantile of length", quantile(&lengths, share), expected, 0.03);
    }
    match number(&case["broken"]) {
        0.0 => assert!(outcome.broken.is_empty(), "{name}"),
        expected => {
            near("broken", outcome.broken.len() as f64, expected, 0.15);
            let broken: Vec<f32> = outcome.broken.iter().map(|b| lengths[b.link as usize]).collect();
            near("length of broken", mean(&broken), number(&case["mean_length_of_broken"]), 0.05);
        }
    }
    let place = SegmentSpec { size, length_scale: 1.0, max_length: f32::INFINITY };
    let placed = segments::place(&moved, &links, &place, |_| true);
    let all: Vec<_> = placed.iter().map(|s| s.ends).collect();
    let (strength, degrees) = orientation(&all);
    near("orientation strength", strength, number(&case["orientation_strength"]), 0.1);
    assert!((degrees - number(&case["orientation_degrees"])).abs() < 1.5, "{name}: {degrees}");
    let clipped = segments::clip(&placed, Vec2::ZERO, size);
    near("clipped segments", clipped.len() as f64, number(&case["clipped_segments"]), 0.001);
    let hash = Hash::new(seed + 3);
    let [thin, wide] = pair(&parameters["W"]);
    let stroke = |s: &segments::Segment| Stroke {
        ends: s.ends,
        half_width: 0.5 * (thin + (wide - thin) * hash.unit_f32(u64::from(s.link))),
        depth: 1.0,
    };
    let strokes: Vec<Stroke> = clipped.iter().map(stroke).collect();
    near("area of wrinkles", mean(&picture(&strokes)), number(&case["wrinkle_area_share_constant_width"]), 0.03);
}

/// A run without drag, as in the source.
const STILL: Motion<f32> = Motion {
    step: 0.0,
    steps: 0,
    integrator: shibo_kernel::springs::Integrator::Explicit,
    drag: 0.0,
    break_on: shibo_kernel::springs::BreakOn::Either,
    settle: 0.0,
};

#[expect(clippy::cast_possible_truncation, reason = "the kernels take f32")]
fn narrow(v: &Value) -> f32 {
    v.as_f64().expect("a number") as f32
}

fn cases() -> Value {
    serde_json::from_str(include_str!("../vectors/leather_100x100.json")).expect("valid JSON")
}

#[test]
fn a_regular_lattice() {
    check(&cases()["regular"], "regular");
}

#[test]
fn a_jittered_lattice() {
    check(&cases()["jittered"], "jittered");
}

#[test]
fn a_lattice_that_breaks() {
    check(&cases()["breakage"], "breakage");
}
