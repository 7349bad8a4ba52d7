//! Shared by the nodes that draw strokes: the field of a set of strokes, and bounds on what may be drawn.
use glam::Vec2;
use shibo_kernel::ground::tile;
use shibo_kernel::strokes::{self, Draw, Stroke, StrokeSet, StrokeStyle};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Tiling, Type};

/// Maximum number of strokes that overlap, on average. Drawing that many takes about a second per million pixels.
const MOST_LAYERS: f64 = 4096.0;

/// Maximum length or width of a stroke on a canvas that tiles, in canvas sides: a stroke overlaps itself that often.
const MOST_TIMES: f64 = 16.0;

/// The depth field of a set of strokes.
pub(super) fn field(set: StrokeSet, tiling: Tiling) -> Field {
    Field::generate(Type::Gray, tiling, move |out, given| {
        let frame = tile::frame(out);
        set.fill_until(&|| given.check().is_err(), &frame, Draw::Depth, out.plane_mut(0));
        given.check()
    })
}

/// Refuses strokes that would take far too long, for example because of a wrong unit or one zero too many. `names` are
/// the parameters that determine length and width.
pub(super) fn bounded(
    strokes: impl Iterator<Item = Stroke> + Clone,
    style: &StrokeStyle,
    (size, periodic): (Vec2, bool),
    names: [&'static str; 2],
) -> Result<(), Problem> {
    let lengths = strokes.clone().map(|s| f64::from((s.ends[1] - s.ends[0]).length()));
    let widths = strokes.clone().map(|s| f64::from(2.0 * s.half_width));
    let most = MOST_TIMES * f64::from(size.max_element());
    for (name, longest) in names.iter().zip([lengths.fold(0.0, f64::max), widths.fold(0.0, f64::max)]) {
        if periodic && longest > most {
            let message = format!(
                "{name} makes strokes of {longest:.0} mm; on a canvas that tiles they must be at most {most} mm"
            );
            let help = format!("that is {MOST_TIMES} times the canvas");
            return Err(Problem::new(Code::OutOfRange, message).at(*name).help(help));
        }
    }
    let layers = strokes::layers(strokes, style, size, periodic);
    if layers <= MOST_LAYERS {
        return Ok(());
    }
    let [_, width] = names;
    let message = format!(
        "{width} makes about {layers:.0} strokes lie over each other at every place; at most {MOST_LAYERS} are allowed"
    );
    Err(Problem::new(Code::TooLarge, message).at(width).help("make them smaller, or fewer"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_that_take_too_long_are_refused() {
        let stroke = |length: f32, half_width: f32| Stroke {
            ends: [Vec2::ZERO, Vec2::new(length, 0.0)],
            half_width,
            depth: 1.0,
        };
        let (size, names, style) = (Vec2::splat(40.0), ["length", "width"], StrokeStyle::default());
        let with = |length, half_width, count, periodic| {
            let problem =
                bounded(std::iter::repeat_n(stroke(length, half_width), count), &style, (size, periodic), names)
                    .err()?;
            Some((problem.code, problem.field))
        };
        assert_eq!(with(640.0, 0.1, 1, true), None);
        assert_eq!(with(641.0, 0.1, 1, true).unwrap().0, Code::OutOfRange);
        assert_eq!(with(1.0, 321.0, 1, true).unwrap().0, Code::OutOfRange);
        assert_eq!(with(1e5, 1e4, 4096, false), None);
        assert_eq!(with(1e5, 1e4, 4097, false).unwrap().0, Code::TooLarge);
        assert_eq!(with(10.0, 0.5, 100_000, true), None);
        assert_eq!(with(10.0, 20.0, 100_000, true).unwrap().0, Code::TooLarge);
    }
}
