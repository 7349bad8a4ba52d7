//! Cost of stamps, in CPU seconds of one thread: a million stamps of 32² pixels on 4096², by tiles of 256², as in
//! `TileSampler`.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
#![expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts")]

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, Vec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::window::{Frame, WindowExt as _};
use shibo_kernel::scatter::atlas::Layout;
use shibo_kernel::scatter::paint::{Overlap, Source, Target, paint};
use shibo_kernel::scatter::set::{Stamp, StampSet};
use shibo_value::{Tiling, Window};

/// CPU seconds of this thread, or wall time if the system does not report them.
fn cpu_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

const SIDE: usize = 4096;
const TILE: usize = 256;
/// Side of a stamp in pixels.
const STAMP: usize = 32;

/// Stamps in a jittered grid over a canvas of 4096 mm, a pixel being 1 mm.
fn stamps(count: u64, turned: bool, scaled: bool) -> Vec<Stamp> {
    let columns = (count as f64).sqrt() as u64;
    let pitch = SIDE as f64 / columns as f64;
    let stamp = |n: u64| {
        let draw = |k: u64| Hash::new(9).with(n).unit(k);
        let at = DVec2::new((n % columns) as f64 + draw(0), (n / columns) as f64 + draw(1)) * pitch;
        let angle = if turned { std::f64::consts::TAU * draw(2) } else { 0.0 };
        let half = 0.5 * STAMP as f64 * if scaled { 0.5 + 0.5 * draw(3) } else { 1.0 };
        Stamp {
            center: at,
            half: Vec2::splat(half as f32),
            turn: DVec2::from_angle(angle).as_vec2(),
            value: (0.5 + 0.5 * draw(4)) as f32,
            id: n as u32 + 1,
            picture: 0,
        }
    };
    (0..columns * columns).map(stamp).collect()
}

fn main() {
    let layout = Layout::new(STAMP, STAMP);
    let mut data = vec![0.0; layout.len()];
    let at = |k: usize| (k as f32 + 0.5) / STAMP as f32 * 2.0 - 1.0;
    let dome = (0..STAMP * STAMP).map(|k| (1.0 - at(k % STAMP).powi(2)) * (1.0 - at(k / STAMP).powi(2))).collect();
    layout.build(dome, &mut data);
    let source = Source::new(&layout, vec![&data]);
    let canvas = (DVec2::splat(SIDE as f64), Tiling::BOTH);
    let start = Instant::now();
    println!("1 000 000 stamps of 32² on 4096², CPU s");
    for (name, turned, scaled, overlap) in [
        ("upright, Max", false, false, Overlap::Max),
        ("turned, Max", true, false, Overlap::Max),
        ("turned and scaled, Max", true, true, Overlap::Max),
        ("turned, Add", true, false, Overlap::Add),
        ("turned, Over", true, false, Overlap::Over),
    ] {
        let mut best = [f64::INFINITY; 2];
        for _ in 0..3 {
            let list = stamps(1_000_000, turned, scaled);
            let before = cpu_seconds(start);
            let set = StampSet::new(list, canvas);
            best[0] = best[0].min(cpu_seconds(start) - before);
            let before = cpu_seconds(start);
            let mut out = vec![0.0; TILE * TILE];
            for j in 0..SIDE / TILE {
                for i in 0..SIDE / TILE {
                    out.fill(0.0);
                    let frame = Frame::new(Window::of((i * TILE) as i32, (j * TILE) as i32, TILE, TILE), [1.0; 2]);
                    paint(&|| false, (&set, &source, overlap), &frame, Target::Values(vec![black_box(&mut out)]));
                }
            }
            best[1] = best[1].min(cpu_seconds(start) - before);
        }
        println!("{name:24} {:6.2} drawn, {:5.2} sorted", best[1], best[0]);
    }
}
