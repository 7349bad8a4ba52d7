//! Light by direction, stored as a square picture: the sphere is projected to an octahedron, which is unfolded into the
//! square -1..1 (T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", 2008). The middle of the square is
//! the direction +z, its corners are -z. Every map has a border of one texel, so that interpolation needs no case for
//! its edges.
use crate::ground::math::{floor_int, max};

/// Four numbers of a texel: light in red, green and blue, and the share of the key light (see
/// [`Environment`](super::Environment)).
pub type Texel = [f32; 4];

/// A square map of light by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Texels along an edge, without the border.
    size: usize,
    /// Rows of `size + 2` texels.
    texels: Vec<Texel>,
}

/// The place of a direction in the square -1..1. The direction need not have length 1.
#[inline(always)]
pub fn place(d: [f32; 3]) -> [f32; 2] {
    let scale = 1.0 / max(d[0].abs() + d[1].abs() + d[2].abs(), 1e-12);
    let (u, v) = (d[0] * scale, d[1] * scale);
    let folded = [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)];
    if d[2] < 0.0 { folded } else { [u, v] }
}

/// The point of the octahedron |x| + |y| + |z| = 1 at a place of the square.
fn point([u, v]: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - u.abs() - v.abs();
    if z < 0.0 { [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v), z] } else { [u, v, z] }
}

/// Mean of `a` and `b` with weight `t` of `b`.
#[inline(always)]
pub(super) fn mix(a: Texel, b: Texel, t: f32) -> Texel {
    let mut out = a;
    for k in 0..4 {
        out[k] = a[k] + (b[k] - a[k]) * t;
    }
    out
}

impl Map {
    /// A map of the values of `f` at the directions of its texels, which have length 1.
    pub(super) fn of(size: usize, f: impl Fn([f32; 3]) -> Texel + Sync) -> Self {
        use rayon::prelude::*;
        let row = |y: usize| (0..size).map(|x| f(direction(x, y, size))).collect::<Vec<_>>();
        let inner: Vec<Texel> = (0..size).into_par_iter().flat_map_iter(row).collect();
        Self::bordered(size, &inner)
    }

    /// Adds the border to rows of `size` texels.
    fn bordered(size: usize, inner: &[Texel]) -> Self {
        let wide = size + 2;
        let mut texels = vec![[0.0; 4]; wide * wide];
        for y in 0..wide {
            for x in 0..wide {
                // Beyond an edge the square continues at its other half, mirrored.
                let (mut i, mut j) = (x.clamp(1, size) - 1, y.clamp(1, size) - 1);
                if (x == 0) | (x == wide - 1) {
                    j = size - 1 - j;
                }
                if (y == 0) | (y == wide - 1) {
                    i = size - 1 - i;
                }
                texels[y * wide + x] = inner[j * size + i];
            }
        }
        Self { size, texels }
    }

    /// Texels along an edge, without the border.
    pub const fn size(&self) -> usize {
        self.size
    }

    /// Rows of `size + 2` texels, with the border.
    pub fn texels(&self) -> &[Texel] {
        &self.texels
    }

    /// A map with half the texels along an edge: each is the mean of four.
    pub(super) fn halved(&self) -> Self {
        let size = self.size / 2;
        let at = |x: usize, y: usize| self.texels[(y + 1) * (self.size + 2) + x + 1];
        let mean = |i: usize| {
            let (x, y) = (2 * (i % size), 2 * (i / size));
            let (above, below) = (mix(at(x, y), at(x + 1, y), 0.5), mix(at(x, y + 1), at(x + 1, y + 1), 0.5));
            mix(above, below, 0.5)
        };
        Self::bordered(size, &(0..size * size).map(mean).collect::<Vec<_>>())
    }

    /// The value at a place of the square, interpolated between four texels.
    #[inline(always)]
    pub fn at(&self, [u, v]: [f32; 2]) -> Texel {
        #[expect(clippy::cast_precision_loss, reason = "maps have at most some thousand texels along an edge")]
        let half = 0.5 * self.size as f32;
        let ((x, i), (y, j)) = (floor_int(u * half + half + 0.5), floor_int(v * half + half + 0.5));
        let (s, t) = (u * half + half + 0.5 - x, v * half + half + 0.5 - y);
        let wide = self.size + 2;
        let most = self.size;
        let (i, j) = (clamped(i, most), clamped(j, most));
        let rows = [j * wide + i, (j + 1) * wide + i];
        let [above, below] = rows.map(|at| match self.texels.get(at..at + 2) {
            Some(&[left, right]) => mix(left, right, s),
            _ => [0.0; 4],
        });
        mix(above, below, t)
    }

