//! Draws a graph as SVG.
use super::{Drawing, Item, Shape, Wire};
use shibo_bridge::page::layout::{Layout, LayoutPosition, layout};
use std::fmt::Write;

const MARGIN: f64 = 24.0;
const BOX_HEIGHT: f64 = 40.0;
const ROW: f64 = 62.0;
const GAP: f64 = 76.0;
/// Mean width of a character in pixels.
const LETTER: f64 = 7.4;

/// Positions and widths of the columns.
struct Columns {
    starts: Vec<f64>,
    widths: Vec<f64>,
}

impl Columns {
    fn of(drawing: &Drawing, layout: &Layout) -> Self {
        let mut widths = vec![0.0_f64; layout.columns];
        for (item, place) in drawing.items.iter().zip(&layout.places) {
            widths[place.column] = widths[place.column].max(width(item));
        }
        let mut starts = vec![MARGIN];
        for w in &widths {
            starts.push(starts.last().copied().unwrap_or(MARGIN) + w + GAP);
        }
        Self { starts, widths }
    }
}

fn width(item: &Item) -> f64 {
    let letters = item.name.chars().count().max(item.kind.chars().count());
    (letters as f64 * LETTER + 26.0).max(84.0)
}

fn middle(place: LayoutPosition) -> f64 {
    MARGIN + place.row * ROW + BOX_HEIGHT / 2.0
}

/// The drawing in SVG.
pub(super) fn svg(drawing: &Drawing) -> String {
    let pairs: Vec<(usize, usize)> = drawing.wires.iter().map(|w| (w.from, w.to)).collect();
    let layout = layout(drawing.items.len(), &pairs, |i| drawing.items[i].shape == Shape::Output);
    let columns = Columns::of(drawing, &layout);
    let full = columns.starts.last().copied().unwrap_or(MARGIN) - GAP + MARGIN;
    let height = 2.0 * MARGIN + layout.rows * ROW + BOX_HEIGHT;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{full:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {full:.0} {height:.0}\" font-family=\"system-ui, sans-serif\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fbfaf8\"/>",
        escaped(&drawing.title)
    );
    let arrivals = arrivals(drawing, &layout);
    for (i, wire) in drawing.wires.iter().enumerate() {
        self::wire(&mut out, drawing, wire, &path(wire, &layout.bends[i], &layout, &columns, arrivals[i], drawing));
    }
    for (item, place) in drawing.items.iter().zip(&layout.places) {
        self::item(&mut out, item, columns.starts[place.column], middle(*place));
    }
    out.push_str("</svg>\n");
    out
}

/// Vertical offset from a box's middle at which each wire arrives, so that wires into a box do not overlap.
fn arrivals(drawing: &Drawing, layout: &Layout) -> Vec<f64> {
    let mut into: Vec<Vec<usize>> = vec![Vec::new(); drawing.items.len()];
    for (i, wire) in drawing.wires.iter().enumerate() {
        into[wire.to].push(i);
    }
    let mut arrivals = vec![0.0; drawing.wires.len()];
    for wires in &mut into {
        let row = |i: usize| layout.bends[i].last().map_or(layout.places[drawing.wires[i].from].row, |bend| bend.row);
        wires.sort_by(|&a, &b| row(a).total_cmp(&row(b)));
        let step = (BOX_HEIGHT - 14.0) / wires.len().max(3) as f64;
        for (k, &i) in wires.iter().enumerate() {
            arrivals[i] = (k as f64 - (wires.len() - 1) as f64 / 2.0) * step;
        }
    }
    arrivals
}

/// Path of a wire: curves from box to bend to box, level through the columns between.
fn path(
    wire: &Wire,
    bends: &[LayoutPosition],
    layout: &Layout,
    columns: &Columns,
    arrival: f64,
    drawing: &Drawing,
) -> String {
    let (from, to) = (layout.places[wire.from], layout.places[wire.to]);
    let (mut x, mut y) = (columns.starts[from.column] + width(&drawing.items[wire.from]), middle(from));
    let mut d = format!("M{x:.1} {y:.1}");
    // A narrow box leaves a part of its column free.
    let edge = columns.starts[from.column] + columns.widths[from.column];
    if edge > x {
        let _ = write!(d, "H{edge:.1}");
        x = edge;
    }
    let mut curve = |to_x: f64, to_y: f64, d: &mut String| {
        let half = (to_x - x) / 2.0;
        let _ = write!(d, "C{:.1} {y:.1} {:.1} {to_y:.1} {to_x:.1} {to_y:.1}", x + half, to_x - half);
        (x, y) = (to_x, to_y);
    };
    for bend in bends {
        let end = columns.starts[bend.column] + columns.widths[bend.column];
        curve(columns.starts[bend.column], middle(*bend), &mut d);
        let _ = write!(d, "H{end:.1}");
        curve(end, middle(*bend), &mut d);
    }
    curve(columns.starts[to.column], middle(to) + arrival, &mut d);
    d
}

fn wire(out: &mut String, drawing: &Drawing, wire: &Wire, path: &str) {
    let from = &drawing.items[wire.from].name;
    let output = wire.output.as_ref().map_or(String::new(), |output| format!(".{output}"));
    let to = &drawing.items[wire.to].name;
    let port = if wire.port.is_empty() { String::new() } else { format!(".{}", wire.port) };
    let title = escaped(&format!("{from}{output} → {to}{port}: {}", wire.ty));
    let _ = writeln!(
        out,
        "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-opacity=\"0.85\"><title>{title}</title></path>",
        wire.ty.color()
    );
}

fn item(out: &mut String, item: &Item, x: f64, middle: f64) {
    let (w, top) = (width(item), middle - BOX_HEIGHT / 2.0);
    let (fill, line) = match item.shape {
        Shape::Node => ("#ffffff", "#b9b3a8"),
        Shape::Use => ("#f3ead6", "#a98f55"),
        Shape::Output => ("#e6eef8", "#6f8fb5"),
    };
    let (kind, name) = (escaped(&item.kind), escaped(&item.name));
    let _ = writeln!(
        out,
        "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{w:.1}\" height=\"{BOX_HEIGHT}\" rx=\"8\" fill=\"{fill}\" stroke=\"{line}\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"13\" font-weight=\"600\" fill=\"#2b2a28\">{name}</text>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"11\" fill=\"#77726a\">{kind}</text>",
        x + 12.0,
        middle - 3.0,
        x + 12.0,
        middle + 13.0,
    );
}

/// Escapes text for XML.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}
