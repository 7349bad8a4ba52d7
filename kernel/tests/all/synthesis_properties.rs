//! Properties of synthesis that hold for any exemplar.
#![allow(clippy::cast_possible_truncation, reason = "test pictures are small")]

use crate::synthesis::{Plain, analysed, lumps, plane, settings};
use proptest::prelude::*;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::stop::NEVER;
use shibo_kernel::synthesis::analysis::find_alike;
use shibo_kernel::synthesis::aniso::Position;
use shibo_kernel::synthesis::driver::{Analysed, run};
use shibo_kernel::synthesis::exact::{CorrectionRule, Corrector, Features, offsets, upsample};
use shibo_kernel::synthesis::jacobian::{Jacobian, from_angle_scale};
use shibo_kernel::synthesis::lattice::detect;
use shibo_kernel::synthesis::magnify::places;
use shibo_kernel::synthesis::region::Output;
use shibo_kernel::synthesis::texels::{Fetch, Texels};
use shibo_kernel::synthesis::{Lookup, Neighbours, PixelPlane};
use std::sync::atomic::{AtomicI32, Ordering};

fn synthesise(exemplar: &Texels<f32>, usable: &[bool], output: &Output, local: bool, inputs: &Plain) -> Vec<Position> {
    let levels = analysed(exemplar);
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable, guide: &[], picture: None };
    run(&analysed, output, &settings(local), inputs).expect("nothing stops it").coords
}

fn unbounded(x: i32, y: i32, w: usize, h: usize) -> Output {
    Output { start: [x, y], size: [w, h], wrap: [false; 2] }
}

fn swirl(x: f64, y: f64) -> Jacobian {
    from_angle_scale((0.02 * x) as f32, (1.0 + 0.004 * y) as f32, 1.1)
}

#[test]
fn windows_are_parts_of_larger_ones() {
    for (wrap, jacobian) in [(false, None), (true, None), (false, Some(swirl as fn(f64, f64) -> Jacobian))] {
        let exemplar = lumps(40, 36, wrap);
        let inputs = Plain { jacobian, ..Plain::default() };
        let whole = synthesise(&exemplar, &[], &unbounded(-20, -7, 90, 70), true, &inputs);
        for (x, y, w, h) in [(-20, -7, 90, 70), (3, 11, 33, 21), (-1, -1, 1, 1), (37, 5, 21, 50)] {
            let part = synthesise(&exemplar, &[], &unbounded(x, y, w, h), true, &inputs);
            for (k, at) in part.iter().enumerate() {
                let (px, py) = (k % w + (x + 20) as usize, k / w + (y + 7) as usize);
                assert_eq!(*at, whole[py * 90 + px], "window {x} {y}, pixel {k}");
            }
        }
    }
}

/// Discontinuity of the output where pieces end: the squared difference between its neighbours and the continuation of
/// the exemplar, summed over all pixels. Includes diagonals, so that the direction in which pieces end does not matter.
fn torn(exemplar: &Texels<f32>, j: fn(f64, f64) -> Jacobian) -> f64 {
    const SIDE: usize = 160;
    let output = Output { start: [0, 0], size: [SIDE; 2], wrap: [true; 2] };
    let inputs = Plain { jacobian: Some(j), ..Plain::default() };
    let coords = synthesise(exemplar, &[], &output, false, &inputs);
    let j = j(0.0, 0.0);
    let mut sum = 0.0;
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        for (dx, dy, weight) in [(1, 0, 1.0), (0, 1, 1.0), (1, 1, 0.5f64.sqrt()), (SIDE - 1, 1, 0.5f64.sqrt())] {
            let by = [if dx == SIDE - 1 { -1.0 } else { dx as f32 }, dy as f32];
            let from = coords[y * SIDE + x];
            let on = [from[0] + j[0] * by[0] + j[1] * by[1], from[1] + j[2] * by[0] + j[3] * by[1]];
            let to = coords[(y + dy) % SIDE * SIDE + (x + dx) % SIDE];
            if on != to {
                let (a, b) = (exemplar.fetch(on, Fetch::Bilinear), exemplar.fetch(to, Fetch::Bilinear));
                sum += weight * a.iter().zip(&b).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>();
            }
        }
    }
    sum
}

