//! Mended joints: fewer torn features, as sharp as before; and windows, threads, guides and given pixels as in all of
//! synthesis.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "test pictures are small")]
use crate::synthesis::{Plain, analysed, plane, settings};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::aniso::Position;
use shibo_kernel::synthesis::driver::{Analysed, Inputs, Settings, Start, run};
use shibo_kernel::synthesis::lattice::Basis;
use shibo_kernel::synthesis::region::{Output, Region};
use shibo_kernel::synthesis::texels::Texels;

/// Cells of about ten pixels between dark joints of two, each with its own brightness.
fn cells(side: usize, wrap: bool) -> Texels<f32> {
    let hash = Hash::new(12);
    let count = side / 10;
    let pitch = side as f64 / count as f64;
    let value = |p: usize| {
        let (x, y) = ((p % side) as f64 / pitch, (p / side) as f64 / pitch);
        let mut near = [(f64::MAX, 0u64); 2];
        for j in -2i32..=2 {
            for i in -2i32..=2 {
                let (cx, cy) = (x.floor() + f64::from(i), y.floor() + f64::from(j));
                let name = [cx, cy].map(|c| if wrap { c.rem_euclid(count as f64) } else { c + 64.0 });
                let name = name[1] as u64 * 256 + name[0] as u64;
                let cell = hash.with(name);
                let d = (cx + cell.unit(0) - x).hypot(cy + cell.unit(1) - y);
                if d < near[0].0 {
                    near = [(d, name), near[0]];
                } else if d < near[1].0 {
                    near[1] = (d, name);
                }
            }
        }
        let joint = ((near[1].0 - near[0].0) * pitch / 4.0).min(1.0);
        (joint * (0.7 + 0.3 * hash.with(near[0].1).unit(2))) as f32
    };
    let data: Vec<f32> = (0..side * side).map(value).collect();
    let mean = data.iter().sum::<f32>() / data.len() as f32;
    let spread = (data.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / data.len() as f32).sqrt();
    Texels::new(plane(side, side, wrap), 1, data.iter().map(|v| (v - mean) / spread).collect())
}

fn plain(rounds: u32, seed: u64) -> Settings {
    Settings { kappa: 2.5, jitter: 0.0, rounds, hash: Hash::new(seed), ..settings(true) }
}

fn grown<I: Inputs>(
    exemplar: &Texels<f32>,
    guide: &[f32],
    output: &Output,
    how: &Settings,
    inputs: &I,
) -> Vec<Position> {
    let levels = analysed(exemplar);
    let picture = Some((exemplar, false));
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide, picture };
    run(&analysed, output, how, inputs).unwrap_or_else(|_| panic!("nothing stops it")).coords
}

fn unbounded(x: i32, y: i32, w: usize, h: usize) -> Output {
    Output { start: [x, y], size: [w, h], wrap: [false; 2] }
}

/// The values at the coordinates.
fn shown(exemplar: &Texels<f32>, coords: &[Position]) -> Vec<f32> {
    coords.iter().map(|at| exemplar.at(at[0].floor() as i32, at[1].floor() as i32)[0]).collect()
}

