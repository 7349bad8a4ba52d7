//! Stamps drawn into a window.
use super::atlas::Layout;
use super::blocks::{Block, Blocks, Hidden};
use super::set::StampSet;
use super::span::{BLOCK, Span, Values};
use crate::ground::math::{atan2_degrees, lerp, saturate};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt as _, index};
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

/// What a stamp does to its content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// It is multiplied by the value of the stamp.
    #[default]
    Scaled,
    /// Nothing.
    Steady,
    /// The content is an angle in degrees, from +x towards +y: it turns with the stamp. Angles are not mixed.
    Angle,
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
    /// What becomes of the content; heights are multiplied by the value of the stamp in any case.
    pub content: Content,
    /// For [`Overlap::ByHeight`]: how high the ground is in the window; what lies below it is not seen.
    pub ground: Option<&'a [f32]>,
}

impl<'a> Source<'a> {
    /// Opaque pictures, multiplied by the values of the stamps, on no ground.
    pub fn new(layout: &'a Layout, values: Vec<&'a [f32]>) -> Self {
        Self { layout, values, shape: None, height: None, content: Content::Scaled, ground: None }
    }
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

/// What decides which stamp is seen, in a block of pixels.
struct Texels {
    cover: Values,
    height: Values,
}

struct Painter<'a> {
    set: &'a StampSet,
    source: &'a Source<'a>,
    overlap: Overlap,
    frame: &'a Frame,
}

/// Draws the stamps that touch a window; once `stop` is true, with whatever is drawn by then. O(stamps near + the pixels in which they
/// are seen).
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
        Target::Values(mut planes) => match overlap {
            Overlap::ByHeight => painter.highest(stop, &mut planes),
            Overlap::Max => painter.blend(
                stop,
                (&mut planes, Hidden::Below { pictures: &source.values, zero: true, any_order: true }),
                #[inline(always)]
                |out, value, cover| {
                    let value = value * cover;
                    if cover > 0.0 && value > out { value } else { out }
                },
            ),
            Overlap::Add => painter.blend(
                stop,
                (&mut planes, Hidden::Never),
                #[inline(always)]
                |out, value, cover| out + value * cover,
            ),
            Overlap::Over => painter.blend(stop, (&mut planes, painter.under()), over),
        },
        Target::Cover(plane) => painter.cover(stop, plane),
        Target::Ids(plane) => painter.ids(stop, plane),
        Target::Local(planes) => painter.local(stop, planes),
    }
}

/// A value over another one: exactly that value where it covers the pixel.
#[inline(always)]
fn over(out: f32, value: f32, cover: f32) -> f32 {
    if cover < 1.0 { lerp(out, value, cover) } else { value }
}