#[test]
fn tears_no_more_when_rotated() {
    let exemplar = lumps(64, 64, false);
    // As good as without rotation, on the same path.
    let upright = torn(&exemplar, |_, _| from_angle_scale(1e-5, 1.0, 1.0));
    let turned = [
        torn(&exemplar, |_, _| from_angle_scale(0.3, 1.0, 1.0)),
        torn(&exemplar, |_, _| from_angle_scale(0.646, 1.0, 1.0)),
        torn(&exemplar, |_, _| from_angle_scale(2.0, 1.0, 1.0)),
        torn(&exemplar, |_, _| from_angle_scale(-1.2, 1.0, 1.0)),
    ];
    for turned in turned {
        assert!(turned < 1.05 * upright, "{turned} beside {upright}");
    }
}

#[test]
fn the_same_on_any_number_of_threads() {
    let exemplar = lumps(32, 32, false);
    let inputs = [Plain::default(), Plain { jacobian: Some(swirl), ..Plain::default() }];
    for inputs in inputs {
        let results: Vec<Vec<Position>> = [1, 2, 7]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let output = Output { start: [0, 0], size: [75, 64], wrap: [true, true] };
                pool.install(|| synthesise(&exemplar, &[], &output, false, &inputs))
            })
            .collect();
        assert_eq!(results[0], results[1]);
        assert_eq!(results[0], results[2]);
    }
}

#[test]
fn positions_stay_inside_and_never_streak() {
    for (w, h, wrap) in [(33, 47, false), (32, 32, true), (1, 9, false), (3, 1, true), (1, 1, false), (17, 5, false)] {
        let exemplar = lumps(w, h, wrap);
        for jacobian in [None, Some(swirl as fn(f64, f64) -> Jacobian)] {
            let inputs = Plain { jacobian, ..Plain::default() };
            let output = Output { start: [0, 0], size: [64, 50], wrap: [true, false] };
            let coords = synthesise(&exemplar, &[], &output, false, &inputs);
            let inside = |c: &Position| c[0] >= 0.0 && c[0] < w as f32 && c[1] >= 0.0 && c[1] < h as f32;
            assert!(coords.iter().all(inside), "{w}x{h}");
        }
    }
    for (w, h, wrap) in [(33, 47, false), (32, 32, true), (64, 64, false)] {
        let exemplar = lumps(w, h, wrap);
        let output = Output { start: [0, 0], size: [192, 192], wrap: [true; 2] };
        for local in [true, false] {
            let coords = synthesise(&exemplar, &[], &output, local, &Plain::default());
            let at = |x: usize, y: usize| coords[y % 192 * 192 + x % 192];
            for (x, y) in (0..192).flat_map(|x| (0..192).map(move |y| (x, y))) {
                let own = at(x, y);
                assert!(at(x + 1, y) != own || at(x + 2, y) != own, "a streak at {x}, {y} of {w}x{h}");
                assert!(at(x, y + 1) != own || at(x, y + 2) != own, "a streak at {x}, {y} of {w}x{h}");
            }
        }
    }
}

/// With the swirl's Jacobian, the steps from many pixels to their right and lower neighbours follow it, although it
/// rotates so fast that pieces must end; without a Jacobian, nearly none do.
#[test]
fn coordinates_follow_a_jacobian_that_varies() {
    let exemplar = lumps(64, 64, true);
    let follows = |jacobian: Option<fn(f64, f64) -> Jacobian>| {
        let inputs = Plain { jacobian, ..Plain::default() };
        let coords = synthesise(&exemplar, &[], &unbounded(0, 0, 96, 96), true, &inputs);
        let apart = |a: f32, b: f32| (a - b + 32.0).rem_euclid(64.0) - 32.0;
        let kept = (0..95 * 95).filter(|k| {
            let (x, y) = (k % 95, k / 95);
            let (own, j) = (coords[y * 96 + x], swirl(x as f64 + 0.5, y as f64 + 0.5));
            let near = |next: Position, step: [f32; 2]| {
                apart(next[0] - own[0], step[0]).abs() + apart(next[1] - own[1], step[1]).abs() < 0.1
            };
            near(coords[y * 96 + x + 1], [j[0], j[2]]) && near(coords[(y + 1) * 96 + x], [j[1], j[3]])
        });
        kept.count() as f64 / (95.0 * 95.0)
    };
    let (along, without) = (follows(Some(swirl)), follows(None));
    println!("{along:.3} of the pixels follow the Jacobian, {without:.3} without it");
    assert!(along > 0.3 && without < 0.05, "{along:.3} of the pixels follow the Jacobian, {without:.3} without it");
}

