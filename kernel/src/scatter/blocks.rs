//! Which stamps are seen in which blocks of a window. What a block shows already, or what is drawn over it later, hides most of
//! the stamps where many overlap, and those are not drawn there. That never changes a bit of the result.
use super::atlas::Layout;
use super::set::{Near, StampSet};
use super::span::{Placed, SIDE, Span};
use crate::ground::number::index_u32;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;

/// How often a window asks whether to stop: once in so many stamps.
const AT_ONCE: u32 = 256;

/// What hides a stamp.
pub(super) enum Hidden<'a> {
    /// Nothing.
    Never,
    /// What is there already, if that is nowhere less than these pictures times the stamp's value, or 0 if `zero` is true. In
    /// `any_order` the result does not depend on the order.
    Below { pictures: &'a [&'a [f32]], zero: bool, any_order: bool },
    /// What is there already, if that is nowhere less than 1.
    Full,
    /// A later stamp that covers the whole block; stamps are opaque.
    Later,
}

/// A block in which a stamp is seen.
pub(super) struct Block {
    /// The stamp's place in the order of drawing.
    pub(super) number: u32,
    /// The factor on its values.
    pub(super) value: f32,
    /// The first pixel in the planes.
    at: usize,
    /// From one row of the planes to the next.
    stride: usize,
    columns: usize,
    rows: usize,
}

impl Block {
    /// Changes a plane: `change(pixel of the block, value)`; returns the least value that is then there.
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

    /// The least value of a plane.
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

    /// Calls for every pixel of the window: `visit(pixel of the block, pixel of the planes)`.
    #[inline(always)]
    pub(super) fn pixels(&self, mut visit: impl FnMut(usize, usize)) {
        for row in 0..self.rows {
            for k in 0..self.columns {
                visit(SIDE * row + k, self.at + row * self.stride + k);
            }
        }
    }
}

/// A stamp in the blocks of a window.
struct Laid {
    placed: Placed,
    value: f32,
    /// How far the pixels of a block lie from its middle, texels.
    reach: [f32; 2],
    /// Of the picture, texels.
    size: [f32; 2],
    /// How wide the soft edge is inside and outside, texels.
    edge: [f32; 2],
}

impl Laid {
    /// Whether it may touch a block.
    #[inline(always)]
    fn touches(&self, middle: [f32; 2]) -> bool {
        (0..2).all(|k| {
            let reach = self.reach[k] + self.edge[k];
            middle[k] >= -reach && middle[k] <= self.size[k] + reach
        })
    }

    /// Whether it covers every pixel of a block.
    #[inline(always)]
    fn covers(&self, middle: [f32; 2]) -> bool {
        (0..2).all(|k| {
            let reach = self.reach[k] + self.edge[k];
            middle[k] >= reach && middle[k] <= self.size[k] - reach
        })
    }

    /// The most that it can be in a block.
    #[inline(always)]
    fn peak(&self, picture: &[f32], middle: [f32; 2], zero: bool) -> f32 {
        // Values between texels lie within a texel.
        let reach = self.reach[0].max(self.reach[1]) + 1.0;
        self.at_most(self.placed.level().peak(picture, middle, reach), zero)
    }

    /// The most that it can be anywhere.
    fn summit(&self, picture: &[f32], zero: bool) -> f32 {
        self.at_most(self.placed.level().summit(picture), zero)
    }

    /// The most that it can be where texels are at most `texel`.
    #[inline(always)]
    fn at_most(&self, texel: f32, zero: bool) -> f32 {
        if self.value < 0.0 {
            return f32::INFINITY;
        }
        // Rounding adds some millionths.
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

    /// Visits the blocks in which a stamp may be seen, stamp by stamp in the order of drawing, until `stop` is true. `visit` gets the
    /// block, where its pixels lie, and a number for each of the pictures that can be hidden (one without any), in which it leaves
    /// the least value that the block then shows.
    #[inline(always)]
    pub(super) fn each(
        &self,
        stop: &dyn Fn() -> bool,
        hidden: &Hidden<'_>,
        mut visit: impl FnMut(&Block, &mut Span, &mut [f32]),
    ) {
        let (rect, stamps) = (self.frame.window, self.set.stamps());
        let mut near = self.set.near(self.frame);
        let mut width = 1;
        if let Hidden::Below { pictures, any_order, .. } = hidden {
            width = pictures.len().max(1);
            if *any_order {
                // High ones first: they hide most.
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
            let [rows, columns] = laid.placed.blocks(self.frame);
            if let Hidden::Below { pictures, zero, .. } = hidden {
                let summits = || pictures.iter().map(|picture| laid.summit(picture, *zero));
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
                            !(pictures.iter().zip(&*least)).all(|(p, least)| laid.peak(p, middle, *zero) <= *least)
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
        let placed = Placed::new(stamp, shift, self.layout.levels(), self.frame);
        let ((size, edge), reach) = (placed.outline(), placed.reach());
        Laid { placed, value: stamp.value, reach, size, edge }
    }

    #[inline(always)]
    fn block(&self, number: u32, value: f32, [i, j]: [usize; 2]) -> Block {
        let rect = self.frame.window;
        let (x, y) = (SIDE * i, SIDE * j);
        Block {
            number,
            value,
            at: y * rect.columns() + x,
            stride: rect.columns(),
            columns: (rect.columns() - x).min(SIDE),
            rows: (rect.rows() - y).min(SIDE),
        }
    }

    /// For each block the last of the stamps that covers all of it; nothing is found unless it is `wanted`.
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
