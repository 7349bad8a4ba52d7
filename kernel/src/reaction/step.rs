//! One step in time of two substances that diffuse and react, by finite differences.
//!
//! Second differences use nine points, so their error is the same in all directions: δx² + δy² + δx²δy²/6 for square
//! cells (J. Strikwerda, "Finite Difference Schemes", 12.5). Each value depends on the step before alone, so results do
//! not depend on the number of threads.
use crate::ground::math::max;
use crate::ground::simd::{self, inlined};
use rayon::prelude::*;

/// Rows of a grid that one thread computes at a time.
const BAND: usize = 16;

/// The least concentration of v: the square is still a normal number, because subnormal ones take a hundred times as
/// long to compute.
const LEAST: f32 = 1e-18;

/// Points that are computed before they are written. The compiler knows that a block of its own overlaps no input.
const BLOCK: usize = 64;

/// The law at a point. Every number is multiplied by the step in time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Law {
    /// How fast u becomes v.
    pub(super) speed: f32,
    /// How fast u is fed.
    pub(super) feed: f32,
    /// How fast v vanishes: the sum of feed and kill.
    pub(super) loss: f32,
    /// Diffusion of u across, down and diagonal, per square of the cell.
    pub(super) u: [f32; 3],
    /// Diffusion of v across and down, per square of the cell.
    pub(super) v: [f32; 2],
}

/// Laws that differ from point to point, by rows. The speed is the same everywhere.
#[derive(Clone, Debug, Default)]
pub(super) struct Laws {
    pub(super) speed: f32,
    pub(super) feed: Vec<f32>,
    pub(super) loss: Vec<f32>,
    pub(super) u: [Vec<f32>; 3],
    pub(super) v: [Vec<f32>; 2],
}

impl Laws {
    /// The laws of `count` points.
    pub(super) fn of(count: usize, law: impl Fn(usize) -> Law) -> Self {
        let mut laws = Self::default();
        for law in (0..count).map(law) {
            laws.speed = law.speed;
            laws.feed.push(law.feed);
            laws.loss.push(law.loss);
            laws.u.iter_mut().zip(law.u).for_each(|(plane, value)| plane.push(value));
            laws.v.iter_mut().zip(law.v).for_each(|(plane, value)| plane.push(value));
        }
        laws
    }

    /// The laws, to be read.
    pub(super) fn all(&self) -> Part<'_> {
        let [ux, uy, uxy] = &self.u;
        let [vx, vy] = &self.v;
        Part { speed: self.speed, feed: &self.feed, loss: &self.loss, u: [ux, uy, uxy], v: [vx, vy] }
    }
}

/// Some of the laws.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    speed: f32,
    feed: &'a [f32],
    loss: &'a [f32],
    u: [&'a [f32]; 3],
    v: [&'a [f32]; 2],
}

/// The law at each point.
pub(super) trait Here: Copy + Send + Sync {
    /// The laws of `count` points from `from` on.
    fn cut(&self, from: usize, count: usize) -> Self;

    /// The law of a point.
    fn at(&self, point: usize) -> Law;
}

impl Here for Law {
    #[inline(always)]
    fn cut(&self, _from: usize, _count: usize) -> Self {
        *self
    }

    #[inline(always)]
    fn at(&self, _point: usize) -> Law {
        *self
    }
}

impl Here for Part<'_> {
    #[inline(always)]
    fn cut(&self, from: usize, count: usize) -> Self {
        let [ux, uy, uxy] = self.u;
        let [vx, vy] = self.v;
        Part {
            speed: self.speed,
            feed: &self.feed[from..][..count],
            loss: &self.loss[from..][..count],
            u: [&ux[from..][..count], &uy[from..][..count], &uxy[from..][..count]],
            v: [&vx[from..][..count], &vy[from..][..count]],
        }
    }

    #[inline(always)]
    fn at(&self, point: usize) -> Law {
        Law {
            speed: self.speed,
            feed: self.feed[point],
            loss: self.loss[point],
            u: [self.u[0][point], self.u[1][point], self.u[2][point]],
            v: [self.v[0][point], self.v[1][point]],
        }
    }
}

/// Concentrations of u and v on a grid that repeats. Rows have one more point on each side, a copy of the other end.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) width: usize,
    pub(super) height: usize,
    u: [Vec<f32>; 2],
    v: [Vec<f32>; 2],
}

impl State {
    /// The state with the values u and v at each point.
    pub(super) fn new(width: usize, height: usize, value: impl Fn(usize, usize) -> [f32; 2] + Sync) -> Self {
        let stride = width + 2;
        let (mut u, mut v) = (vec![0.0; stride * height], vec![0.0; stride * height]);
        u.par_chunks_mut(stride).zip(v.par_chunks_mut(stride)).enumerate().for_each(|(y, (u, v))| {
            for x in 0..width {
                [u[x + 1], v[x + 1]] = value(x, y);
            }
            close(u);
            close(v);
        });
        let next = vec![0.0; stride * height];
        Self { width, height, u: [u, next.clone()], v: [v, next] }
    }