/// A lookup that records how far from a pixel it was read.
struct Watched {
    plane: PixelPlane,
    centre: [i32; 2],
    far: AtomicI32,
    reads: AtomicI32,
}

impl Lookup for Watched {
    fn index(&self, x: i32, y: i32) -> usize {
        self.far.fetch_max((x - self.centre[0]).abs().max((y - self.centre[1]).abs()), Ordering::Relaxed);
        self.reads.fetch_add(1, Ordering::Relaxed);
        self.plane.index(x, y)
    }
}

impl Neighbours for Watched {}

#[test]
fn only_the_eight_immediate_neighbours_are_read() {
    let texels = lumps(16, 16, true);
    let texels = Texels::new(texels.plane, 2, texels.data.iter().map(|v| f64::from(*v)).collect::<Vec<f64>>());
    let features = Features { texels: &texels, ratio: 1.0, second: &[], plane: texels.plane };
    let hash = Hash::new(3);
    let map: Vec<[f64; 2]> = (0..81).map(|p| [16.0 * hash.unit(2 * p), 16.0 * hash.unit(2 * p + 1)]).collect();
    for (square, compared) in [(4, 4), (3, 9), (5, 25)] {
        assert_eq!(offsets(square).len(), compared);
        let rule = CorrectionRule { square, averaged: true, fetch: Fetch::Bilinear, h: 1.0, kappa: 1.0, sub_passes: 1 };
        for (angle, scale, stretch) in [(0.0, 1.0, 1.0), (0.7, 0.3, 1.0), (2.5, 4.0, 2.0), (4.0, 1.0, 0.4)] {
            let j = from_angle_scale(angle, scale, stretch).map(f64::from);
            let (far, reads) = (AtomicI32::new(0), AtomicI32::new(0));
            let watched = Watched { plane: plane(9, 9, true), centre: [4, 4], far, reads };
            let corrector = Corrector { features: &features, rule: &rule, lookup: &watched, jacobian: |_| j };
            assert_eq!(corrector.neighbourhood(&map, (4, 4)).len(), 2 * compared);
            assert!(corrector.candidates(&map, (4, 4)).len() >= 9);
            corrector.best(&map, (4, 4), &[]);
            assert!(watched.reads.into_inner() > 9);
            assert_eq!(watched.far.into_inner(), 1, "{square} {angle} {scale} {stretch}");
        }
    }
}

#[test]
fn hides_masked_pixels_and_keeps_given_ones() {
    let exemplar = lumps(48, 48, false);
    let usable: Vec<bool> = (0..48 * 48).map(|p| !(10..26).contains(&(p % 48)) || p / 48 > 30).collect();
    let output = Output { start: [0, 0], size: [96, 96], wrap: [true; 2] };
    let coords = synthesise(&exemplar, &usable, &output, false, &Plain::default());
    let shown = |c: &Position| usable[c[1] as usize * 48 + c[0] as usize];
    let hidden = coords.iter().filter(|c| !shown(c)).count();
    assert!(hidden * 500 < coords.len(), "{hidden} masked pixels are shown");
    let given = |x: f64, y: f64| -> Option<Position> {
        ((x - 48.0).abs() < 12.0 && (y - 40.0).abs() < 10.0).then_some([(x - 30.0) as f32, (y - 20.0) as f32])
    };
    let coords = synthesise(&exemplar, &[], &output, false, &Plain { fixed: Some(given), ..Plain::default() });
    for (p, at) in coords.iter().enumerate() {
        if let Some(wanted) = given((p % 96) as f64 + 0.5, (p / 96) as f64 + 0.5) {
            assert_eq!(*at, wanted);
        }
    }
}

