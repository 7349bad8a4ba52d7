//! Throughput of the texel kernels on one thread, in megapixels per second of processor time.
//!
//! The table printed first reads the thread's own clock, so it also means something on a busy machine; divan's wall
//! times follow.

use std::hint::black_box;
use std::time::Instant;

use shibo_nodes::kernel::hash::Hash;
use shibo_nodes::kernel::lattice::Canvas;
use shibo_nodes::kernel::noise::{Noise, NoiseSpec};
use shibo_nodes::kernel::window::{Frame, Rect};

/// Seconds this thread has run, or wall time where the system does not tell.
fn cpu_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Best rate of several runs, pixels per CPU second divided by 10^6.
fn rate(pixels: usize, mut work: impl FnMut()) -> f64 {
    let start = Instant::now();
    work();
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let before = cpu_seconds(start);
        work();
        best = best.min(cpu_seconds(start) - before);
    }
    pixels as f64 * 1e-6 / best
}

const SIDE: usize = 1024;
const TILE: usize = 256;

/// All tiles of a square picture.
fn tiles() -> impl Iterator<Item = Rect> {
    (0..SIDE / TILE).flat_map(|j| {
        (0..SIDE / TILE).map(move |i| Rect::new((i * TILE) as i32, (j * TILE) as i32, TILE, TILE))
    })
}

fn noise(periodic: bool) -> f64 {
    let canvas = Canvas { size: [1024.0; 2], tiles: [periodic; 2] };
    let noise = Noise::new(&NoiseSpec::fbm(256.0, 8), &canvas, Hash::new(1));
    let mut out = vec![0.0; TILE * TILE];
    rate(SIDE * SIDE, || {
        for rect in tiles() {
            noise.fill(&Frame::new(rect, [1.0; 2]), black_box(&mut out));
        }
    })
}

fn fastnoise() -> f64 {
    let mut noise = fastnoise_lite::FastNoiseLite::with_seed(1);
    noise.set_noise_type(Some(fastnoise_lite::NoiseType::Perlin));
    noise.set_fractal_type(Some(fastnoise_lite::FractalType::FBm));
    noise.set_fractal_octaves(Some(8));
    noise.set_frequency(Some(1.0 / 256.0));
    let mut out = vec![0.0; TILE * TILE];
    rate(SIDE * SIDE, || {
        for rect in tiles() {
            for (k, out) in black_box(&mut out).iter_mut().enumerate() {
                *out = noise.get_noise_2d(
                    (rect.x0 as usize + k % TILE) as f32 + 0.5,
                    (rect.y0 as usize + k / TILE) as f32 + 0.5,
                );
            }
        }
    })
}

fn main() {
    let peer = fastnoise();
    for periodic in [false, true] {
        let own = noise(periodic);
        println!("fBm 8 octaves, periodic {periodic}: {own:.1} Mpx/s; fastnoise-lite {peer:.1}; ratio {:.1}", own / peer);
    }
}
