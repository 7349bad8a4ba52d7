//! The pixels of each level that an output needs.
//!
//! Along axes that wrap, a level covers the output once. Along others, a level is larger than its wanted part by the
//! reach of its correction, so that every window of an unbounded texture shows the same content; with every pass the
//! margin shrinks.
use super::plane::PixelPlane;
use crate::ground::window::{index, offset};

/// The wanted pixels of the result, in absolute coordinates, and the axes that wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// First column and row; 0 along axes that wrap.
    pub start: [i32; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Wrapping of x and y.
    pub wrap: [bool; 2],
}

/// The pixels of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Spacing in finest pixels.
    pub h: usize,
    /// First column and row, absolute, in pixels of the level.
    pub start: [i32; 2],
    /// Columns and rows, and the axes that wrap.
    pub plane: PixelPlane,
    /// Difference between `h` and the width of the last column (and row), along axes that wrap.
    pub short: [i32; 2],
}

/// Reads of a level's correction.
#[derive(Clone, Copy, Debug)]
pub struct Needs {
    /// Spacing in finest pixels.
    pub h: usize,
    /// Reach in pixels of the level.
    pub reach: i32,
    /// If set, local tiles of this side are needed whole.
    pub tile: Option<usize>,
}

/// The pixels of a level: those at its start, and those of its result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planned {
    /// The pixels held at the start of the level.
    pub region: Region,
    /// The pixels whose result must be right.
    pub wanted: Region,
}

/// Plans the pixels of all levels; `needs` is sorted from the coarsest level to the finest.
pub fn plan(output: &Output, needs: &[Needs]) -> Vec<Planned> {
    let axes = [0, 1].map(|axis| line(output, axis, needs));
    let region = |k: usize, lines: [(i32, usize); 2]| Region {
        h: needs[k].h,
        start: lines.map(|line| line.0),
        plane: PixelPlane { w: lines[0].1, h: lines[1].1, wrap: output.wrap },
        short: [0, 1].map(|d| match output.wrap[d] {
            true => index(lines[d].1 * needs[k].h - output.size[d]),
            false => 0,
        }),
    };
    let planned = |k: usize| Planned {
        region: region(k, [axes[0][k].0, axes[1][k].0]),
        wanted: region(k, [axes[0][k].1, axes[1][k].1]),
    };
    (0..needs.len()).map(planned).collect()
}

/// First pixel and count along an axis: of the pixels held, and of the wanted ones.
type Line = ((i32, usize), (i32, usize));

fn line(output: &Output, axis: usize, needs: &[Needs]) -> Vec<Line> {
    if output.wrap[axis] {
        let all = |need: &Needs| (0, output.size[axis].div_ceil(need.h));
        return needs.iter().map(|need| (all(need), all(need))).collect();
    }
    let (mut from, mut to) = (output.start[axis], output.start[axis] + index(output.size[axis]));
    let mut lines: Vec<Line> = Vec::new();
    for (k, need) in needs.iter().enumerate().rev() {
        if k + 1 < needs.len() {
            let step = index(needs[k].h / needs[k + 1].h);
            (from, to) = (from.div_euclid(step), (to - 1).div_euclid(step) + 1);
        }
        let wanted = (from, offset(to - from));
        (from, to) = (from - need.reach, to + need.reach);
        if let Some(tile) = need.tile {
            let tile = index((tile / need.h).max(1));
            (from, to) = (from.div_euclid(tile) * tile, ((to - 1).div_euclid(tile) + 1) * tile);
        }
        lines.push(((from, offset(to - from)), wanted));
    }
    lines.reverse();
    lines
}

impl Region {
    /// Centre of pixel (x, y), relative to the region, in finest output pixels.
    pub fn center(&self, x: usize, y: usize) -> [f64; 2] {
        let at = |start: i32, k: usize| (f64::from(start + index(k)) + 0.5) * self.h as f64;
        [at(self.start[0], x), at(self.start[1], y)]
    }

