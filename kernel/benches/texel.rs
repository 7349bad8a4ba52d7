//! Throughput of the texel kernels on one thread, in megapixels per CPU second.
//!
//! The table printed first reads the thread's own clock, so it is also meaningful on a busy machine; divan's wall times
//! follow.

#![expect(clippy::cast_possible_truncation, reason = "small counts")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ThreadTime;
use glam::DVec2;
use shibo_kernel::filter::blur;
use shibo_kernel::filter::disk::Disk;
use shibo_kernel::filter::distance::{self, DistanceSpec};
use shibo_kernel::filter::warp::{self, WarpSpec};
use shibo_kernel::filter::{median, morphology};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::stop::NEVER;
use shibo_kernel::ground::window::{Frame, View, WindowExt};
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Noise, NoiseSpec};
use shibo_kernel::noise::worley::{Metric, Worley, WorleyOut, WorleySpec};
use shibo_kernel::pointwise::blend;
use shibo_kernel::pointwise::expression::Machine;
use shibo_kernel::pointwise::tone::{self, Gradient, Interpolation, Levels};
use shibo_kernel::surface::environment::{Environment, Scene};
use shibo_kernel::surface::layers::{self, HeightMode};
use shibo_kernel::surface::normal::{self, NormalSpec, SlopeFilter};
use shibo_kernel::surface::occlusion::{self, OcclusionSpec};
use shibo_kernel::surface::poisson::Poisson;
use shibo_kernel::surface::relief::{self, ReliefSpec, Surface};
use shibo_value::Tiling;
use shibo_value::Window;
use shibo_value::expression::{self, Compiled, Meaning, Names};

/// Best rate of several runs, pixels per CPU second divided by 10^6. A run repeats the work for some time, since some
/// systems advance the thread's clock in steps of milliseconds.
fn rate(pixels: usize, mut work: impl FnMut()) -> f64 {
    work();
    let once = Instant::now();
    work();
    let repeats = (0.08 / once.elapsed().as_secs_f64().max(1e-6)).ceil().clamp(1.0, 1e4);
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let before = ThreadTime::now();
        for _ in 0..repeats as u32 {
            work();
        }
        best = best.min(before.elapsed().as_secs_f64() / repeats);
    }
    pixels as f64 * 1e-6 / best
}

const SIDE: usize = 1024;
const TILE: usize = 256;

/// All tiles of a square picture.
fn tiles() -> impl Iterator<Item = Window> {
    (0..SIDE / TILE)
        .flat_map(|j| (0..SIDE / TILE).map(move |i| Window::of((i * TILE) as i32, (j * TILE) as i32, TILE, TILE)))
}

fn noise(periodic: bool) -> f64 {
    let canvas = (DVec2::splat(1024.0), Tiling { x: periodic, y: periodic });
    let noise = Noise::new(&NoiseSpec::fbm(256.0, 8), canvas, Hash::new(1));
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
                *out = noise
                    .get_noise_2d((rect.x as usize + k % TILE) as f32 + 0.5, (rect.y as usize + k / TILE) as f32 + 0.5);
            }
        }
    })
}

/// A picture with grooves, larger than the bench's by `halo`.
fn picture(rect: Window) -> Vec<f32> {
    let canvas = (DVec2::splat(1024.0), Tiling::BOTH);
    let mut data = vec![0.0; rect.len()];
    Noise::new(&NoiseSpec::fbm(40.0, 4), canvas, Hash::new(2)).fill(&Frame::new(rect, [1.0; 2]), &mut data);
    data
}

const WHOLE: Window = Window { x: 0, y: 0, width: SIDE as u32, height: SIDE as u32 };

/// Blur of the whole picture at once, and by tiles with their halos.
fn blurs(sigma: f64) -> (f64, f64) {
    let big = WHOLE.with_halo([blur::halo(sigma); 2]);
    let data = picture(big);
    let view = View::new(&data, big);
    let mut out = vec![0.0; SIDE * SIDE];
    let whole = rate(SIDE * SIDE, || blur::blur(&view, WHOLE, [sigma; 2], black_box(&mut out)));
    let tiled = rate(SIDE * SIDE, || {
        for rect in tiles() {
            blur::blur(&view, rect, [sigma; 2], black_box(&mut out[..TILE * TILE]));
        }
    });
    (whole, tiled)
}

fn distances(radius: f64) -> f64 {
    let spec = DistanceSpec { threshold: 0.7, radius, step: [1.0; 2] };
    let big = WHOLE.with_halo(spec.halo());
    let data = picture(big);
    let view = View::new(&data, big);
    let mut out = vec![0.0; TILE * TILE];
    rate(SIDE * SIDE, || {
        for rect in tiles() {
            distance::distance(&view, rect, &spec, black_box(&mut out));
        }
    })
}

