//! Draws stamps into a window.
use super::atlas::Layout;
use super::blocks::{Blocks, Hidden, StampBlock};
use super::set::StampSet;
use super::span::{BLOCK, Span, Values};
use crate::ground::math::{atan2_degrees, lerp, saturate};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::{DVec2, Vec2};
use shibo_macros::choice;

/// Result where stamps overlap.
#[choice]
pub enum Overlap {
    /// The largest value, channel by channel.
    #[default]
    Max,
    /// The sum.
    Add,
    /// The stamp drawn last.
    Over,
    /// The stamp that is highest at the pixel.
    ByHeight,
}

/// Effect of a stamp on its content.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Multiplies it by the value of the stamp.
    #[default]
    Scaled,
    /// No effect.
    Steady,
    /// The content is an angle in degrees, from +x towards +y, which rotates with the stamp. Angles are not blended.
    Angle,
}

/// A picture to stamp, in the layout of a [`Layout`].
#[derive(Clone, Debug, Default)]
pub struct Picture<'a> {
    /// Channels of the content: at least one, and as many as other pictures have.
    pub values: Vec<&'a [f32]>,
    /// Opacity, 0..1; opaque if `None`.
    pub shape: Option<&'a [f32]>,
    /// Height, for [`Overlap::ByHeight`]; the first channel if `None`.
    pub height: Option<&'a [f32]>,
}

/// The pictures to stamp.
#[derive(Clone, Debug)]
pub struct Source<'a> {
    /// Their layout.
    pub layout: &'a Layout,
    /// The pictures; a stamp shows the one that it names. At least one.
    pub pictures: Vec<Picture<'a>>,
    /// Effect on the content; heights are always multiplied by the value of the stamp.
    pub content: Content,
    /// For [`Overlap::ByHeight`]: height of the ground in the window; stamps below it are hidden.
    pub ground: Option<&'a [f32]>,
}

impl<'a> Source<'a> {
    /// One opaque picture, multiplied by the values of the stamps, without ground.
    pub fn new(layout: &'a Layout, values: Vec<&'a [f32]>) -> Self {
        let pictures = vec![Picture { values, ..Picture::default() }];
        Self { layout, pictures, content: Content::Scaled, ground: None }
    }
}

