//! The layout of an instance on the canvas of the graph that uses it.
use super::convert;
use super::part::{Shape, SyntaxValue};
use super::read::{self, mismatch, shorten};
use super::report::Report;
use super::ron_text::number_text;
use super::schema;
use crate::diagnostics::Code;
use crate::node::{Arg, DynNode};
use crate::registry::{Internal, Registry};
use crate::value::{Canvas, Tiling, Type};
use glam::DVec2;
use std::sync::Arc;

/// The graph of an instance is at most this many canvases wide, to fill a canvas that does not tile.
const MOST_CANVASES: f64 = 8.0;
/// The range of an instance's scale, the same as in the node that moves fields.
const SCALES: (f64, f64) = (1e-3, 1e3);

/// The layout of an instance on the canvas of the graph that uses it.
#[derive(Clone)]
pub(super) struct Layout {
    /// The place of the layout in the text.
    pub(super) part: SyntaxValue,
    /// The canvas that the instance is placed on.
    pub(super) canvas: Canvas,
    scale: DVec2,
    angle: f64,
    offset: DVec2,
    /// The size of the instance's own canvas, if given.
    size: Option<DVec2>,
    /// The centre of the instance's own canvas.
    middle: DVec2,
}

impl Layout {
    /// Maps a point of the canvas to the instance, both relative to the centre.
    fn inverse(&self, place: DVec2) -> DVec2 {
        let (sin, cos) = libm::sincos(-self.angle.to_radians());
        DVec2::new(cos, sin).rotate(place - self.offset) / self.scale
    }

    /// The canvas of the instance: the given one, or one that is large enough to leave no empty corners where nothing
    /// repeats.
    pub(super) fn own_canvas(&mut self, report: &mut Report) -> Canvas {
        if let Some(size) = self.size {
            self.middle = size * 0.5;
            return Canvas { size_mm: size, tile: Tiling::NONE, ..self.canvas };
        }
        let half = self.canvas.size_mm * 0.5;
        let corners = [half, -half, DVec2::new(half.x, -half.y), DVec2::new(-half.x, half.y)];
        let reach = corners.iter().fold(DVec2::ZERO, |reach, corner| reach.max(self.inverse(*corner).abs()));
        let mut size = self.canvas.size_mm;
        let mut small = false;
        let mut grow = |size: &mut f64, reach: f64, half: f64| {
            // Powers of two, so that most changes of the layout do not change the size and thus the moved graph.
            let mut wanted = 1.0;
            while wanted < reach / half - 1e-9 {
                wanted *= 2.0;
            }
            let most = MOST_CANVASES.min(Canvas::MAX_SIZE_MM / *size);
            small |= wanted > most;
            *size *= wanted.min(most.max(1.0));
        };
        if !self.canvas.tile.x {
            grow(&mut size.x, reach.x, half.x);
        }
        if !self.canvas.tile.y {
            grow(&mut size.y, reach.y, half.y);
        }
        if small {
            let message = "the instance lies too far away, or is too small, to fill the canvas";
            let help = "its graph is made on a canvas at most 8 times as large as this one";
            report.push(self.part.error(Code::Advice, message).help(help).as_warning());
        }
        self.middle = size * 0.5;
        Canvas { size_mm: size, ..self.canvas }
    }

    /// The node that moves a value of a type, and its kind.
    pub(super) fn node(&self, registry: &Registry, ty: Type) -> Option<(String, Arc<dyn DynNode>)> {
        let pair = |pair: DVec2| format!("({}, {})", number_text(pair.x), number_text(pair.y));
        let (scale, angle, middle) = (pair(self.scale), number_text(self.angle), pair(self.middle));
        let offset = pair(self.offset + self.canvas.size_mm * 0.5 - self.middle);
        let same = self.middle == self.canvas.size_mm * 0.5;
        let mut args = vec![
            (convert::PORT, Arg::Slot(0)),
            ("scale", Arg::Ron(&scale)),
            ("angle", Arg::Ron(&angle)),
            ("offset", Arg::Ron(&offset)),
        ];
        if !same {
            args.push(("pivot", Arg::Ron(&middle)));
        }
        let role = if ty == Type::Material { Internal::LayMaterial } else { Internal::LayField };
        let (kind, built) = registry.internal(role, &args)?;
        Some((kind.to_owned(), built.ok()?))
    }
}

/// Reads the `canvas` field of a `Use` on a canvas.
pub(super) fn layout(part: &SyntaxValue, canvas: Canvas, report: &mut Report) -> Option<Layout> {
    let fields = read::fields(part, "`canvas` of `Use`", schema::LAYOUT, report)?;
    let mut layout = Layout {
        part: part.clone(),
        canvas,
        scale: DVec2::ONE,
        angle: 0.0,
        offset: DVec2::ZERO,
        size: None,
        middle: canvas.size_mm * 0.5,
    };
    let mut good = true;
    for field in &fields {
        match field.name.as_str() {
            "scale" => match two(&field.value, "scale", SCALES, report) {
                Some(scale) => layout.scale = scale,
                None => good = false,
            },
            "angle" => match within(&field.value, "angle", (-360.0, 360.0), report) {
                Some(angle) => layout.angle = angle,
                None => good = false,
            },
            "size_mm" => match own_size(&field.value, canvas, report) {
                Some(size) => layout.size = Some(size),
                None => good = false,
            },
            _ => match two(&field.value, "offset", (-1e6, 1e6), report) {
                Some(offset) => layout.offset = offset,
                None => good = false,
            },
        }
    }
    good.then_some(layout)
}

/// The size of an instance's own canvas, which may be given only if the canvas does not tile.
fn own_size(part: &SyntaxValue, canvas: Canvas, report: &mut Report) -> Option<DVec2> {
    if canvas.tile != Tiling::NONE {
        let message = "an instance on a canvas that tiles has the size of that canvas";
        let help = "leave `size_mm` out of the `canvas` of the `Use`, or write `tile: None` in the canvas of the graph";
        report.push(part.error(Code::BadValue, message).help(help));
        return None;
    }
    two(part, "size_mm", (1e-3, Canvas::MAX_SIZE_MM), report)
}

fn within(part: &SyntaxValue, what: &str, (lo, hi): (f64, f64), report: &mut Report) -> Option<f64> {
    let value = read::number(part, what, report)?;
    if (lo..=hi).contains(&value) {
        return Some(value);
    }
    let message = format!("{what} is `{}`; it must be between {lo} and {hi}", shorten(part.str()));
    report.push(part.error(Code::OutOfRange, message));
    None
}

/// One number for both directions, or one for each.
fn two(part: &SyntaxValue, what: &str, range: (f64, f64), report: &mut Report) -> Option<DVec2> {
    match part.shape() {
        Shape::Number(_) => within(part, what, range, report).map(DVec2::splat),
        Shape::Tuple(items) if items.len() == 2 => {
            let (x, y) = (within(&items[0], what, range, report), within(&items[1], what, range, report));
            Some(DVec2::new(x?, y?))
        }
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a number or a pair of numbers"));
            None
        }
    }
}