/// One material over another at 4096²: colour, normal and six more channels, by tiles; and the time as a multiple of
/// that of copying both.
fn materials() -> (f64, f64) {
    const SIDE: usize = 4096;
    let plane = |k: usize| -> Vec<f32> { (0..SIDE * SIDE).map(|i| ((i * (k + 3)) % 1013) as f32 / 1013.0).collect() };
    let (base, top, weight) = ([0, 1, 2].map(plane), [3, 4, 5].map(plane), plane(6));
    let mut out = [(); 3].map(|()| vec![0.0f32; SIDE * SIDE]);
    let tiles = || (0..SIDE * SIDE).step_by(TILE * TILE).map(|at| at..at + TILE * TILE);
    let mixed = rate(SIDE * SIDE, || {
        for tile in tiles() {
            let weight = &weight[tile.clone()];
            for k in [0, 1, 2, 0, 1, 2, 0, 1] {
                layers::mix_values(weight, &base[k][tile.clone()], &top[k][tile.clone()], &mut out[k][tile.clone()]);
            }
            layers::mix_heights(
                HeightMode::Replace,
                0.1,
                weight,
                &base[2][tile.clone()],
                &top[2][tile.clone()],
                &mut out[2][tile.clone()],
            );
            let [x, y, z] = &mut out;
            let out = [&mut x[tile.clone()], &mut y[tile.clone()], &mut z[tile.clone()]];
            let [b, t] = [&base, &top].map(|planes| [0, 1, 2].map(|k| &planes[k][tile.clone()]));
            layers::mix_normals(weight, black_box(b), t, out);
        }
    });
    let copied = rate(SIDE * SIDE, || {
        for tile in tiles() {
            for k in [0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2] {
                out[k][tile.clone()].copy_from_slice(black_box(&base[k][tile.clone()]));
                out[k][tile.clone()].copy_from_slice(black_box(&top[k][tile.clone()]));
            }
        }
    });
    (mixed, copied / mixed)
}

/// The median of a disk, and its maximum, by tiles.
fn disks(radius: f64) -> (f64, f64) {
    let disk = Disk::new(radius, [1.0; 2]);
    let big = WHOLE.with_halo(disk.halo());
    let data = picture(big);
    let view = View::new(&data, big);
    let mut out = vec![0.0; TILE * TILE];
    let middle = rate(SIDE * SIDE, || {
        for rect in tiles() {
            median::median(&view, rect, &disk, black_box(&mut out));
        }
    });
    let greatest = rate(SIDE * SIDE, || {
        for rect in tiles() {
            morphology::extreme(&view, rect, &disk, false, black_box(&mut out));
        }
    });
    (middle, greatest)
}

/// Height from slopes that repeat, including setup, on one thread.
fn heights(side: usize) -> f64 {
    let data = picture(WHOLE);
    let row = |y: usize, d: usize| -> Vec<f32> {
        (0..side).map(|x| data[(y + d) % SIDE * SIDE + (x + d) % SIDE] - 0.5).collect()
    };
    let rows: Vec<[Vec<f32>; 2]> = (0..side).map(|y| [row(y, 0), row(y, 77)]).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        rate(side * side, || {
            let mut poisson = Poisson::new([side; 2], [1.0; 2], [true; 2]);
            rows.iter().enumerate().for_each(|(y, [p, q])| poisson.set_row(y, p, q));
            black_box(poisson.solve(NEVER));
        })
    })
}

fn cells(border: bool) -> f64 {
    let canvas = (DVec2::splat(1024.0), Tiling::BOTH);
    let spec = WorleySpec { shape: CellShape::round(20.0), jitter: 1.0, metric: Metric::Euclidean };
    let worley = Worley::new(&spec, canvas, Hash::new(1));
    let [mut f1, mut f2, mut edge] = [(); 3].map(|()| vec![0.0; TILE * TILE]);
    rate(SIDE * SIDE, || {
        for rect in tiles() {
            let mut out = WorleyOut { f1: Some(&mut f1), f2: Some(&mut f2), ..WorleyOut::default() };
            if border {
                out.border = Some(&mut edge);
            }
            worley.fill(&Frame::new(rect, [1.0; 2]), black_box(&mut out));
        }
    })
}

