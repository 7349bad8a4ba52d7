//! The time at which branches reach a point, and the blending of times (Momoi & Takatera 2014, §3.6, eqs 14–18).
//!
//! θ of (15) is taken as the angle between the axis and the vector from b1 to the point: as printed, with b2, it would
//! always be 90°. Several branches are combined as 1/T² = 1/T1² + Σ 1/T2², which does not depend on their order.
//!
//! Cost: about 1.5 ns a point and branch in single precision.
use super::trunk::Places;
use crate::ground::real::Real;
use crate::ground::simd::dispatch;
use glam::DVec3;

/// A branch in the variables of the equations.
#[derive(Clone, Copy, Debug)]
pub struct Axis<R> {
    start: [R; 3],
    direction: [R; 3],
    length: R,
    /// T_α, the year of its birth (16).
    birth: R,
    inverse_elongation: R,
    inverse_thickening: R,
}

impl<R: Real> Axis<R> {
    /// A branch from `start` in `direction` (of length 1), born in the year `birth`.
    pub fn new(start: DVec3, direction: DVec3, length: f64, birth: f64, elongation: f64, thickening: f64) -> Self {
        Self {
            start: start.to_array().map(R::of),
            direction: direction.to_array().map(R::of),
            length: R::of(length),
            birth: R::of(birth),
            inverse_elongation: R::of(1.0 / elongation),
            inverse_thickening: R::of(1.0 / thickening),
        }
    }

    /// The vector from the branch's start to a point.
    #[inline(always)]
    fn way_from_start(&self, p: [R; 3]) -> [R; 3] {
        let b = self.start;
        [p[0] - b[0], p[1] - b[1], p[2] - b[2]]
    }

    /// Distance of a point along the branch's direction: 0 or less behind the plane F.
    #[inline(always)]
    fn along(&self, p: [R; 3]) -> R {
        let (v, u) = (self.way_from_start(p), self.direction);
        v[0] * u[0] + v[1] * u[1] + v[2] * u[2]
    }

    /// For a point at a distance along the branch: s, which the branch's length limits, and s · (T2 - T_α).
    #[inline(always)]
    fn way(&self, p: [R; 3], along: R) -> (R, R) {
        let (v, u) = (self.way_from_start(p), self.direction);
        let foot = along.smaller(self.length);
        let w = [v[0] - foot * u[0], v[1] - foot * u[1], v[2] - foot * u[2]];
        let r2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        // T_γ = r √(s² + r²) / (s v_b), so s T_γ = √(r² (r² + s²)) / v_b.
        let around = (r2 * (r2 + foot * foot)).sqrt() * self.inverse_thickening;
        (foot, foot * foot * self.inverse_elongation + around)
    }
}

/// Number of points computed together.
const RUN: usize = 64;

/// Calls `body(from, to, sums)` for runs of points with Σ T2^-2 over all branches, for eq (18) with several branches.
/// Loops over branches outside and over the points of a run inside, so that the inner loop is simple.
#[inline(always)]
fn inverse_squares<R: Real>(branches: &[Axis<R>], at: &Places<'_, R>, mut body: impl FnMut(usize, usize, &[R; RUN])) {
    for from in (0..at.x.len()).step_by(RUN) {
        let to = (from + RUN).min(at.x.len());
        let points = || at.x[from..to].iter().zip(&at.y[from..to]).zip(&at.z[from..to]);
        let mut sums = [R::ZERO; RUN];
        let mut along = [R::ZERO; RUN];
        for branch in branches {
            for (((x, y), z), along) in points().zip(&mut along) {
                *along = branch.along([*x, *y, *z]);
            }
            // Many runs lie completely behind the plane F of a branch, where it adds nothing.
            if !along[..to - from].iter().fold(false, |any, s| any | (*s > R::ZERO)) {
                continue;
            }
            for ((((x, y), z), along), sum) in points().zip(&along).zip(&mut sums) {
                let (s, way) = branch.way([*x, *y, *z], *along);
                let time = s * branch.birth + way;
                let reached = s > R::ZERO && time > R::ZERO;
                let inverse = s / if reached { time } else { R::ONE };
                let inverse = if reached { inverse } else { R::ZERO };
                *sum += inverse * inverse;
            }
        }
        body(from, to, &sums);
    }
}

/// The time at which branches reach points, combined as (Σ T2^-2)^(-1/2); infinite where none does.
pub fn branch_time<R: Real>(branches: &[Axis<R>], at: &Places<'_, R>, out: &mut [R]) {
    dispatch(
        #[inline(always)]
        || {
            inverse_squares(
                branches,
                at,
                #[inline(always)]
                |from, to, sums| {
                    for (out, sum) in out[from..to].iter_mut().zip(sums) {
                        let time = R::ONE / sum.sqrt();
                        *out = if *sum > R::ZERO { time } else { R::INFINITY };
                    }
                },
            );
        },
    );
}

/// (a^-k + b^-k)^(-1/k) of two times, `b` possibly infinite: eq (18) for k = 2, the minimum for k = ∞. If a time is 0
/// or less, returns the smaller one.
#[inline(always)]
pub fn blend<R: Real>(a: R, b: R, power: Power<R>) -> R {
    let (small, large) = (a.smaller(b), a.larger(b));
    let ratio = small / large;
    let ratio = if small > R::ZERO && large < R::INFINITY { ratio } else { R::ZERO };
    let square = ratio * ratio;
    match power {
        Power::Minimum => small,
        Power::Two => small / (R::ONE + square).sqrt(),
        Power::Four => small / (R::ONE + square * square).sqrt().sqrt(),
        Power::Other(k) => {
            let raised = (k * ratio.larger(R::of(1e-30)).ln()).exp();
            small / ((R::ONE + raised).ln() / k).exp()
        }
    }
}

