//! Compares formulas with kernels that compute the same.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::super::blend::{BlendMode, blend};
use super::super::color::{ColorSpace, convert};
use super::Machine;
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use proptest::prelude::*;
use shibo_value::expression::{Compiled, Meaning, Names, compile, of_piece};
use std::sync::Arc;

/// Two colours `c` and `d`, two numbers `s` and `t`, and pieces.
struct Planes;

impl Names for Planes {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        Some(match name {
            "c" => Meaning::Planes { first: 0, count: 3 },
            "d" => Meaning::Planes { first: 3, count: 3 },
            "s" => Meaning::Planes { first: 6, count: 1 },
            "t" => Meaning::Planes { first: 7, count: 1 },
            "piece" => Meaning::Ids { plane: 6 },
            _ => return None,
        })
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(3)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(1000 + seed)
    }
}

fn compiled(text: &str) -> Compiled {
    compile(text, &mut Planes).unwrap_or_else(|faults| panic!("{text}: {faults:?}"))
}

/// The planes of the result of a program.
fn result(compiled: &Compiled, planes: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let program = compiled.program(&|_| [Some(0.0); 2], [false; 2]).unwrap();
    let read: Vec<&[f32]> = program.planes.iter().map(|plane| planes[*plane].as_slice()).collect();
    let mut out = vec![vec![7.0; planes[0].len()]; compiled.components()];
    let mut slices: Vec<&mut [f32]> = out.iter_mut().map(Vec::as_mut_slice).collect();
    Machine::new(&program).run(&read, &mut slices);
    out
}

fn formula(text: &str, planes: &[Vec<f32>]) -> Vec<Vec<f32>> {
    result(&compiled(text), planes)
}

/// All pairs of values in two planes, followed by others.
fn pairs() -> Vec<Vec<f32>> {
    let values = [-2.5_f32, -0.4, 0.0, 0.02, 0.2, 0.25, 0.5, 0.75, 0.9, 1.0, 1.75, 3.0];
    let all: Vec<(f32, f32)> = values.iter().flat_map(|a| values.map(|b| (*a, b))).collect();
    let (a, b): (Vec<f32>, Vec<f32>) = all.into_iter().unzip();
    let other: Vec<f32> = a.iter().zip(&b).map(|(a, b)| 0.3 * a - 0.2 * b).collect();
    [&a, &b, &other, &b, &other, &a, &a, &b].map(Vec::clone).into()
}

fn bits(plane: &[f32]) -> Vec<u32> {
    plane.iter().map(|value| (value + 0.0).to_bits()).collect()
}

#[test]
fn converts_colours_as_the_node_does() {
    let planes = pairs();
    for (text, from, to) in [
        ("oklab(c)", ColorSpace::Linear, ColorSpace::Oklab),
        ("from_oklab(c)", ColorSpace::Oklab, ColorSpace::Linear),
        ("hsv(c)", ColorSpace::Linear, ColorSpace::Hsv),
        ("from_hsv(c)", ColorSpace::Hsv, ColorSpace::Linear),
        ("from_hsv(c * (360, 1, 1))", ColorSpace::Hsv, ColorSpace::Linear),
        ("srgb(c)", ColorSpace::Linear, ColorSpace::Srgb),
        ("from_srgb(c)", ColorSpace::Srgb, ColorSpace::Linear),
    ] {
        let turned: Vec<f32> =
            planes[0].iter().map(|hue| if text.contains("360") { hue * 360.0 } else { *hue }).collect();
        let mut expected = vec![vec![0.0; turned.len()]; 3];
        let [r, g, b] = &mut expected[..] else { unreachable!() };
        convert(from, to, [&turned, &planes[1], &planes[2]], [r, g, b]);
        for (found, expected) in formula(text, &planes).concat().iter().zip(expected.concat()) {
            assert!((found - expected).abs() <= 1e-6 * (1.0 + expected.abs()), "{text}: {found}, not {expected}");
        }
    }
}

