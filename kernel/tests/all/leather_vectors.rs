//! The leather kernels against reference values computed independently in double precision.
#![allow(clippy::cast_possible_truncation, reason = "the vectors are f64, the kernels f32")]

use glam::{IVec2, Vec2};
use serde_json::Value;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::real::Real;
use shibo_kernel::ground::window::{Frame, WindowExt};
use shibo_kernel::leather::bands::{self, BandSpec};
use shibo_kernel::leather::lines::{Raster, Reduction, Sample, bresenham};
use shibo_kernel::leather::links::{GridShape, Links, grid_links, radius_links};
use shibo_kernel::leather::points::{self, GridSpec};
use shibo_kernel::leather::segments::{self, Segment, SegmentSpec};
use shibo_kernel::springs::{BreakOn, Integrator, Mass, Motion, Net, Outcome, simulate};
use shibo_kernel::strokes::{Draw, Profile, Stroke, StrokeSet, StrokeStyle};
use shibo_value::Window;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/leather.json")).expect("valid JSON")
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
}

fn rows(v: &Value) -> Vec<Vec<f64>> {
    v.as_array().expect("a list").iter().map(numbers).collect()
}

fn pairs(v: &Value) -> Vec<[f64; 2]> {
    rows(v).iter().map(|r| [r[0], r[1]]).collect()
}

fn vec2s(v: &Value) -> Vec<Vec2> {
    pairs(v).iter().map(|&[x, y]| Vec2::new(x as f32, y as f32)).collect()
}

fn links(v: &Value) -> Vec<[u32; 2]> {
    pairs(v).iter().map(|l| l.map(|p| p as u32)).collect()
}

fn flat(v: &Value) -> Vec<f64> {
    rows(v).concat()
}

