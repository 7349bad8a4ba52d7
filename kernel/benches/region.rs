//! Cost of pieces of masks: `cargo bench -p shibo-kernel --bench region`, the minimum of several runs, in CPU time of
//! one thread.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
use shibo_kernel::region::axes::Picture;
use shibo_kernel::region::flood;
use shibo_kernel::region::pieces::{Pieces, reaches};
use std::hint::black_box;
use std::time::Instant;

const SIDE: usize = 4096;

/// CPU seconds of this thread, or wall time if the system does not report them.
fn cpu_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Megapixels per CPU second, of the fastest of five runs.
fn rate(mut body: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let before = cpu_seconds(start);
        body();
        best = best.min(cpu_seconds(start) - before);
    }
    (SIDE * SIDE) as f64 * 1e-6 / best
}

fn main() {
    let mut ids = vec![0.0; SIDE * SIDE];
    for (name, size) in [("blobs of 500 pixels", 500.0), ("of 60", 60.0), ("of 8", 8.0)] {
        let wave = |i: usize, k: f64| (std::f64::consts::TAU * k / size * i as f64).sin();
        let mask: Vec<f32> = (0..SIDE * SIDE)
            .map(|i| {
                let (x, y) = (i % SIDE, i / SIDE);
                if wave(x, 1.0) + wave(y, 1.0) + 0.5 * wave(x + y, 0.7) > 0.2 { 1.0 } else { 0.0 }
            })
            .collect();
        let mut count = 0;
        let flood = rate(|| count = flood::label(black_box(&mask), SIDE, [true; 2], &mut ids));
        let measured = rate(|| {
            let pieces = Pieces::of(black_box(&ids));
            let picture = Picture { ids: &ids, width: SIDE, step: glam::DVec2::ONE, wrap: [true; 2] };
            black_box(picture.middles(&reaches(&pieces, &ids, SIDE, [true; 2])));
        });
        println!("{name}: {count} pieces, numbered at {flood:.0} Mpx/s, measured at {measured:.0} Mpx/s");
    }
}
