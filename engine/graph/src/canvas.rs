//! The canvas of a graph.
use super::params::Params;
use super::part::{Shape, SyntaxValue};
use super::read::{self, mismatch, shorten};
use super::report::Report;
use super::schema;
use super::subst::substitute;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::value::{Canvas, Resolution, TileMode};
use glam::{DVec2, UVec2};

/// The default canvas.
pub(super) const DEFAULT: Canvas =
    Canvas { size_mm: DVec2::splat(100.0), resolution: UVec2::splat(1024), tile: TileMode::Both.tiling(), seed: 0 };

/// A requested resolution and its place in the text.
pub(super) struct Asked {
    pub(super) resolution: Resolution,
    pub(super) span: Option<Span>,
}

/// Reads a canvas and the resolution it requests; fields with errors keep their defaults.
pub(super) fn read(part: Option<&SyntaxValue>, params: &Params, report: &mut Report) -> (Canvas, Asked) {
    let mut asked = Asked { resolution: Resolution::Longer(DEFAULT.resolution.x), span: None };
    let mut canvas = DEFAULT;
    let Some(part) = part else { return (canvas, asked) };
    let Some(fields) = read::fields(part, "`canvas`", schema::CANVAS, report) else { return (canvas, asked) };
    for field in fields {
        let Some(value) = substitute(&field.value, params, report).map(|s| s.part) else { continue };
        match field.name.as_str() {
            "size_mm" => canvas.size_mm = size(&value, report).unwrap_or(canvas.size_mm),
            "resolution" => {
                asked.span = Some(value.span());
                asked.resolution = resolution(&value, report).unwrap_or(asked.resolution);
            }
            "tile" => canvas.tile = tile(&value, report).unwrap_or_default().tiling(),
            _ => canvas.seed = seed(&value, report).unwrap_or(canvas.seed),
        }
    }
    canvas.resolution = asked.resolution.of(canvas.size_mm);
    (canvas, asked)
}

/// Applies the requested resolution to a canvas; warns if it distorts the picture.
pub(super) fn resize(canvas: &mut Canvas, asked: &Asked, typed: bool, report: &mut Report) {
    canvas.resolution = asked.resolution.of(canvas.size_mm);
    let Some(span) = asked.span.filter(|_| !asked.resolution.fits(canvas.size_mm)) else { return };
    let (pixels, mm) = (canvas.resolution, canvas.size_mm);
    let longer = pixels.max_element();
    let fitting = Resolution::Longer(longer).of(mm);
    let message = format!(
        "the picture is squashed: {} × {} pixels do not have the shape of the canvas, {} × {} mm",
        pixels.x, pixels.y, mm.x, mm.y
    );
    let pair = if typed { format!("{}x{}", fitting.x, fitting.y) } else { format!("({}, {})", fitting.x, fitting.y) };
    let help = format!("write `{longer}` for the longer side alone, or `{pair}`");
    report.push(Diagnostic::new(Code::Advice, span, message).help(help).as_warning());
}

/// One number for both directions, or one for each.
fn two(part: &SyntaxValue, what: &str, report: &mut Report) -> Option<[(SyntaxValue, f64); 2]> {
    let items = match part.shape() {
        Shape::Number(_) => vec![part.clone(), part.clone()],
        Shape::Tuple(items) if items.len() == 2 => items,
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a number or a pair of numbers"));
            return None;
        }
    };
    let read = |item: &SyntaxValue, report: &mut Report| Some((item.clone(), read::number(item, what, report)?));
    let (a, b) = (read(&items[0], report), read(&items[1], report));
    Some([a?, b?])
}

fn size(part: &SyntaxValue, report: &mut Report) -> Option<DVec2> {
    let sides = two(part, "size_mm", report)?;
    let mut good = true;
    for (item, value) in &sides {
        if *value <= 0.0 || *value > Canvas::MAX_SIZE_MM {
            let message = format!(
                "size_mm is `{}`; it must be greater than 0 and at most {} mm",
                shorten(item.str()),
                Canvas::MAX_SIZE_MM
            );
            report.push(item.error(Code::OutOfRange, message));
            good = false;
        }
    }
    good.then(|| DVec2::new(sides[0].1, sides[1].1))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be whole and in range")]
fn resolution(part: &SyntaxValue, report: &mut Report) -> Option<Resolution> {
    let sides = two(part, "resolution", report)?;
    let mut good = true;
    for (item, value) in &sides {
        let found = shorten(item.str());
        if value.fract() != 0.0 {
            report.push(mismatch(item, "`resolution`", "a whole number of pixels"));
        } else if *value < 1.0 {
            let message = format!("resolution is `{found}`; it must be at least 1 pixel");
            report.push(item.error(Code::OutOfRange, message));
        } else if *value > f64::from(Canvas::MAX_RESOLUTION) {
            report.push(part.error(Code::TooLarge, too_large(&found)));
        } else {
            continue;
        }
        good = false;
    }
    let size = UVec2::new(sides[0].1 as u32, sides[1].1 as u32);
    let is_pair = matches!(part.shape(), Shape::Tuple(_));
    good.then_some(if is_pair { Resolution::Exact(size) } else { Resolution::Longer(size.x) })
}

/// The message for a resolution beyond the limit.
pub(super) fn too_large(found: &str) -> String {
    format!("resolution is `{found}`; it must be at most {} pixels", Canvas::MAX_RESOLUTION)
}

fn tile(part: &SyntaxValue, report: &mut Report) -> Option<TileMode> {
    let (modes, names) = (TileMode::ALL, TileMode::ALL.map(|(name, _)| name));
    match part.shape() {
        Shape::Word(word) => {
            let found = modes.iter().find(|(name, _)| *name == word).map(|(_, mode)| *mode);
            if found.is_none() {
                let message = format!("there is no tiling `{}`", shorten(&word));
                report.unknown(part.error(Code::UnknownVariant, message), &word, "tiling", names);
            }
            found
        }
        _ => {
            report.push(mismatch(part, "`tile`", "one of `Both`, `X`, `Y`, `None`"));
            None
        }
    }
}

/// A seed of random numbers.
pub(super) fn seed(part: &SyntaxValue, report: &mut Report) -> Option<u64> {
    let value = read::number(part, "seed", report)?;
    if value.fract() != 0.0 {
        report.push(mismatch(part, "`seed`", "a whole number"));
        return None;
    }
    let seed = crate::node::ron_options().from_str(part.str()).ok();
    if seed.is_none() {
        let message = format!("seed is `{}`; it must be between 0 and {}", shorten(part.str()), u64::MAX);
        report.push(part.error(Code::OutOfRange, message));
    }
    seed
}