/// The share of patches of 7² pixels that differ from all those of the exemplar by more than 0.45 of its deviation, and
/// the energy of their gradients over that of the most similar patches.
fn torn(exemplar: &Texels<f32>, picture: &[f32], w: usize) -> (f64, f64) {
    let side = exemplar.plane.w;
    let patch = |data: &[f32], w: usize, x: usize, y: usize| -> Vec<f32> {
        (0..7).flat_map(|j| data[(y + j) * w + x..][..7].to_vec()).collect()
    };
    let known: Vec<Vec<f32>> =
        (0..(side - 6) * (side - 6)).map(|p| patch(&exemplar.data, side, p % (side - 6), p / (side - 6))).collect();
    let energy = |patch: &[f32]| -> f64 {
        let across = patch.chunks_exact(7).flat_map(|row| row.windows(2)).map(|v| f64::from(v[1] - v[0]).powi(2));
        let down = (7..49).map(|k| f64::from(patch[k] - patch[k - 7]).powi(2));
        across.chain(down).sum()
    };
    let (mut far, mut count, mut sharp, mut wanted) = (0.0, 0.0, 0.0, 0.0);
    for y in (0..picture.len() / w - 6).step_by(5) {
        for x in (0..w - 6).step_by(5) {
            let here = patch(picture, w, x, y);
            let off = |other: &[f32]| here.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
            let best = known.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("there are patches");
            far += if (off(best) / 49.0).sqrt() > 0.45 { 1.0 } else { 0.0 };
            count += 1.0;
            sharp += energy(&here);
            wanted += energy(best);
        }
    }
    (far / count, sharp / wanted)
}

#[test]
fn tears_few_features_and_blurs_nothing() {
    let exemplar = cells(72, false);
    let output = unbounded(0, 0, 128, 128);
    let of = |rounds: u32| {
        let all = [3, 4].map(|seed| {
            let coords = grown(&exemplar, &[], &output, &plain(rounds, seed), &Plain::default());
            torn(&exemplar, &shown(&exemplar, &coords), 128)
        });
        ((all[0].0 + all[1].0) / 2.0, (all[0].1 + all[1].1) / 2.0)
    };
    let (left, mended, best) = (of(0), of(1), of(3));
    assert!(left.0 > 0.1, "the exemplar is too easy: {left:?}");
    // One lookup round and one replacing round; then three of each.
    assert!(mended.0 < 0.35 * left.0 && best.0 < 0.2 * left.0, "torn {left:?}, mended {mended:?}, best {best:?}");
    assert!((0.95..1.05).contains(&mended.1) && (0.95..1.05).contains(&best.1), "mended {mended:?}, best {best:?}");
}

#[test]
fn windows_are_parts_of_larger_ones() {
    for wrap in [false, true] {
        let exemplar = cells(40, wrap);
        let how = plain(2, 5);
        let whole = grown(&exemplar, &[], &unbounded(-20, 7, 90, 70), &how, &Plain::default());
        for (x, y, w, h) in [(-20, 7, 1, 1), (13, 30, 40, 20), (50, 60, 20, 17)] {
            let part = grown(&exemplar, &[], &unbounded(x, y, w, h), &how, &Plain::default());
            for (k, at) in part.iter().enumerate() {
                let (col, row) = (x + 20 + (k % w) as i32, y - 7 + (k / w) as i32);
                assert_eq!(*at, whole[row as usize * 90 + col as usize], "pixel ({col}, {row}) of {wrap}");
            }
        }
    }
}

/// Positions next to the best tried position are tried too; in large exemplars they may lie across its sides.
#[test]
fn searches_across_wrapping_sides_of_large_exemplars() {
    let hash = Hash::new(21);
    let side = 900;
    let data = (0..side * side).map(|p| 12.0f32.sqrt() * (hash.unit_f32(p as u64) - 0.5)).collect();
    let exemplar = Texels::new(plane(side, side, true), 1, data);
    let output = Output { start: [0, 0], size: [400, 400], wrap: [true; 2] };
    // Start from single pixels only: there are many spots.
    let how = Settings { coarsest: 1, passes: 0, ..plain(1, 9) };
    let coords = grown(&exemplar, &[], &output, &how, &Plain::default());
    let inside = |at: &Position| at.iter().all(|v| (0.0..side as f32).contains(v));
    assert!(coords.len() == 400 * 400 && coords.iter().all(inside));
}

#[test]
fn the_same_on_any_number_of_threads() {
    let exemplar = cells(40, false);
    let output = Output { start: [0, 0], size: [75, 90], wrap: [true; 2] };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| grown(&exemplar, &[], &output, &plain(2, 6), &Plain::default()))
    };
    let one = on(1);
    assert!([2, 5].into_iter().all(|threads| on(threads) == one));
}