    /// Shift of the content of pixel (x, y), relative to the region, if it is read across a wrapping side: its distance
    /// is smaller than a whole number of pixels by this much. In finest pixels.
    #[inline(always)]
    pub fn beyond(&self, x: i32, y: i32) -> [i32; 2] {
        let axis = |k: i32, n: usize, short: i32| short * (i32::from(k >= index(n)) - i32::from(k < 0));
        [axis(x, self.plane.w, self.short[0]), axis(y, self.plane.h, self.short[1])]
    }

    /// The `wanted` part plus a margin of `by` pixels; the whole range along axes that wrap.
    pub fn around(&self, wanted: &Self, by: i32) -> Self {
        let PixelPlane { w, h, wrap } = self.plane;
        let (size, inner) = ([w, h], [wanted.plane.w, wanted.plane.h]);
        let line = |d: usize| {
            if wrap[d] {
                return (self.start[d], size[d]);
            }
            let from = (wanted.start[d] - by).max(self.start[d]);
            let to = (wanted.start[d] + index(inner[d]) + by).min(self.start[d] + index(size[d]));
            (from, offset(to - from))
        };
        let lines = [line(0), line(1)];
        Self { start: lines.map(|line| line.0), plane: PixelPlane { w: lines[0].1, h: lines[1].1, wrap }, ..*self }
    }

    /// Crops a per-pixel array to a `part` of the region; an empty array stays empty.
    pub fn keep<T: Copy>(&self, part: &Self, numbers: &mut Vec<T>) {
        if numbers.is_empty() || part == self {
            return;
        }
        let (skip, w) = ([0, 1].map(|d| offset(part.start[d] - self.start[d])), part.plane.w);
        for y in 0..part.plane.h {
            let from = (y + skip[1]) * self.plane.w + skip[0];
            numbers.copy_within(from..from + w, y * w);
        }
        numbers.truncate(w * part.plane.h);
    }

    /// A unique number of pixel (x, y), the same in every region.
    pub fn name(&self, x: usize, y: usize) -> u64 {
        let word = |start: i32, k: usize| u64::from((start + index(k)).cast_unsigned());
        word(self.start[1], y) << 32 | word(self.start[0], x)
    }

    /// The pixel's parent in the coarser region `parent`, and the quadrant of the parent that the pixel is.
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
    fn plans_all_parents() {
        let needs: Vec<Needs> = [16, 8, 4, 2, 1].map(|h| Needs { h, reach: 8, tile: (h > 1).then_some(128) }).to_vec();
        for (start, size, wrap) in [([-37, 1000], [61, 1], [false; 2]), ([0, 5], [100, 77], [true, false])] {
            let planned = plan(&Output { start, size, wrap }, &needs);
            for pair in planned.windows(2) {
                let pair = [pair[0].wanted, pair[1].region];
                for (x, y) in [(0, 0), (pair[1].plane.w - 1, pair[1].plane.h - 1)] {
                    let (parent, _) = pair[1].parent(&pair[0], x, y);
                    assert!(parent < pair[0].plane.w * pair[0].plane.h);
                    assert!(pair[1].plane.w.div_ceil(2) <= pair[0].plane.w);
                }
            }
        }
    }

    #[test]
    fn keeps_values_of_cropped_pixels() {
        let needs = [Needs { h: 2, reach: 5, tile: Some(32) }, Needs { h: 1, reach: 3, tile: None }];
        for wrap in [[false; 2], [false, true]] {
            let planned = plan(&Output { start: [if wrap[0] { 0 } else { -7 }, 0], size: [20, 30], wrap }, &needs)[0];
            let all = planned.region;
            let names = |of: &Region| -> Vec<u64> {
                (0..of.plane.w * of.plane.h).map(|p| of.name(p % of.plane.w, p / of.plane.w)).collect()
            };
            for by in [100, 4, 0] {
                let part = all.around(&planned.wanted, by);
                let mut numbers = names(&all);
                all.keep(&part, &mut numbers);
                assert_eq!(numbers, names(&part));
                assert!(by > 4 || part.plane.w == planned.wanted.plane.w + 2 * by as usize);
            }
            assert_eq!(all.around(&planned.wanted, 0), planned.wanted);
        }
    }
}
