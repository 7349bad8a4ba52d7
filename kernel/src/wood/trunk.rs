//! The time at which a trunk reaches a point (Momoi & Takatera 2014, §3.3 and §3.5, eqs 8–13).
//!
//! The segment is found by comparing heights alone (§5.2); runs of points in the same segment are computed together, so
//! the number of nodes hardly matters. Cost: about 3 ns a point in single precision, a third of that for level rows.
use crate::ground::real::Real;
use crate::ground::simd::dispatch;
use glam::DVec3;

/// Arrangement of points in rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// Unknown.
    Any,
    /// Rows of this many points; rows with equal z share one lookup of the trunk.
    Of(usize),
    /// Rows of this many points; all points of a row have the same z.
    Level(usize),
}

/// Points, with one slice per coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Places<'a, R> {
    /// x in mm.
    pub x: &'a [R],
    /// y in mm.
    pub y: &'a [R],
    /// z in mm.
    pub z: &'a [R],
    /// Their arrangement.
    pub rows: Rows,
}

/// Speed of a trunk's growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Elongation in mm a year, `v_e`.
    pub elongation: f64,
    /// Thickening in mm a year, `v_h`.
    pub thickening: f64,
    /// The height from which the tree grows, in mm: z of eq (12) counts from here.
    pub ground: f64,
    /// Relative increase of thickening while the trunk is thin: `v = v_h (1 + boost · e^(-d / fade))`; 0 in the source.
    pub boost: f64,
    /// The radius in mm over which `boost` fades.
    pub fade: f64,
}

/// A segment as polynomials of t = (z - z0) · inverse.
#[derive(Clone, Copy, Debug)]
struct Segment<R> {
    low: R,
    high: R,
    z0: R,
    inverse: R,
    x: [R; 4],
    y: [R; 4],
}

/// A trunk, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Trunk<R> {
    /// The extended start, the segments, the extended end.
    segments: Vec<Segment<R>>,
}

/// Number of points computed between two searches for the segment.
const RUN: usize = 64;

impl<R: Real> Trunk<R> {
    /// From control points that are evenly spaced in z. Without segments, the trunk is the z axis.
    pub fn new(trunk: &[[DVec3; 4]]) -> Self {
        let cubic = |c: [f64; 4]| {
            [c[0], 3.0 * (c[1] - c[0]), 3.0 * (c[0] - 2.0 * c[1] + c[2]), c[3] - c[0] + 3.0 * (c[1] - c[2])].map(R::of)
        };
        let segment = |c: &[DVec3; 4]| Segment {
            low: R::of(c[0].z),
            high: R::of(c[3].z),
            z0: R::of(c[0].z),
            inverse: R::of(1.0 / (c[3].z - c[0].z)),
            x: cubic(c.map(|p| p.x)),
            y: cubic(c.map(|p| p.y)),
        };
        let straight = |at: DVec3, tangent: DVec3| Segment {
            low: -R::INFINITY,
            high: R::INFINITY,
            z0: R::of(at.z),
            inverse: R::ONE,
            x: [R::of(at.x), R::of(tangent.x / tangent.z), R::ZERO, R::ZERO],
            y: [R::of(at.y), R::of(tangent.y / tangent.z), R::ZERO, R::ZERO],
        };
        let (Some(first), Some(last)) = (trunk.first(), trunk.last()) else {
            return Self { segments: vec![straight(DVec3::ZERO, DVec3::Z)] };
        };
        let mut segments = vec![Segment { high: R::of(first[0].z), ..straight(first[0], first[1] - first[0]) }];
        segments.extend(trunk.iter().map(segment));
        segments.push(Segment { low: R::of(last[3].z), ..straight(last[3], last[3] - last[2]) });
        Self { segments }
    }

