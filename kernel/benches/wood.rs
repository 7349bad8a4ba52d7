//! Speed of single wood kernels, 256 × 256 points as in a tile of the engine: `cargo bench -p shibo-kernel --bench
//! wood`. CPU time of one thread, the minimum of several runs. `cargo bench -p shibo-nodes` measures the cost of
//! graphs.
#![allow(clippy::disallowed_methods, reason = "figures that are told")]
use cpu_time::ThreadTime;
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::Noise3;
use shibo_kernel::wood::branch::{Axis, Power, blend_all, branch_time};
use shibo_kernel::wood::fit::{Scheme, equalize, fit, point_at};
use shibo_kernel::wood::trunk::{Growth, Places, Rows, Trunk};
use shibo_kernel::wood::year_table::{Variation, YearTable, late_share};
use std::hint::black_box;

/// Points along a side.
const SIDE: u16 = 256;

/// Prints the cost of `work` per point.
fn timed(name: &str, mut work: impl FnMut()) {
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let before = ThreadTime::now();
        for _ in 0..20 {
            work();
        }
        best = best.min(before.elapsed().as_secs_f64() / 20.0);
    }
    let points = f64::from(SIDE) * f64::from(SIDE);
    println!("  {name}: {:.2} ns a point, {:.0} Mpx/s", best / points * 1e9, points / best * 1e-6);
}

/// Points of a plane: rows along x (level) or along z.
fn picture(level: bool) -> [Vec<f32>; 3] {
    let (mut x, mut z) = (Vec::new(), Vec::new());
    for j in 0..SIDE {
        for i in 0..SIDE {
            let share = |k: u16| f32::from(k) / f32::from(SIDE);
            let (across, up) = if level { (share(i), share(j)) } else { (share(j), share(i)) };
            x.push(300.0 * across - 150.0);
            z.push(1000.0 * up);
        }
    }
    let y = vec![25.0; x.len()];
    [x, y, z]
}

fn main() {
    let node = |i: u32| {
        let t = f64::from(i) / 8.0;
        DVec3::new(30.0 * (t * 9.0).sin(), 20.0 * (t * 7.0).cos(), 1000.0 * t)
    };
    let nodes: Vec<DVec3> = (0..9).map(node).collect();
    let controls = equalize(&fit(&nodes, Scheme::Natural).expect("they rise")).expect("they rise").0;
    let trunk = Trunk::<f32>::new(&controls);
    let growth = Growth { elongation: 230.0, thickening: 2.6, ground: 0.0, boost: 0.0, fade: 25.0 };
    let branch = |i: u32| {
        let (z, turn) = (300.0 * (f64::from(i) + 0.5), f64::from(i) * 2.4);
        let direction = DVec3::new(turn.cos(), turn.sin(), 0.7).normalize();
        Axis::new(point_at(&controls, z), direction, f64::INFINITY, z / 230.0, 230.0, 0.4)
    };
    let branches: Vec<Axis<f32>> = (0..3).map(branch).collect();
    for (name, level) in [("level rows", true), ("rows along the trunk", false)] {
        println!("{name}:");
        let [x, y, z] = &picture(level);
        let columns = usize::from(SIDE);
        let at = Places { x, y, z, rows: if level { Rows::Level(columns) } else { Rows::Of(columns) } };
        let (mut t1, mut t2) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        timed("trunk", || trunk.time(&at, &growth, black_box(&mut t1)));
        timed("three branches", || branch_time(&branches, &at, black_box(&mut t2)));
        let mut out = t1.clone();
        for k in [2.0, 4.0, f64::INFINITY, 3.0] {
            timed(&format!("copy and blend, k = {k}"), || {
                out.copy_from_slice(&t1);
                blend_all(black_box(&mut out), &t2, Power::of(k));
            });
        }
    }
    parts();
}

/// Noise and ring colours.
fn parts() {
    println!("parts of the look:");
    let [x, y, z] = picture(false);
    let mut out = vec![0.0_f32; x.len()];
    let noise = Noise3::new(Hash::new(1), 0);
    timed("noise in space", || {
        dispatch(
            #[inline(always)]
            || {
                for (((out, x), y), z) in out.iter_mut().zip(&x).zip(&y).zip(&z) {
                    *out = noise.at(x * 0.1, y * 0.1, z * 0.01);
                }
            },
        );
        black_box(&mut out);
    });
    let pattern: Vec<[f32; 3]> = (0..256).map(|i| [0.9 - 0.002 * i as f32; 3]).collect();
    let table = YearTable::new(
        &pattern,
        256,
        &late_share(&pattern, 256),
        192,
        Variation { depth: 0.3, phase: 0.25 },
        Hash::new(1),
    );
    timed("filtered ring colour", || {
        for (i, out) in out.iter_mut().enumerate() {
            *out = table.mean(i as f64 * 1e-4, 0.02, 0.011)[0];
        }
        black_box(&mut out);
    });
}