#[test]
fn lattices_are_found_to_parts_of_a_pixel() {
    let (w, h) = (128, 96);
    let hash = Hash::new(4);
    let (a, b) = ([13.4, 1.2], [-2.1, 9.7]);
    let det: f64 = a[0] * b[1] - a[1] * b[0];
    let data = (0..w * h)
        .map(|p| {
            let (x, y) = ((p % w) as f64, (p / w) as f64);
            let (i, j) = ((x * b[1] - y * b[0]) / det, (a[0] * y - a[1] * x) / det);
            let wave = (i * std::f64::consts::TAU).cos() + (j * std::f64::consts::TAU).cos();
            (wave + 0.3 * hash.unit(p as u64)) as f32
        })
        .collect();
    let found = detect(&Texels::new(plane(w, h, false), 1, data)).expect("it repeats");
    assert!(found.is_regular(), "{found:?}");
    assert!((found.basis.det().abs() - det.abs()).abs() < 0.5, "{found:?}");
    for v in [a, b] {
        let off = found.basis.coordinates(v).map(|c| (c - c.round()).abs());
        assert!(off[0].max(off[1]) < 0.02, "{found:?}");
    }
    let noise = Texels::new(plane(64, 64, false), 1, (0..4096).map(|n| hash.unit_f32(n)).collect());
    assert!(detect(&noise).is_none_or(|found| !found.is_regular()));
}

#[test]
fn finds_lattice_with_less_than_two_periods() {
    // A wall of running bond: two courses and two half bricks are 56 pixels; 96 pixels show 1.7 periods.
    let n = 96;
    let hash = Hash::new(8);
    let wall = |p: usize| {
        let (x, y) = (p % n, p / n);
        let (course, inside) = (y / 28, y % 28);
        let along = (x + course % 2 * 28) % 56;
        let joint = inside < 4 || along < 4;
        (if joint { 1.0 } else { 0.2 } + 0.2 * hash.unit(p as u64)) as f32
    };
    let picture = Texels::new(plane(n, n, false), 1, (0..n * n).map(wall).collect());
    let found = detect(&picture).expect("it repeats");
    assert!(found.is_regular() && found.mean > 0.8, "{found:?}");
    for v in [[56.0, 0.0], [28.0, 28.0]] {
        let off = found.basis.coordinates(v).map(|c| (c - c.round()).abs());
        assert!(off[0].max(off[1]) < 0.05, "{found:?}");
    }
    // Noise has no lattice at any size.
    for seed in 0..6 {
        let data = (0..n * n).map(|p| Hash::new(seed).unit_f32(p as u64)).collect();
        let lumps = Texels::new(plane(n, n, false), 1, data).blurred(12);
        assert!(detect(&lumps).is_none_or(|found| !found.is_regular()), "{:?}", detect(&lumps));
    }
}

