//! Lettering: the outlines of a text in a font.
use glam::DVec2;
use shibo_kernel::shape::outline::{Edge, flatten};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::{Face, GlyphId, OutlineBuilder, Tag};

/// The default font: Quattrocento by Pablo Impallari, under the SIL Open Font License (`nodes/fonts/OFL.txt`).
const EMBEDDED: &[u8] = include_bytes!("../../fonts/Quattrocento-Regular.otf");

/// Maximum size of a font file, in bytes.
const MOST_BYTES: u64 = 64 << 20;

/// Maximum number of edges of a text.
const MOST_EDGES: usize = 400_000;

/// Largest distance of edges from the curves of a font, as a share of its size.
const TOLERANCE: f64 = 5e-5;

/// Parameters for setting a text.
pub(super) struct Setting<'a> {
    pub(super) text: &'a str,
    /// mm.
    pub(super) size: f64,
    /// Space between letters, as a share of the size.
    pub(super) tracking: f64,
    /// Distance from line to line, as a share of the size.
    pub(super) leading: f64,
    /// Alignment of lines: 0 left, ½ centred, 1 right.
    pub(super) align: f64,
}

/// The bytes of a font file, or of the embedded font.
pub(super) fn load(file: Option<&FileHandle>) -> Result<std::borrow::Cow<'static, [u8]>, Problem> {
    let Some(file) = file else { return Ok(EMBEDDED.into()) };
    let bad = |why: String| Problem::new(Code::BadFile, format!("`{}`: {why}", file.display())).at("font");
    let length = file.facts().map_err(|error| bad(error.to_string()))?.length;
    if length > MOST_BYTES {
        return Err(bad(format!("the file has {} MiB; fonts of up to 64 MiB are read", length >> 20)));
    }
    let bytes = file.bytes(MOST_BYTES).map_err(|error| bad(error.to_string()))?;
    Face::parse(&bytes, 0).map_err(|error| {
        bad(format!("this is no font that can be read: {error}")).help("name a TrueType or OpenType font")
    })?;
    Ok(bytes.into())
}

/// The edges of a text about the origin, mm, y down.
pub(super) fn edges(font: &[u8], setting: &Setting<'_>) -> Result<Vec<Edge>, Problem> {
    let face = Face::parse(font, 0)
        .map_err(|error| Problem::new(Code::BadFile, format!("the font cannot be read: {error}")).at("font"))?;
    let unit = setting.size / f64::from(face.units_per_em());
    let lines: Vec<&str> = setting.text.lines().collect();
    let capitals = face.capital_height().map_or(0.7 * f64::from(face.units_per_em()), f64::from) * unit;
    let height = capitals + setting.leading * setting.size * lines.len().saturating_sub(1) as f64;
    let mut pen = Pen { unit, tolerance: TOLERANCE * setting.size, ..Pen::default() };
    for (n, line) in lines.iter().enumerate() {
        let places = places(&face, line, setting.tracking * f64::from(face.units_per_em()))?;
        let width = places.last().map_or(0.0, |(_, x)| *x) * unit;
        let baseline = capitals + n as f64 * setting.leading * setting.size - 0.5 * height;
        for (glyph, x) in places.iter().filter_map(|(glyph, x)| Some(((*glyph)?, *x))) {
            pen.origin = DVec2::new(x * unit - setting.align * width, baseline);
            face.outline_glyph(glyph, &mut pen);
            if pen.edges.len() > MOST_EDGES {
                let message = format!("the text has more than {MOST_EDGES} edges");
                return Err(Problem::new(Code::TooLarge, message).at("text").help("shorten it, or use a plainer font"));
            }
        }
    }
    let mut edges = pen.edges;
    // Centre the text on its widest line, for every alignment.
    let (low, high) =
        edges.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| (low.min(e.from.x), high.max(e.from.x)));
    let shift = DVec2::new(if low <= high { -0.5 * (low + high) } else { 0.0 }, 0.0);
    edges.iter_mut().for_each(|e| (e.from, e.to) = (e.from + shift, e.to + shift));
    Ok(edges)
}

/// The glyphs of a line with their places in units of the font; the last entry is the end of the line.
fn places(face: &Face<'_>, line: &str, tracking: f64) -> Result<Vec<(Option<GlyphId>, f64)>, Problem> {
    let mut places: Vec<(Option<GlyphId>, f64)> = Vec::new();
    let (mut at, mut before): (f64, Option<GlyphId>) = (0.0, None);
    for letter in line.chars() {
        let glyph = match face.glyph_index(letter) {
            Some(glyph) => glyph,
            None => {
                let message = format!("the font has no glyph for `{}`", letter.escape_default());
                return Err(Problem::new(Code::BadValue, message)
                    .at("text")
                    .help("name a font that has it, with `font`"));
            }
        };
        if let Some(before) = before {
            at += kerning(face, before, glyph) + tracking;
        }
        places.push((Some(glyph), at));
        at += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
        before = Some(glyph);
    }
    places.push((None, at));
    Ok(places)
}

