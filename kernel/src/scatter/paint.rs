//! Stamps drawn into a window.
use super::atlas::Layout;
use super::set::StampSet;
use super::span::{BLOCK, Placed, Span};
use crate::ground::math::lerp;
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt as _, index, offset};
use glam::{DVec2, Vec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is seen where stamps overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Overlap {
    /// The largest value, channel by channel.
    #[default]
    Max,
    /// The sum.
    Add,
    /// The stamp that was drawn last.
    Over,
    /// The stamp that is highest there.
    ByHeight,
}

/// What is stamped: pictures laid out by a [`Layout`].
#[derive(Clone, Debug)]
pub struct Source<'a> {
    /// How they are laid out.
    pub layout: &'a Layout,
    /// The channels of the content; at least one.
    pub values: Vec<&'a [f32]>,
    /// How opaque it is, 0..1; opaque if there is none.
    pub shape: Option<&'a [f32]>,
    /// How high it is, for [`Overlap::ByHeight`]; the first channel if there is none.
    pub height: Option<&'a [f32]>,
}

/// What is drawn.
pub enum Target<'a> {
    /// The content, into planes that hold the background.
    Values(Vec<&'a mut [f32]>),
    /// How much is covered, 0..1, into a plane of zeros.
    Cover(&'a mut [f32]),
    /// The numbers of stamps, into a plane of zeros.
    Ids(&'a mut [f32]),
    /// mm from the middle of the stamp along its own axes, into planes of zeros.
    Local([&'a mut [f32]; 2]),
}

/// No stamp.
const NONE: u32 = u32::MAX;

/// How often a window asks whether to stop: once in so many stamps.
const AT_ONCE: usize = 256;

/// The values of a block of pixels.
struct Texels {
    cover: [f32; BLOCK],
    value: [f32; BLOCK],
    height: [f32; BLOCK],
}

struct Painter<'a> {
    set: &'a StampSet,
    source: &'a Source<'a>,
    overlap: Overlap,
    frame: &'a Frame,
}

/// Draws the stamps that touch a window; once `stop` is true, with whatever is drawn by then. O(stamps near + their pixels).
///
/// # Panics
/// If planes are shorter than the window, or there is no content.
pub fn paint(
    stop: &dyn Fn() -> bool,
    (set, source, overlap): (&StampSet, &Source<'_>, Overlap),
    frame: &Frame,
    target: Target<'_>,
) {
    let painter = Painter { set, source, overlap, frame };
    match target {
        Target::Values(mut planes) => match (overlap, source.shape.is_some()) {
            (Overlap::ByHeight, _) => painter.highest(stop, &mut planes),
            (Overlap::Max, false) if planes.len() == 1 => {
                painter.plain(
                    stop,
                    planes[0],
                    #[inline(always)]
                    |out, value, _| if value > out { value } else { out },
                );
            }
            (Overlap::Add, false) if planes.len() == 1 => {
                painter.plain(
                    stop,
                    planes[0],
                    #[inline(always)]
                    |out, value, _| out + value,
                );
            }
            (Overlap::Max, _) => {
                painter.blend(
                    stop,
                    &mut planes,
                    #[inline(always)]
                    |out, value, cover| {
                        let value = value * cover;
                        if value > out { value } else { out }
                    },
                );
            }
            (Overlap::Add, _) => painter.blend(
                stop,
                &mut planes,
                #[inline(always)]
                |out, value, cover| out + value * cover,
            ),
            (Overlap::Over, _) => painter.blend(stop, &mut planes, lerp),
        },
        Target::Cover(plane) => painter.cover(stop, plane),
        Target::Ids(plane) => painter.ids(stop, plane),
        Target::Local(planes) => painter.local(stop, planes),
    }
}

impl Painter<'_> {
    /// Visits the rows of all stamps near, some pixels at a time: `visit(number, value, first pixel in the window, span)`.
    #[inline(always)]
    fn each(&self, stop: &dyn Fn() -> bool, mut visit: impl FnMut(u32, f32, usize, &mut Span)) {
        let (rect, stamps) = (self.frame.window, self.set.stamps());
        let mut span = Span::new();
        for (n, near) in self.set.near(self.frame).iter().enumerate() {
            if n % AT_ONCE == 0 && stop() {
                return;
            }
            let stamp = &stamps[near.stamp as usize];
            let shift = DVec2::new(f64::from(near.copy[0]), f64::from(near.copy[1])) * self.set.period();
            let placed = Placed::new(stamp, shift, self.source.layout.levels(), self.frame);
            for y in placed.rows(self.frame) {
                let mut columns = placed.columns(y, self.frame);
                let row = offset(y - rect.y) * rect.columns();
                while columns.start < columns.end {
                    let n = offset(columns.end - columns.start).min(BLOCK);
                    placed.find(columns.start, y, n, &mut span);
                    visit(near.stamp, stamp.value, row + offset(columns.start - rect.x), &mut span);
                    columns.start += index(n);
                }
            }
        }
    }

    /// One channel of opaque stamps. The value is that of the stamp times its cover.
    #[inline(always)]
    fn plain(&self, stop: &dyn Fn() -> bool, plane: &mut [f32], rule: impl Fn(f32, f32, f32) -> f32) {
        let data = self.source.values[0];
        simd::dispatch(
            #[inline(always)]
            || {
                let mut values = [0.0; BLOCK];
                self.each(stop, |_, factor, at, span| {
                    span.read(data, &mut values);
                    let cover = &span.cover[..span.n];
                    for ((out, value), cover) in plane[at..at + span.n].iter_mut().zip(&values).zip(cover) {
                        *out = rule(*out, value * factor * cover, *cover);
                    }
                });
            },
        );
    }

    /// Any number of channels.
    #[inline(always)]
    fn blend(&self, stop: &dyn Fn() -> bool, planes: &mut [&mut [f32]], rule: impl Fn(f32, f32, f32) -> f32) {
        simd::dispatch(
            #[inline(always)]
            || {
                let mut values = [0.0; BLOCK];
                self.each(stop, |_, factor, at, span| {
                    let cover = self.opacity(span);
                    for (plane, data) in planes.iter_mut().zip(&self.source.values) {
                        span.read(data, &mut values);
                        for ((out, value), cover) in plane[at..at + span.n].iter_mut().zip(&values).zip(&cover) {
                            *out = rule(*out, value * factor, *cover);
                        }
                    }
                });
            },
        );
    }

    /// How opaque the stamp is at the pixels, 0..1.
    #[inline(always)]
    fn opacity(&self, span: &mut Span) -> [f32; BLOCK] {
        let mut cover = span.cover;
        if let Some(shape) = self.source.shape {
            let mut opacity = [0.0; BLOCK];
            span.read(shape, &mut opacity);
            for (cover, opacity) in cover.iter_mut().zip(&opacity) {
                *cover *= crate::ground::math::saturate(*opacity);
            }
        }
        cover
    }

    /// What decides which stamp is seen.
    #[inline(always)]
    fn texels(&self, factor: f32, span: &mut Span) -> Texels {
        let mut texels = Texels { cover: self.opacity(span), value: [0.0; BLOCK], height: [0.0; BLOCK] };
        if self.overlap == Overlap::Over {
            return texels;
        }
        span.read(self.source.values[0], &mut texels.value);
        match self.source.height.filter(|_| self.overlap == Overlap::ByHeight) {
            Some(height) => {
                span.read(height, &mut texels.height);
                texels.height.iter_mut().for_each(|h| *h *= factor);
            }
            None => {
                let heights = texels.height.iter_mut().zip(texels.value.iter().zip(&texels.cover));
                if self.overlap == Overlap::ByHeight {
                    heights.for_each(|(h, (v, _))| *h = v * factor);
                } else {
                    heights.for_each(|(h, (v, c))| *h = v * factor * c);
                }
            }
        }
        texels
    }

    /// By height: the highest so far is seen, softly at the edges of what lies over others.
    fn highest(&self, stop: &dyn Fn() -> bool, planes: &mut [&mut [f32]]) {
        let mut tops = vec![f32::NEG_INFINITY; self.frame.window.len()];
        let mut values = [0.0; BLOCK];
        self.each(stop, |_, factor, at, span| {
            let texels = self.texels(factor, span);
            let tops = &mut tops[at..at + span.n];
            for (plane, data) in planes.iter_mut().zip(&self.source.values) {
                span.read(data, &mut values);
                for (k, out) in plane[at..at + span.n].iter_mut().enumerate() {
                    if texels.height[k] > tops[k] {
                        *out = lerp(*out, values[k] * factor, texels.cover[k]);
                    }
                }
            }
            for (k, top) in tops.iter_mut().enumerate() {
                if texels.height[k] > *top && texels.cover[k] >= 0.5 {
                    *top = texels.height[k];
                }
            }
        });
    }

    fn cover(&self, stop: &dyn Fn() -> bool, plane: &mut [f32]) {
        self.each(stop, |_, _, at, span| {
            let cover = self.opacity(span);
            for (out, cover) in plane[at..at + span.n].iter_mut().zip(&cover) {
                *out += (1.0 - *out) * cover;
            }
        });
    }

    /// The stamp that is seen at each pixel: the last, the highest, or the one of the largest value.
    fn seen(&self, stop: &dyn Fn() -> bool) -> Vec<u32> {
        let area = self.frame.window.len();
        let (mut tops, mut seen) = (vec![f32::NEG_INFINITY; area], vec![NONE; area]);
        let last = self.overlap == Overlap::Over;
        self.each(stop, |number, factor, at, span| {
            let texels = self.texels(factor, span);
            for k in 0..span.n {
                if texels.cover[k] >= 0.5 && (last || texels.height[k] > tops[at + k]) {
                    (tops[at + k], seen[at + k]) = (texels.height[k], number);
                }
            }
        });
        seen
    }

    fn ids(&self, stop: &dyn Fn() -> bool, plane: &mut [f32]) {
        for (out, number) in plane.iter_mut().zip(self.seen(stop)) {
            if let Some(stamp) = self.set.stamps().get(number as usize) {
                *out = stamp.id as f32;
            }
        }
    }

    fn local(&self, stop: &dyn Fn() -> bool, [along, across]: [&mut [f32]; 2]) {
        let (rect, period) = (self.frame.window, self.set.period());
        for (k, number) in self.seen(stop).into_iter().enumerate() {
            let Some(stamp) = self.set.stamps().get(number as usize) else { continue };
            let at =
                DVec2::from(self.frame.center(rect.x + index(k % rect.columns()), rect.y + index(k / rect.columns())));
            // The copy that is nearest; a stamp larger than the canvas is seen by its nearest copy too.
            let away = at - stamp.center;
            let turns =
                DVec2::select(period.cmpgt(DVec2::ZERO), (away / period.max(DVec2::splat(1e-9))).round(), DVec2::ZERO);
            let away = (away - turns * period).as_vec2();
            let turn = Vec2::new(stamp.turn.x, stamp.turn.y);
            (along[k], across[k]) = (turn.dot(away), turn.perp_dot(away));
        }
    }
}

/// The number of pixels that the largest of some stamps has along its sides on a grid of this step, for a canvas that
/// is stamped whole: at most `most`.
pub fn resolution(half: Vec2, step: [f64; 2], most: u32) -> [u32; 2] {
    let pixel = (step[0] * step[1]).sqrt();
    let pixels = |half: f32| narrow((2.0 * f64::from(half) / pixel).ceil().clamp(1.0, f64::from(most)));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
    [pixels(half.x) as u32, pixels(half.y) as u32]
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
mod tests {
    use super::super::set::Stamp;
    use super::*;
    use shibo_engine::value::Tiling;
    use shibo_engine::value::Window;

    /// A dome: 1 in the middle, 0 at the border.
    fn dome(side: usize) -> Vec<f32> {
        let at = |k: usize| (k as f32 + 0.5) / side as f32 * 2.0 - 1.0;
        let value = |k: usize| (1.0 - at(k % side).powi(2)) * (1.0 - at(k / side).powi(2)) * (1.0 + 0.3 * at(k % side));
        (0..side * side).map(value).collect()
    }

    fn stamps() -> Vec<Stamp> {
        let stamp = |n: u32, x: f64, y: f64, half: f32, degrees: f32, value: f32| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Stamp {
                center: DVec2::new(x, y),
                half: Vec2::new(half, 0.7 * half),
                turn: Vec2::new(cos, sin),
                value,
                id: n,
            }
        };
        vec![
            stamp(1, 10.0, 8.0, 4.0, 0.0, 1.0),
            stamp(2, 12.5, 9.0, 4.0, 37.0, 0.8),
            stamp(3, 0.5, 19.0, 4.0, -120.0, 1.0),
            stamp(4, 25.0, 3.0, 2.0, 90.0, -0.5),
        ]
    }

    fn drawn(overlap: Overlap, frame: &Frame, background: f32, shape: bool) -> Vec<f32> {
        let side = 32;
        let layout = Layout::new(side, side);
        let (mut data, mut ones) = (vec![0.0; layout.len()], vec![0.0; layout.len()]);
        layout.build(dome(side), &mut data);
        layout.build(vec![1.0; side * side], &mut ones);
        let source = Source { layout: &layout, values: vec![&data], shape: shape.then_some(&ones[..]), height: None };
        let set = StampSet::new(stamps(), (DVec2::new(30.0, 20.0), Tiling::BOTH));
        let mut out = vec![background; frame.window.len()];
        paint(&|| false, (&set, &source, overlap), frame, Target::Values(vec![&mut out]));
        out
    }

    /// The same by hand: every stamp in every copy, its dome by formula.
    fn by_hand(overlap: Overlap, p: DVec2, background: f64) -> f64 {
        let (mut out, mut top) = (background, f64::NEG_INFINITY);
        for s in stamps() {
            for i in -2..=2 {
                for j in -2..=2 {
                    let d = p - s.center - DVec2::new(f64::from(i) * 30.0, f64::from(j) * 20.0);
                    let (cos, sin) = (f64::from(s.turn.x), f64::from(s.turn.y));
                    let u = (cos * d.x + sin * d.y) / f64::from(s.half.x);
                    let v = (cos * d.y - sin * d.x) / f64::from(s.half.y);
                    if u.abs() > 1.0 || v.abs() > 1.0 {
                        continue;
                    }
                    let value = (1.0 - u * u) * (1.0 - v * v) * (1.0 + 0.3 * u) * f64::from(s.value);
                    match overlap {
                        Overlap::Max => out = out.max(value),
                        Overlap::Add => out += value,
                        Overlap::Over => out = value,
                        Overlap::ByHeight if value > top => (out, top) = (value, value),
                        Overlap::ByHeight => {}
                    }
                }
            }
        }
        out
    }

    #[test]
    fn stamps_are_those_of_the_formula() {
        let frame = Frame::new(Window::of(0, 0, 240, 160), [0.125, 0.125]);
        for overlap in [Overlap::Max, Overlap::Add, Overlap::Over, Overlap::ByHeight] {
            for shape in [false, true] {
                let got = drawn(overlap, &frame, 0.0, shape);
                let mut off = 0;
                for (k, got) in (0..).zip(&got) {
                    let want = by_hand(overlap, DVec2::from(frame.center(k % 240, k / 240)), 0.0);
                    // Pixels at an edge are covered in part.
                    off += u32::from((f64::from(*got) - want).abs() > 0.03);
                }
                assert!(off < 240 * 160 / 100, "{overlap:?} {shape}: {off} pixels are off");
            }
        }
    }

    #[test]
    fn windows_are_crops() {
        let whole = Frame::new(Window::of(-20, -10, 280, 190), [0.1237, 0.1291]);
        let part = Frame::new(Window::of(33, 7, 71, 50), [0.1237, 0.1291]);
        for overlap in [Overlap::Max, Overlap::Add, Overlap::Over, Overlap::ByHeight] {
            let (a, b) = (drawn(overlap, &whole, 0.1, false), drawn(overlap, &part, 0.1, false));
            for (k, b) in b.iter().enumerate() {
                let (x, y) = (33 + 20 + k % 71, 7 + 10 + k / 71);
                assert_eq!(a[y * 280 + x].to_bits(), b.to_bits(), "{overlap:?}");
            }
        }
    }

    #[test]
    fn numbers_and_places_are_those_of_the_stamp_on_top() {
        let frame = Frame::new(Window::of(0, 0, 240, 160), [0.125, 0.125]);
        let layout = Layout::new(8, 8);
        let mut data = vec![0.0; layout.len()];
        layout.build(vec![1.0; 64], &mut data);
        let source = Source { layout: &layout, values: vec![&data], shape: None, height: None };
        let set = StampSet::new(stamps(), (DVec2::new(30.0, 20.0), Tiling::BOTH));
        let [mut ids, mut x, mut y, mut cover] = [(); 4].map(|()| vec![0.0; frame.window.len()]);
        paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Ids(&mut ids));
        paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Local([&mut x, &mut y]));
        paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Cover(&mut cover));
        let mut counts = [0; 5];
        for k in 0..ids.len() {
            counts[ids[k] as usize] += 1;
            // Two that cover a little less than half of a pixel each cover three quarters together.
            assert!(if ids[k] > 0.0 { cover[k] >= 0.5 } else { cover[k] <= 0.75 }, "{k}");
            if ids[k] > 0.0 {
                let half = stamps()[ids[k] as usize - 1].half;
                assert!(x[k].abs() <= half.x + 0.1 && y[k].abs() <= half.y + 0.1);
            }
        }
        // 8 × 5.6 mm and 4 × 2.8 mm at 64 pixels to the mm²; the second lies over the first.
        assert!(
            (counts[2] - 2867i32).abs() < 40 && (counts[3] - 2867i32).abs() < 40 && (counts[4] - 717i32).abs() < 20
        );
        assert!(counts[1] < 2000 && counts[1] > 500, "{counts:?}");
    }
}
