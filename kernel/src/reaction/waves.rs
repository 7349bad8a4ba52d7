//! Tests that patterns have the wanted waves.
use super::regime::{Regime, natural};
use super::*;
use crate::ground::stop::NEVER;
use rustfft::FftPlannerScalar;
use rustfft::num_complex::Complex64;

/// A pattern on 64 × 64 mm, read at `side` × `side` pixels.
fn picture(reaction: &Reaction, local: Local, seed: u64, side: usize) -> Vec<f64> {
    let spline = reaction.grow(false, |_| local, Hash::new(seed), NEVER).unwrap();
    let at = |k: usize| ((k as f64 + 0.5) / side as f64) * reaction.size.x;
    (0..side * side).map(|k| f64::from(spline.at(DVec2::new(at(k % side), at(k / side))))).collect()
}

/// Length of a wave as a share of the side: the mean wave number of the spectrum between 0.6 and 1.5 times its peak.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wave numbers are small")]
fn length(picture: &[f64], side: usize) -> f64 {
    let mean = picture.iter().sum::<f64>() / picture.len() as f64;
    let mut data: Vec<Complex64> = picture.iter().map(|v| Complex64::new(v - mean, 0.0)).collect();
    let fft = FftPlannerScalar::new().plan_fft_forward(side);
    for _ in 0..2 {
        data.chunks_exact_mut(side).for_each(|row| fft.process(row));
        data = (0..side * side).map(|k| data[(k % side) * side + k / side]).collect();
    }
    let signed = |k: usize| if 2 * k < side { k as f64 } else { k as f64 - side as f64 };
    let number = |k: usize| signed(k % side).hypot(signed(k / side));
    let mut rings = vec![0.0; side];
    data.iter().enumerate().for_each(|(k, c)| rings[number(k) as usize] += c.norm_sqr());
    let smooth = |k: usize| rings[k - 2] + 2.0 * rings[k - 1] + 3.0 * rings[k] + 2.0 * rings[k + 1] + rings[k + 2];
    let peak = (3..side / 3).max_by(|a, b| smooth(*a).total_cmp(&smooth(*b))).unwrap() as f64 + 0.5;
    let (mut sum, mut power) = (0.0, 0.0);
    for (k, c) in data.iter().enumerate() {
        if (0.6 * peak..1.5 * peak).contains(&number(k)) {
            (sum, power) = (sum + number(k) * c.norm_sqr(), power + c.norm_sqr());
        }
    }
    power / sum
}

fn pattern(regime: Regime, wave: f64) -> (Reaction, Local) {
    let (feed, kill) = regime.rates();
    let size = DVec2::splat(64.0);
    let reaction = Reaction { size, wave, natural: regime.natural(), anisotropy: 0.0, time: SETTLED };
    (reaction, Local { feed, kill, scale: 1.0, along: DVec2::X, open: 1.0, starts: true })
}

#[test]
fn waves_have_the_wanted_length_at_any_resolution() {
    for regime in [Regime::Holes, Regime::Maze, Regime::Spots] {
        let (reaction, local) = pattern(regime, 2.9);
        let lengths = [128, 256, 512].map(|side| 64.0 * length(&picture(&reaction, local, 1, side), side));
        assert!(lengths.iter().all(|l| (l / 2.9 - 1.0).abs() < 0.02), "{regime:?} {lengths:?}");
    }
}

#[test]
fn waves_do_not_depend_on_the_seed() {
    let (reaction, local) = pattern(Regime::Coral, 3.3);
    let lengths = [2, 3, 4].map(|seed| 64.0 * length(&picture(&reaction, local, seed, 128), 128));
    assert!(lengths.iter().all(|l| (l / 3.3 - 1.0).abs() < 0.02), "{lengths:?}");
}

#[test]
fn rates_between_the_patterns_have_nearly_the_wanted_length() {
    for (feed, kill) in [(0.026, 0.056), (0.05, 0.0625), (0.038, 0.062)] {
        let (reaction, local) = pattern(Regime::Maze, 3.0);
        let reaction = Reaction { natural: natural(feed, kill), ..reaction };
        let length = 64.0 * length(&picture(&reaction, Local { feed, kill, ..local }, 1, 128), 128);
        assert!((length / 3.0 - 1.0).abs() < 0.06, "{feed} {kill} {length}");
    }
}

#[test]
fn stripes_follow_the_direction() {
    let (reaction, local) = pattern(Regime::Maze, 4.0);
    let reaction = Reaction { anisotropy: 0.5, natural: Regime::Maze.directed(0.5), ..reaction };
    // Stripes along x first. A whole number of them fits the area, so the length is that of 16 or 17 stripes.
    let length = 64.0 * length(&picture(&reaction, local, 1, 128), 128);
    assert!((length / 4.0 - 1.0).abs() < 0.05, "{length}");
    let along = DVec2::new(0.8, 0.6);
    let spline = reaction.grow(false, |_| Local { along, ..local }, Hash::new(1), NEVER).unwrap();
    let change = |step: DVec2| {
        let at = |k: u32| DVec2::new(f64::from(k % 40), f64::from(k / 40)) * 1.6;
        (0..1600).map(|k| (spline.at(at(k) + step) - spline.at(at(k))).powi(2)).sum::<f32>()
    };
    let (along, across) = (change(along), change(along.perp()));
    assert!(across > 8.0 * along, "{along} {across}");
}
