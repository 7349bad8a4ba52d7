//! What an exemplar shows around each pixel of a level, to be compared with what a result shows around one of its own.
use super::candidates::narrow;
use super::pca::principal;
use super::plane::Plane;
use super::region::Region;
use super::table::Table;
use super::texels::{Texels, mirrored};
use crate::ground::window::{index, offset};

/// What is compared of a pixel: its channels, or their principal components where there are more.
pub(super) type Shade = [f32; 4];

/// The factor on the distance of patches that are not whole, because they reach beyond the exemplar.
const BEYOND: f32 = 1.5;

/// A level's picture, padded so far that whatever a neighbour predicts is there with all that lies around it.
pub(super) struct Patches {
    /// Spacing in finest pixels.
    pub(super) h: usize,
    /// How far patches reach, in pixels of the level.
    pub(super) reach: usize,
    stride: usize,
    pad: usize,
    shades: Vec<Shade>,
    /// What a patch's distance is multiplied by; infinite where nothing may be shown.
    worth: Vec<f32>,
    /// The index in the level's tables; of the border outside.
    known: Vec<u32>,
    /// Where the padding of sides that join leads; empty if none do.
    home: Vec<u32>,
}

impl Patches {
    /// The patches of a level from its picture.
    pub(super) fn new(image: &Texels<f32>, table: &Table, reach: usize) -> Self {
        let Plane { w, h: rows, wrap } = image.plane;
        let (h, pad) = (table.h, 2 * reach * table.h);
        let stride = w + 2 * pad;
        let count = stride * (rows + 2 * pad);
        let shades = shades(image);
        let margin = index(reach * h);
        let whole = |k: i32, n: usize, wrap: bool| wrap || (margin..index(n) - margin).contains(&k);
        let mut made = Self {
            h,
            reach,
            stride,
            pad,
            shades: Vec::with_capacity(count),
            worth: Vec::with_capacity(count),
            known: Vec::with_capacity(count),
            home: Vec::new(),
        };
        for p in 0..count {
            let [x, y] = made.place(p);
            made.shades.push(shades[mirrored(y, rows, wrap[1]) * w + mirrored(x, w, wrap[0])]);
            let at = table.at([index(Plane::bring(x, w, wrap[0])), index(Plane::bring(y, rows, wrap[1]))]);
            made.known.push(at);
            made.worth.push(if !table.holds([x, y]) || !table.is_valid(at) {
                f32::INFINITY
            } else if whole(x, w, wrap[0]) && whole(y, rows, wrap[1]) {
                1.0
            } else {
                BEYOND
            });
        }
        if wrap != [false; 2] {
            let bring = |k: i32, n: usize, wrap: bool| if wrap { k.rem_euclid(index(n)) } else { k };
            let place = |p: usize| made.place(p);
            let home = |[x, y]: [i32; 2]| made.at([bring(x, w, wrap[0]), bring(y, rows, wrap[1])]);
            made.home = (0..count).map(|p| home(place(p))).collect();
        }
        made
    }

    fn place(&self, p: usize) -> [i32; 2] {
        [index(p % self.stride) - index(self.pad), index(p / self.stride) - index(self.pad)]
    }

    /// The index of exemplar pixel (x, y), which may lie in the padding.
    #[inline(always)]
    pub(super) fn at(&self, [x, y]: [i32; 2]) -> u32 {
        narrow(offset(y + index(self.pad)) * self.stride + offset(x + index(self.pad)))
    }

    /// The exemplar pixel of an index.
    #[inline(always)]
    pub(super) fn pixel(&self, at: u32) -> [i32; 2] {
        self.place(at as usize)
    }

    /// The index in the level's tables.
    #[inline(always)]
    pub(super) fn known(&self, at: u32) -> u32 {
        self.known[at as usize]
    }

    /// What is added to an index to go (x, y) pixels of the level on.
    #[inline(always)]
    pub(super) fn step(&self, x: i32, y: i32) -> u32 {
        (index(self.h) * (y * index(self.stride) + x)).cast_unsigned()
    }

    /// An index brought inside where sides join.
    #[inline(always)]
    pub(super) fn home(&self, at: u32) -> u32 {
        if self.home.is_empty() { at } else { self.home[at as usize] }
    }

    /// What pixel (x, y) shows if it continues the one at (dx, dy) from it, whose index is what `at` gives.
    #[inline(always)]
    pub(super) fn continued(
        &self,
        region: &Region,
        [x, y]: [i32; 2],
        [dx, dy]: [i32; 2],
        at: impl Fn(usize) -> u32,
    ) -> u32 {
        let Plane { w, h, wrap } = region.plane;
        // Across joined sides, it may be nearer than usual.
        let beyond = region.beyond(x + dx, y + dy);
        let shift = (beyond[1] * index(self.stride) + beyond[0]).cast_unsigned();
        let near = Plane::bring(y + dy, h, wrap[1]) * w + Plane::bring(x + dx, w, wrap[0]);
        self.home(at(near).wrapping_sub(self.step(dx, dy)).wrapping_add(shift))
    }

    /// What the distance of the patch around an index is multiplied by; infinite where nothing may be shown.
    #[inline(always)]
    pub(super) fn worth(&self, at: u32) -> f32 {
        self.worth[at as usize]
    }

    /// What is compared of the pixel of an index.
    #[inline(always)]
    pub(super) fn shade(&self, at: u32) -> &Shade {
        &self.shades[at as usize]
    }

    /// The squared distance of the patch around an index from one that is shown; infinite where it is above `most`.
    #[inline(always)]
    pub(super) fn distance(&self, shown: &[Shade], at: u32, most: f32) -> f32 {
        let side = 2 * self.reach + 1;
        let mut first = at as usize - self.reach * self.h * (self.stride + 1);
        let mut sums = [0.0f32; 4];
        let mut sum = 0.0;
        for row in shown.chunks_exact(side) {
            let own = self.shades[first..first + (side - 1) * self.h + 1].iter().step_by(self.h);
            for (v, e) in row.iter().zip(own) {
                for c in 0..4 {
                    let d = v[c] - e[c];
                    sums[c] += d * d;
                }
            }
            sum = (sums[0] + sums[2]) + (sums[1] + sums[3]);
            if sum > most {
                return f32::INFINITY;
            }
            first += self.h * self.stride;
        }
        sum
    }
}

/// What is compared of every pixel of a picture.
fn shades(image: &Texels<f32>) -> Vec<Shade> {
    let pixels = image.data.chunks_exact(image.channels);
    if image.channels <= 4 {
        return pixels.map(|v| std::array::from_fn(|c| v.get(c).copied().unwrap_or(0.0))).collect();
    }
    let matrix = principal(&image.data, image.channels, 4);
    pixels
        .map(|v| {
            let mut out = [0.0; 4];
            for (v, row) in v.iter().zip(&matrix) {
                out.iter_mut().zip(row).for_each(|(out, m)| *out += v * m);
            }
            out
        })
        .collect()
}
