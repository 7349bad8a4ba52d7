//! Exemplars and results that wrap along one axis only: each axis is handled independently.
#![allow(clippy::cast_possible_truncation, reason = "test pictures are small")]
use crate::synthesis::{Plain, analysed, settings};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::aniso::Position;
use shibo_kernel::synthesis::driver::{Analysed, Settings, Start, run};
use shibo_kernel::synthesis::jacobian::{Jacobian, from_angle_scale};
use shibo_kernel::synthesis::lattice::Basis;
use shibo_kernel::synthesis::region::Output;
use shibo_kernel::synthesis::texels::Texels;

const WRAPS: [[bool; 2]; 4] = [[true, false], [false, true], [true, true], [false, false]];

/// Bumps that nearly repeat by a lattice, on a rectangle with the wrapping axes `wrap`.
fn bumps(wrap: [bool; 2], basis: Basis, seed: u64) -> Texels<f32> {
    let (w, h, hash) = (48, 48, Hash::new(seed));
    let value = |p: usize| {
        let [i, j] = basis.coordinates([(p % w) as f64, (p / w) as f64]);
        let cell = hash.with(i.round() as i64 as u64).unit(j.round() as i64 as u64);
        let wave = (i * std::f64::consts::TAU).cos() + (j * std::f64::consts::TAU).cos();
        (wave + 0.5 * cell + 0.3 * hash.unit(p as u64)) as f32
    };
    Texels::new(PixelPlane { w, h, wrap }, 1, (0..w * h).map(value).collect())
}

fn grown(
    exemplar: &Texels<f32>,
    output: &Output,
    how: &Settings,
    jacobian: Option<fn(f64, f64) -> Jacobian>,
) -> Vec<Position> {
    let levels = analysed(exemplar);
    let picture = jacobian.is_none().then_some((exemplar, false));
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide: &[], picture };
    run(&analysed, output, how, &Plain { jacobian, ..Plain::default() }).expect("nothing stops it").coords
}

/// The mean step of the values from one column (or row) to the next: across wrapping sides, and inside.
fn steps(exemplar: &Texels<f32>, coords: &[Position], [w, h]: [usize; 2], rows: bool) -> (f64, f64) {
    let shown = |x: usize, y: usize| {
        let at = coords[y % h * w + x % w];
        f64::from(exemplar.at(at[0].floor() as i32, at[1].floor() as i32)[0])
    };
    let step = |k: usize| -> f64 {
        if rows {
            (0..w).map(|x| (shown(x, k) - shown(x, k + 1)).abs()).sum::<f64>() / w as f64
        } else {
            (0..h).map(|y| (shown(k, y) - shown(k + 1, y)).abs()).sum::<f64>() / h as f64
        }
    };
    let n = if rows { h } else { w };
    (step(n - 1), (0..n - 1).map(step).sum::<f64>() / (n - 1) as f64)
}

#[test]
fn wraps_only_requested_axes() {
    let basis = Basis { a: [11.7, 0.6], b: [-0.5, 12.3] };
    for wrap in WRAPS {
        let mut sums = [[0.0; 2]; 2];
        for seed in 0..24 {
            let exemplar = bumps(wrap, basis, seed);
            let start = if seed % 4 == 3 { Start::Random } else { Start::Lattice(basis) };
            let jitter = if seed % 3 == 0 { 0.5 } else { 0.0 };
            let rounds = if seed % 2 == 0 { 2 } else { 0 };
            let how = Settings { start, jitter, rounds, adrift: true, hash: Hash::new(seed), ..settings(true) };
            // No side is a whole number of periods.
            let size = [71, 66];
            let coords = grown(&exemplar, &Output { start: [0, 0], size, wrap }, &how, None);
            let inside = |c: &Position| (0.0..48.0).contains(&c[0]) && (0.0..48.0).contains(&c[1]);
            assert!(coords.iter().all(inside), "{wrap:?} {seed}");
            for (axis, sums) in sums.iter_mut().enumerate() {
                let (side, within) = steps(&exemplar, &coords, size, axis == 1);
                sums[0] += side;
                sums[1] += within;
            }
        }
        for (axis, [side, within]) in sums.into_iter().enumerate() {
            let joined = side < 1.3 * within;
            assert_eq!(joined, wrap[axis], "{wrap:?}, axis {axis}: {side:.2} where sides meet, {within:.2} inside");
        }
    }
}

#[test]
fn positions_stay_inside_along_a_jacobian() {
    let basis = Basis { a: [11.7, 0.6], b: [-0.5, 12.3] };
    let turned: fn(f64, f64) -> Jacobian = |x, _| from_angle_scale(0.4 + 0.01 * x as f32, 1.1, 0.9);
    for wrap in WRAPS {
        let exemplar = bumps(wrap, basis, 5);
        let coords = grown(&exemplar, &Output { start: [0, 0], size: [61, 70], wrap }, &settings(true), Some(turned));
        let inside = |c: &Position| (0.0..48.0).contains(&c[0]) && (0.0..48.0).contains(&c[1]);
        assert!(coords.iter().all(inside), "{wrap:?}");
    }
}

/// Along an axis that does not wrap, a smaller result is a part of a larger one.
#[test]
fn a_larger_canvas_extends_a_smaller_one() {
    let basis = Basis { a: [11.7, 0.6], b: [-0.5, 12.3] };
    for seed in [1, 2, 3] {
        for (axis, wrap) in [[false, true], [true, false]].into_iter().enumerate() {
            let exemplar = bumps(wrap, basis, seed);
            let how = Settings {
                start: Start::Lattice(basis),
                jitter: 0.0,
                rounds: 2,
                adrift: true,
                hash: Hash::new(seed),
                ..settings(true)
            };
            let of = |from: i32, n: usize| {
                let (mut start, mut size) = ([0, 0], [64, 64]);
                (start[axis], size[axis]) = (from, n);
                (size[0], grown(&exemplar, &Output { start, size, wrap }, &how, None))
            };
            let ((w, small), (wide, large)) = (of(7, 40), of(0, 90));
            for (p, at) in small.iter().enumerate() {
                let mut place = [p % w, p / w];
                place[axis] += 7;
                assert_eq!(*at, large[place[1] * wide + place[0]], "{wrap:?} {seed}: pixel {p}");
            }
        }
    }
}
