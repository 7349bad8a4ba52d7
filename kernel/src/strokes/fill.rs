//! The inner loops of [`super::set`]: draws strokes into a window, several pixels of a row at a time.
//!
//! The rows of a stroke are divided into blocks of pixels before any is drawn. So the processor mispredicts few
//! branches, and the long chains of operations of several blocks overlap.

use super::job::Job;
use super::pen::{Edge, Gaussian, LANES, Linear, Pen, Pens, Shape, Smooth};
use super::style::{NO_STROKE, Profile};
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt};
use pulp::Simd;
use shibo_value::Buffer;
use std::ops::RangeInclusive;

/// Combination of new pixels with existing ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CombineRule {
    /// The maximum.
    Max,
    /// The maximum, and the id of its stroke.
    Ids,
    /// The sum.
    Add,
    /// The sum minus the product times this factor.
    Screen(f32),
}

impl CombineRule {
    /// Combines a new pixel with the existing one.
    #[inline(always)]
    fn combine<S: Simd>(self, simd: S, old: S::f32s, new: S::f32s) -> S::f32s {
        match self {
            Self::Max | Self::Ids => simd.max_f32s(old, new),
            Self::Add => simd.add_f32s(old, new),
            Self::Screen(part) => {
                let both = simd.mul_f32s(simd.mul_f32s(old, new), simd.splat_f32s(part));
                simd.sub_f32s(simd.add_f32s(old, new), both)
            }
        }
    }
}

/// The pixels of a window, padded for whole blocks.
pub(super) struct Target {
    frame: Frame,
    rule: CombineRule,
    stride: usize,
    values: Buffer,
    ids: Vec<u32>,
}

impl Target {
    pub(super) fn new(frame: &Frame, rule: CombineRule) -> Self {
        let stride = frame.window.columns() + LANES;
        let count = stride * frame.window.rows();
        let ids = if rule == CombineRule::Ids { vec![NO_STROKE; count] } else { Vec::new() };
        Self { frame: *frame, rule, stride, values: Buffer::zeros(count), ids }
    }

    /// Draws strokes in their order.
    pub(super) fn draw(&mut self, job: Job<'_>) {
        simd::dispatch_op(Call { target: self, job });
    }

    pub(super) fn copy_to(&self, out: &mut [f32], ids: &mut [u32]) {
        let width = self.frame.window.columns();
        if width == 0 {
            return;
        }
        for (to, from) in out.chunks_exact_mut(width).zip(self.values.chunks_exact(self.stride)) {
            to.copy_from_slice(&from[..width]);
        }
        for (to, from) in ids.chunks_exact_mut(width).zip(self.ids.chunks_exact(self.stride)) {
            to.copy_from_slice(&from[..width]);
        }
    }
}

/// A call for [`pulp::Arch::dispatch`]: a closure would not be inlined into the function with the vector instructions.
struct Call<'c, 's> {
    target: &'c mut Target,
    job: Job<'s>,
}

impl pulp::WithSimd for Call<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { target, job } = self;
        match job.style.profile {
            Profile::Flat | Profile::Brush => target.strokes(simd, &job, 1.0, |pen| Edge::new(pen, &job.style)),
            Profile::Linear => target.strokes(simd, &job, 1.0, |_| Linear),
            Profile::Smooth => target.strokes(simd, &job, 1.0, |_| Smooth),
            Profile::Gaussian { sigma, cutoff } => {
                let unit = (128.0 * sigma * sigma).sqrt().recip();
                let end = (2.0 * cutoff * unit).min(1.0);
                target.strokes(simd, &job, unit, |_| Gaussian { end: end * end });
            }
        }
    }
}

