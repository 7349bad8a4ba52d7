//! Tests of the comparison of pictures.
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    reason = "tests fail by panicking, and samples are rounded"
)]
use super::*;
use shibo_picture::SampleKind;
use std::f64::consts::TAU;

/// Waves of several lengths in two directions, seen at a scale and a turn in degrees.
fn waves(scale: f64, turn: f64, contrast: f64, tint: f64) -> Picture {
    let side = 192_u32;
    let (sin, cos) = (libm::sin(turn.to_radians()), libm::cos(turn.to_radians()));
    let mut planes = vec![0.0; 3 * (side * side) as usize];
    for index in 0..side * side {
        let (x, y) = (f64::from(index % side), f64::from(index / side));
        // Turned counter-clockwise on the screen, where y grows downwards.
        let (u, v) = ((x * cos - y * sin) / scale, (x * sin + y * cos) / scale);
        let mut sum = 0.0;
        for k in 1..14 {
            let k = f64::from(k);
            let length = 5.0 + 2.3 * k;
            sum += libm::sin(u * TAU / length + 1.7 * k * k + 0.2 * libm::sin(v / 9.0))
                + 0.4 * libm::sin((v + 0.3 * u) * TAU / length + k * k);
        }
        let value = 0.5 + contrast * sum / 14.0;
        for channel in 0..3_u32 {
            let shown = value + if channel == 0 { tint } else { 0.0 };
            planes[(channel * side * side + index) as usize] = shown.clamp(0.0, 1.0) as f32;
        }
    }
    let names = ["R", "G", "B"].map(str::to_owned).to_vec();
    Picture { width: side, height: side, channels: 3, planes, source: SampleKind::U8, names, has_alpha: false }
}

fn compared(a: &Picture, b: &Picture) -> Comparison {
    compare(a, b, &CompareRequest::default()).unwrap()
}

#[test]
fn equal_pictures_have_no_difference() {
    let picture = waves(1.0, 0.0, 0.5, 0.0);
    let found = compared(&picture, &picture);
    assert!(found.distance < 1e-9 && found.floor.unwrap() > 0.0, "{found:?}");
    assert_eq!(found.words, ["no difference that one would see"]);
    let flat = waves(1.0, 0.0, 0.0, 0.0);
    let found = compared(&flat, &flat);
    assert_eq!((found.size, found.turn, found.contrast), (None, None, None));
}

#[test]
fn measures_size_turn_contrast_and_color() {
    let base = waves(1.0, 0.0, 0.5, 0.0);
    let coarse = compared(&waves(1.3, 0.0, 0.5, 0.0), &base);
    assert!((coarse.size.unwrap().value - 1.3).abs() < 0.12, "{coarse:?}");
    let turned = compared(&waves(1.0, 20.0, 0.5, 0.0), &base);
    assert!((turned.turn.unwrap().value - 20.0).abs() < 4.0, "{turned:?}");
    assert!(turned.words.iter().any(|words| words.contains("counter-clockwise")), "{turned:?}");
    let flat = compared(&waves(1.0, 0.0, 0.3, 0.1), &base);
    assert!((flat.contrast.unwrap().value - 0.6).abs() < 0.05, "{flat:?}");
    assert!(flat.words.iter().any(|words| words.contains("red")), "{flat:?}");
}

#[test]
fn refuses_small_pictures_and_wrong_widths() {
    let picture = waves(1.0, 0.0, 0.5, 0.0);
    let small = Picture { width: 16, height: 16, planes: vec![0.5; 768], ..picture.clone() };
    assert!(
        compare(&small, &picture, &CompareRequest { width_mm_a: Some(1.0), width_mm_b: Some(12.0) })
            .unwrap_err()
            .contains("at least 32")
    );
    assert!(compare(&picture, &picture, &CompareRequest { width_mm_a: Some(f64::NAN), width_mm_b: None }).is_err());
}
