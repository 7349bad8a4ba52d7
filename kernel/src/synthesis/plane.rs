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
}

impl Lookup for Plane {
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        Self::bring(y, self.h, self.wrap[1]) * self.w + Self::bring(x, self.w, self.wrap[0])
    }
}