impl Target {
    /// Draws strokes with the cross-section that `shape` returns for each; a half width is `unit` of its units.
    #[inline(always)]
    fn strokes<S: Simd, P: Shape>(&mut self, simd: S, job: &Job<'_>, unit: f32, shape: impl Fn(&Pen) -> P) {
        let style = &job.style;
        let pens = Pens::new(&self.frame, job, unit);
        let taper = style.taper > 0.0 || style.tip > 0.0 || style.profile == Profile::Brush;
        let mut scratch = Scratch::NEW;
        for near in job.near {
            let Some(pen) = pens.pen(&job.grooves[near.groove as usize], near.copy) else { continue };
            let shape = shape(&pen);
            match (taper, style.round_caps, self.rule == CombineRule::Max) {
                (false, false, true) => self.stroke::<S, false, false, true>(simd, &pen, &shape, &mut scratch),
                (false, true, true) => self.stroke::<S, false, true, true>(simd, &pen, &shape, &mut scratch),
                (true, false, true) => self.stroke::<S, true, false, true>(simd, &pen, &shape, &mut scratch),
                (true, true, true) => self.stroke::<S, true, true, true>(simd, &pen, &shape, &mut scratch),
                (_, false, _) => self.stroke::<S, true, false, false>(simd, &pen, &shape, &mut scratch),
                (_, true, _) => self.stroke::<S, true, true, false>(simd, &pen, &shape, &mut scratch),
            }
        }
    }

    /// Draws one stroke. `MAX`: by [`CombineRule::Max`].
    #[inline(always)]
    fn stroke<S: Simd, const TAPER: bool, const ROUND: bool, const MAX: bool>(
        &mut self,
        simd: S,
        pen: &Pen,
        shape: &impl Shape,
        scratch: &mut Scratch,
    ) {
        let height = i32::try_from(self.frame.window.height).unwrap_or(i32::MAX);
        let last = pen.rows[1].min((height - 1).saturating_sub(pen.row));
        let lanes = S::F32_LANES;
        let blocks = (usize::try_from(pen.wide).unwrap_or(0).div_ceil(lanes)).min(self.stride / lanes);
        for strip in 0..blocks.div_ceil(STRIP) {
            let mut row = pen.rows[0].max(pen.row.saturating_neg());
            while row <= last {
                let count;
                (row, count) = self.cut(simd, pen, row..=last, [strip, blocks.min(STRIP)], scratch);
                for block in &scratch.blocks[..count] {
                    let new = pen.values::<S, TAPER, ROUND>(simd, block.column, [block.along, block.across], shape);
                    let out = &mut S::as_mut_simd_f32s(&mut self.values[block.at..block.at + lanes]).0[0];
                    if MAX {
                        *out = simd.max_f32s(*out, new);
                        continue;
                    }
                    if self.rule == CombineRule::Ids {
                        let ids = &mut S::as_mut_simd_u32s(&mut self.ids[block.at..block.at + lanes]).0[0];
                        *ids = simd.select_u32s(simd.less_than_f32s(*out, new), simd.splat_u32s(pen.id), *ids);
                    }
                    *out = self.rule.combine(simd, *out, new);
                }
            }
        }
    }

    /// Divides a strip of rows into blocks, as many as there is room for; returns the next row and the number of
    /// blocks. Blocks beyond a row's end are written and then overwritten: this is faster than a branch.
    #[inline(always)]
    fn cut<S: Simd>(
        &self,
        simd: S,
        pen: &Pen,
        rows: RangeInclusive<i32>,
        [strip, per_row]: [usize; 2],
        scratch: &mut Scratch,
    ) -> (i32, usize) {
        let lanes = S::F32_LANES;
        let (mut row, mut count) = (*rows.start(), 0);
        while row <= *rows.end() && count + LANES * STRIP <= BLOCKS {
            let spans = pen.spans(simd, row as f32, self.frame.window.width as f32, (strip * STRIP * lanes) as f32);
            S::as_mut_simd_u32s(&mut scratch.from).0[0] = spans.from;
            S::as_mut_simd_u32s(&mut scratch.count).0[0] = spans.count;
            S::as_mut_simd_f32s(&mut scratch.column).0[0] = spans.column;
            S::as_mut_simd_f32s(&mut scratch.along).0[0] = spans.along;
            S::as_mut_simd_f32s(&mut scratch.across).0[0] = spans.across;
            let here = usize::try_from(rows.end() - row + 1).unwrap_or(0).min(lanes);
            let mut line = usize::try_from(pen.row + row).unwrap_or(0) * self.stride;
            for r in 0..here {
                let at = line + scratch.from[r] as usize;
                let (column, along, across) = (scratch.column[r], scratch.along[r], scratch.across[r]);
                for (n, block) in scratch.blocks[count..count + STRIP].iter_mut().take(per_row).enumerate() {
                    *block = Block { at: at + n * lanes, column: column + (n * lanes) as f32, along, across };
                }
                count += (scratch.count[r] as usize).min(per_row);
                line += self.stride;
            }
            row += i32::try_from(lanes).unwrap_or(1);
        }
        (row, count)
    }
}