impl Painter<'_> {
    fn blocks(&self) -> Blocks<'_> {
        Blocks::new(self.set, self.source.layout, self.frame)
    }

    /// What hides a stamp where the last one is seen.
    const fn under(&self) -> Hidden<'static> {
        if self.source.shape.is_some() { Hidden::Never } else { Hidden::Later }
    }

    /// The pictures that decide which stamp is highest.
    fn heights(&self) -> &[&[f32]] {
        match &self.source.height {
            Some(height) if self.overlap == Overlap::ByHeight => std::slice::from_ref(height),
            _ => self.source.values.get(..1).unwrap_or(&[]),
        }
    }

    /// Draws the content by a rule for the value that is there, that of the stamp, and how much it covers.
    #[inline(always)]
    fn blend(
        &self,
        stop: &dyn Fn() -> bool,
        (planes, hidden): (&mut [&mut [f32]], Hidden<'_>),
        rule: impl Fn(f32, f32, f32) -> f32,
    ) {
        simd::dispatch(
            #[inline(always)]
            || {
                let mut values = [0.0; BLOCK];
                self.blocks().each(
                    stop,
                    &hidden,
                    #[inline(always)]
                    |block, span, least| {
                        let cover = self.edges(self.opacity(span));
                        for (n, (plane, data)) in planes.iter_mut().zip(&self.source.values).enumerate() {
                            let factor = self.content(data, block, span, &mut values);
                            block.draw(
                                plane,
                                #[inline(always)]
                                |k, out| *out = rule(*out, values[k] * factor, cover[k]),
                            );
                            if matches!(hidden, Hidden::Below { .. }) {
                                least[n] = block.least(plane);
                            }
                        }
                    },
                );
            },
        );
    }

    /// Reads a channel of the content; returns what it must be multiplied by.
    #[inline(always)]
    fn content(&self, data: &[f32], block: &Block, span: &mut Span, values: &mut Values) -> f32 {
        span.read(data, values);
        match self.source.content {
            Content::Scaled => return block.value,
            Content::Steady => {}
            Content::Angle => {
                let turn = self.set.stamps()[block.number as usize].turn;
                let turn = atan2_degrees(turn.y, turn.x);
                values.iter_mut().for_each(|angle| *angle += turn);
            }
        }
        1.0
    }

    /// How much of the content is seen where the stamp covers so much.
    #[inline(always)]
    fn edges(&self, mut cover: Values) -> Values {
        if self.source.content == Content::Angle {
            cover.iter_mut().for_each(|cover| *cover = if *cover >= 0.5 { 1.0 } else { 0.0 });
        }
        cover
    }

    /// How high the ground is.
    fn ground(&self) -> Vec<f32> {
        let ground = self.source.ground.filter(|_| self.overlap == Overlap::ByHeight);
        ground.map_or_else(|| vec![f32::NEG_INFINITY; self.frame.window.len()], <[f32]>::to_vec)
    }

    /// How opaque the stamp is at the pixels, 0..1.
    #[inline(always)]
    fn opacity(&self, span: &mut Span) -> Values {
        let mut cover = span.cover;
        if let Some(shape) = self.source.shape {
            let mut opacity = [0.0; BLOCK];
            span.read(shape, &mut opacity);
            for (cover, opacity) in cover.iter_mut().zip(&opacity) {
                *cover *= saturate(*opacity);
            }
        }
        cover
    }

    /// What decides which stamp is seen.
    #[inline(always)]
    fn texels(&self, factor: f32, span: &mut Span) -> Texels {
        let mut texels = Texels { cover: self.opacity(span), height: [0.0; BLOCK] };
        let (Some(data), false) = (self.heights().first(), self.overlap == Overlap::Over) else { return texels };
        span.read(data, &mut texels.height);
        if self.overlap == Overlap::ByHeight {
            texels.height.iter_mut().for_each(|h| *h *= factor);
        } else {
            texels.height.iter_mut().zip(&texels.cover).for_each(|(h, cover)| *h = *h * factor * cover);
        }
        texels
    }

    /// By height: the highest so far is seen, softly at the edges of what lies over others.
    fn highest(&self, stop: &dyn Fn() -> bool, planes: &mut [&mut [f32]]) {
        simd::dispatch(
            #[inline(always)]
            || {
                let mut tops = self.ground();
                let mut values = [0.0; BLOCK];
                let hidden = Hidden::Below { pictures: self.heights(), zero: false, any_order: false };
                self.blocks().each(
                    stop,
                    &hidden,
                    #[inline(always)]
                    |block, span, least| {
                        let texels = self.texels(block.value, span);
                        let cover = self.edges(texels.cover);
                        for (plane, data) in planes.iter_mut().zip(&self.source.values) {
                            let factor = self.content(data, block, span, &mut values);
                            block.pixels(
                                #[inline(always)]
                                |k, at| {
                                    if texels.height[k] > tops[at] {
                                        plane[at] = over(plane[at], values[k] * factor, cover[k]);
                                    }
                                },
                            );
                        }
                        block.draw(
                            &mut tops,
                            #[inline(always)]
                            |k, top| {
                                let higher = texels.height[k] > *top && texels.cover[k] >= 0.5;
                                *top = if higher { texels.height[k] } else { *top };
                            },
                        );
                        least[0] = block.least(&tops);
                    },
                );
            },
        );
    }

    fn cover(&self, stop: &dyn Fn() -> bool, plane: &mut [f32]) {
        simd::dispatch(
            #[inline(always)]
            || {
                self.blocks().each(
                    stop,
                    &Hidden::Full,
                    #[inline(always)]
                    |block, span, least| {
                        let cover = self.opacity(span);
                        block.draw(
                            plane,
                            #[inline(always)]
                            |k, out| *out += (1.0 - *out) * cover[k],
                        );
                        least[0] = block.least(plane);
                    },
                );
            },
        );
    }

    /// The stamp that is seen at each pixel: the last, the highest, or the one of the largest value.
    fn seen(&self, stop: &dyn Fn() -> bool) -> Vec<u32> {
        let area = self.frame.window.len();
        let (mut tops, mut seen) = (self.ground(), vec![NONE; area]);
        let last = self.overlap == Overlap::Over;
        let zero = self.overlap != Overlap::ByHeight;
        let below = Hidden::Below { pictures: self.heights(), zero, any_order: false };
        let hidden = if last { self.under() } else { below };
        simd::dispatch(
            #[inline(always)]
            || {
                self.blocks().each(
                    stop,
                    &hidden,
                    #[inline(always)]
                    |block, span, least| {
                        let texels = self.texels(block.value, span);
                        block.pixels(
                            #[inline(always)]
                            |k, at| {
                                if texels.cover[k] >= 0.5 && (last || texels.height[k] > tops[at]) {
                                    (tops[at], seen[at]) = (texels.height[k], block.number);
                                }
                            },
                        );
                        least[0] = block.least(&tops);
                    },
                );
            },
        );
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
