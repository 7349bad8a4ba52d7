//! The pixel grid of a map or an exemplar, and neighbour lookup.

use crate::ground::window::{OCTANTS, index, offset};

/// Finds the index of a neighbour. All reads of neighbours use this trait, so that it can redirect them.
pub trait Lookup: Sync {
    /// Index of pixel (x, y), which lies at most two pixels outside of the map.
    fn index(&self, x: i32, y: i32) -> usize;
}

/// Finds neighbours, with the offset from the centre of the pixel that represents the neighbour to the neighbour's true
/// position: in pixels of the level, 0 in the plane.
pub trait Neighbours: Lookup {
    /// True if charts may have any orientation. Then orientation must not decide ties between neighbours.
    const CHARTS: bool = false;

    /// The neighbour of pixel (x, y) in the direction of [`OCTANTS`]; `None` if there is none.
    #[inline(always)]
    fn near(&self, (x, y): (i32, i32), octant: usize) -> Option<(usize, [f32; 2])> {
        let [dx, dy] = OCTANTS[octant];
        Some((self.index(x + dx, y + dy), [0.0; 2]))
    }

    /// Returns whether a pixel has content.
    #[inline(always)]
    fn holds(&self, _pixel: usize) -> bool {
        true
    }
}

impl Neighbours for PixelPlane {}

/// Size of a rectangle of pixels, and the axes that wrap. Reads beyond a side that does not wrap give the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelPlane {
    /// Width in pixels.
    pub w: usize,
    /// Height in pixels.
    pub h: usize,
    /// Wrapping of x and y: left joins right, top joins bottom.
    pub wrap: [bool; 2],
}

impl PixelPlane {
    /// Wraps or clamps the column or row `k` to `0..n`.
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

    /// Wraps pixel (x, y) along the axes that wrap; leaves the other coordinates as they are.
    pub fn joined(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let axis = |k: i32, n: usize, wrap: bool| if wrap { k.rem_euclid(index(n)) } else { k };
        [axis(x, self.w, self.wrap[0]), axis(y, self.h, self.wrap[1])]
    }

    /// Moves pixel (x, y) inside: wraps along axes that wrap, else clamps to the border.
    pub fn inside(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        [index(Self::bring(x, self.w, self.wrap[0])), index(Self::bring(y, self.h, self.wrap[1]))]
    }

    /// Default position for a pixel outside: wraps along axes that wrap, else moves inwards by half the rectangle.
    /// Clamping to the border would show as streaks.
    pub fn inwards(&self, at: [i32; 2]) -> [i32; 2] {
        let (border, size) = (self.inside(at), [self.w, self.h].map(index));
        let axis = |d: usize| match self.wrap[d] {
            true => border[d],
            false => at[d] + (border[d] - at[d]).signum() * (size[d] / 2),
        };
        self.inside([axis(0), axis(1)])
    }
}

impl Lookup for PixelPlane {
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        Self::bring(y, self.h, self.wrap[1]) * self.w + Self::bring(x, self.w, self.wrap[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_axes_independently() {
        let plane = |wrap| PixelPlane { w: 8, h: 6, wrap };
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