    /// The index of the segment with height `z`, starting from a guess.
    #[inline(always)]
    fn find(&self, z: R, guess: usize) -> usize {
        let near = &self.segments[guess];
        if z >= near.low && z < near.high {
            return guess;
        }
        let next = guess + 1;
        if next < self.segments.len() && z >= self.segments[next].low && z < self.segments[next].high {
            return next;
        }
        self.segments.partition_point(|s| s.high <= z).min(self.segments.len() - 1)
    }

    /// The trunk's skeleton at one height.
    #[inline(always)]
    pub fn axis_at(&self, z: R) -> [R; 2] {
        self.segments[self.find(z, 0)].point(z)
    }

    /// Horizontal shift of the skeleton in x and y per mm of height, for up to [`RUN`] heights.
    #[inline(always)]
    pub(super) fn lean(&self, z: &[R], lx: &mut [R; RUN], ly: &mut [R; RUN]) {
        let Some(&first) = z.first() else { return };
        let mut guess = self.find(first, 0);
        let segment = &self.segments[guess];
        if z.iter().fold(true, |whole, &z| whole & (z >= segment.low) & (z < segment.high)) {
            for ((z, lx), ly) in z.iter().zip(lx.iter_mut()).zip(ly.iter_mut()) {
                [*lx, *ly] = segment.lean(*z);
            }
            return;
        }
        for ((z, lx), ly) in z.iter().zip(lx.iter_mut()).zip(ly.iter_mut()) {
            guess = self.find(*z, guess);
            [*lx, *ly] = self.segments[guess].lean(*z);
        }
    }

    /// The trunk's skeleton at heights (eqs 8 and 9), at most [`RUN`] of them.
    #[inline(always)]
    fn axis(&self, z: &[R], guess: &mut usize, qx: &mut [R; RUN], qy: &mut [R; RUN]) {
        let Some(&first) = z.first() else { return };
        *guess = self.find(first, *guess);
        let segment = &self.segments[*guess];
        if z.iter().fold(true, |whole, &z| whole & (z >= segment.low) & (z < segment.high)) {
            for ((z, qx), qy) in z.iter().zip(qx.iter_mut()).zip(qy.iter_mut()) {
                [*qx, *qy] = segment.point(*z);
            }
            return;
        }
        for ((z, qx), qy) in z.iter().zip(qx.iter_mut()).zip(qy.iter_mut()) {
            *guess = self.find(*z, *guess);
            [*qx, *qy] = self.segments[*guess].point(*z);
        }
    }

    /// Calls `body(from, to, qx, qy)` for runs of points with the skeleton at their heights.
    #[inline(always)]
    pub fn runs(&self, at: &Places<'_, R>, mut body: impl FnMut(usize, usize, &[R; RUN], &[R; RUN])) {
        let (mut qx, mut qy) = ([R::ZERO; RUN], [R::ZERO; RUN]);
        let mut guess = 0;
        match at.rows {
            Rows::Level(columns) if columns > 0 => {
                for row in (0..at.z.len()).step_by(columns) {
                    guess = self.find(at.z[row], guess);
                    let [x, y] = self.segments[guess].point(at.z[row]);
                    (qx, qy) = ([x; RUN], [y; RUN]);
                    let end = (row + columns).min(at.z.len());
                    for from in (row..end).step_by(RUN) {
                        body(from, (from + RUN).min(end), &qx, &qy);
                    }
                }
            }
            Rows::Of(columns) if columns > 0 => {
                // On a board whose rows run along the trunk, all rows have the same heights.
                let mut line = vec![(qx, qy); columns.div_ceil(RUN)];
                for row in (0..at.z.len()).step_by(columns) {
                    let end = (row + columns).min(at.z.len());
                    for (from, (qx, qy)) in (row..end).step_by(RUN).zip(&mut line) {
                        let to = (from + RUN).min(end);
                        if row == 0 || at.z[from..to] != at.z[from - columns..to - columns] {
                            self.axis(&at.z[from..to], &mut guess, qx, qy);
                        }
                        body(from, to, qx, qy);
                    }
                }
            }
            _ => {
                for from in (0..at.z.len()).step_by(RUN) {
                    let to = (from + RUN).min(at.z.len());
                    self.axis(&at.z[from..to], &mut guess, &mut qx, &mut qy);
                    body(from, to, &qx, &qy);
                }
            }
        }
    }

