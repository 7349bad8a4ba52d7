//! Profiles of edges: the course of a height from 0 to 1.

use crate::ground::math::{max, saturate};
use crate::ground::simd;
use shibo_macros::choice;

/// The shape of an edge, from its foot to its top.
#[choice]
pub enum Profile {
    /// A quarter of a circle: steep at the foot, level at the top
    #[default]
    Round,
    /// A straight slope: a chamfer
    Linear,
    /// Level at both ends
    Smooth,
    /// A hollow quarter of a circle: level at the foot, steep at the top
    Cove,
}

/// out = height · profile(a·distance + b), the argument limited to 0..1.
///
/// # Panics
/// If the slices differ in length.
pub fn apply(profile: Profile, distance: &[f32], [a, b]: [f32; 2], height: f32, out: &mut [f32]) {
    assert!(distance.len() == out.len(), "one height per distance");
    let run = |d: f32| saturate(a * d + b);
    simd::dispatch(
        #[inline(always)]
        || {
            let distances = out.iter_mut().zip(distance);
            match profile {
                Profile::Linear => distances.for_each(|(out, d)| *out = height * run(*d)),
                Profile::Smooth => distances.for_each(|(out, d)| *out = height * smooth(run(*d))),
                Profile::Round => distances.for_each(|(out, d)| *out = height * round(run(*d))),
                Profile::Cove => distances.for_each(|(out, d)| *out = height * cove(run(*d))),
            }
        },
    );
}

/// Number of samples averaged across a pixel.
const PLACES: usize = 8;

/// The height of a ridge, averaged over a pixel of `width`, so that a small picture is the average of a large one: out
/// is the mean of height · profile(1 − |a·d + b|) for d within half a pixel of each distance. Distances of `reach` or
/// more are outside, where it is 0.
///
/// # Panics
/// If the slices differ in length.
pub fn ridge(
    profile: Profile,
    distance: &[f32],
    [a, b]: [f32; 2],
    (width, reach): (f32, f32),
    height: f32,
    out: &mut [f32],
) {
    assert!(distance.len() == out.len(), "one height per distance");
    simd::dispatch(
        #[inline(always)]
        || match profile {
            Profile::Linear => averaged(distance, [a, b], (width, reach), height, out, |t| t),
            Profile::Smooth => averaged(distance, [a, b], (width, reach), height, out, smooth),
            Profile::Round => averaged(distance, [a, b], (width, reach), height, out, round),
            Profile::Cove => averaged(distance, [a, b], (width, reach), height, out, cove),
        },
    );
}

#[inline(always)]
fn averaged(
    distance: &[f32],
    [a, b]: [f32; 2],
    (width, reach): (f32, f32),
    height: f32,
    out: &mut [f32],
    profile: impl Fn(f32) -> f32,
) {
    let step = a * width / PLACES as f32;
    let first = -0.5 * (PLACES as f32 - 1.0) * step;
    let scale = height / PLACES as f32;
    for (out, d) in out.iter_mut().zip(distance) {
        let t = a * d + b + first;
        let mut sum = 0.0;
        for k in 0..PLACES {
            sum += profile(saturate(1.0 - (t + k as f32 * step).abs()));
        }
        *out = if d.abs() < reach { scale * sum } else { 0.0 };
    }
}

#[inline(always)]
fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

#[inline(always)]
fn round(t: f32) -> f32 {
    max(t * (2.0 - t), 0.0).sqrt()
}

#[inline(always)]
fn cove(t: f32) -> f32 {
    1.0 - max(1.0 - t * t, 0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_shapes_of_profiles() {
        let distances = [-1.0, 0.0, 0.6, 1.0, 2.0, 5.0];
        let at = |profile, line| {
            let mut out = [9.0; 6];
            apply(profile, &distances, line, 10.0, &mut out);
            out
        };
        // Points of circles, by (3, 4, 5) triangles.
        for (profile, want) in
            [(Profile::Linear, 3.0), (Profile::Smooth, 2.16), (Profile::Round, 7.141_428), (Profile::Cove, 0.460_608)]
        {
            let out = at(profile, [0.5, 0.0]);
            assert!((out[2] - want).abs() < 1e-4, "{profile:?} {out:?}");
            assert_eq!((out[0], out[1], out[4], out[5]), (0.0, 0.0, 10.0, 10.0));
        }
    }

    #[test]
    fn ridges_are_averaged_over_a_pixel() {
        let ridge = |distances: &[f32], line, pixel| {
            let mut out = vec![9.0; distances.len()];
            ridge(Profile::Linear, distances, line, pixel, 10.0, &mut out);
            out
        };
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        // A ridge from 0 to 2 with its top at 1, under pixels of width 0.
        let sharp = ridge(&[-1.0, 0.0, 0.6, 1.0, 2.0, 5.0], [1.0, -1.0], (0.0, 4.0));
        assert!(near(&sharp, &[0.0, 0.0, 6.0, 10.0, 0.0, 0.0]), "{sharp:?}");
        // A ridge from -1 to 1 under pixels of 0.4: a tenth lower at the top; a twentieth is left at the foot.
        let soft = ridge(&[0.0, 0.5, 1.0, 1.2, 5.0], [1.0, 0.0], (0.4, 1.25));
        assert!(near(&soft, &[9.0, 5.0, 0.5, 0.0, 0.0]), "{soft:?}");
    }
}