    /// The concentration of v, by rows.
    pub(super) fn into_v(self) -> Vec<f32> {
        let [v, _] = self.v;
        v.chunks_exact(self.width + 2).flat_map(|row| &row[1..=self.width]).copied().collect()
    }

    /// Advances by one step. The law is that of all points, or that of each.
    pub(super) fn advance(&mut self, law: impl Here) {
        let (width, stride, height) = (self.width, self.width + 2, self.height);
        let ([u, next_u], [v, next_v]) = (&mut self.u, &mut self.v);
        let (u, v) = (&u[..], &v[..]);
        let bands = next_u.par_chunks_mut(BAND * stride).zip(next_v.par_chunks_mut(BAND * stride)).enumerate();
        bands.for_each(|(band, (next_u, next_v))| {
            simd::dispatch(
                #[inline(always)]
                || {
                    let rows = next_u.chunks_exact_mut(stride).zip(next_v.chunks_exact_mut(stride));
                    for (y, (to_u, to_v)) in (band * BAND..).zip(rows) {
                        let (above, below) = ((y + height - 1) % height, (y + 1) % height);
                        let u = [row_of(u, stride, above), row_of(u, stride, y), row_of(u, stride, below)];
                        let v = [row_of(v, stride, above), row_of(v, stride, y), row_of(v, stride, below)];
                        react(u, v, to_u, to_v, law.cut(y * width, width));
                        close(to_u);
                        close(to_v);
                    }
                },
            );
        });
        self.u.swap(0, 1);
        self.v.swap(0, 1);
    }
}

#[inline(always)]
fn row_of(plane: &[f32], stride: usize, y: usize) -> &[f32] {
    &plane[y * stride..(y + 1) * stride]
}

/// Copies the ends of a row to the points beside it.
#[inline(always)]
fn close(row: &mut [f32]) {
    let last = row.len() - 1;
    row[0] = row[last - 1];
    row[last] = row[1];
}

/// A row of one substance after a step. `rows` are those above, here and below, each with a point more on both sides.
/// `change` gives the new value from the law, the nine values around a point, and the other substance.
#[inline(always)]
fn next(
    out: &mut [f32],
    rows: [&[f32]; 3],
    other: &[f32],
    law: impl Here,
    change: impl Fn(Law, [[f32; 3]; 3], f32) -> f32,
) {
    let [above, here, below] = rows;
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let (from, count) = (block * BLOCK, out.len());
        let (law, [a, b, c]) = (law.cut(from, count), [&above[from..], &here[from..], &below[from..]]);
        let (a0, a1, a2) = (&a[..count], &a[1..=count], &a[2..count + 2]);
        let (b0, b1, b2) = (&b[..count], &b[1..=count], &b[2..count + 2]);
        let (c0, c1, c2) = (&c[..count], &c[1..=count], &c[2..count + 2]);
        let other = &other[from + 1..=from + count];
        let mut made = [0.0; BLOCK];
        for x in 0..count {
            let near = [[a0[x], a1[x], a2[x]], [b0[x], b1[x], b2[x]], [c0[x], c1[x], c2[x]]];
            made[x] = change(law.at(x), near, other[x]);
        }
        out.copy_from_slice(&made[..count]);
    }
}

/// A row of both substances after a step.
#[inline(always)]
fn react(u: [&[f32]; 3], v: [&[f32]; 3], to_u: &mut [f32], to_v: &mut [f32], law: impl Here) {
    let count = to_u.len() - 2;
    let of_u = inlined(
        #[inline(always)]
        |law: Law, u: [[f32; 3]; 3], v: f32| {
            let flow = spread(u, law.u[0], law.u[1]) + law.u[2] * ((u[2][2] - u[2][0]) - (u[0][2] - u[0][0]));
            let here = u[1][1];
            here + (flow + (law.feed * (1.0 - here) - law.speed * (here * v * v)))
        },
    );
    next(&mut to_u[1..=count], u, v[1], law, of_u);
    let of_v = inlined(
        #[inline(always)]
        |law: Law, v: [[f32; 3]; 3], u: f32| {
            let here = v[1][1];
            let flow = spread(v, law.v[0], law.v[1]);
            max(here + (flow + (law.speed * (u * here * here) - law.loss * here)), LEAST)
        },
    );
    next(&mut to_v[1..=count], v, u[1], law, of_v);
}

/// The diffusion at the middle of nine values.
#[inline(always)]
fn spread(p: [[f32; 3]; 3], across: f32, down: f32) -> f32 {
    let (beside, above) = (p[1][0] + p[1][2], p[0][1] + p[2][1]);
    let corners = (p[0][0] + p[0][2]) + (p[2][0] + p[2][2]);
    let (second_x, second_y) = (beside - 2.0 * p[1][1], above - 2.0 * p[1][1]);
    let mixed = corners - 2.0 * (beside + above) + 4.0 * p[1][1];
    across * second_x + down * second_y + (across + down) * (1.0 / 12.0) * mixed
}
