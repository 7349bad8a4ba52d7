//! Fibre space: coordinates that follow the fibres, in which streaks, pores and rays are drawn.
//!
//! a = v_h (T - T_e) is the radius measured by the rings: points of equal a are rings of equal time. θ' = θ + δ/d,
//! where δ is the sideways displacement of the fibres: their wander, the spiral of the stem, curl, and the flow around
//! knots (the stream function of a flow around a cylinder). Then X = a cos θ', Y = a sin θ', Z = z: no seam, no shear,
//! and structure drawn in X, Y, Z flows around knots without further work.
use super::trunk::{Places, Trunk};
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::simd::dispatch;
use crate::noise::noise3::{Noise3, visible};
use glam::{DVec3, Vec3};

/// Settings of fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiberStyle {
    /// Elongation in mm a year.
    pub elongation: f32,
    /// Thickening in mm a year.
    pub thickening: f32,
    /// Height of the ground in mm.
    pub ground: f32,
    /// Wander of fibres; 1 is natural.
    pub wander: f32,
    /// The slope of spiral grain, as a tangent.
    pub spiral: f32,
    /// Amplitude of curly grain in mm.
    pub curl: f32,
    /// Wavelength of curly grain in mm.
    pub curl_length: f32,
    /// Irregularity of these waves.
    pub curl_chaos: f32,
    /// The slope of interlocked grain, as a tangent; its sign alternates from layer to layer.
    pub interlock: f32,
    /// The thickness of two layers of interlocked grain in mm.
    pub interlock_pitch: f32,
}

/// A branch that fibres flow around.
#[derive(Clone, Copy, Debug)]
pub struct Obstacle {
    start: Vec3,
    direction: Vec3,
    /// The horizontal direction perpendicular to the branch.
    side: Vec3,
    /// Its radius divided by the distance from its start.
    taper: f32,
    length: f32,
}

/// Reach of a knot's effect on fibres, in its radii.
const REACH: f32 = 8.0;
const RUN: usize = 64;
/// Height step in mm of the finite difference for the slope of the flow around knots.
const LIFT: f32 = 0.5;

impl Obstacle {
    /// A branch whose thickening is `ratio` times that of the trunk.
    pub fn new(start: DVec3, direction: DVec3, length: f64, ratio: f64) -> Self {
        let side = direction.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        let narrow = crate::ground::number::narrow;
        Self {
            start: start.as_vec3(),
            direction: direction.as_vec3(),
            side: side.as_vec3(),
            taper: narrow(ratio),
            length: narrow(length),
        }
    }

    fn reaches(&self, low: Vec3, high: Vec3) -> bool {
        let (centre, radius) = (0.5 * (low + high), 0.5 * low.distance(high));
        let v = centre - self.start;
        let s = v.dot(self.direction);
        let away = (v - self.direction * s.clamp(0.0, self.length)).length() - radius;
        s + radius > 0.0 && away < REACH * self.taper * math::min(s + radius, self.length)
    }

    /// Sideways displacement of the fibres at a point, and how far the point is inside the branch (0..1).
    #[inline(always)]
    fn push(&self, x: f32, y: f32, z: f32) -> (f32, f32) {
        let v = [x - self.start.x, y - self.start.y, z - self.start.z];
        let u = self.direction;
        let s = math::min(v[0] * u.x + v[1] * u.y + v[2] * u.z, self.length);
        let w = [v[0] - s * u.x, v[1] - s * u.y, v[2] - s * u.z];
        let r2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
        let radius = self.taper * math::max(s, 0.0);
        let square = radius * radius;
        let aside = w[0] * self.side.x + w[1] * self.side.y;
        let fade = math::smooth((REACH * REACH * square - r2) / math::max(0.75 * REACH * REACH * square, 1e-6));
        let push = aside * square / math::max(math::max(r2, square), 1e-6) * fade;
        let inside = math::smooth((1.15 * square - r2) / math::max(0.3 * square, 1e-6));
        (push, inside)
    }
}

/// Fibres, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Fibers {
    style: FiberStyle,
    obstacles: Vec<Obstacle>,
    noise: [Noise3; 8],
}

/// The displacement of fibres relative to an even tree, sideways and outwards, or its derivative by height.
#[derive(Clone, Copy)]
struct Displacement {
    sideways: [f32; RUN],
    outward: [f32; RUN],
    inside: [f32; RUN],
    axis: [[f32; RUN]; 3],
}

