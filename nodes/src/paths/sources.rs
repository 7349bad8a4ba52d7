//! Sources of paths: places, SVG path data, segments, other paths.
use glam::DVec2;
use shibo_kernel::path::pen::{MOST_PIECES, Pen};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Polyline};
use svgtypes::{Error, SimplePathSegment, SimplifyingPathParser};

/// Maximum number of bytes of SVG path data.
const MOST_BYTES: usize = 1 << 20;

/// Draws SVG path data, scaled by `scale` and moved by `offset`.
pub(super) fn draw_data(text: &str, scale: f64, offset: DVec2, pen: &mut Pen) -> Result<(), Problem> {
    if text.len() > MOST_BYTES {
        return Err(Problem::new(Code::TooLarge, "d has more than 1 MiB").at("d"));
    }
    let place = |x: f64, y: f64| DVec2::new(x, y) * scale + offset;
    for segment in SimplifyingPathParser::from(text) {
        match segment.map_err(|error| wrong(text, &error))? {
            SimplePathSegment::MoveTo { x, y } => pen.move_to(place(x, y)),
            SimplePathSegment::LineTo { x, y } => pen.line_to(place(x, y)),
            SimplePathSegment::CurveTo { x1, y1, x2, y2, x, y } => {
                pen.curve_to(&[place(x1, y1), place(x2, y2), place(x, y)]);
            }
            SimplePathSegment::Quadratic { x1, y1, x, y } => pen.curve_to(&[place(x1, y1), place(x, y)]),
            SimplePathSegment::ClosePath => pen.close(),
        }
        if pen.pieces() > MOST_PIECES {
            return Err(too_many("d"));
        }
    }
    Ok(())
}

fn wrong(text: &str, error: &Error) -> Problem {
    let (what, at) = match error {
        Error::UnexpectedData(at) => ("this is no command of a path", Some(*at)),
        Error::InvalidNumber(at) => ("this is no number", Some(*at)),
        Error::InvalidChar(_, at) | Error::InvalidString(_, at) => ("this does not belong here", Some(*at)),
        Error::UnexpectedEndOfStream => ("it ends in the middle of a command", None),
        _ => ("it cannot be read", None),
    };
    let help = "write SVG path data, in mm: `M 2 5 L 10 5 C 14 5 14 12 20 12`, `Z` at the end closes it";
    let problem = Problem::new(Code::BadValue, format!("d is no path: {what}")).at("d").help(help);
    // Positions in errors of the parser count characters from 1.
    let byte = at.map(|at| text.char_indices().nth(at.saturating_sub(1)).map_or(text.len(), |(byte, _)| byte));
    let from = byte.unwrap_or(text.len());
    let to = text[from..].chars().next().map_or(from, |c| from + c.len_utf8());
    problem.within(if from < to { from..to } else { from.saturating_sub(1)..from })
}

pub(super) fn too_many(field: &str) -> Problem {
    let message = format!("{field} makes more than {MOST_PIECES} straight pieces");
    Problem::new(Code::TooLarge, message).at(field)
}

/// Draws another path.
pub(super) fn draw_path(path: &value::Path, close: bool, scale: f64, offset: DVec2, pen: &mut Pen) {
    for curve in &path.curves {
        let mut points = curve.points.iter().map(|p| *p * scale + offset);
        let Some(first) = points.next() else { continue };
        pen.move_to(first);
        points.for_each(|p| pen.line_to(p));
        if close && !curve.closed {
            pen.close();
        }
    }
}

/// The path `copies` times, each moved by `step`.
pub(super) fn repeated(path: value::Path, copies: u32, step: DVec2) -> value::Path {
    if copies < 2 {
        return path;
    }
    let moved = |curve: &Polyline, by: DVec2| Polyline {
        points: curve.points.iter().map(|p| *p + by).collect(),
        closed: curve.closed,
    };
    let all = (0..copies).flat_map(|k| path.curves.iter().map(move |curve| (curve, step * f64::from(k))));
    let curves = all.map(|(curve, by)| moved(curve, by)).collect();
    value::Path { curves, ..path }
}
