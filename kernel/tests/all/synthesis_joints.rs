//! Continuity across the sides of a synthesis that wrap.
#![allow(clippy::cast_possible_truncation, reason = "test pictures are small")]

use crate::synthesis::{Plain, analysed, lumps, settings};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::aniso::{Jacobians, Position};
use shibo_kernel::synthesis::coverage::EvenUse;
use shibo_kernel::synthesis::driver::{Analysed, Inputs, Settings, Start, run};
use shibo_kernel::synthesis::jacobian::{Jacobian, from_angle_scale};
use shibo_kernel::synthesis::lattice::Basis;
use shibo_kernel::synthesis::lattice_start::fit;
use shibo_kernel::synthesis::region::{Output, Region};
use shibo_kernel::synthesis::texels::Texels;

/// Share of steps from one column to the next, and from one row to the next, at which the exemplar does not continue:
/// at wrapping sides, and on average.
fn breaks(coords: &[Position], [w, h]: [usize; 2], j: Jacobian) -> (f64, f64) {
    let broken =
        |a: Position, b: Position, step: Position| (b[0] - a[0] - step[0]).abs() + (b[1] - a[1] - step[1]).abs() > 1e-3;
    let at = |x: usize, y: usize| coords[y % h * w + x % w];
    let column = |x: usize| (0..h).filter(|&y| broken(at(x, y), at(x + 1, y), [j[0], j[2]])).count();
    let row = |y: usize| (0..w).filter(|&x| broken(at(x, y), at(x, y + 1), [j[1], j[3]])).count();
    let share = |sum: usize, n: usize| sum as f64 / n as f64;
    let all = share((0..w).map(column).sum(), w * h) + share((0..h).map(row).sum(), w * h);
    (share(column(w - 1), h) + share(row(h - 1), w), all)
}

/// Lumps; the first channel repeats, with some noise.
fn near_regular(basis: Basis) -> Texels<f32> {
    let (mut exemplar, hash) = (lumps(64, 64, false), Hash::new(8));
    for p in 0..64 * 64 {
        let [i, j] = basis.coordinates([(p % 64) as f64, (p / 64) as f64]);
        let wave = (i * std::f64::consts::TAU).cos() + (j * std::f64::consts::TAU).cos();
        exemplar.data[2 * p] = wave as f32 + 0.4 * hash.unit_f32(p as u64);
    }
    exemplar
}

struct Turned(Jacobian);

impl Inputs for Turned {
    type Stop = ();
    fn jacobians(&self, _: &Region) -> Result<Option<Jacobians>, ()> {
        Ok(Some(Jacobians::Constant(self.0)))
    }
}

#[test]
fn a_turned_lattice_that_must_fit_keeps_its_phase_everywhere() {
    let basis = Basis { a: [13.3, 0.4], b: [-0.3, 11.6] };
    let exemplar = near_regular(basis);
    let levels = analysed(&exemplar);
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide: &[], picture: None };
    for (size, angle) in [([160, 144], 0.65f32), ([97, 110], -0.3), ([130, 130], 2.2)] {
        let j = from_angle_scale(angle, 1.0, 1.0);
        let sides = size.map(|n| n as f64);
        let wide = j.map(f64::from);
        let m = fit(basis, [[wide[0], wide[1]], [wide[2], wide[3]]], sides, [true; 2]).map;
        let settings = Settings { start: Start::Lattice(basis), jitter: 0.0, ..settings(false) };
        let output = Output { start: [0, 0], size, wrap: [true; 2] };
        let coords = run(&analysed, &output, &settings, &Turned(j)).expect("nothing stops it").coords;
        let off = |(p, at): (usize, &Position)| {
            let (x, y) = ((p % size[0]) as f64 + 0.5, (p / size[0]) as f64 + 0.5);
            let step = [m[0][0] * x + m[0][1] * y, m[1][0] * x + m[1][1] * y];
            let c = basis.coordinates([f64::from(at[0]) - step[0], f64::from(at[1]) - step[1]]);
            let off = basis.at(c[0] - c[0].round(), c[1] - c[1].round());
            off[0].hypot(off[1])
        };
        let mean = coords.iter().enumerate().map(off).sum::<f64>() / coords.len() as f64;
        // Without bending it would be a third of a pixel.
        assert!(mean < 0.1, "{size:?}: out of phase by {mean:.3} pixels");
    }
}

