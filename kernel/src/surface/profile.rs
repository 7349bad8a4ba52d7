//! Profiles of edges: how a height runs from 0 to 1.

use crate::ground::math::{max, saturate};
use crate::ground::simd;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The shape of an edge, from its foot to its top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

/// out = height · profile(a·distance + b), the argument limited to 0..1. With `mirror` it is that of 1 − |a·distance + b|.
///
/// # Panics
/// If the slices differ in length.
pub fn apply(profile: Profile, distance: &[f32], [a, b]: [f32; 2], mirror: bool, height: f32, out: &mut [f32]) {
    assert!(distance.len() == out.len(), "one height per distance");
    let run = |d: f32| {
        let t = a * d + b;
        saturate(if mirror { 1.0 - t.abs() } else { t })
    };
    simd::dispatch(
        #[inline(always)]
        || {
            let distances = out.iter_mut().zip(distance);
            match profile {
                Profile::Linear => distances.for_each(|(out, d)| *out = height * run(*d)),
                Profile::Smooth => distances.for_each(|(out, d)| {
                    let t = run(*d);
                    *out = height * (t * t * (3.0 - 2.0 * t));
                }),
                Profile::Round => distances.for_each(|(out, d)| {
                    let t = run(*d);
                    *out = height * max(t * (2.0 - t), 0.0).sqrt();
                }),
                Profile::Cove => distances.for_each(|(out, d)| {
                    let t = run(*d);
                    *out = height * (1.0 - max(1.0 - t * t, 0.0).sqrt());
                }),
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_what_their_names_say() {
        let distances = [-1.0, 0.0, 0.6, 1.0, 2.0, 5.0];
        let at = |profile, line, mirror| {
            let mut out = [9.0; 6];
            apply(profile, &distances, line, mirror, 10.0, &mut out);
            out
        };
        // Circles through (3, 4, 5) triangles.
        for (profile, want) in
            [(Profile::Linear, 3.0), (Profile::Smooth, 2.16), (Profile::Round, 7.141_428), (Profile::Cove, 0.460_608)]
        {
            let out = at(profile, [0.5, 0.0], false);
            assert!((out[2] - want).abs() < 1e-4, "{profile:?} {out:?}");
            assert_eq!((out[0], out[1], out[4], out[5]), (0.0, 0.0, 10.0, 10.0));
        }
        // A ridge from 0 to 2 with its top at 1.
        let ridge = at(Profile::Linear, [1.0, -1.0], true);
        assert!(ridge.iter().zip([0.0, 0.0, 6.0, 10.0, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-5), "{ridge:?}");
    }
}
