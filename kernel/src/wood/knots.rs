//! Branches blended relative to their births: knots without kinks that live or die, darken, and have bark.
//!
//! Beyond the source (Momoi & Takatera 2014, §3.6 and §5.3). Eq (18) blends whole ages, so a branch high up moves rings
//! far away, and the result is discontinuous at b1. Blending the times since the branch's birth, t = T - T_α, is
//! continuous everywhere: at b1 both go to 0 and a blend never exceeds its smaller argument. Several branches: δ = T1 -
//! blend each, T = T1 - (Σ δ^4)^¼, in any order. A branch whose share is below a quarter fades out, down to an eighth,
//! so that far branches can be skipped.
use super::trunk::{Places, Rows};
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::simd::dispatch;
use crate::noise::noise3::Noise3;
use glam::{DVec3, Vec3};

/// A branch that makes a knot.
#[derive(Clone, Copy, Debug)]
pub struct Knot {
    start: Vec3,
    direction: Vec3,
    side: [Vec3; 2],
    length: f32,
    birth: f32,
    /// Lifetime in years.
    life: f32,
    thickening: f32,
    noise: Noise3,
}

/// Settings shared by all knots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnotStyle {
    /// Elongation in mm a year.
    pub elongation: f32,
    /// Thickening of the trunk in mm a year, which gives the thickness of a knot at a distance from the pith.
    pub thickening: f32,
    /// The exponent k of the blend.
    pub power: f32,
    /// Number of years by which rings dip towards a dead stub.
    pub dip: f32,
    /// The thickness of bark around a dead stub in mm.
    pub bark: f32,
    /// Deviation of knots from circles, 0..1.
    pub lobes: f32,
}

/// Shares of the other time at which the effect of a branch begins, and at which it is full.
const FADE: (f32, f32) = (0.12, 0.25);
/// Number of points computed together.
const RUN: usize = 64;

impl Knot {
    /// A branch from `start` in `direction` (of length 1), born in the year `birth`, with a lifetime of `life` years.
    pub fn new(
        start: DVec3,
        direction: DVec3,
        length: f64,
        birth: f64,
        life: f64,
        thickening: f64,
        hash: Hash,
    ) -> Self {
        let (a, b) = direction.any_orthonormal_pair();
        let narrow = crate::ground::number::narrow;
        Self {
            start: start.as_vec3(),
            direction: direction.as_vec3(),
            side: [a.as_vec3(), b.as_vec3()],
            length: narrow(length),
            birth: narrow(birth),
            life: narrow(life),
            thickening: narrow(thickening),
            noise: Noise3::new(hash, 0),
        }
    }

    /// Returns whether the branch affects points within `radius` of `centre` whose trunk times are at most `latest`.
    fn reaches(&self, centre: Vec3, radius: f32, latest: f32, style: &KnotStyle) -> bool {
        let v = centre - self.start;
        let s = v.dot(self.direction);
        if s + radius <= 0.0 {
            return false;
        }
        let away = (v - self.direction * s.clamp(0.0, self.length)).length() - radius;
        let time = away * (1.0 - 1.05 * style.lobes) / self.thickening;
        let since = latest - self.birth + style.dip;
        since > 0.0 && since > FADE.0 * time
    }
}

/// The results for the points of a run.
struct Sums {
    delta: [f32; RUN],
    dip: [f32; RUN],
    share: [f32; RUN],
    bark: [f32; RUN],
}

/// Blends knots into the trunk's time. Outputs the time, the share of a branch at each point (0..1), and bark (0..1),
/// with edges of `pixel` mm.
pub fn blend(knots: &[Knot], style: &KnotStyle, at: &Places<'_, f32>, trunk: &[f32], pixel: f32, out: [&mut [f32]; 3]) {
    let [time, share, bark] = out;
    dispatch(
        #[inline(always)]
        || {
            for from in (0..trunk.len()).step_by(RUN) {
                let to = (from + RUN).min(trunk.len());
                let run = Places { x: &at.x[from..to], y: &at.y[from..to], z: &at.z[from..to], rows: Rows::Any };
                let mut sums = Sums { delta: [0.0; RUN], dip: [0.0; RUN], share: [0.0; RUN], bark: [0.0; RUN] };
                let (centre, radius) = ball(&run);
                let latest = trunk[from..to].iter().fold(f32::MIN, |m, t| math::max(m, *t));
                for knot in knots.iter().filter(|k| k.reaches(centre, radius, latest, style)) {
                    if knot.life.is_finite() {
                        add::<true>(knot, style, &run, &trunk[from..to], pixel, &mut sums);
                    } else {
                        add::<false>(knot, style, &run, &trunk[from..to], pixel, &mut sums);
                    }
                }
                for i in 0..to - from {
                    time[from + i] = trunk[from + i] + sums.dip[i] - sums.delta[i].sqrt().sqrt();
                }
                share[from..to].copy_from_slice(&sums.share[..to - from]);
                bark[from..to].copy_from_slice(&sums.bark[..to - from]);
            }
        },
    );
}