/// Bright on the left, dark on the right.
struct Guided;

impl Inputs for Guided {
    type Stop = ();
    fn guide(&self, region: &Region) -> Result<Vec<f32>, ()> {
        let w = region.plane.w;
        let bright = |p: usize| if region.center(p % w, p / w)[0] < 48.0 { 1.0 } else { 0.0 };
        Ok((0..w * region.plane.h).map(bright).collect())
    }
}

#[test]
fn guides_are_followed_and_given_pixels_stay() {
    let exemplar = cells(72, false);
    let guide: Vec<f32> = (0..72 * 72).map(|p| if p % 72 < 36 { 1.0 } else { 0.0 }).collect();
    let output = unbounded(0, 0, 96, 96);
    let coords = grown(&exemplar, &guide, &output, &plain(2, 7), &Guided);
    let right = coords.iter().enumerate().filter(|(p, at)| (at[0] < 36.0) == (p % 96 < 48)).count();
    assert!(right as f64 > 0.85 * coords.len() as f64, "{right} of {}", coords.len());

    let given = |x: f64, y: f64| (x > 40.0 && y > 50.0 && x < 52.0).then_some([(x - 10.0) as f32, (y - 30.0) as f32]);
    let inputs = Plain { fixed: Some(given), ..Plain::default() };
    let coords = grown(&exemplar, &[], &output, &plain(2, 7), &inputs);
    for (p, at) in coords.iter().enumerate() {
        if let Some(wanted) = given((p % 96) as f64 + 0.5, (p / 96) as f64 + 0.5) {
            assert_eq!(*at, wanted);
        }
    }
}

/// Bricks in running bond between joints, less than three by nine, each with its own colour.
fn bricks(basis: Basis, side: usize) -> Texels<f32> {
    let (hash, [wide, high]) = (Hash::new(3), [basis.b[0], basis.a[1]]);
    let value = |p: usize| {
        let (x, y) = ((p % side) as f64, (p / side) as f64);
        let course = (y / high).floor();
        let along = x / wide + 0.5 * course;
        let (into, up) = ((along - along.floor()) * wide, y - course * high);
        let brick = hash.with((along.floor() + 64.0) as u64 * 256 + course as u64);
        let joint = (into.min(up) / 2.0).min(1.0);
        (joint * (0.6 + 0.4 * brick.unit(0)) + 0.1 * hash.unit(p as u64)) as f32
    };
    let data: Vec<f32> = (0..side * side).map(value).collect();
    let mean = data.iter().sum::<f32>() / data.len() as f32;
    let spread = (data.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / data.len() as f32).sqrt();
    Texels::new(plane(side, side, false), 1, data.iter().map(|v| (v - mean) / spread).collect())
}

#[test]
fn keeps_phase_of_lattice_start() {
    let basis = Basis { a: [16.0, 10.6], b: [32.0, 0.0] };
    let exemplar = bricks(basis, 92);
    for seed in 1..=2 {
        let how = Settings { start: Start::Lattice(basis), coarsest: 16, adrift: true, ..plain(2, seed) };
        let coords = grown(&exemplar, &[], &unbounded(-7, 11, 192, 192), &how, &Plain::default());
        let slipped = |(p, at): (usize, &Position)| {
            let (x, y) = ((p % 192) as f64 - 6.5, (p / 192) as f64 + 11.5);
            let c = basis.coordinates([f64::from(at[0]) - x, f64::from(at[1]) - y]);
            let off = basis.at(c[0] - c[0].round(), c[1] - c[1].round());
            off[0].hypot(off[1]) > 4.0
        };
        let share = coords.iter().enumerate().filter(|at| slipped(*at)).count() as f64 / coords.len() as f64;
        // More than three times as many if no phase is kept.
        assert!(share < 0.005, "seed {seed}: {share:.4} of the pixels are not in step");
    }
}