/// The exponent k of a blend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Power<R> {
    /// ∞.
    Minimum,
    /// 2, the source's.
    Two,
    /// 4.
    Four,
    /// Any other, > 0.
    Other(R),
}

impl<R: Real> Power<R> {
    /// Converts from a number.
    pub fn of(k: f64) -> Self {
        match k {
            k if k.is_infinite() => Self::Minimum,
            2.0 => Self::Two,
            4.0 => Self::Four,
            k => Self::Other(R::of(k)),
        }
    }
}

/// Blends the times `b` into `a`.
pub fn blend_all<R: Real>(a: &mut [R], b: &[R], power: Power<R>) {
    dispatch(
        #[inline(always)]
        // One loop per power: with a branch inside, it would not vectorise.
        || match power {
            Power::Minimum => blend_each(a, b, Power::Minimum),
            Power::Two => blend_each(a, b, Power::Two),
            Power::Four => blend_each(a, b, Power::Four),
            Power::Other(k) => blend_each(a, b, Power::Other(k)),
        },
    );
}

/// [`blend_all`] with a power that is a constant where it is inlined.
#[inline(always)]
fn blend_each<R: Real>(a: &mut [R], b: &[R], power: Power<R>) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = blend(*a, *b, power);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::trunk::Rows;

    #[test]
    fn blends_are_norms() {
        for k in [1.5, 2.0, 4.0, 9.0] {
            for (a, b) in [(3.0, 4.0), (1e-3, 1e3), (5.0, 5.0), (1e4, 2.0)] {
                let want = (f64::powf(a, -k) + f64::powf(b, -k)).powf(-1.0 / k);
                assert!((blend(a, b, Power::of(k)) / want - 1.0).abs() < 1e-12, "{k} {a} {b}");
            }
        }
        assert_eq!(blend(3.0, f64::INFINITY, Power::of(2.0)), 3.0);
        assert_eq!(blend(3.0, 4.0, Power::of(f64::INFINITY)), 3.0);
        assert_eq!(blend(0.0, 4.0, Power::of(4.0)), 0.0);
        assert_eq!(blend(-1.0, 4.0, Power::of(2.0)), -1.0);
    }

    /// Points around the two branches, many of them behind one or both.
    fn points<R: Real>() -> [Vec<R>; 3] {
        let axis = |of: fn(u32) -> f64| (0..500).map(|i| R::of(of(i))).collect();
        [axis(|i| f64::from(i / 5) - 60.0), axis(|i| f64::from(i % 13) - 6.0), axis(|i| f64::from(i % 29))]
    }

    fn branches<R: Real>() -> [Axis<R>; 2] {
        [
            Axis::new(DVec3::new(0.0, 0.0, 4.0), DVec3::new(0.6, 0.0, 0.8), f64::INFINITY, 2.0, 2.0, 0.3),
            Axis::new(DVec3::new(1.0, 0.0, 9.0), DVec3::new(0.0, -1.0, 0.0), 12.0, 4.5, 2.0, 0.3),
        ]
    }

    fn times<R: Real>(branches: &[Axis<R>]) -> Vec<R> {
        let [x, y, z] = &points();
        let mut out = vec![R::ZERO; x.len()];
        branch_time(branches, &Places { x, y, z, rows: Rows::Any }, &mut out);
        out
    }

    #[test]
    fn several_branches_are_blended() {
        let [a, b] = branches::<f64>();
        let (first, second, both) = (times(&[a]), times(&[b]), times(&[a, b]));
        for ((a, b), both) in first.iter().zip(&second).zip(&both) {
            let want = blend(*a, *b, Power::Two);
            assert!(*both == want || (both / want - 1.0).abs() < 1e-12, "{both} {want}");
        }
        assert!(both.iter().any(|t| t.is_infinite()) && both.iter().any(|t| t.is_finite()));
    }

    #[test]
    fn runs_behind_a_branch_change_nothing() {
        let [x, y, z] = &points::<f32>();
        let one = |i: usize| {
            let (x, y, z) = (&x[i..=i], &y[i..=i], &z[i..=i]);
            let mut out = [0.0];
            branch_time(&branches(), &Places { x, y, z, rows: Rows::Any }, &mut out);
            out[0].to_bits()
        };
        assert!((0..x.len()).map(one).eq(times(&branches::<f32>()).iter().map(|t| t.to_bits())));
    }

    #[test]
    fn blends_slices_like_numbers() {
        let b = times(&branches::<f32>());
        let a: Vec<f32> = (0..500u16).map(|i| f32::from(i) * 0.07 - 1.0).collect();
        for k in [f64::INFINITY, 2.0, 4.0, 1.5] {
            let power = Power::of(k);
            let mut all = a.clone();
            blend_all(&mut all, &b, power);
            let each = a.iter().zip(&b).map(|(a, b)| blend(*a, *b, power).to_bits());
            assert!(each.eq(all.iter().map(|t| t.to_bits())), "{k}");
        }
    }
}