#[test]
fn continues_across_wrapping_sides_as_well_as_inside() {
    let basis = Basis { a: [13.3, 0.4], b: [-0.3, 11.6] };
    let near_regular = near_regular(basis);
    let turned: fn(f64, f64) -> Jacobian = |_, _| from_angle_scale(0.6, 1.0, 1.0);
    for (exemplar, start, jacobian) in [
        (lumps(64, 64, false), Start::Random, None),
        (lumps(64, 64, false), Start::Random, Some(turned)),
        (near_regular, Start::Lattice(basis), None),
    ] {
        let levels = analysed(&exemplar);
        let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide: &[], picture: None };
        // A whole number of the coarsest pixels, or not; neither is a whole number of periods.
        for (size, most) in [([208, 192], 1.2), ([203, 190], 1.7)] {
            let output = Output { start: [0, 0], size, wrap: [true; 2] };
            let (mut joint, mut mean) = (0.0, 0.0);
            for seed in 0..12 {
                let settings = Settings { start, jitter: 0.0, hash: Hash::new(seed), ..settings(false) };
                let inputs = Plain { jacobian, ..Plain::default() };
                let coords = run(&analysed, &output, &settings, &inputs).expect("nothing stops it").coords;
                let j = jacobian.map_or([1.0, 0.0, 0.0, 1.0], |j| j(0.0, 0.0));
                let (here, all) = breaks(&coords, size, j);
                (joint, mean) = (joint + here / 12.0, mean + all / 12.0);
            }
            println!("{start:?} {size:?}: {joint:.3} where sides join, {mean:.3} anywhere");
            assert!(joint < most * mean, "{start:?} {size:?}: {joint:.3} where sides join, {mean:.3} anywhere");
        }
    }
}

/// Share of steps at which the exemplar does not continue, within `near` columns and rows of wrapping sides, and
/// anywhere.
fn ends(coords: &[Position], [w, h]: [usize; 2], near: usize) -> (f64, f64) {
    let broken = |a: Position, b: Position, step: Position| a[0] + step[0] != b[0] || a[1] + step[1] != b[1];
    let at = |x: usize, y: usize| coords[y % h * w + x % w];
    let beside = |k: usize, n: usize| k.min(n - 1 - k) < near;
    let (mut here, mut all, mut pixels) = (0, 0, 0);
    for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
        let own = at(x, y);
        let n = i32::from(broken(own, at(x + 1, y), [1.0, 0.0])) + i32::from(broken(own, at(x, y + 1), [0.0, 1.0]));
        all += n;
        if beside(x, w) || beside(y, h) {
            (here, pixels) = (here + n, pixels + 1);
        }
    }
    (f64::from(here) / f64::from(pixels), f64::from(all) / (w * h) as f64)
}

/// With even use by tiles, more pieces end where tiles meet; so wrapping sides must lie inside tiles.
#[test]
fn keeps_tile_borders_off_wrapping_sides() {
    let exemplar = lumps(64, 64, false);
    let levels = analysed(&exemplar);
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide: &[], picture: None };
    let output = Output { start: [0, 0], size: [256, 256], wrap: [true; 2] };
    let (mut joint, mut mean) = (0.0, 0.0);
    for seed in 0..24 {
        let even = Some(EvenUse { amount: 1.0, tile: Some(64), halved: false });
        let settings = Settings { even, jitter: 0.0, kappa: 2.5, hash: Hash::new(seed), ..settings(true) };
        let coords = run(&analysed, &output, &settings, &Plain::default()).expect("nothing stops it").coords;
        let (here, all) = ends(&coords, output.size, 6);
        (joint, mean) = (joint + here / 24.0, mean + all / 24.0);
    }
    println!("{joint:.4} near where sides join, {mean:.4} anywhere");
    assert!(joint < mean, "{joint:.4} near where sides join, {mean:.4} anywhere");
}

/// A result that may begin at any pixel begins where fewer pieces end, and fills the same plane as one with a fixed
/// origin.
#[test]
fn places_origin_where_pieces_continue() {
    let exemplar = lumps(64, 64, false);
    let levels = analysed(&exemplar);
    let analysed = Analysed { plane: exemplar.plane, levels: &levels, usable: &[], guide: &[], picture: None };
    let output = Output { start: [0, 0], size: [203, 160], wrap: [true; 2] };
    for seed in 0..12 {
        let made = |adrift: bool, wrap: [bool; 2]| {
            let settings = Settings { jitter: 0.0, adrift, hash: Hash::new(seed), ..settings(false) };
            run(&analysed, &Output { wrap, ..output }, &settings, &Plain::default()).expect("nothing stops it").coords
        };
        let (open, still) = (made(true, [true; 2]), made(false, [true; 2]));
        let (here, all) = ends(&open, output.size, 4);
        assert!(here < 0.9 * all, "seed {seed}: {here:.3} near where sides join, {all:.3} anywhere");
        let begins = (0..203 * 160).filter(|p| still[*p] == open[0]).any(|p| {
            (0..203 * 160).all(|k| still[(p / 203 + k / 203) % 160 * 203 + (p % 203 + k % 203) % 203] == open[k])
        });
        assert!(begins, "seed {seed}: another plane");
        // Windows of a result that does not wrap stay parts of larger ones.
        assert_eq!(made(true, [true, false]), made(false, [true, false]));
    }
}