/// Output of [`paint`].
pub enum Target<'a> {
    /// The content, into planes that hold the background.
    Values(Vec<&'a mut [f32]>),
    /// Coverage, 0..1, into a plane of zeros.
    Cover(&'a mut [f32]),
    /// Ids of stamps, into a plane of zeros.
    Ids(&'a mut [f32]),
    /// Offset in mm from the middle of the stamp along its own axes, into planes of zeros.
    Local([&'a mut [f32]; 2]),
}

/// Marks a pixel without a stamp.
const NONE: u32 = u32::MAX;

/// Coverage and height of a stamp in a block, which decide its visibility.
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

/// Draws the stamps that touch a window; incomplete if `stop` returned true. O(stamps near + the pixels in which they
/// are visible).
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
                (&mut planes, Hidden::Below { pictures: painter.contents(), zero: true, any_order: true }),
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

/// Blends a value over another one; exact where it covers the whole pixel.
#[inline(always)]
fn over(out: f32, value: f32, cover: f32) -> f32 {
    if cover < 1.0 { lerp(out, value, cover) } else { value }
}

impl Painter<'_> {
    fn blocks(&self) -> Blocks<'_> {
        Blocks::new(self.set, self.source.layout, self.frame)
    }

    /// The rule of [`Overlap::Over`] for hidden stamps.
    fn under(&self) -> Hidden<'static> {
        if self.source.pictures.iter().any(|picture| picture.shape.is_some()) { Hidden::Never } else { Hidden::Later }
    }

    /// The picture of a stamp.
    #[inline(always)]
    fn picture(&self, stamp: u32) -> &Picture<'_> {
        &self.source.pictures[self.set.stamps()[stamp as usize].picture as usize]
    }

    /// The channels of each picture.
    fn contents(&self) -> Vec<&[&[f32]]> {
        self.source.pictures.iter().map(|picture| &picture.values[..]).collect()
    }

    /// The channel that decides how high a picture is.
    fn height<'p>(&self, picture: &'p Picture<'_>) -> &'p [&'p [f32]] {
        match &picture.height {
            Some(height) if self.overlap == Overlap::ByHeight => std::slice::from_ref(height),
            _ => picture.values.get(..1).unwrap_or(&[]),
        }
    }

    /// The channels that decide the highest stamp, for each picture.
    fn heights(&self) -> Vec<&[&[f32]]> {
        self.source.pictures.iter().map(|picture| self.height(picture)).collect()
    }

    /// Draws the content by a rule for the existing value, the stamp's value, and its coverage.
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
                        let picture = self.picture(block.number);
                        let cover = self.edges(self.opacity(picture, span));
                        for (n, (plane, data)) in planes.iter_mut().zip(&picture.values).enumerate() {
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

    /// Reads a channel of the content; returns the factor on it.
    #[inline(always)]
    fn content(&self, data: &[f32], block: &StampBlock, span: &mut Span, values: &mut Values) -> f32 {
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

    /// Coverage for blending the content; angles have hard edges.
    #[inline(always)]
    fn edges(&self, mut cover: Values) -> Values {
        if self.source.content == Content::Angle {
            cover.iter_mut().for_each(|cover| *cover = if *cover >= 0.5 { 1.0 } else { 0.0 });
        }
        cover
    }

    /// Height of the ground.
    fn ground(&self) -> Vec<f32> {
        let ground = self.source.ground.filter(|_| self.overlap == Overlap::ByHeight);
        ground.map_or_else(|| vec![f32::NEG_INFINITY; self.frame.window.len()], <[f32]>::to_vec)
    }

    /// Opacity of the stamp at the pixels, 0..1.
    #[inline(always)]
    fn opacity(&self, picture: &Picture<'_>, span: &mut Span) -> Values {
        let mut cover = span.cover;
        if let Some(shape) = picture.shape {
            let mut opacity = [0.0; BLOCK];
            span.read(shape, &mut opacity);
            for (cover, opacity) in cover.iter_mut().zip(&opacity) {
                *cover *= saturate(*opacity);
            }
        }
        cover
    }

    /// Coverage and height of a stamp in a block.
    #[inline(always)]
    fn texels(&self, picture: &Picture<'_>, factor: f32, span: &mut Span) -> Texels {
        let mut texels = Texels { cover: self.opacity(picture, span), height: [0.0; BLOCK] };
        let (Some(data), false) = (self.height(picture).first(), self.overlap == Overlap::Over) else { return texels };
        span.read(data, &mut texels.height);
        if self.overlap == Overlap::ByHeight {
            texels.height.iter_mut().for_each(|h| *h *= factor);
        } else {
            texels.height.iter_mut().zip(&texels.cover).for_each(|(h, cover)| *h = *h * factor * cover);
        }
        texels
    }

    /// Draws by height: the highest stamp so far is visible, with soft edges over the others.
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
                        let picture = self.picture(block.number);
                        let texels = self.texels(picture, block.value, span);
                        let cover = self.edges(texels.cover);
                        for (plane, data) in planes.iter_mut().zip(&picture.values) {
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
                        let cover = self.opacity(self.picture(block.number), span);
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

    /// The visible stamp at each pixel: the last, the highest, or the one with the largest value.
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
                        let texels = self.texels(self.picture(block.number), block.value, span);
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
            // Use the nearest copy, also for a stamp larger than the canvas.
            let away = at - stamp.center;
            let turns =
                DVec2::select(period.cmpgt(DVec2::ZERO), (away / period.max(DVec2::splat(1e-9))).round(), DVec2::ZERO);
            let away = (away - turns * period).as_vec2();
            let turn = Vec2::new(stamp.turn.x, stamp.turn.y);
            (along[k], across[k]) = (turn.dot(away), turn.perp_dot(away));
        }
    }
}

/// Side of the largest stamp in pixels, on a grid of this step, for a canvas that is stamped whole: at most `most`.
pub fn resolution(half: Vec2, step: [f64; 2], most: u32) -> [u32; 2] {
    let pixel = (step[0] * step[1]).sqrt();
    let pixels = |half: f32| narrow((2.0 * f64::from(half) / pixel).ceil().clamp(1.0, f64::from(most)));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
    [pixels(half.x) as u32, pixels(half.y) as u32]
}