#[test]
fn blends_as_the_node_does() {
    let planes = pairs();
    for (name, mode) in [
        ("multiply", BlendMode::Multiply),
        ("screen", BlendMode::Screen),
        ("overlay", BlendMode::Overlay),
        ("soft_light", BlendMode::SoftLight),
        ("darken", BlendMode::Darken),
        ("lighten", BlendMode::Lighten),
    ] {
        let mut expected = vec![0.0; planes[6].len()];
        blend(mode, &planes[6], &planes[7], None, 1.0, &mut expected);
        assert_eq!(bits(&formula(&format!("{name}(s, t)"), &planes)[0]), bits(&expected), "{name}");
    }
}

#[test]
fn numbers_of_pieces_are_those_of_the_stream() {
    let mut planes = pairs();
    let pieces: Vec<i16> = (0..).step_by(7).map(|piece| piece - 20).take(planes[6].len()).collect();
    planes[6] = pieces.iter().map(|piece| f32::from(*piece)).collect();
    let hash = Hash::new(1005);
    let expected = |piece: &i16| narrow(hash.with(i64::from(*piece).cast_unsigned()).unit(0));
    let expected: Vec<f32> = pieces.iter().map(expected).collect();
    assert_eq!(bits(&formula("random(piece, 2 + 3)", &planes)[0]), bits(&expected));
    assert_eq!(of_piece(1005, planes[6][9]), expected[9]);
}

#[test]
fn noise_in_space_fills_its_range() {
    let at: Vec<f32> = (0..40_000_i32).map(|i| (i % 200) as f32 * 0.37).collect();
    let across: Vec<f32> = (0..40_000_i32).map(|i| (i / 200) as f32 * 0.43).collect();
    let mut planes = vec![Vec::new(); 8];
    (planes[0], planes[6], planes[7]) = (at.clone(), at, across);
    let noise = &formula("noise(s, t, s * 0.13 + 0.5)", &planes)[0];
    let mean = noise.iter().sum::<f32>() / noise.len() as f32;
    assert!((mean - 0.5).abs() < 0.01, "{mean}");
    assert!(noise.iter().any(|value| *value < 0.15) && noise.iter().any(|value| *value > 0.85));
    assert_eq!(formula("noise(3, -5, 7)", &planes)[0][0], 0.5);
}

/// Formulas of one number that read `s` and `t`, or `c`.
const INNER: [&str; 8] = [
    "s + t",
    "s / t",
    "log(s)",
    "sin(360 * s) * t",
    "max(s, t)",
    "c.g / c.b",
    "random(s) + noise(s, t)",
    "if(s > t, s, 2)",
];
/// Formulas that read `c`, `s` and `t`.
const OUTER: [&str; 6] =
    ["s * t - c.r", "(s, t, s) * c", "sqrt(s) + log(t)", "if(s > t, c, s)", "s + s / t", "hash(s, t) * c.b"];

proptest! {
    #[test]
    fn fused_programs_have_the_bits_of_two_steps(
        outer in 0..OUTER.len(), inner in proptest::array::uniform2(0..INNER.len()), only_one: bool,
    ) {
        let planes = pairs();
        let inner = inner.map(|index| Arc::new(compiled(INNER[index])));
        let outer = compiled(OUTER[outer]);
        let replaced = |plane: usize| (6..if only_one { 7 } else { 8 }).contains(&plane);
        // Planes of inner programs follow those of the outer one.
        let fused = outer.fuse(
            &|plane| replaced(plane).then(|| (inner[plane - 6].clone(), 0)),
            &|outer, plane| if outer.is_some() { 8 + plane } else { plane },
        );
        let fused = fused.unwrap();
        let mut two = planes.clone();
        for plane in (6..8).filter(|plane| replaced(*plane)) {
            two[plane] = result(&inner[plane - 6], &planes).remove(0);
        }
        let all = [planes.clone(), planes].concat();
        prop_assert_eq!(bits(&result(&fused, &all).concat()), bits(&result(&outer, &two).concat()));
    }
}