fn close(a: &[[f64; 2]], b: &[[f64; 2]], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// Runs a case of the vectors; `grid` uses the path without lists where possible.
fn run<T: Real>(all: &Value, case: &Value, grid: bool) -> Outcome<T> {
    let list = |v: &Value| numbers(v).into_iter().map(T::of).collect::<Vec<T>>();
    let start = if case["start"].is_array() { &case["start"] } else { &all["points"] };
    let points: Vec<[T; 2]> = pairs(start).iter().map(|p| p.map(T::of)).collect();
    let (links, k, rest) = (links(&case["links"]), list(&case["k"]), list(&case["L"]));
    let fixed_ids = numbers(&all["fixed"]);
    let fixed: Vec<bool> = (0..25).map(|i| fixed_ids.contains(&f64::from(i))).collect();
    let threshold = match &case["Fth"] {
        Value::Null => Vec::new(),
        Value::Array(_) => list(&case["Fth"]),
        one => vec![T::of(one.as_f64().expect("a number")); links.len()],
    };
    let options = &case["options"];
    let damping = options["damper"].as_f64().map(|c| vec![T::of(c); links.len()]).unwrap_or_default();
    let field = flat(&all["fields_20x20"][options["field"].as_str().expect("a field")]);
    let live = |p: [T; 2]| {
        let [x, y] = p.map(|v| ((v.wide() / 4.0 * 20.0).floor() as i64).clamp(0, 19) as usize);
        T::of(0.5 + 1.5 * field[y * 20 + x])
    };
    let masses = if case["m"].is_array() { list(&case["m"]) } else { Vec::new() };
    let net = Net {
        links: &links,
        stiffness: &k,
        rest: &rest,
        damping: &damping,
        threshold: &threshold,
        fixed: &fixed,
        size: [T::of(4.0); 2],
        mass: if masses.is_empty() { Mass::Live(&live) } else { Mass::Each(&masses) },
        grid: grid.then_some(GridShape { nx: 5, ny: 5, eight: links.len() == 72, periodic: false }),
        ..Net::default()
    };
    let motion = Motion {
        step: T::of(case["delta"].as_f64().expect("a number")),
        steps: case["K"].as_u64().expect("a number") as u32,
        integrator: Integrator::Explicit,
        drag: T::of(options["drag"].as_f64().unwrap_or(0.0)),
        break_on: if options["break_on"] == "tension" { BreakOn::Tension } else { BreakOn::Either },
        settle: T::of(0.0),
    };
    simulate(&points, &net, &motion, &mut |_| true).expect("stable")
}

fn check<T: Real>(tolerance: f64, exact: bool) {
    let all = vectors();
    for case in all["lattices"].as_array().expect("cases") {
        for grid in [false, true] {
            let name = format!("{} grid {grid}", case["name"]);
            let out = run::<T>(&all, case, grid);
            let wide = |v: &[[T; 2]]| v.iter().map(|p| p.map(Real::wide)).collect::<Vec<_>>();
            if exact || case["name"] != "m every step" {
                assert!(close(&wide(&out.positions), &pairs(&case["positions"]), tolerance), "{name}: positions");
                assert!(close(&wide(&out.velocities), &pairs(&case["velocities"]), 30.0 * tolerance), "{name}: speeds");
            }
            let mut broken: Vec<[u64; 2]> = out.broken.iter().map(|b| [u64::from(b.link), u64::from(b.step)]).collect();
            broken.sort_unstable();
            let list = case["broken"].as_array().expect("a list");
            let number = |v: &Value| v.as_u64().expect("a number");
            let expected: Vec<_> = list.iter().map(|b| [number(&b["link"]), number(&b["step"])]).collect();
            assert_eq!(broken, expected, "{name}");
        }
    }
}

#[test]
fn springs_in_f64() {
    check::<f64>(1e-9, true);
}

#[test]
fn springs_in_f32() {
    check::<f32>(2e-3, false);
}

#[test]
fn grids_and_links() {
    let all = vectors();
    let spec = GridSpec {
        size: Vec2::splat(4.0),
        pitch: Vec2::ONE,
        stagger: 0.0,
        jitter: 1.0,
        keep_border: true,
        periodic: false,
    };
    let regular = points::grid(&GridSpec { jitter: 0.0, ..spec }, Hash::new(42));
    assert_eq!(regular.points, vec2s(&all["points"]));
    assert_eq!(points::grid(&spec, Hash::new(42)).points, vec2s(&all["jittered_seed42"]));
    let fixed = points::border(&regular.points, spec.size, 0.0);
    let ids: Vec<f64> = (0..25).filter(|&i| fixed[i]).map(|i| i as f64).collect();
    assert_eq!(ids, numbers(&all["fixed"]));
    for case in all["lattices"].as_array().expect("cases") {
        let shape = regular.shape(case["options"]["diag"] == true, false);
        let found = grid_links(shape);
        assert_eq!(found.pairs, links(&case["links"]));
        assert_eq!(found.pairs.len(), shape.link_count());
    }
}

#[test]
fn pitches_may_differ() {
    let spec = GridSpec {
        size: Vec2::new(6.0, 4.0),
        pitch: Vec2::new(1.5, 1.0),
        stagger: 0.0,
        jitter: 0.0,
        keep_border: true,
        periodic: false,
    };
    let grid = points::grid(&spec, Hash::new(1));
    assert_eq!((grid.nx, grid.ny, grid.pitch), (5, 5, Vec2::new(1.5, 1.0)));
    assert_eq!(grid.points[7], Vec2::new(3.0, 1.0));
}

#[test]
fn random_points_and_radius_links() {
    let all = vectors();
    let case = &all["random_seed3"];
    let found = points::random(12, Vec2::splat(4.0), Hash::new(3));
    assert_eq!(found, vec2s(&case["points"]));
    let radius = case["radius"].as_f64().expect("a number") as f32;
    assert_eq!(radius_links(&found, radius, Vec2::splat(4.0), false).pairs, links(&case["links"]));
}

#[test]
fn hexagons() {
    let size = Vec2::splat(6.0);
    let (points, links) = points::hexagons(size, 1.0, false);
    assert_eq!((points.len(), links.pairs.len()), (28, 35));
    assert!(links.lengths(&points, size).iter().all(|l| (l - 1.0).abs() < 1e-5));
    let mut degree = vec![0; points.len()];
    links.pairs.iter().flatten().for_each(|&p| degree[p as usize] += 1);
    assert_eq!(degree.iter().max(), Some(&3));
    let (points, links) = points::hexagons(size, 1.0, true);
    assert_eq!(links.pairs.len() * 2, points.len() * 3);
    assert!(links.lengths(&points, size).iter().all(|l| (0.8..1.3).contains(l)));
}

#[test]
fn line_pixels_and_scalars() {
    let all = vectors();
    for case in all["lines"].as_array().expect("cases") {
        let ends = [&case["p"], &case["q"]].map(numbers);
        let [w, h] = [0, 1].map(|i| numbers(&case["image"])[i] as usize);
        let raster = Raster { values: &vec![0.0; w * h], width: w, height: h, size: Vec2::splat(4.0), periodic: false };
        let [p, q] = ends.map(|e| raster.pixel(Vec2::new(e[0] as f32, e[1] as f32)));
        let mut found = Vec::new();
        bresenham(p, q, |p| found.push([f64::from(p.x), f64::from(p.y)]));
        assert_eq!(found, pairs(&case["pixels_col_row"]));
    }
    for case in all["lattices"].as_array().expect("cases") {
        let values: Vec<f32> = flat(&all["fields_20x20"][case["options"]["field"].as_str().expect("a field")])
            .iter()
            .map(|&v| v as f32)
            .collect();
        let raster = Raster { values: &values, width: 20, height: 20, size: Vec2::splat(4.0), periodic: false };
        let start = vec2s(if case["start"].is_array() { &case["start"] } else { &all["points"] });
        let reduce = if case["options"]["how"] == "sum" { Reduction::Sum } else { Reduction::Mean };
        let lines: Vec<_> = links(&case["links"]).iter().map(|l| l.map(|p| start[p as usize])).collect();
        let found = raster.along_all(&lines, Sample::Line, reduce);
        for (found, expected) in found.iter().zip(numbers(&case["line_scalar"])) {
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{}: {found} {expected}", case["name"]);
        }
    }
}

#[test]
fn pixels_near_a_line() {
    let raster = Raster { values: &[0.0; 100], width: 10, height: 10, size: Vec2::splat(10.0), periodic: false };
    let mut found = Vec::new();
    raster.near([Vec2::new(2.5, 3.5), Vec2::new(4.5, 3.5)], 1.0, |p| found.push(p));
    let row = |y, from, to| (from..=to).map(move |x| IVec2::new(x, y));
    let expected: Vec<_> = row(2, 2, 4).chain(row(3, 1, 5)).chain(row(4, 2, 4)).collect();
    assert_eq!(found, expected);
}

#[test]
fn placed_and_clipped_segments() {
    let all = vectors();
    let spec = SegmentSpec { size: Vec2::splat(4.0), length_scale: 1.0, max_length: f32::INFINITY };
    let near = |found: &[Segment], expected: &Value| {
        let expected = rows(expected);
        assert_eq!(found.len(), expected.len());
        for (s, e) in found.iter().zip(expected) {
            let flat = [s.ends[0].x, s.ends[0].y, s.ends[1].x, s.ends[1].y];
            assert!(flat.iter().zip(&e).all(|(a, b)| (f64::from(*a) - b).abs() < 2e-5), "{flat:?} {e:?}");
        }
    };
    for case in all["lattices"].as_array().expect("cases") {
        let links = Links { pairs: links(&case["links"]), wraps: Vec::new() };
        let placed = segments::place(&vec2s(&case["positions"]), &links, &spec, |_| true);
        near(&placed, &case["segments"]);
        let clipped = segments::clip(&placed, Vec2::ZERO, spec.size);
        near(&clipped, &case["clipped"]);
        let from: Vec<f64> = clipped.iter().map(|s| f64::from(s.link)).collect();
        assert_eq!(from, numbers(&case["clipped_from"]));
    }
}

/// Fills a whole picture, without antialiasing.
fn picture(strokes: &[Stroke], profile: Profile, size: Vec2, image: &[f64]) -> Vec<f32> {
    let style = StrokeStyle { profile, min_width: 0.0, antialias: false, ..StrokeStyle::default() };
    let (width, height) = (image[0] as usize, image[1] as usize);
    let step = size / Vec2::new(width as f32, height as f32);
    let mut out = vec![f32::NAN; width * height];
    StrokeSet::new(strokes, style, None).fill(
        &Frame::new(Window::of(0, 0, width, height), step.as_dvec2().to_array()),
        Draw::Depth,
        &mut out,
    );
    out
}

#[test]
fn rasters() {
    let all = vectors();
    for case in all["raster"].as_array().expect("cases") {
        let widths = numbers(&case["widths"]);
        let stroke = |(s, w): (&Vec<f64>, &f64)| Stroke {
            ends: [Vec2::new(s[0] as f32, s[1] as f32), Vec2::new(s[2] as f32, s[3] as f32)],
            half_width: 0.5 * *w as f32,
            depth: 1.0,
        };
        let strokes: Vec<_> = rows(&case["segments"]).iter().zip(&widths).map(stroke).collect();
        let profile = match case["profile"].as_str() {
            Some("constant") => Profile::Flat,
            Some("gauss") => Profile::Gaussian { sigma: 1.0 / 6.0, cutoff: 0.5 },
            _ => Profile::Brush,
        };
        let out = picture(&strokes, profile, Vec2::splat(4.0), &numbers(&case["image"]));
        for (found, expected) in out.iter().zip(flat(&case["depth"])) {
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{profile:?}: {found} {expected}");
        }
    }
}

#[test]
fn reference_bands() {
    let all = vectors();
    let case = &all["reference"];
    assert_eq!(bands::claim(4.0, 3, 2, Hash::new(5)), vec2s(&case["nuclei_seed5"]));
    let chart = bands::flow_chart(4.0, Vec2::new(14.0, 10.0), Hash::new(5));
    assert_eq!(chart, vec2s(&case["flow_chart_seed5_xmax14_ymax10"]));
    let size = Vec2::new(14.0, 10.0);
    let spec = BandSpec { size, pitch: 4.0, angle: [0.3, 0.7], width: [1.0, 2.0], length: [5.0, 9.0] };
    let found = bands::bands(&vec2s(&case["nuclei_seed5"]), &spec, Hash::new(6));
    for (band, expected) in found.iter().zip(rows(&case["bands_seed6_theta_U_H"])) {
        let found = [band.angle, band.width, band.length];
        assert!(found.iter().zip(&expected).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-5), "{band:?}");
    }
    let strokes = bands::strokes(&found);
    for (profile, name) in [(Profile::Flat, "binary"), (bands::GAUSSIAN, "graded")] {
        let out = picture(&strokes, profile, size, &numbers(&case["image"]));
        for (found, expected) in out.iter().zip(flat(&case[name])) {
            assert!((f64::from(*found) - expected).abs() < 2e-5, "{name}: {found} {expected}");
        }
    }
}
