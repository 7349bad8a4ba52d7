//! Curves through points: tone curves, profiles.
//!
//! A curve is a sum of sections. Each section rises from 0 to its own height while x passes through it, and is constant
//! outside. So the curve needs no table and no search: it is exact at its points, at any distance between them, and
//! processes eight pixels at a time. Smooth curves are the monotone cubics of F. Fritsch and R. Carlson (1980), with
//! the harmonic mean of neighbouring slopes: between two points they never leave the range of these two.

use super::tone::inverse;
use crate::ground::math::saturate;
use crate::ground::simd;
use shibo_macros::choice;

/// The interpolation between points.
#[choice]
pub enum CurveKind {
    /// A smooth curve that never overshoots its points.
    #[default]
    Smooth,
    /// Straight lines.
    Linear,
}

/// A curve through points, constant before the first and after the last.
#[derive(Clone, Debug)]
pub struct Curve {
    first: f32,
    sections: Vec<Section>,
    kind: CurveKind,
}

/// The part of the curve between two points.
#[derive(Clone, Copy, Debug)]
struct Section {
    start: f32,
    scale: f32,
    rise: f32,
    /// The slopes at both ends, times the length.
    bend: [f32; 2],
}

impl Curve {
    /// The curve through `points` (x, y) with x ascending; two points at one x make a step. Without points it is the
    /// identity on 0..1.
    #[expect(clippy::cast_possible_truncation, reason = "curves need no more than f32")]
    pub fn new(points: &[(f64, f64)], kind: CurveKind) -> Self {
        let points = if points.is_empty() { &[(0.0, 0.0), (1.0, 1.0)] } else { points };
        let slopes = monotone_slopes(points);
        let sections = points.windows(2).zip(slopes.windows(2)).map(|(p, m)| {
            let length = p[1].0 - p[0].0;
            let bend = if length > LEAST { [m[0] * length, m[1] * length] } else { [0.0; 2] };
            Section {
                start: p[0].0 as f32,
                scale: inverse(length as f32),
                rise: (p[1].1 - p[0].1) as f32,
                bend: bend.map(|b| b as f32),
            }
        });
        Self { first: points[0].1 as f32, sections: sections.collect(), kind }
    }

    /// Applies the curve.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn apply(&self, input: &[f32], out: &mut [f32]) {
        assert!(input.len() == out.len(), "one result per value");
        simd::dispatch(
            #[inline(always)]
            || match self.kind {
                CurveKind::Smooth => self.fill::<true>(input, out),
                CurveKind::Linear => self.fill::<false>(input, out),
            },
        );
    }

    #[inline(always)]
    fn fill<const SMOOTH: bool>(&self, input: &[f32], out: &mut [f32]) {
        const BLOCK: usize = 64;
        for (input, out) in input.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            let (mut x, mut y) = ([0.0; BLOCK], [self.first; BLOCK]);
            x[..input.len()].copy_from_slice(input);
            for Section { start, scale, rise, bend: [a, b] } in &self.sections {
                for (y, x) in y.iter_mut().zip(&x) {
                    let t = saturate((x - start) * scale);
                    if SMOOTH {
                        let u = 1.0 - t;
                        *y += rise * (t * t * (3.0 - 2.0 * t)) + t * u * (a * u - b * t);
                    } else {
                        *y += rise * t;
                    }
                }
            }
            out.copy_from_slice(&y[..out.len()]);
        }
    }
}

/// Points closer than this make a step.
const LEAST: f64 = 1e-12;

fn monotone_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let secant: Vec<f64> = points.windows(2).map(|p| (p[1].1 - p[0].1) / (p[1].0 - p[0].0).max(LEAST)).collect();
    (0..points.len())
        .map(|k| {
            let before = if k > 0 { secant.get(k - 1) } else { secant.first() };
            let (a, b) = (before.copied().unwrap_or(0.0), secant.get(k).or(before).copied().unwrap_or(0.0));
            if a * b <= 0.0 { 0.0 } else { 2.0 * a * b / (a + b) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(curve: &Curve, x: f32) -> f32 {
        let mut out = [0.0];
        curve.apply(&[x], &mut out);
        out[0]
    }

    /// Cubic Hermite interpolation, from its four basis polynomials.
    fn hermite(t: f64, [y0, y1]: [f64; 2], [m0, m1]: [f64; 2]) -> f64 {
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * y0 + (t3 - 2.0 * t2 + t) * m0 + (3.0 * t2 - 2.0 * t3) * y1 + (t3 - t2) * m1
    }

    #[test]
    fn smooth_curves_are_the_cubics_of_fritsch_and_carlson() {
        let curve = Curve::new(&[(0.0, 0.0), (1.0, 1.0), (3.0, 2.0)], CurveKind::Smooth);
        // Slopes 1 and ½ meet in 2·1·½ / 1½ = ⅔; at the ends the slopes are those of the lines.
        for k in 0..=20u8 {
            let t = f64::from(k) / 20.0;
            #[expect(clippy::cast_possible_truncation, reason = "a test")]
            let (x, y) = (t as f32, (1.0 + 2.0 * t) as f32);
            assert!((f64::from(at(&curve, x)) - hermite(t, [0.0, 1.0], [1.0, 2.0 / 3.0])).abs() < 1e-6);
            assert!((f64::from(at(&curve, y)) - hermite(t, [1.0, 2.0], [4.0 / 3.0, 1.0])).abs() < 1e-6);
        }
        assert_eq!([at(&curve, -5.0), at(&curve, 9.0)], [0.0, 2.0]);
    }

    #[test]
    fn lines_and_steps() {
        let curve = Curve::new(&[(0.0, 1.0), (0.5, 0.0), (0.5, 4.0), (1.0, 2.0)], CurveKind::Linear);
        let found = [0.0, 0.25, 0.5, 0.500_001, 0.75, 1.0].map(|x| at(&curve, x));
        for (got, want) in found.into_iter().zip([1.0, 0.5, 0.0, 4.0, 3.0, 2.0]) {
            assert!((got - want).abs() < 1e-4, "{found:?}");
        }
        let step = Curve::new(&[(0.5, 0.0), (0.5, 1.0)], CurveKind::Smooth);
        assert_eq!([at(&step, 0.5), at(&step, 0.6)], [0.0, 1.0]);
        let same = Curve::new(&[], CurveKind::Smooth);
        assert!((0..=10u8).map(|k| f32::from(k) / 10.0).all(|x| (at(&same, x) - x).abs() < 1e-6));
    }

    proptest! {
        #[test]
        fn curves_do_not_overshoot(y in proptest::collection::vec(0f64..1.0, 2..6)) {
            let points: Vec<(f64, f64)> = (0..).zip(&y).map(|(k, y)| (f64::from(k) / 4.0, *y)).collect();
            let curve = Curve::new(&points, CurveKind::Smooth);
            for pair in points.windows(2) {
                for k in 0..=10 {
                    let x = pair[0].0 + (pair[1].0 - pair[0].0) * f64::from(k) / 10.0;
                    #[expect(clippy::cast_possible_truncation, reason = "a test")]
                    let v = f64::from(at(&curve, x as f32));
                    let (low, high) = (pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1));
                    prop_assert!(v >= low - 1e-5 && v <= high + 1e-5, "{v} beyond {low}..{high}");
                }
            }
        }
    }
}