/// Shift of the second of two glyphs by kerning, in units of the font.
fn kerning(face: &Face<'_>, left: GlyphId, right: GlyphId) -> f64 {
    let Some(gpos) = face.tables().gpos else {
        let tables = face.tables().kern.into_iter().flat_map(|kern| kern.subtables);
        let horizontal = tables.filter(|table| table.horizontal && !table.has_state_machine);
        return horizontal.filter_map(|table| table.glyphs_kerning(left, right)).map(f64::from).sum();
    };
    let lookups =
        gpos.features.into_iter().filter(|f| f.tag == Tag::from_bytes(b"kern")).flat_map(|f| f.lookup_indices);
    let mut seen = Vec::new();
    for number in lookups {
        if seen.contains(&number) {
            continue;
        }
        seen.push(number);
        let Some(lookup) = gpos.lookups.get(number) else { continue };
        // The first subtable that contains the pair counts.
        for table in lookup.subtables.into_iter::<PositioningSubtable<'_>>() {
            let PositioningSubtable::Pair(pair) = table else { continue };
            let Some(index) = pair.coverage().get(left) else { continue };
            let found = match pair {
                PairAdjustment::Format1 { sets, .. } => sets.get(index).and_then(|set| set.get(right)),
                PairAdjustment::Format2 { classes, matrix, .. } => {
                    matrix.get((classes.0.get(left), classes.1.get(right)))
                }
            };
            if let Some((first, _)) = found {
                return f64::from(first.x_advance);
            }
        }
    }
    0.0
}

/// Collects edges; fonts have y up.
#[derive(Default)]
struct Pen {
    unit: f64,
    tolerance: f64,
    origin: DVec2,
    at: DVec2,
    start: DVec2,
    edges: Vec<Edge>,
}

impl Pen {
    fn place(&self, x: f32, y: f32) -> DVec2 {
        self.origin + DVec2::new(f64::from(x), -f64::from(y)) * self.unit
    }

    fn curve(&mut self, points: &[DVec2]) {
        flatten(points, self.tolerance, &mut self.edges);
        self.at = points.last().copied().unwrap_or(self.at);
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.close();
        self.at = self.place(x, y);
        self.start = self.at;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.curve(&[self.at, self.place(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.curve(&[self.at, self.place(x1, y1), self.place(x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.curve(&[self.at, self.place(x1, y1), self.place(x2, y2), self.place(x, y)]);
    }

    fn close(&mut self) {
        if self.at != self.start {
            self.curve(&[self.at, self.start]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str, align: f64, tracking: f64) -> Vec<Edge> {
        edges(EMBEDDED, &Setting { text, size: 10.0, tracking, leading: 1.2, align }).unwrap()
    }

    fn extent(edges: &[Edge]) -> (DVec2, DVec2) {
        let low = edges.iter().map(|e| e.from).fold(DVec2::INFINITY, DVec2::min);
        (low, edges.iter().map(|e| e.from).fold(DVec2::NEG_INFINITY, DVec2::max))
    }

    #[test]
    fn letters_are_closed_and_in_the_middle() {
        let letters = set("HOH", 0.5, 0.0);
        let (low, high) = extent(&letters);
        assert!((low.x + high.x).abs() < 1e-9 && (low.y + high.y).abs() < 0.3, "{low} {high}");
        // Capitals are about 0.7 of the size, and each outline ends where it starts.
        assert!((6.0..8.0).contains(&(high.y - low.y)), "{}", high.y - low.y);
        let sum: DVec2 = letters.iter().map(|e| e.to - e.from).sum();
        assert!(sum.length() < 1e-6);
        assert!(set("  ", 0.5, 0.0).is_empty());
    }

    #[test]
    fn pairs_are_kerned_and_letters_tracked() {
        let width = |text: &str, tracking| {
            let (low, high) = extent(&set(text, 0.0, tracking));
            high.x - low.x
        };
        // Kerning moves A and V closer together than H and H.
        let sum = |a: &str, b: &str| width(a, 0.0) + width(b, 0.0);
        let gap = |text: &str, a: &str, b: &str| width(text, 0.0) - sum(a, b);
        assert!(gap("AV", "A", "V") < gap("HH", "H", "H") - 0.5, "{} {}", gap("AV", "A", "V"), gap("HH", "H", "H"));
        assert!((width("HHH", 0.1) - width("HHH", 0.0) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn lines_are_aligned() {
        let edge = |align: f64, low: bool| {
            let lines = set("HH\nH", align, 0.0);
            let second: Vec<Edge> = lines.iter().copied().filter(|e| e.from.y > 1.0 && e.to.y > 1.0).collect();
            let (a, b) = (extent(&lines), extent(&second));
            if low { b.0.x - a.0.x } else { a.1.x - b.1.x }
        };
        assert!(edge(0.0, true).abs() < 1e-9 && edge(1.0, false).abs() < 1e-9);
        assert!((edge(0.5, true) - edge(0.5, false)).abs() < 1e-6);
    }

    #[test]
    fn reports_letters_missing_in_font() {
        let setting = Setting { text: "aシ", size: 10.0, tracking: 0.0, leading: 1.0, align: 0.0 };
        let problem = edges(EMBEDDED, &setting).unwrap_err();
        assert!(problem.message.contains("no glyph for `\\u{30b7}`"), "{}", problem.message);
        assert!(edges(b"no font", &setting).is_err());
    }
}
