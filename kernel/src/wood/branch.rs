//! The time at which branches reach a point, and how times are blended (§3.6, eqs 14–18; W-4, W-8, W-11).
//!
//! Cost: about 1.5 ns a point and branch in single precision.
use super::trunk::Places;
use crate::ground::real::Real;
use crate::ground::simd::dispatch;
use glam::DVec3;

/// A branch as its equations want it.
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

    /// How far along the branch a point lies, and s · (T2 - T_α): 0 or less behind the plane F.
    #[inline(always)]
    pub(crate) fn way(&self, p: [R; 3]) -> (R, R) {
        let (b, u) = (self.start, self.direction);
        let v = [p[0] - b[0], p[1] - b[1], p[2] - b[2]];
        let s = v[0] * u[0] + v[1] * u[1] + v[2] * u[2];
        let foot = s.smaller(self.length);
        let w = [v[0] - foot * u[0], v[1] - foot * u[1], v[2] - foot * u[2]];
        let r2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        // T_γ = r √(s² + r²) / (s v_b), so s T_γ = √(r² (r² + s²)) / v_b.
        let around = (r2 * (r2 + foot * foot)).sqrt() * self.inverse_thickening;
        (foot, foot * foot * self.inverse_elongation + around)
    }
}

/// Points computed together.
const RUN: usize = 64;

/// Calls `body(from, to, sums)` for runs of points with Σ T2^-2 over all branches: what eq (18) for several branches wants
/// (W-8). Branch by branch over the points of a run, so that the loop is a plain one.
#[inline(always)]
fn inverse_squares<R: Real>(branches: &[Axis<R>], at: &Places<'_, R>, mut body: impl FnMut(usize, usize, &[R; RUN])) {
    for from in (0..at.x.len()).step_by(RUN) {
        let to = (from + RUN).min(at.x.len());
        let mut sums = [R::ZERO; RUN];
        for branch in branches {
            let points = at.x[from..to].iter().zip(&at.y[from..to]).zip(&at.z[from..to]);
            for (((x, y), z), sum) in points.zip(&mut sums) {
                let (s, way) = branch.way([*x, *y, *z]);
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

/// Eq (18) for several branches in one go: T1 / √(1 + Σ (T1 / T2)²), in place of T1.
pub fn blend_branches<R: Real>(branches: &[Axis<R>], at: &Places<'_, R>, time: &mut [R]) {
    dispatch(
        #[inline(always)]
        || {
            inverse_squares(
                branches,
                at,
                #[inline(always)]
                |from, to, sums| {
                    for (time, sum) in time[from..to].iter_mut().zip(sums) {
                        *time = *time / (R::ONE + *time * *time * *sum).sqrt();
                    }
                },
            );
        },
    );
}

/// (a^-k + b^-k)^(-1/k) of two times, `b` possibly infinite: eq (18) for k = 2, the minimum for k = ∞. Times of 0 and
/// less are taken as they are: the smaller one.
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

/// The k of a blend.
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
    /// Of a number.
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
        || a.iter_mut().zip(b).for_each(|(a, b)| *a = blend(*a, *b, power)),
    );
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

    #[test]
    fn one_pass_is_two() {
        let branches = [
            Axis::<f64>::new(DVec3::new(0.0, 0.0, 4.0), DVec3::new(0.6, 0.0, 0.8), f64::INFINITY, 2.0, 2.0, 0.3),
            Axis::<f64>::new(DVec3::new(1.0, 0.0, 9.0), DVec3::new(0.0, -1.0, 0.0), 12.0, 4.5, 2.0, 0.3),
        ];
        let x: Vec<f64> = (0..300).map(|i| f64::from(i % 17) - 8.0).collect();
        let y: Vec<f64> = (0..300).map(|i| f64::from(i % 13) - 6.0).collect();
        let z: Vec<f64> = (0..300).map(|i| f64::from(i % 29)).collect();
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let (mut fused, mut apart, mut times) = (vec![7.0; 300], vec![7.0; 300], vec![0.0; 300]);
        blend_branches(&branches, &at, &mut fused);
        branch_time(&branches, &at, &mut times);
        blend_all(&mut apart, &times, Power::Two);
        assert!(times.iter().any(|t| t.is_infinite()) && times.iter().any(|t| t.is_finite()));
        assert!(fused.iter().zip(&apart).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