/// Noise of the wander of fibres.
#[derive(Clone, Copy)]
struct Wander {
    noise: [Noise3; 2],
    across: f32,
    along: f32,
    sideways: f32,
    outward: f32,
}

impl Wander {
    #[inline(always)]
    fn add<const SLOPE: bool>(&self, amount: f32, [dx, dy]: [&[f32; RUN]; 2], z: &[f32], out: &mut Displacement) {
        if amount <= 0.0 {
            return;
        }
        let (a, b) = (1.0 / self.across, 1.0 / self.along);
        let (at, scale) = ([&dx[..], &dy[..], z], [a, a, b]);
        let [p, q] = self.noise;
        let amount = if SLOPE { amount * b } else { amount };
        let (sideways, outward) = (amount * self.sideways, amount * self.outward);
        if SLOPE {
            p.each_slope(at, scale, 0.0, &mut out.sideways, |sum, v| sum + sideways * v);
            q.each_slope(at, scale, 0.0, &mut out.outward, |sum, v| sum + outward * v);
        } else {
            p.each(at, scale, 0.0, &mut out.sideways, |sum, v| sum + sideways * v);
            q.each(at, scale, 0.0, &mut out.outward, |sum, v| sum + outward * v);
        }
    }
}

impl Fibers {
    /// Prepares fibres from their settings.
    pub fn new(style: FiberStyle, obstacles: Vec<Obstacle>, hash: Hash) -> Self {
        Self { style, obstacles, noise: std::array::from_fn(|i| Noise3::new(hash, i as u64)) }
    }

    /// The displacements of fibres at up to [`RUN`] points, `dx` and `dy` relative to the pith; with `SLOPE` their
    /// derivative with respect to height.
    #[inline(always)]
    fn displacement<const SLOPE: bool>(
        &self,
        at: [&[f32]; 3],
        from_pith: [&[f32; RUN]; 2],
        pixel: f32,
        out: &mut Displacement,
    ) {
        // With a known bound of 64, no index needs a check.
        let n = at[2].len().min(RUN);
        let [x, y, z] = at.map(|axis| &axis[..n]);
        let [dx, dy] = from_pith;
        let style = &self.style;
        for (out, z) in out.sideways.iter_mut().zip(z) {
            *out = if SLOPE { style.spiral } else { style.spiral * (z - style.ground) };
        }
        (out.outward, out.inside) = ([0.0; RUN], [0.0; RUN]);
        let coarse =
            Wander { noise: [self.noise[0], self.noise[1]], across: 18.0, along: 70.0, sideways: 0.55, outward: 0.40 };
        let fine =
            Wander { noise: [self.noise[2], self.noise[3]], across: 5.0, along: 15.0, sideways: 0.13, outward: 0.10 };
        coarse.add::<SLOPE>(style.wander * visible(27.0, pixel), from_pith, z, out);
        fine.add::<SLOPE>(style.wander * visible(7.5, pixel), from_pith, z, out);
        if style.curl > 0.0 {
            self.curl::<SLOPE>([&dx[..n], &dy[..n], z], out);
        }
        let range = |v: &[f32]| v.iter().fold((f32::MAX, f32::MIN), |(l, h), &v| (math::min(l, v), math::max(h, v)));
        if self.obstacles.is_empty() {
            return;
        }
        let ((x0, x1), (y0, y1), (z0, z1)) = (range(x), range(y), range(z));
        let (low, high) = (Vec3::new(x0, y0, z0) - 1.0, Vec3::new(x1, y1, z1) + 1.0);
        for obstacle in self.obstacles.iter().filter(|o| o.reaches(low, high)) {
            for i in 0..n {
                let (mut push, inside) = obstacle.push(x[i], y[i], z[i]);
                if SLOPE {
                    push = (obstacle.push(x[i], y[i], z[i] + LIFT).0 - push) * (1.0 / LIFT);
                }
                // The branch's side has the direction of growing angles if the branch points away from the pith.
                out.sideways[i] += push;
                let more = inside > out.inside[i];
                out.inside[i] = if more { inside } else { out.inside[i] };
                for (axis, u) in out.axis.iter_mut().zip(obstacle.direction.to_array()) {
                    axis[i] = if more { u } else { axis[i] };
                }
            }
        }
    }

