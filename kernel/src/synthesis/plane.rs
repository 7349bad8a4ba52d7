//! The pixels of a map and of an exemplar, and where a neighbour is found.

use crate::ground::window::{OCTANTS, index, offset};

/// Where the coordinates of a neighbour are found: the one point of indirection.
pub trait Lookup: Sync {
    /// The index of pixel (x, y), which lies at most two pixels outside of the map.
    fn index(&self, x: i32, y: i32) -> usize;
}

/// Where the neighbours of a pixel are found, and where the place of a neighbour lies seen from the pixel that stands for it:
/// in pixels of the level, 0 in the plane.
pub trait Neighbours: Lookup {
    /// Whether charts may lie in any way, which must decide no tie between neighbours.
    const CHARTS: bool = false;

    /// The neighbour of pixel (x, y) in the direction of [`OCTANTS`]; `None` where there is nothing.
    #[inline(always)]
    fn near(&self, (x, y): (i32, i32), octant: usize) -> Option<(usize, [f32; 2])> {
        let [dx, dy] = OCTANTS[octant];
        Some((self.index(x + dx, y + dy), [0.0; 2]))
    }

    /// Whether there is anything at a pixel.
    #[inline(always)]
    fn holds(&self, _pixel: usize) -> bool {
        true
    }
}

impl Neighbours for Plane {}

/// A rectangle of pixels whose sides join, or not, in x and y; a read beyond a side that does not gives the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plane {
    /// Width in pixels.
    pub w: usize,
    /// Height in pixels.
    pub h: usize,
    /// Whether left and right, top and bottom join.
    pub wrap: [bool; 2],
}

impl Plane {
    /// The column or row that is read for `k`, of `n`.
    #[inline(always)]
    pub fn bring(k: i32, n: usize, wrap: bool) -> usize {
        let n = index(n);
        let k = if (0..n).contains(&k) {
            k
        } else if wrap {
            k.rem_euclid(n)
        } else {
            k.clamp(0, n - 1)
        };
        offset(k)
    }

    /// Pixel (x, y) brought inside along the axes whose sides join; along the others it stays where it is.
    pub fn joined(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let axis = |k: i32, n: usize, wrap: bool| if wrap { k.rem_euclid(index(n)) } else { k };
        [axis(x, self.w, self.wrap[0]), axis(y, self.h, self.wrap[1])]
    }

    /// Pixel (x, y) brought inside: around where sides join, else to the border.
    pub fn inside(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        [index(Self::bring(x, self.w, self.wrap[0])), index(Self::bring(y, self.h, self.wrap[1]))]
    }

    /// Where a pixel (x, y) outside goes if nothing else is known: along axes whose sides join around, along the others
    /// inwards by half the rectangle. Never to the border, which would show as streaks.
    pub fn inwards(&self, at: [i32; 2]) -> [i32; 2] {
        let (border, size) = (self.inside(at), [self.w, self.h].map(index));
        let axis = |d: usize| match self.wrap[d] {
            true => border[d],
            false => at[d] + (border[d] - at[d]).signum() * (size[d] / 2),
        };
        self.inside([axis(0), axis(1)])
    }
}

impl Lookup for Plane {
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        Self::bring(y, self.h, self.wrap[1]) * self.w + Self::bring(x, self.w, self.wrap[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_each_axis_by_itself() {
        let plane = |wrap| Plane { w: 8, h: 6, wrap };
        for (wrap, joined, inside, inwards) in [
            ([false; 2], [9, -2], [7, 0], [5, 1]),
            ([true, false], [1, -2], [1, 0], [1, 1]),
            ([false, true], [9, 4], [7, 4], [5, 4]),
            ([true; 2], [1, 4], [1, 4], [1, 4]),
        ] {
            let plane = plane(wrap);
            assert_eq!((plane.joined([9, -2]), plane.inside([9, -2])), (joined, inside), "{wrap:?}");
            assert_eq!(plane.inwards([9, -2]), inwards, "{wrap:?}");
        }
    }
}
