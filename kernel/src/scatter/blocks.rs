//! Occlusion culling of stamps per block of a window. Where many stamps overlap, most are hidden by the content of a
//! block, or by later stamps; those are not drawn there. Culling never changes a bit of the result.
use super::atlas::Layout;
use super::set::{Near, StampSet};
use super::span::{PlacedStamp, SIDE, Span};
use crate::ground::number::index_u32;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;

/// Number of stamps between two checks of `stop`.
const AT_ONCE: u32 = 256;

/// Conditions under which a stamp is hidden.
pub(super) enum Hidden<'a> {
    /// Nothing hides a stamp.
    Never,
    /// The block's content hides a stamp if it is nowhere less than the channels of its picture times the stamp's value
    /// (or than 0 if `zero`). `any_order`: the result does not depend on the order of drawing.
    Below { pictures: Vec<&'a [&'a [f32]]>, zero: bool, any_order: bool },
    /// The block's content hides a stamp if it is nowhere less than 1.
    Full,
    /// A later stamp that covers the whole block hides it; stamps are opaque.
    Later,
}

/// A block in which a stamp is visible.
pub(super) struct StampBlock {
    /// Index of the stamp.
    pub(super) number: u32,
    /// Factor on the stamp's values.
    pub(super) value: f32,
    /// Offset of the first pixel in the planes.
    at: usize,
    /// Offset from one row of the planes to the next.
    stride: usize,
    columns: usize,
    rows: usize,
}

impl StampBlock {
    /// Changes a plane by `change(pixel of the block, value)`.
    #[inline(always)]
    pub(super) fn draw<T: Copy>(&self, plane: &mut [T], mut change: impl FnMut(usize, &mut T)) {
        for row in 0..self.rows {
            let out = &mut plane[self.at + row * self.stride..][..self.columns];
            if let Ok(out) = <&mut [T; SIDE]>::try_from(&mut *out) {
                for (k, out) in out.iter_mut().enumerate() {
                    change(SIDE * row + k, out);
                }
            } else {
                for (k, out) in out.iter_mut().enumerate() {
                    change(SIDE * row + k, out);
                }
            }
        }
    }

    /// The smallest value of a plane in the block.
    #[inline(always)]
    pub(super) fn least(&self, plane: &[f32]) -> f32 {
        let lower = |a: f32, b: f32| if b < a { b } else { a };
        let mut least = [f32::INFINITY; SIDE];
        for row in 0..self.rows {
            let values = &plane[self.at + row * self.stride..][..self.columns];
            if let Ok(values) = <&[f32; SIDE]>::try_from(values) {
                for k in 0..SIDE {
                    least[k] = lower(least[k], values[k]);
                }
            } else {
                least[0] = values.iter().copied().fold(least[0], lower);
            }
        }
        least.into_iter().fold(f32::INFINITY, lower)
    }

    /// Calls `visit(pixel of the block, pixel of the planes)` for every pixel of the block.
    #[inline(always)]
    pub(super) fn pixels(&self, mut visit: impl FnMut(usize, usize)) {
        for row in 0..self.rows {
            for k in 0..self.columns {
                visit(SIDE * row + k, self.at + row * self.stride + k);
            }
        }
    }
}

/// A stamp laid out for the blocks of a window.
struct Laid {
    placed: PlacedStamp,
    value: f32,
    /// Maximum distance of a block's pixels from its middle, in texels.
    reach: [f32; 2],
    /// Size of the picture, in texels.
    size: [f32; 2],
    /// Width of the soft edge inside and outside, in texels.
    edge: [f32; 2],
}

impl Laid {
    /// Returns whether the stamp may touch a block.
    #[inline(always)]
    fn touches(&self, middle: [f32; 2]) -> bool {
        (0..2).all(|k| {
            let reach = self.reach[k] + self.edge[k];
            middle[k] >= -reach && middle[k] <= self.size[k] + reach
        })
    }

    /// Returns whether the stamp covers every pixel of a block.
    #[inline(always)]
    fn covers(&self, middle: [f32; 2]) -> bool {
        (0..2).all(|k| {
            let reach = self.reach[k] + self.edge[k];
            middle[k] >= reach && middle[k] <= self.size[k] - reach
        })
    }

    /// Upper bound of the stamp's values in a block.
    #[inline(always)]
    fn peak(&self, picture: &[f32], middle: [f32; 2], zero: bool) -> f32 {
        // Interpolation reads up to one texel farther.
        let reach = self.reach[0].max(self.reach[1]) + 1.0;
        self.at_most(self.placed.level().peak(picture, middle, reach), zero)
    }

    /// Upper bound of the stamp's values.
    fn summit(&self, picture: &[f32], zero: bool) -> f32 {
        self.at_most(self.placed.level().summit(picture), zero)
    }

    /// Upper bound of the stamp's values if its texels are at most `texel`.
    #[inline(always)]
    fn at_most(&self, texel: f32, zero: bool) -> f32 {
        if self.value < 0.0 {
            return f32::INFINITY;
        }
        // Allow for rounding, a few millionths.
        let most = texel * self.value;
        let most = most + 1e-5 * most.abs();
        if zero { most.max(0.0) } else { most }
    }
}