/// Number of blocks of a row that are divided at a time.
const STRIP: usize = 4;
/// Number of blocks that are drawn at a time.
const BLOCKS: usize = 192;

/// Several adjacent pixels of a row.
#[derive(Clone, Copy, Default)]
struct Block {
    /// Index of the first one on the target.
    at: usize,
    /// Column of the first one, relative to the middle of the stroke.
    column: f32,
    /// The row's offsets along and across, see [`Pen::values`].
    along: f32,
    across: f32,
}

/// Memory for rows and blocks.
struct Scratch {
    from: [u32; LANES],
    count: [u32; LANES],
    column: [f32; LANES],
    along: [f32; LANES],
    across: [f32; LANES],
    blocks: [Block; BLOCKS],
}

impl Scratch {
    const NEW: Self = Self {
        from: [0; LANES],
        count: [0; LANES],
        column: [0.0; LANES],
        along: [0.0; LANES],
        across: [0.0; LANES],
        blocks: [Block { at: 0, column: 0.0, along: 0.0, across: 0.0 }; BLOCKS],
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::strokes::set::StrokeSet;
    use crate::strokes::style::{Combine, Draw, Stroke, StrokeStyle};
    use glam::Vec2;
    use pulp::WithSimd;
    use shibo_value::Window;

    #[test]
    fn any_width_of_vectors_draws_the_same_bits() {
        let hash = Hash::new(7);
        let stroke = |n: u64| {
            let r = |i: u64| hash.unit_f32(8 * n + i);
            let at = Vec2::new(r(0), r(1)) * 10.0;
            let half = Vec2::new(r(2) - 0.5, (r(3) - 0.5) * r(4)) * 6.0;
            Stroke { ends: [at - half, at + half], half_width: 0.6 * r(5) * r(5), depth: r(6) }
        };
        let strokes: Vec<Stroke> = (0..60).map(stroke).collect();
        let window = Window::of(-3, 2, 77, 61);
        let frame = Frame { window, origin: [0.4, -0.7], step: [0.125, 0.17] };
        let gaussian = Profile::Gaussian { sigma: 0.2, cutoff: 0.64 };
        for profile in [Profile::Flat, Profile::Linear, Profile::Smooth, gaussian, Profile::Brush] {
            for (taper, round_caps, rule) in
                [(0.0, false, CombineRule::Max), (0.4, true, CombineRule::Ids), (0.0, true, CombineRule::Add)]
            {
                let style = StrokeStyle { profile, taper, round_caps, combine: Combine::Add, ..StrokeStyle::default() };
                let set = StrokeSet::new(&strokes, style, None);
                let (near, copies) = set.near(&frame, true);
                let draw = |wide: bool| {
                    let mut target = Target::new(&frame, rule);
                    let (period, draw) = (Vec2::ZERO, Draw::Depth);
                    let job = Job { grooves: set.grooves(), near: &near, copies: &copies, style, period, draw };
                    if wide {
                        target.draw(job);
                    } else {
                        Call { target: &mut target, job }.with_simd(pulp::Scalar::new());
                    }
                    let (mut out, mut ids) = (vec![0.0; 77 * 61], vec![0; 77 * 61]);
                    target.copy_to(&mut out, &mut ids);
                    (out.iter().map(|v: &f32| v.to_bits()).collect::<Vec<_>>(), ids)
                };
                assert!(draw(true) == draw(false), "{profile:?} {rule:?}");
            }
        }
    }
}