    /// Calls `f` with the direction and value of every texel.
    pub(super) fn each(&self, mut f: impl FnMut([f32; 3], Texel)) {
        for y in 0..self.size {
            for x in 0..self.size {
                f(direction(x, y, self.size), self.texels[(y + 1) * (self.size + 2) + x + 1]);
            }
        }
    }

    /// A map of the values of `f` at every direction and value of this one.
    pub(super) fn mapped(&self, f: impl Fn([f32; 3], Texel) -> Texel) -> Self {
        let mut inner = Vec::with_capacity(self.size * self.size);
        self.each(|d, texel| inner.push(f(d, texel)));
        Self::bordered(self.size, &inner)
    }

    /// Multiplies one of the four numbers of every texel.
    pub(super) fn scale(&mut self, number: usize, by: f32) {
        self.texels.iter_mut().for_each(|texel| texel[number] *= by);
    }

    /// Sums `f` over all texels, given direction, value and solid angle of each.
    pub(super) fn sum<const N: usize>(&self, f: impl Fn([f32; 3], Texel, f32) -> [f32; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        for y in 0..self.size {
            for x in 0..self.size {
                let texel = self.texels[(y + 1) * (self.size + 2) + x + 1];
                let terms = f(direction(x, y, self.size), texel, angle(x, y, self.size));
                sum.iter_mut().zip(terms).for_each(|(sum, term)| *sum += f64::from(term));
            }
        }
        sum
    }
}

/// Limits an index to 0..=most.
#[inline(always)]
fn clamped(i: i32, most: usize) -> usize {
    usize::try_from(i).unwrap_or(0).min(most)
}

/// The middle of a texel in the square.
#[expect(clippy::cast_precision_loss, reason = "maps have at most some thousand texels along an edge")]
fn middle(x: usize, y: usize, size: usize) -> [f32; 2] {
    [x, y].map(|k| (2.0 * k as f32 + 1.0) / size as f32 - 1.0)
}

/// The direction of the middle of a texel; its length is 1.
fn direction(x: usize, y: usize, size: usize) -> [f32; 3] {
    let p = point(middle(x, y, size));
    let long = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    p.map(|c| c / long)
}

/// The solid angle of a texel: its area in the square, divided by the cubed distance of its point on the octahedron.
#[expect(clippy::cast_precision_loss, reason = "maps have at most some thousand texels along an edge")]
fn angle(x: usize, y: usize, size: usize) -> f32 {
    let p = point(middle(x, y, size));
    let squared = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    4.0 / ((size * size) as f32 * squared * squared.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_texel_of_a_direction() {
        let size = 16;
        let map = Map::of(size, |d| [d[0], d[1], d[2], 1.0]);
        for y in 0..size {
            for x in 0..size {
                let d = direction(x, y, size);
                let found = map.at(place(d.map(|c| 3.0 * c)));
                let off = (0..3).map(|k| (found[k] - d[k]).abs()).fold(0.0, f32::max);
                assert!(off < 1e-5, "{x} {y}: {d:?} {found:?}");
            }
        }
    }

    #[test]
    fn texels_cover_the_sphere_once() {
        let map = Map::of(64, |_| [1.0; 4]);
        let [all, up] = map.sum(|d, _, angle| {
            [
                angle,
                if d[2] > 1e-3 {
                    2.0 * angle
                } else if d[2] > -1e-3 {
                    angle
                } else {
                    0.0
                },
            ]
        });
        assert!((all / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{all}");
        assert!((up / all - 1.0).abs() < 1e-3, "{up}");
    }

    /// Interpolation is continuous across the edges of the square, where both sides are the same direction.
    #[test]
    fn has_no_seam() {
        let map = Map::of(32, |d| [d[0], d[1] * d[2], d[2], 0.0]);
        for k in 0..50_u8 {
            let t = -0.98 + 0.04 * f32::from(k);
            for (a, b) in [([t, 1.0], [-t, 1.0]), ([1.0, t], [1.0, -t])] {
                let (a, b) = (map.at(a), map.at(b));
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 0.01), "{t}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn any_place_gives_a_number() {
        let map = Map::of(8, |_| [1.0; 4]);
        for v in [f32::NAN, f32::INFINITY, -1e9, 1e9, 0.0] {
            let _ = map.at([v, -v]);
            assert!(place([v, v, v]).iter().all(|c| !c.is_infinite()));
        }
    }
}