fn jacobian() -> impl Strategy<Value = [f64; 4]> {
    (0.0..std::f64::consts::TAU, 0.4..2.0, 0.6..1.6).prop_map(|(angle, scale, stretch): (f64, f64, f64)| {
        from_angle_scale(angle as f32, scale as f32, stretch as f32).map(f64::from)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn zeros_and_a_constant_jacobian_give_the_affine_map(j in jacobian(), w in 1usize..4, h in 1usize..3, levels in 1u32..5) {
        let mut size = [w, h];
        let mut map = vec![[0.0; 2]; w * h];
        for level in 1..=levels {
            let spacing = f64::from(1 << (levels - level));
            map = upsample(&map, plane(size[0], size[1], false), spacing, |_, _| j);
            size = size.map(|n| 2 * n);
        }
        // Around the centre of each starting pixel.
        let side = 1 << levels;
        for (p, at) in map.iter().enumerate() {
            let centred = |k: usize| (k % side) as f64 + 0.5 - side as f64 / 2.0;
            let (x, y) = (centred(p % size[0]), centred(p / size[0]));
            prop_assert!((at[0] - (j[0] * x + j[1] * y)).abs() < 1e-9);
            prop_assert!((at[1] - (j[2] * x + j[3] * y)).abs() < 1e-9);
        }
    }

    #[test]
    fn affine_maps_are_fixed_points(j in jacobian(), u in 0.0..40.0f64, v in 0.0..40.0f64, square in 3u8..=5, averaged: bool) {
        let texels = lumps(32, 32, true);
        let texels = Texels::new(texels.plane, 2, texels.data.iter().map(|v| f64::from(*v)).collect::<Vec<f64>>());
        let features = Features { texels: &texels, ratio: 1.0, second: &[], plane: texels.plane };
        let area = plane(9, 8, false);
        let map: Vec<[f64; 2]> = (0..72)
            .map(|p| {
                let (x, y) = (f64::from(p % 9), f64::from(p / 9));
                [u + j[0] * x + j[1] * y, v + j[2] * x + j[3] * y]
            })
            .collect();
        let rule = CorrectionRule { square, averaged, fetch: Fetch::Bilinear, h: 1.0, kappa: 1.0, sub_passes: 4 };
        let corrector = Corrector { features: &features, rule: &rule, lookup: &area, jacobian: |_| j };
        // Inside; at the border neighbours are missing.
        for (x, y) in (1..8).flat_map(|x| (1..7).map(move |y| (x, y))) {
            let own = map[area.index(x, y)];
            let best = corrector.best(&map, (x, y), &[]);
            prop_assert!((best[0] - own[0]).abs() + (best[1] - own[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn magnification_is_exact_on_affine_maps(j in jacobian(), x in 1.0..7.0f64, y in 1.0..7.0f64) {
        let area = plane(8, 8, false);
        let at = |x: f64, y: f64| [3.0 + j[0] * x + j[1] * y, 5.0 + j[2] * x + j[3] * y];
        let map: Vec<[f64; 2]> = (0..64).map(|p| at(f64::from(p % 8) + 0.5, f64::from(p / 8) + 0.5)).collect();
        let mut total = 0.0;
        for (place, weight) in places(&map, &area, [x, y], |_| j) {
            let wanted = at(x, y);
            prop_assert!((place[0] - wanted[0]).abs() + (place[1] - wanted[1]).abs() < 1e-9);
            total += weight;
        }
        prop_assert!((total - 1.0).abs() < 1e-12);
    }
}

#[test]
fn candidate_sets_hold_pixels_apart_from_each_other() {
    for wrap in [true, false] {
        let exemplar = lumps(40, 36, wrap);
        let mut levels = analysed(&exemplar);
        let two: Vec<Vec<u32>> = levels.iter().map(|level| level.second.clone()).collect();
        find_alike(&mut levels, exemplar.plane, &[], 3.0, 4, Hash::new(2), NEVER);
        let n = 40 * 36;
        let span = |a: u32, b: u32| {
            let axis = |a: u32, b: u32, n: u32| {
                let d = a.abs_diff(b);
                if wrap { d.min(n - d) } else { d }
            };
            axis(a % 40, b % 40, 40).max(axis(a / 40, b / 40, 36))
        };
        for (level, two) in levels.iter().zip(&two) {
            assert_eq!(level.second.len(), 3 * n);
            // The first of several candidates is the one of a pair.
            assert_eq!(&level.second[..n], &two[..]);
            // Pixels between searched ones are derived from them, so candidates keep their distance only at searched
            // pixels.
            let step = (level.h / 4).max(1) as u32;
            for p in (0..n as u32).filter(|p| p % 40 % step == 0 && p / 40 % step == 0) {
                let set = [0, 1, 2].map(|k| level.second[k * n + p as usize]);
                for (k, a) in set.iter().enumerate() {
                    assert!(span(*a, p) >= 3 && set[..k].iter().all(|b| span(*a, *b) >= 3), "{p}: {set:?}");
                }
            }
        }
        find_alike(&mut levels, exemplar.plane, &[], 3.0, 1, Hash::new(2), NEVER);
        assert!(levels.iter().all(|level| level.second.iter().enumerate().all(|(p, q)| p as u32 == *q)));
    }
}