/// A bounding ball of points.
fn ball(at: &Places<'_, f32>) -> (Vec3, f32) {
    let range = |v: &[f32]| v.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (math::min(l, v), math::max(h, v)));
    let ((x0, x1), (y0, y1), (z0, z1)) = (range(at.x), range(at.y), range(at.z));
    let (low, high) = (Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1));
    (0.5 * (low + high), 0.5 * low.distance(high) * 1.001 + 1e-3)
}

#[inline(always)]
fn add<const DEAD: bool>(
    knot: &Knot,
    style: &KnotStyle,
    at: &Places<'_, f32>,
    trunk: &[f32],
    pixel: f32,
    sums: &mut Sums,
) {
    let (b, u) = (knot.start, knot.direction);
    let [e, f] = knot.side;
    let inverse_ve = 1.0 / style.elongation;
    let inverse_vb = 1.0 / knot.thickening;
    let points = at.x.iter().zip(at.y).zip(at.z).zip(trunk);
    for (i, (((x, y), z), t)) in points.enumerate().take(RUN) {
        let (vx, vy, vz) = (x - b.x, y - b.y, z - b.z);
        let s = vx * u.x + vy * u.y + vz * u.z;
        let foot = math::min(s, knot.length);
        let (wx, wy, wz) = (vx - foot * u.x, vy - foot * u.y, vz - foot * u.z);
        let r = (wx * wx + wy * wy + wz * wz).sqrt();
        let inverse_r = 1.0 / (r + 1e-6);
        let (p, q) = ((wx * e.x + wy * e.y + wz * e.z) * inverse_r, (wx * f.x + wy * f.y + wz * f.z) * inverse_r);
        let wobble = if style.lobes > 0.0 { knot.noise.at(p * 1.3, q * 1.3, foot * (1.0 / 35.0)) } else { 0.0 };
        let r = r * (1.0 + style.lobes * wobble);
        let inside = s > 0.0 && *t > knot.birth;
        let foot = if s > 0.0 { foot } else { 1.0 };
        let t2 = foot * inverse_ve + r * (r * r + foot * foot).sqrt() * inverse_vb / foot;
        let t1 = t - knot.birth;
        let (mut own, mut since, mut power, mut dip) = (t2, t1, style.power, 0.0);
        if DEAD {
            let past = t1 - knot.life;
            let closed = math::smooth(past * (1.0 / 3.0));
            let beyond = t2 - knot.life;
            own = if beyond > 0.0 { knot.life + beyond * (1.0 + 14.0 * closed) } else { t2 };
            power += 5.0 * closed;
            let edge = math::max(beyond * knot.thickening, 0.0);
            let thick = math::max(foot * knot.thickening / style.thickening, 1e-2);
            dip = style.dip * math::smooth(past * 0.25) * math::exp(-math::min(edge / (0.55 * thick), 80.0));
            since = t1 + dip;
            let ragged = style.bark * (1.0 + 0.8 * knot.noise.at(p * 2.7 + 9.0, q * 2.7, foot * 0.12));
            let off = (beyond * knot.thickening - 0.35).abs();
            let skin = math::saturate((ragged - off) / math::max(pixel, 0.1) + 0.5) * math::smooth(past);
            sums.bark[i] = if inside { math::max(sums.bark[i], skin) } else { sums.bark[i] };
        }
        let (small, large) = (math::min(since, own), math::max(since, own));
        let ratio = small / math::max(large, 1e-6);
        let square = ratio * ratio;
        let blended = if DEAD {
            // Powers of 2 and 2^-x: small · (1 + ratio^k)^(-1/k).
            let raised = math::exp2(power * math::log2(math::max(ratio, 1e-12)));
            small * math::exp2(-math::log2(1.0 + raised) / power)
        } else if style.power == 4.0 {
            small / (1.0 + square * square).sqrt().sqrt()
        } else {
            let raised = math::exp2(power * math::log2(math::max(ratio, 1e-12)));
            small * math::exp2(-math::log2(1.0 + raised) / power)
        };
        let g = since / math::max(own, 1e-6);
        let near = if inside { math::smooth((g - FADE.0) * (1.0 / (FADE.1 - FADE.0))) } else { 0.0 };
        let delta = math::max(since - blended, 0.0) * near;
        let square = delta * delta;
        sums.delta[i] += square * square;
        sums.dip[i] += dip * near;
        let g4 = math::min(g * g, 1e4);
        let g4 = g4 * g4;
        sums.share[i] = math::max(sums.share[i], near * g4 / (1.0 + g4));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STYLE: KnotStyle =
        KnotStyle { elongation: 230.0, thickening: 2.6, power: 4.0, dip: 0.9, bark: 0.6, lobes: 0.16 };

    fn knots() -> Vec<Knot> {
        let knot = |z: f64, life: f64| {
            let direction = DVec3::new(0.8, 0.1, 0.6).normalize();
            Knot::new(DVec3::new(0.0, 0.0, z), direction, f64::INFINITY, z / 230.0, life, 0.4, Hash::new(3))
        };
        vec![knot(100.0, f64::INFINITY), knot(500.0, 9.0)]
    }

    /// The largest step of T between neighbours on a square of `side` mm around a point, `n` by `n` points.
    fn jump(knots: &[Knot], centre: Vec3, side: f32, n: usize) -> f32 {
        let step = side / n as f32;
        let point = |i: usize| {
            let (a, b) = ((i % n) as f32 * step - side / 2.0, (i / n) as f32 * step - side / 2.0);
            (centre.x + 0.6 * a, centre.y + b, centre.z + 0.8 * a)
        };
        let x: Vec<f32> = (0..n * n).map(|i| point(i).0).collect();
        let y: Vec<f32> = (0..n * n).map(|i| point(i).1).collect();
        let z: Vec<f32> = (0..n * n).map(|i| point(i).2).collect();
        let trunk: Vec<f32> = (0..n * n).map(|i| z[i] / 230.0 + x[i].hypot(y[i]) / 2.6).collect();
        let (mut t, mut share, mut bark) = (trunk.clone(), trunk.clone(), trunk.clone());
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        blend(knots, &STYLE, &at, &trunk, 0.1, [&mut t, &mut share, &mut bark]);
        assert!(t.iter().chain(&share).chain(&bark).all(|v| v.is_finite()));
        let across = (0..n * n).filter(|i| i % n > 0).map(|i| (t[i] - t[i - 1]).abs());
        let down = (n..n * n).map(|i| (t[i] - t[i - n]).abs());
        across.chain(down).fold(0.0, f32::max)
    }

    #[test]
    fn time_is_continuous_at_the_birth_of_a_branch_and_round_knots() {
        for (centre, side) in [
            (Vec3::new(0.0, 0.0, 100.0), 8.0),
            (Vec3::new(40.0, 5.0, 130.0), 30.0),
            (Vec3::new(60.0, 7.5, 545.0), 30.0),
        ] {
            let jumps = [50, 100, 200].map(|n| jump(&knots(), centre, side, n));
            assert!(jumps[1] / jumps[0] < 0.7 && jumps[2] / jumps[1] < 0.7, "{centre}: {jumps:?}");
        }
    }

    #[test]
    fn far_branches_change_nothing() {
        let knots = knots();
        let x: Vec<f32> = (0..300).map(|i| i as f32 * 0.3 - 45.0).collect();
        let y = vec![-60.0; 300];
        let z = vec![130.0; 300];
        let trunk: Vec<f32> = x.iter().map(|x| x.hypot(60.0) / 2.6).collect();
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let run = |from: usize, to: usize| {
            let (mut t, mut s, mut b) = (vec![0.0; to - from], vec![0.0; to - from], vec![0.0; to - from]);
            let part = Places { x: &at.x[from..to], y: &at.y[from..to], z: &at.z[from..to], rows: Rows::Any };
            blend(&knots, &STYLE, &part, &trunk[from..to], 0.1, [&mut t, &mut s, &mut b]);
            t
        };
        let whole = run(0, 300);
        // The bits do not depend on the points that are computed together.
        for (from, to) in [(0, 7), (50, 300), (129, 130)] {
            assert_eq!(run(from, to), whole[from..to]);
        }
    }
}