/// Normals of a picture beyond the caches, and bytes per second of a triad in the same run, as Mpx/s of equal traffic.
fn normals() -> (f64, f64) {
    const BIG: usize = 4096;
    let rect = Window::of(0, 0, BIG, BIG);
    let big = rect.with_halo([normal::HALO; 2]);
    let data = vec![0.5; big.len()];
    let spec = NormalSpec { step: [1.0; 2], strength: 1.0, y_up: true, encode: false, slope: SlopeFilter::Central };
    let [mut x, mut y, mut z] = [(); 3].map(|()| vec![0.0f32; BIG * BIG]);
    let own = rate(BIG * BIG, || {
        normal::normal(&View::new(&data, big), rect, &spec, [black_box(&mut x), &mut y, &mut z]);
    });
    let triad = rate(BIG * BIG, || {
        for ((x, y), z) in black_box(&mut x).iter_mut().zip(&y).zip(&z) {
            *x = y + 3.0 * z;
        }
    });
    // A plane is fetched before it is written: a triad moves four planes, and normals seven.
    (own, triad * 4.0 / 7.0)
}

fn gradient_map(oklab: bool) -> f64 {
    let stops: Vec<(f32, [f32; 3])> = (0..5u8).map(|k| (f32::from(k) / 4.0, [0.1 * f32::from(k), 0.3, 0.2])).collect();
    let map = Gradient::new(&stops, Interpolation::Linear, oklab);
    let data = picture(Window::of(0, 0, TILE, TILE));
    let [mut r, mut g, mut b] = [(); 3].map(|()| vec![0.0; TILE * TILE]);
    rate(TILE * TILE, || map.apply(&data, [black_box(&mut r), &mut g, &mut b]))
}

fn lit() -> (f64, f64) {
    let spec = OcclusionSpec { radius: 6.0, strength: 1.0, step: [1.0; 2] };
    let rect = Window::of(0, 0, TILE, TILE);
    let big = rect.with_halo(spec.halo());
    let data = picture(big);
    let view = View::new(&data, big);
    let mut open = vec![0.0; TILE * TILE];
    let occluded = rate(TILE * TILE, || occlusion::occlusion(&view, rect, &spec, black_box(&mut open)));
    let grey = vec![0.4; TILE * TILE];
    let surface =
        Surface { color: [&grey; 3], roughness: &grey, occlusion: &open, normal: None, fibers: None, finish: None };
    let [mut r, mut g, mut b] = [(); 3].map(|()| vec![0.0; TILE * TILE]);
    let mut shade = |spec: &ReliefSpec<'_>| {
        let big = rect.with_halo([spec.halo().unsigned_abs() as usize; 2]);
        let data = picture(big);
        let view = View::new(&data, big);
        rate(TILE * TILE, || relief::relief(&view, rect, &surface, spec, [black_box(&mut r), &mut g, &mut b]))
    };
    let studio = Environment::of(Scene::Studio);
    let environment = Some(studio.as_ref());
    let lamp = shade(&ReliefSpec::new([1.0; 2]));
    let plain = shade(&ReliefSpec { environment, ..ReliefSpec::new([1.0; 2]) });
    // As long as a shadow of 2 mm on 60 mm at 2048 pixels.
    let cast = shade(&ReliefSpec { environment, shadows: 68.0, ..ReliefSpec::new([1.0; 2]) });
    println!("lit picture in the studio, Mpx/s: {plain:.1}, with shadows {cast:.1}, under the lamp {lamp:.1}");
    (occluded, lamp)
}

fn points() -> (f64, f64, f64) {
    let rect = Window::of(0, 0, TILE, TILE);
    let data = picture(rect.with_halo([8, 8]));
    let mut out = vec![0.0; TILE * TILE];
    let input = &data[..TILE * TILE];
    let spec = Levels { input: [0.1, 0.9], gamma: 2.2, output: [0.0, 1.0] };
    let power = rate(TILE * TILE, || tone::levels(black_box(input), &mut out, &spec));
    let blended = rate(TILE * TILE, || {
        blend::blend(blend::BlendMode::Overlay, black_box(input), input, Some(input), 0.5, &mut out);
    });
    let view = View::new(&data, rect.with_halo([8, 8]));
    let spec = WarpSpec { step: [1.0; 2], limit: [4.0; 2] };
    let warped = rate(TILE * TILE, || {
        let _ = black_box(spec.reads(rect, [input, input]));
        warp::warp(black_box(&[view]), rect, [input, input], &spec, &mut [&mut out]);
    });
    (power, blended, warped)
}

/// The planes for the names in a formula: `a`, `b` and `x`.
struct Planes;

impl Names for Planes {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        let first = ["a", "b", "x"].iter().position(|plane| *plane == name)?;
        Some(Meaning::Planes { first, count: 1 })
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(1)
    }
}