    /// Curly grain: waves along the stem of varying strength.
    #[inline(always)]
    fn curl<const SLOPE: bool>(&self, at: [&[f32]; 3], out: &mut Displacement) {
        let style = &self.style;
        let inverse = 1.0 / style.curl_length;
        let sizes = [(28.0_f32, 38.0_f32), (9.0, 16.0), (45.0, 60.0)];
        let none = [0.0; RUN];
        let (mut values, mut slopes) = ([none; 3], [none; 3]);
        for (k, (across, along)) in sizes.into_iter().enumerate() {
            let (noise, scale) = (self.noise[4 + k], [1.0 / across, 1.0 / across, 1.0 / along]);
            noise.each(at, scale, 0.0, &mut values[k], |_, v| v);
            if SLOPE {
                noise.each_slope(at, scale, 0.0, &mut slopes[k], |_, v| v * (1.0 / along));
            }
        }
        for (i, z) in at[2].iter().enumerate() {
            let [wide, fine, strong] = [0, 1, 2].map(|k| values[k][i]);
            let whole = 0.62 + 0.75 * strong;
            let strong = math::saturate(whole);
            let turn = std::f32::consts::TAU * (z * inverse + style.curl_chaos * (wide + 0.35 * fine));
            let (s, c) = math::sin_cos(turn);
            if SLOPE {
                let rise = if whole == strong { 0.75 * slopes[2][i] } else { 0.0 };
                let chaos = style.curl_chaos * (slopes[0][i] + 0.35 * slopes[1][i]);
                let turning = strong * std::f32::consts::TAU * (inverse + chaos);
                out.sideways[i] += style.curl * (rise * s + turning * c);
                out.outward[i] += 0.8 * style.curl * (rise * c - turning * s);
            } else {
                out.sideways[i] += style.curl * strong * s;
                out.outward[i] += 0.8 * style.curl * strong * c;
            }
        }
    }

    /// X, Y and Z of points whose growth time in the even tree is `time`.
    pub fn place(&self, trunk: &Trunk<f32>, at: &Places<'_, f32>, time: &[f32], pixel: f32, out: [&mut [f32]; 3]) {
        let [px, py, pz] = out;
        pz.copy_from_slice(at.z);
        let style = &self.style;
        let inverse = 1.0 / style.elongation;
        self.each(
            trunk,
            at,
            #[inline(always)]
            |from, to, from_pith, displacement| {
                let parts = [&at.x[from..to], &at.y[from..to], &at.z[from..to]];
                self.displacement::<false>(parts, from_pith, pixel, displacement);
                let [dx, dy] = from_pith;
                let n = (to - from).min(RUN);
                let (time, z) = (&time[from..][..n], &at.z[from..][..n]);
                let (px, py) = (&mut px[from..][..n], &mut py[from..][..n]);
                for i in 0..n {
                    let d = (dx[i] * dx[i] + dy[i] * dy[i]).sqrt() + 1e-4;
                    let even = style.thickening * (time[i] - (z[i] - style.ground) * inverse);
                    let a = even + displacement.outward[i] * d / (d + 4.0);
                    let turn = displacement.sideways[i] / (d + 1.5);
                    let (s, c) = math::sin_cos(turn);
                    let (u, v) = (dx[i] / d, dy[i] / d);
                    px[i] = a * (u * c - v * s);
                    py[i] = a * (v * c + u * s);
                }
            },
        );
    }

