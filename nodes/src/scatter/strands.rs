//! Shared by `Scratches` and `Fibers`: strands anywhere on the canvas, drawn as strokes.
use crate::map::Map;
use glam::{DVec2, Vec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::scatter::strand::{Ends, Strand};
use shibo_kernel::strokes::{self, Draw, NO_STROKE, Stroke, StrokeSet, StrokeStyle};
use shibo_node::{CanvasFacts, Context, Direction, Gray, In, Outputs, Range};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};
use std::sync::Arc;

/// Maximum number of strokes of all strands.
const MOST_STROKES: f64 = 4e6;

/// Maximum number of strokes that overlap, on average.
const MOST_LAYERS: f64 = 1024.0;

/// Number of strands, and their variation.
pub(super) struct StrandPlan<'a> {
    /// Strands per cm².
    pub(super) density: f64,
    pub(super) length: Range,
    pub(super) width: Range,
    pub(super) depth: Range,
    /// Degrees.
    pub(super) angle: Range,
    /// Largest bend in degrees per mm, either way.
    pub(super) curl: f64,
    pub(super) ends: Ends,
    pub(super) mask: &'a Option<In<Gray>>,
    pub(super) direction: &'a Option<In<Direction>>,
}

/// Strokes of all strands, `pieces` of each.
struct Strands {
    set: StrokeSet,
    pieces: u32,
    tiling: Tiling,
}

impl StrandPlan<'_> {
    fn count(&self, size: DVec2) -> f64 {
        (self.density * size.element_product() / 100.0).round()
    }

    /// Number of strokes per strand: enough for its ends and its bend.
    fn pieces(&self) -> u32 {
        let turn = if self.direction.is_some() { 180.0 } else { self.curl * self.length.hi };
        [8, 16, 24, 32].into_iter().find(|n| turn <= 8.0 * f64::from(*n)).unwrap_or(48)
    }

    /// Refuses too many strands, and strands much longer than the canvas.
    pub(super) fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let size = canvas.size_mm();
        let (count, pieces) = (self.count(size), f64::from(self.pieces()));
        if count * pieces > MOST_STROKES {
            let most = (MOST_STROKES / pieces / size.element_product() * 100.0).floor();
            let message =
                format!("density makes {count:.0} strands; on this canvas it must be at most {most} in a cm²");
            let help = format!("write `density: {most}` or less, or make the strands shorter or straighter");
            return vec![Problem::new(Code::TooLarge, message).at("density").help(help)];
        }
        let most = 4.0 * size.max_element();
        if self.length.hi > most {
            let message =
                format!("length is `{}` mm; it must be at most {most} mm, four times the canvas", self.length.hi);
            return vec![Problem::new(Code::OutOfRange, message).at("length")];
        }
        let layers = count * self.length.hi * self.width.hi / size.element_product();
        if layers > MOST_LAYERS {
            let message = format!(
                "about {layers:.0} strands lie over each other at every place; at most {MOST_LAYERS} are allowed"
            );
            return vec![
                Problem::new(Code::TooLarge, message).at("width").help("make them thinner, shorter, or fewer"),
            ];
        }
        Vec::new()
    }

    /// The outputs of a node: the depths times `sign`, the mask, and the numbers of strands.
    pub(super) fn outputs(&self, cx: &Context<'_>, seed: u64, sign: f32) -> Result<Outputs, Stop> {
        let strands = self.strands(cx, Hash::new(cx.seed(seed)), style(strokes::Profile::Smooth))?;
        let [height, mask, ids] = strands.fields(sign);
        Ok(Outputs::one(height).with("mask", mask).with("ids", ids))
    }

    /// The strands; strand n uses the random numbers of `hash.with(n)`.
    fn strands(&self, cx: &Context<'_>, hash: Hash, style: StrokeStyle) -> Result<Strands, Stop> {
        let size = cx.size_mm();
        let pitch = (100.0 / self.density.max(1e-9)).sqrt().min(0.5 * self.length.hi.max(1e-3));
        let mask = Map::read(cx, (self.mask, "mask"), pitch)?;
        let direction = Map::read(cx, (self.direction, "direction"), pitch)?;
        let field = |p: Vec2| direction.as_ref().map_or(0.0, |map| map.at(p.as_dvec2()));
        let tiling = whole(cx.tiling());
        let (mut strokes, mut kept): (Vec<Stroke>, u64) = (Vec::new(), 0);
        let pieces = self.pieces();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be below 4 million")]
        let count = self.count(size).max(0.0) as u64;
        for n in 0..count {
            if n % 1024 == 0 {
                cx.check()?;
            }
            let draw = |k: u64| hash.with(n).unit(k);
            let middle = DVec2::new(draw(0), draw(1)) * size;
            if mask.as_ref().is_some_and(|map| draw(2) >= f64::from(map.at(middle))) {
                continue;
            }
            kept += 1;
            let strand = Strand {
                middle: middle.as_vec2(),
                angle: narrow(self.angle.at(draw(3))),
                length: narrow(self.length.at(draw(4))),
                curl: narrow(self.curl * (2.0 * draw(5) - 1.0)),
                half_width: narrow(0.5 * self.width.at(draw(6))),
                depth: narrow(self.depth.at(draw(7))),
            };
            strand.strokes(pieces as usize, self.ends, &field, &mut strokes);
        }
        if kept == 0 && count > 0 {
            let problem = Problem::new(Code::Advice, "mask is 0 wherever a strand would lie: none is left").at("mask");
            cx.evaluator.warn(problem);
        }
        let period = (tiling == Tiling::BOTH).then(|| size.as_vec2());
        let set = StrokeSet::new(&strokes, style, period);
        Ok(Strands { set, pieces, tiling })
    }
}

impl Strands {
    /// The depths times `sign`, the mask, and the numbers of strands from 1.
    fn fields(self, sign: f32) -> [Field; 3] {
        let tiling = self.tiling;
        let shared = Arc::new(self);
        let drawn = |draw: Draw, sign: f32| {
            let strands = shared.clone();
            Field::generate(Type::Gray, tiling, move |out, given| {
                let frame = tile::frame(out);
                strands.set.fill_until(&|| given.check().is_err(), &frame, draw, out.plane_mut(0));
                if sign < 0.0 {
                    out.data_mut().iter_mut().for_each(|v| *v = if *v == 0.0 { 0.0 } else { -*v });
                }
                given.check()
            })
        };
        let ids = {
            let strands = shared.clone();
            Field::generate(Type::Ids, tiling, move |out, given| {
                let frame = tile::frame(out);
                let mut ids = vec![NO_STROKE; out.window.len()];
                strands.set.fill_with_ids(&|| given.check().is_err(), &frame, out.plane_mut(0), &mut ids);
                for (out, id) in out.data_mut().iter_mut().zip(ids) {
                    *out = if id == NO_STROKE { 0.0 } else { (id / strands.pieces + 1) as f32 };
                }
                given.check()
            })
        };
        [drawn(Draw::Depth, sign), drawn(Draw::Mask, 1.0), ids]
    }
}

/// Tiling of strands on a canvas with this tiling: in both directions or not at all.
pub(super) fn whole(tiling: Tiling) -> Tiling {
    if tiling == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
}

/// The style of the strokes of strands.
fn style(profile: strokes::Profile) -> StrokeStyle {
    StrokeStyle { profile, round_caps: true, ..StrokeStyle::default() }
}