/// The blocks of a window.
pub(super) struct Blocks<'a> {
    set: &'a StampSet,
    layout: &'a Layout,
    frame: &'a Frame,
    columns: usize,
    rows: usize,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(set: &'a StampSet, layout: &'a Layout, frame: &'a Frame) -> Self {
        let [columns, rows] = [frame.window.columns(), frame.window.rows()].map(|n| n.div_ceil(SIDE));
        Self { set, layout, frame, columns, rows }
    }

    /// Visits the blocks in which a stamp may be visible, stamp by stamp in the order of drawing, until `stop` returns
    /// true. `visit` gets the block, the positions of its pixels, and one number per channel of [`Hidden::Below`] (one
    /// for other rules), in which it stores the smallest value of the block after drawing.
    #[inline(always)]
    pub(super) fn each(
        &self,
        stop: &dyn Fn() -> bool,
        hidden: &Hidden<'_>,
        mut visit: impl FnMut(&StampBlock, &mut Span, &mut [f32]),
    ) {
        let (rect, stamps) = (self.frame.window, self.set.stamps());
        let mut near = self.set.near(self.frame);
        let mut width = 1;
        if let Hidden::Below { pictures, any_order, .. } = hidden {
            width = pictures.first().map_or(1, |channels| channels.len().max(1));
            if *any_order {
                // Large values first: they hide most.
                near.sort_by(|a, b| stamps[b.stamp as usize].value.total_cmp(&stamps[a.stamp as usize].value));
            }
        }
        let covered = self.covered(stop, matches!(hidden, Hidden::Later), &near);
        let mut least = vec![f32::NEG_INFINITY; self.columns * self.rows * width];
        let mut span = Span::new();
        for (n, near) in (0u32..).zip(&near) {
            if n % AT_ONCE == 0 && stop() {
                return;
            }
            let laid = self.laid(near);
            let picture = stamps[near.stamp as usize].picture as usize;
            let [rows, columns] = laid.placed.blocks(self.frame);
            if let Hidden::Below { pictures, zero, .. } = hidden {
                let summits = || pictures[picture].iter().map(|picture| laid.summit(picture, *zero));
                let mut rows =
                    rows.clone().map(|j| &least[(j * self.columns + columns.start) * width..][..columns.len() * width]);
                if rows.all(|row| {
                    row.chunks_exact(width).all(|least| summits().zip(least).all(|(most, least)| most <= *least))
                }) {
                    continue;
                }
            }
            for j in rows {
                for i in columns.clone() {
                    let (x, y) = (rect.x + index(SIDE * i), rect.y + index(SIDE * j));
                    let (middle, k) = (laid.placed.middle(x, y), j * self.columns + i);
                    if !laid.touches(middle) {
                        continue;
                    }
                    let least = &mut least[k * width..][..width];
                    let seen = match hidden {
                        Hidden::Never => true,
                        Hidden::Below { pictures, zero, .. } => {
                            let channels = pictures[picture].iter().zip(&*least);
                            !channels.into_iter().all(|(channel, least)| laid.peak(channel, middle, *zero) <= *least)
                        }
                        Hidden::Full => least[0] < 1.0,
                        Hidden::Later => covered[k] <= n,
                    };
                    if seen {
                        laid.placed.find(x, y, &mut span);
                        visit(&self.block(near.stamp, laid.value, [i, j]), &mut span, least);
                    }
                }
            }
        }
    }

    fn laid(&self, near: &Near) -> Laid {
        let stamp = &self.set.stamps()[near.stamp as usize];
        let shift = DVec2::new(f64::from(near.copy[0]), f64::from(near.copy[1])) * self.set.period();
        let placed = PlacedStamp::new(stamp, shift, self.layout.levels(), self.frame);
        let ((size, edge), reach) = (placed.outline(), placed.reach());
        Laid { placed, value: stamp.value, reach, size, edge }
    }

    #[inline(always)]
    fn block(&self, number: u32, value: f32, [i, j]: [usize; 2]) -> StampBlock {
        let rect = self.frame.window;
        let (x, y) = (SIDE * i, SIDE * j);
        StampBlock {
            number,
            value,
            at: y * rect.columns() + x,
            stride: rect.columns(),
            columns: (rect.columns() - x).min(SIDE),
            rows: (rect.rows() - y).min(SIDE),
        }
    }

    /// For each block the last stamp that covers all of it; 0 unless `wanted`.
    fn covered(&self, stop: &dyn Fn() -> bool, wanted: bool, near: &[Near]) -> Vec<u32> {
        let (rect, mut last) = (self.frame.window, vec![0; self.columns * self.rows]);
        let mut open = if wanted { last.len() } else { 0 };
        for (n, near) in (0..index_u32(near.len())).zip(near).rev() {
            if open == 0 || (n % AT_ONCE == 0 && stop()) {
                break;
            }
            let laid = self.laid(near);
            let [rows, columns] = laid.placed.blocks(self.frame);
            for j in rows {
                for i in columns.clone() {
                    let last = &mut last[j * self.columns + i];
                    let middle = laid.placed.middle(rect.x + index(SIDE * i), rect.y + index(SIDE * j));
                    if *last == 0 && laid.covers(middle) {
                        *last = n;
                        open -= usize::from(n > 0);
                    }
                }
            }
        }
        last
    }
}
