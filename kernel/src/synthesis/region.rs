//! Which pixels of each level an output needs.
//!
//! Where sides join, a level covers the output once. Elsewhere a level is larger than the part of it that is wanted, by
//! the reach of its correction, so that every window of an unbounded texture is the same part of it.
use super::plane::Plane;
use crate::ground::window::{index, offset};

/// Pixels of the result: absolute numbers, and where sides join.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// First column and row; 0 where sides join.
    pub start: [i32; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Whether left and right, top and bottom join.
    pub wrap: [bool; 2],
}

/// The pixels of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Spacing in finest pixels.
    pub h: usize,
    /// First column and row, absolute, in pixels of the level.
    pub start: [i32; 2],
    /// Columns and rows, and where sides join.
    pub plane: Plane,
    /// By how much the last column and row are narrower than `h`, where sides join.
    pub short: [i32; 2],
}

/// What a level's correction reads.
#[derive(Clone, Copy, Debug)]
pub struct Needs {
    /// Spacing in finest pixels.
    pub h: usize,
    /// How many pixels of the level away.
    pub reach: i32,
    /// Whether all of every local tile that is touched.
    pub tile: Option<usize>,
}

/// The regions of all levels, `needs` from the coarsest to the finest.
pub fn plan(output: &Output, needs: &[Needs]) -> Vec<Region> {
    let axes = [0, 1].map(|axis| line(output, axis, needs));
    (0..needs.len())
        .map(|k| Region {
            h: needs[k].h,
            start: [axes[0][k].0, axes[1][k].0],
            plane: Plane { w: axes[0][k].1, h: axes[1][k].1, wrap: output.wrap },
            short: [0, 1].map(|d| match output.wrap[d] {
                true => index(axes[d][k].1 * needs[k].h - output.size[d]),
                false => 0,
            }),
        })
        .collect()
}

fn line(output: &Output, axis: usize, needs: &[Needs]) -> Vec<(i32, usize)> {
    if output.wrap[axis] {
        return needs.iter().map(|need| (0, output.size[axis].div_ceil(need.h))).collect();
    }
    let (mut from, mut to) = (output.start[axis], output.start[axis] + index(output.size[axis]));
    let mut lines: Vec<(i32, usize)> = Vec::new();
    for (k, need) in needs.iter().enumerate().rev() {
        if k + 1 < needs.len() {
            let step = index(needs[k].h / needs[k + 1].h);
            (from, to) = (from.div_euclid(step), (to - 1).div_euclid(step) + 1);
        }
        (from, to) = (from - need.reach, to + need.reach);
        if let Some(tile) = need.tile {
            let tile = index((tile / need.h).max(1));
            (from, to) = (from.div_euclid(tile) * tile, ((to - 1).div_euclid(tile) + 1) * tile);
        }
        lines.push((from, offset(to - from)));
    }
    lines.reverse();
    lines
}

impl Region {
    /// The centre of pixel (x, y), counted within the region, in finest output pixels.
    pub fn center(&self, x: usize, y: usize) -> [f64; 2] {
        let at = |start: i32, k: usize| (f64::from(start + index(k)) + 0.5) * self.h as f64;
        [at(self.start[0], x), at(self.start[1], y)]
    }

    /// Where pixel (x, y), counted within the region, is read across joined sides: by how much its distance is smaller
    /// than a whole number of pixels, so that its content belongs that much further on. In finest pixels.
    #[inline(always)]
    pub fn beyond(&self, x: i32, y: i32) -> [i32; 2] {
        let axis = |k: i32, n: usize, short: i32| short * (i32::from(k >= index(n)) - i32::from(k < 0));
        [axis(x, self.plane.w, self.short[0]), axis(y, self.plane.h, self.short[1])]
    }

    /// A number of its own for pixel (x, y), the same in every region.
    pub fn name(&self, x: usize, y: usize) -> u64 {
        let word = |start: i32, k: usize| u64::from((start + index(k)).cast_unsigned());
        word(self.start[1], y) << 32 | word(self.start[0], x)
    }

    /// Where in the coarser region `parent` pixel (x, y) comes from, and which of its quarters it is.
    pub fn parent(&self, parent: &Self, x: usize, y: usize) -> (usize, [usize; 2]) {
        let step = index(parent.h / self.h);
        let axis = |d: usize, k: usize| {
            let at = self.start[d] + index(k);
            (offset(at.div_euclid(step) - parent.start[d]), offset(at.rem_euclid(step)))
        };
        let ((px, bx), (py, by)) = (axis(0, x), axis(1, y));
        (py * parent.plane.w + px, [bx, by])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_are_always_there() {
        let needs: Vec<Needs> = [16, 8, 4, 2, 1].map(|h| Needs { h, reach: 8, tile: (h > 1).then_some(128) }).to_vec();
        for (start, size, wrap) in [([-37, 1000], [61, 1], [false; 2]), ([0, 5], [100, 77], [true, false])] {
            let regions = plan(&Output { start, size, wrap }, &needs);
            for pair in regions.windows(2) {
                for (x, y) in [(0, 0), (pair[1].plane.w - 1, pair[1].plane.h - 1)] {
                    let (parent, _) = pair[1].parent(&pair[0], x, y);
                    assert!(parent < pair[0].plane.w * pair[0].plane.h);
                    assert!(pair[1].plane.w.div_ceil(2) <= pair[0].plane.w);
                }
            }
        }
    }
}