/// The rate on tiles of so many equal formulas, each the `x` of the next, and their number of operations.
fn formulas(text: &str, count: usize) -> (f64, usize) {
    let one = Arc::new(expression::compile(text, &mut Planes).expect("a formula"));
    let next = |all: Arc<Compiled>, _| {
        let fused = one.fuse(&|plane| (plane == 2).then(|| (all.clone(), 0)), &|_, plane| plane);
        Arc::new(fused.expect("a short one"))
    };
    let program = (1..count).fold(one.clone(), next).program(&|_| [Some(0.0); 2], [false; 2]).expect("a short one");
    let data = picture(Window::of(0, 0, TILE, TILE));
    let planes: Vec<&[f32]> = program.planes.iter().map(|_| data.as_slice()).collect();
    let mut out = vec![0.0; TILE * TILE];
    let machine = Machine::new(&program);
    let rate = rate(TILE * TILE, || {
        machine.run(black_box(&planes), &mut [black_box(out.as_mut_slice())]);
    });
    (rate, program.instructions.len())
}

fn table() {
    println!("Mpx per CPU second, one thread");
    let peer = fastnoise();
    for periodic in [false, true] {
        let own = noise(periodic);
        println!("fBm 8 octaves, periodic {periodic}: {own:.1}; fastnoise-lite {peer:.1}; ratio {:.1}", own / peer);
    }
    println!("Worley F1+F2 {:.0}; with border {:.0}", cells(false), cells(true));
    for sigma in [1.0, 4.0, 10.0, 40.0, 160.0] {
        let (whole, tiled) = blurs(sigma);
        println!("blur {sigma} px: {whole:.0}; by tiles of {TILE} with halo: {tiled:.0}");
    }
    for radius in [8.0, 32.0, 128.0] {
        println!("distance up to {radius} px, by tiles: {:.0}", distances(radius));
    }
    for radius in [1.0, 2.0, 3.0, 4.0, 8.0, 32.0] {
        let (middle, greatest) = disks(radius);
        println!("disk of {radius} px, by tiles: median {middle:.0}; greatest value {greatest:.0}");
    }
    for side in [1024, 2000, 2048] {
        println!("height from slopes {side}²: {:.0}", heights(side));
    }
    let (own, triad) = normals();
    println!("normal 4096²: {own:.0}; triad of equal traffic {triad:.0}; share {:.2}", own / triad);
    println!("gradient map, 5 stops: {:.0}; in Oklab {:.0}", gradient_map(false), gradient_map(true));
    let (occluded, lit) = lit();
    println!("occlusion {occluded:.0}; relief {lit:.0}");
    let (rate, copies) = materials();
    println!("two materials of eight channels 4096²: {rate:.0}; {copies:.2} times the copying of both (at most 1.5)");
    let (power, blended, warped) = points();
    println!("levels with gamma {power:.0}; overlay with mask {blended:.0}; warp {warped:.0}");
    for (text, count) in [
        ("if(a > 0.5, a * b + x, clamp(b - a, 0, 1)) * (a + b) - abs(x - 0.5)", 1),
        ("a * b + x * 0.1 - a * a + b * (x + 1) - b", 1),
        ("sin(360 * a) + cos(360 * b)", 1),
        ("noise(8 * a, 8 * b)", 1),
        ("x * 0.9 + 0.05", 20),
        ("mix(max(x, 0.2), a, 0.4)", 20),
    ] {
        let (rate, operations) = formulas(text, count);
        println!("{count} x {text}: {operations} operations: {rate:.0} (at least 370 for eleven)");
    }
}

#[divan::bench]
fn fbm_8_octaves(bencher: divan::Bencher<'_, '_>) {
    let canvas = (DVec2::splat(1024.0), Tiling::BOTH);
    let noise = Noise::new(&NoiseSpec::fbm(256.0, 8), canvas, Hash::new(1));
    let mut out = vec![0.0; TILE * TILE];
    let frame = Frame::new(Window::of(0, 0, TILE, TILE), [1.0; 2]);
    bencher.counter(divan::counter::ItemsCount::new(TILE * TILE)).bench_local(|| noise.fill(&frame, &mut out));
}

#[divan::bench(args = [1.0, 4.0, 10.0, 40.0])]
fn blur_tile(bencher: divan::Bencher<'_, '_>, sigma: f64) {
    let rect = Window::of(0, 0, TILE, TILE);
    let big = rect.with_halo([blur::halo(sigma); 2]);
    let data = picture(big);
    let mut out = vec![0.0; TILE * TILE];
    bencher
        .counter(divan::counter::ItemsCount::new(TILE * TILE))
        .bench_local(|| blur::blur(&View::new(&data, big), rect, [sigma; 2], &mut out));
}

fn main() {
    table();
    divan::main();
}