    /// The horizontal distance from the skeleton (eq 10).
    pub fn distance(&self, at: &Places<'_, R>, out: &mut [R]) {
        dispatch(
            #[inline(always)]
            || {
                self.runs(
                    at,
                    #[inline(always)]
                    |from, to, qx, qy| {
                        let points = at.x[from..to].iter().zip(&at.y[from..to]);
                        for (((x, y), (qx, qy)), out) in points.zip(qx.iter().zip(qy)).zip(&mut out[from..to]) {
                            let (dx, dy) = (*x - *qx, *y - *qy);
                            *out = (dx * dx + dy * dy).sqrt();
                        }
                    },
                );
            },
        );
    }

    /// The time at which the trunk reaches the points, in years (eqs 10–13).
    pub fn time(&self, at: &Places<'_, R>, growth: &Growth, out: &mut [R]) {
        let rate = Rate::new(growth);
        dispatch(
            #[inline(always)]
            || {
                let (x, y, z) = (at.x, at.y, at.z);
                self.runs(
                    at,
                    #[inline(always)]
                    |from, to, qx, qy| {
                        let points = x[from..to].iter().zip(&y[from..to]).zip(&z[from..to]);
                        let axis = qx.iter().zip(qy);
                        if rate.boost > R::ZERO {
                            for ((((x, y), z), (qx, qy)), out) in points.zip(axis).zip(&mut out[from..to]) {
                                let (dx, dy) = (*x - *qx, *y - *qy);
                                *out = rate.height(*z) + rate.aged((dx * dx + dy * dy).sqrt());
                            }
                        } else {
                            for ((((x, y), z), (qx, qy)), out) in points.zip(axis).zip(&mut out[from..to]) {
                                let (dx, dy) = (*x - *qx, *y - *qy);
                                *out = rate.height(*z) + (dx * dx + dy * dy).sqrt() * rate.inverse_thickening;
                            }
                        }
                    },
                );
            },
        );
    }
}

impl<R: Real> Segment<R> {
    #[inline(always)]
    fn point(&self, z: R) -> [R; 2] {
        let t = (z - self.z0) * self.inverse;
        let at = |c: &[R; 4]| ((c[3] * t + c[2]) * t + c[1]) * t + c[0];
        [at(&self.x), at(&self.y)]
    }

    /// Horizontal shift of the skeleton per mm of height.
    #[inline(always)]
    fn lean(&self, z: R) -> [R; 2] {
        let t = (z - self.z0) * self.inverse;
        let (two, three) = (R::of(2.0), R::of(3.0));
        let at = |c: &[R; 4]| ((three * c[3] * t + two * c[2]) * t + c[1]) * self.inverse;
        [at(&self.x), at(&self.y)]
    }
}

/// [`Growth`] with reciprocals instead of divisors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rate<R> {
    ground: R,
    inverse_elongation: R,
    inverse_thickening: R,
    boost: R,
    inverse_fade: R,
    fade: R,
    inverse_sum: R,
}

impl<R: Real> Rate<R> {
    pub(crate) fn new(growth: &Growth) -> Self {
        Self {
            ground: R::of(growth.ground),
            inverse_elongation: R::of(1.0 / growth.elongation),
            inverse_thickening: R::of(1.0 / growth.thickening),
            boost: R::of(growth.boost),
            inverse_fade: R::of(1.0 / growth.fade),
            fade: R::of(growth.fade),
            inverse_sum: R::of(1.0 / (1.0 + growth.boost)),
        }
    }

    /// T_e (eq 12).
    #[inline(always)]
    pub(crate) fn height(&self, z: R) -> R {
        (z - self.ground) * self.inverse_elongation
    }

