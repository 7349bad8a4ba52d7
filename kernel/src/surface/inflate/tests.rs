use super::*;
use crate::ground::stop::NEVER;

/// The membrane over the region where `shape`, a signed distance or the like in mm, is positive; on 32 × 32 mm.
fn over(side: usize, wrap: [bool; 2], shape: impl Fn(f64, f64) -> f64) -> Vec<f32> {
    let step = 32.0 / side as f64;
    let at = |k: usize| (k as f64 + 0.5) * step;
    let field: Vec<f32> = (0..side * side).map(|k| narrow(0.5 + shape(at(k % side), at(k / side)))).collect();
    membrane(&field, side, 0.5, [step; 2], wrap, NEVER).unwrap()
}

/// The largest error at pixels, for the solution `want`, as a share of its largest value.
fn error(side: usize, got: &[f32], want: impl Fn(f64, f64) -> f64) -> f64 {
    let at = |k: usize| (k as f64 + 0.5) * 32.0 / side as f64;
    let most = (0..got.len()).map(|k| want(at(k % side), at(k / side))).fold(0.0, f64::max);
    let off = |k: usize| (f64::from(got[k]) - want(at(k % side), at(k / side)).max(0.0)).abs();
    (0..got.len()).map(off).fold(0.0, f64::max) / most
}

fn round(x: f64, y: f64) -> f64 {
    (x - 15.3).hypot(y - 16.4)
}

#[test]
fn a_disc_is_a_paraboloid_at_any_resolution() {
    for side in [64, 101, 256, 512] {
        let got = over(side, [false; 2], |x, y| 12.0 - round(x, y));
        let off = error(side, &got, |x, y| (144.0 - round(x, y).powi(2)) / 4.0);
        assert!(off < 0.005, "{side}: {off}");
        let small = over(side, [true; 2], |x, y| 2.0 - round(x, y));
        let off = error(side, &small, |x, y| (4.0 - round(x, y).powi(2)) / 4.0);
        assert!(off < 0.02, "{side}: {off}");
    }
}

#[test]
fn a_hard_edge_costs_little() {
    for side in [256, 512] {
        let got = over(side, [true; 2], |x, y| (12.0 - round(x, y)).signum());
        let off = error(side, &got, |x, y| (144.0 - round(x, y).powi(2)) / 4.0);
        assert!(off < 0.015, "{side}: {off}");
    }
}

#[test]
fn ellipses_and_rings_have_their_known_heights() {
    let (a, b) = (14.0, 6.0);
    let share = |x: f64, y: f64| 1.0 - ((x - 16.0) / a).powi(2) - ((y - 16.0) / b).powi(2);
    let got = over(256, [true; 2], share);
    let off = error(256, &got, |x, y| share(x, y) * a * a * b * b / (2.0 * (a * a + b * b)));
    assert!(off < 0.005, "{off}");
    // A ring from 4 to 12 mm: h = (c² − r²) / 4 + d ln(r / c) with both ends at 0.
    let d = (144.0 - 16.0) / (4.0 * 3.0f64.ln());
    let got = over(256, [true; 2], |x, y| 4.0 - (round(x, y) - 8.0).abs());
    let ring = |r: f64| (144.0 - r * r) / 4.0 + d * (r / 12.0).ln();
    let off = error(256, &got, |x, y| if (4.0..12.0).contains(&round(x, y)) { ring(round(x, y)) } else { 0.0 });
    assert!(off < 0.01, "{off}");
}

#[test]
fn a_square_has_the_known_height() {
    // The top of a square of side 1 is 0.0736714.
    for side in [64, 256] {
        let got = over(side, [true; 2], |x, y| 10.0 - (x - 16.0).abs().max((y - 16.0).abs()));
        let top = f64::from(got.iter().copied().fold(0.0, f32::max)) / 400.0;
        assert!((top / 0.073_671_4 - 1.0).abs() < 0.01, "{side}: {top}");
    }
}

#[test]
fn strips_run_over_edges() {
    // A strip across the picture: level at edges that do not repeat, the same where they repeat.
    for wrap in [[false, false], [true, false], [true, true]] {
        let got = over(90, wrap, |_, y| 5.0 - (y - 16.0).abs());
        assert!(error(90, &got, |_, y| (25.0 - (y - 16.0).powi(2)) / 2.0) < 0.005);
    }
    // A strip over the edge, cut there or going on.
    let got = over(90, [true, true], |_, y| 5.0 - y.min(32.0 - y));
    assert!(error(90, &got, |_, y| (25.0 - y.min(32.0 - y).powi(2)) / 2.0) < 0.005);
    let got = over(90, [true, false], |_, y| 5.0 - y);
    assert!(error(90, &got, |_, y| (25.0 - y * y) / 2.0) < 0.005);
}

#[test]
fn all_masks_are_solved_within_the_cycles() {
    let hash = crate::ground::hash::Hash::new(1);
    let masks: [&dyn Fn(usize, usize) -> bool; 5] = [
        &|x, y| (x, y) != (40, 50),
        &|x, y| x % 5 != 0 && y % 7 != 0,
        &|x, y| (x + y) % 2 == 0,
        &|x, y| hash.unit((x * 200 + y) as u64) < 0.7,
        &|x, y| (x / 3 + y / 9) % 4 != 0 || x == 0,
    ];
    for (number, mask) in masks.iter().enumerate() {
        for wrap in [[true; 2], [false, true]] {
            let (width, height) = (129, 96);
            let field: Vec<f32> =
                (0..width * height).map(|k| f32::from(u8::from(mask(k % width, k / width)))).collect();
            let fine = finest(&field, width, 0.5, [1.0, 0.7], wrap);
            let mut b = vec![0.0; fine.len()];
            for k in 0..field.len() {
                b[k / width * (width + 2) + k % width + 1] = field[k];
            }
            let mut all = storeys(fine.clone());
            let h = solve(&mut all, b.clone(), NEVER).unwrap();
            let mut left = b.clone();
            fine.residual(&h, &b, &mut left);
            let share = (dot(&fine, &left, &left) / dot(&fine, &b, &b)).sqrt();
            assert!(share < 0.01, "mask {number}: {share}");
        }
    }
}

#[test]
fn odd_input_gives_numbers() {
    for (field, width) in [
        (vec![], 4),
        (vec![1.0; 12], 4),
        (vec![0.0; 12], 3),
        (vec![1.0, 0.0], 2),
        (vec![1.0, 0.0, 1.0], 1),
        (vec![f32::NAN, 1.0, f32::INFINITY, f32::NEG_INFINITY, 0.7, 0.2], 3),
        (vec![f32::MAX, f32::MIN, 1e-40, 0.5], 2),
    ] {
        for wrap in [[true; 2], [false; 2]] {
            let got = membrane(&field, width, 0.5, [0.5, 0.25], wrap, NEVER).unwrap();
            assert!(got.len() == field.len() && got.iter().all(|h| h.is_finite() && *h >= 0.0), "{field:?}");
        }
    }
    assert!(membrane(&[1.0, 0.0], 2, 0.5, [1.0; 2], [true; 2], &|| true).is_none());
}

#[test]
fn threads_do_not_change_bits() {
    let one = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| over(150, [true; 2], |x, y| (x * 0.9).sin() + (y * 0.7).cos()))
    };
    assert_eq!(one(1), one(3));
}