    /// The directions of fibres, of length 1.
    pub fn direction(&self, trunk: &Trunk<f32>, at: &Places<'_, f32>, pixel: f32, out: [&mut [f32]; 3]) {
        let [fx, fy, fz] = out;
        let style = &self.style;
        self.each(
            trunk,
            at,
            #[inline(always)]
            |from, to, from_pith, displacement| {
                let parts = [&at.x[from..to], &at.y[from..to], &at.z[from..to]];
                self.displacement::<true>(parts, from_pith, pixel, displacement);
                let [dx, dy] = from_pith;
                let (mut lx, mut ly) = ([0.0; RUN], [0.0; RUN]);
                trunk.lean(parts[2], &mut lx, &mut ly);
                let n = (to - from).min(RUN);
                let (fx, fy, fz) = (&mut fx[from..][..n], &mut fy[from..][..n], &mut fz[from..][..n]);
                for i in 0..n {
                    let d = (dx[i] * dx[i] + dy[i] * dy[i]).sqrt() + 1e-4;
                    let (u, v) = (dx[i] / d, dy[i] / d);
                    // Along a fibre X and Y are constant: the point moves against the change of the displacement.
                    let swing = if style.interlock > 0.0 {
                        style.interlock * math::sin(std::f32::consts::TAU * d / style.interlock_pitch)
                    } else {
                        0.0
                    };
                    let aside = swing - displacement.sideways[i];
                    let outward = -displacement.outward[i] * d / (d + 4.0);
                    let f = [lx[i] + outward * u - aside * v, ly[i] + outward * v + aside * u, 1.0];
                    let w = displacement.inside[i];
                    let f: [f32; 3] = std::array::from_fn(|k| math::lerp(f[k], displacement.axis[k][i], w));
                    let length = 1.0 / (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt();
                    (fx[i], fy[i], fz[i]) = (f[0] * length, f[1] * length, f[2] * length);
                }
            },
        );
    }

    #[inline(always)]
    fn each(
        &self,
        trunk: &Trunk<f32>,
        at: &Places<'_, f32>,
        mut body: impl FnMut(usize, usize, [&[f32; RUN]; 2], &mut Displacement),
    ) {
        let none = [0.0; RUN];
        let mut displacement = Displacement { sideways: none, outward: none, inside: none, axis: [none; 3] };
        dispatch(
            #[inline(always)]
            || {
                trunk.runs(
                    at,
                    #[inline(always)]
                    |from, to, qx, qy| {
                        let (mut dx, mut dy) = ([0.0; RUN], [0.0; RUN]);
                        for (i, (x, y)) in at.x[from..to].iter().zip(&at.y[from..to]).enumerate() {
                            (dx[i], dy[i]) = (x - qx[i], y - qy[i]);
                        }
                        body(from, to, [&dx, &dy], &mut displacement);
                    },
                );
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wood::fit::{Scheme, equalize, fit};
    use crate::wood::trunk::Rows;

    /// The direction at a point is that of the fibre through it, however many other points are evaluated.
    #[test]
    fn fibres_run_with_the_trunk_at_every_point() {
        let nodes = [(-30.0, 0.0), (0.0, 48.0), (-30.0, 96.0), (10.0, 160.0)].map(|(x, z)| DVec3::new(x, 0.2 * x, z));
        let (trunk, _) = equalize(&fit(&nodes, Scheme::Local).unwrap()).unwrap();
        let trunk = Trunk::<f32>::new(&trunk);
        let style = FiberStyle {
            elongation: 200.0,
            thickening: 2.0,
            ground: 0.0,
            wander: 0.0,
            spiral: 0.0,
            curl: 0.0,
            curl_length: 10.0,
            curl_chaos: 0.0,
            interlock: 0.0,
            interlock_pitch: 14.0,
        };
        let fibers = Fibers::new(style, Vec::new(), Hash::new(1));
        let n = 400;
        let [x, y] = [20.0, -15.0].map(|v| vec![v; n]);
        let z: Vec<f32> = (0..n).map(|i| -20.0 + 0.5 * i as f32).collect();
        let directions = |from: usize, to: usize| -> [Vec<f32>; 3] {
            let mut out = [0; 3].map(|_| vec![0.0; to - from]);
            let [a, b, c] = &mut out;
            let at = Places { x: &x[from..to], y: &y[from..to], z: &z[from..to], rows: Rows::Any };
            fibers.direction(&trunk, &at, 0.5, [a, b, c]);
            out
        };
        let all = directions(0, n);
        for i in 0..n {
            let one = directions(i, i + 1);
            assert!((0..3).all(|k| one[k][0].to_bits() == all[k][i].to_bits()), "point {i}");
            let ([ax, ay], [bx, by]) = (trunk.axis_at(z[i] - 0.05), trunk.axis_at(z[i] + 0.05));
            let lean = Vec3::new((bx - ax) / 0.1, (by - ay) / 0.1, 1.0).normalize();
            let off = lean.angle_between(Vec3::new(all[0][i], all[1][i], all[2][i])).to_degrees();
            assert!(off < 0.5, "point {i} is {off}° off");
        }
    }
}