    /// T_h with a speed that falls with the radius: the integral of 1 / (v_h (1 + boost e^(-d / fade))).
    #[inline(always)]
    fn aged(&self, d: R) -> R {
        // ln((e^u + q) / (1 + q)) = u + ln((1 + q e^-u) / (1 + q)) never overflows.
        let faded = (-(d * self.inverse_fade)).exp();
        let less = ((R::ONE + self.boost * faded) * self.inverse_sum).ln();
        (d + self.fade * less) * self.inverse_thickening
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::fit::{Scheme, equalize, fit, point_at};

    fn trunk(n: usize) -> Vec<[DVec3; 4]> {
        let node = |i: usize| {
            let t = i as f64;
            DVec3::new(4.0 * (t * 1.1).sin(), 3.0 * (t * 0.7).cos(), 80.0 * t / (n - 1) as f64)
        };
        equalize(&fit(&(0..n).map(node).collect::<Vec<_>>(), Scheme::Natural).unwrap()).unwrap().0
    }

    const GROWTH: Growth = Growth { elongation: 2.0, thickening: 0.5, ground: 0.0, boost: 0.0, fade: 1.0 };

    #[test]
    fn agrees_on_times_in_all_row_layouts() {
        let trunk_points = trunk(9);
        let (single, double) = (Trunk::<f32>::new(&trunk_points), Trunk::<f64>::new(&trunk_points));
        let points: Vec<DVec3> = (0..700)
            .map(|i| DVec3::new(f64::from(i % 37) - 18.0, f64::from(i % 23) * 0.7 - 9.0, f64::from(i / 70) * 9.7 - 8.0))
            .collect();
        let axis = |a: usize| points.iter().map(|p| p[a]).collect::<Vec<f64>>();
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let mut out = vec![0.0; x.len()];
        double.time(&at, &GROWTH, &mut out);
        for (p, t) in points.iter().zip(&out) {
            let q = point_at(&trunk_points, p.z);
            let want = p.z / 2.0 + p.truncate().distance(q.truncate()) / 0.5;
            assert!((t - want).abs() < 1e-10, "{p}");
        }
        let mut level = vec![0.0; x.len()];
        double.time(&Places { rows: Rows::Level(70), ..at }, &GROWTH, &mut level);
        assert_eq!(level, out);
        // Rows of other lengths than the level ones have different heights; some are like the row before.
        for columns in [1, 10, 70, 100, 700] {
            let mut rows = vec![0.0; x.len()];
            double.time(&Places { rows: Rows::Of(columns), ..at }, &GROWTH, &mut rows);
            assert_eq!(rows, out, "{columns}");
        }
        let narrow = |v: &[f64]| v.iter().map(|&v| f32::of(v)).collect::<Vec<_>>();
        let (x, y, z) = (narrow(&x), narrow(&y), narrow(&z));
        let mut short = vec![0.0; x.len()];
        single.time(&Places { x: &x, y: &y, z: &z, rows: Rows::Any }, &GROWTH, &mut short);
        assert!(short.iter().zip(&out).all(|(a, b)| (f64::from(*a) - b).abs() < 2e-5));
    }

    #[test]
    fn ageing_trees_thicken_more_slowly() {
        let axis = Trunk::<f64>::new(&[]);
        let growth = Growth { boost: 0.6, fade: 25.0, thickening: 2.0, ..GROWTH };
        let x: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.1).collect();
        let none = vec![0.0; x.len()];
        let mut t = none.clone();
        axis.time(&Places { x: &x, y: &none, z: &none, rows: Rows::Any }, &growth, &mut t);
        for i in (1..x.len()).step_by(97) {
            let speed = 0.1 / (t[i] - t[i - 1]);
            let want = 2.0 * (1.0 + 0.6 * (-(x[i] - 0.05) / 25.0).exp());
            assert!((speed - want).abs() < 1e-5, "{speed} {want}");
        }
    }
}
