//! SVG files of lines, in millimetres, for plotters, laser engravers and drawing programs.
use super::spec;
use glam::{DVec2, Vec2};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write;

/// Lines on a page.
#[derive(Clone, Debug)]
pub struct Drawing<'a> {
    /// The upper left corner of the page in mm.
    pub corner: DVec2,
    /// Its size in mm.
    pub size: DVec2,
    /// The two ends of each line in mm, and its width in mm; 0 is a hairline.
    pub lines: &'a [([Vec2; 2], f32)],
    /// Pairs of a name and a text.
    pub metadata: &'a [(String, String)],
}

/// Width in mm of hairlines.
const HAIRLINE: f32 = 0.05;

/// Bytes of a page of the drawing's size in mm, y down, with a group of lines for every width (to 1/100 mm, from the
/// thinnest). Each group is one path of lines in their order. Numbers are to 1/1000 mm.
///
/// # Errors
/// Only if the system runs out of memory.
pub fn svg(drawing: &Drawing<'_>) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    body(&mut bytes, drawing).map(|()| bytes)
}

/// The beginning of a page in mm, y down.
pub(crate) fn opened(corner: DVec2, size: DVec2) -> String {
    let (DVec2 { x, y }, DVec2 { x: w, y: h }) = (corner, size);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}mm\" height=\"{h}mm\" viewBox=\"{x} {y} {w} {h}\">\n"
    )
}

fn body(out: &mut impl Write, drawing: &Drawing<'_>) -> std::io::Result<()> {
    out.write_all(opened(drawing.corner, drawing.size).as_bytes())?;
    writeln!(out, "<desc>{}</desc>", escaped(&spec::described(drawing.metadata)))?;
    writeln!(out, r#"<g fill="none" stroke="black" stroke-linecap="round">"#)?;
    // Widths in hundredths of a mm, so that there are few groups.
    let mut groups: BTreeMap<u32, Vec<&[Vec2; 2]>> = BTreeMap::new();
    for (ends, width) in drawing.lines {
        let width = if *width > 0.0 { *width } else { HAIRLINE };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded and greater than 0")]
        groups.entry((width * 100.0).round().max(1.0) as u32).or_default().push(ends);
    }
    for (width, lines) in groups {
        let mut path = String::new();
        for [a, b] in lines {
            // Writing to a string cannot fail.
            let _ = write!(path, "M{:.3} {:.3}L{:.3} {:.3}", a.x, a.y, b.x, b.y);
        }
        writeln!(out, r#"<path stroke-width="{}" d="{path}"/>"#, f64::from(width) / 100.0)?;
    }
    writeln!(out, "</g>\n</svg>")
}

/// Escapes text for XML; characters that XML does not allow are left out.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_width_share_a_path() {
        let lines = [
            ([Vec2::ZERO, Vec2::new(1.5, 2.0)], 0.3),
            ([Vec2::ONE, Vec2::new(0.12345, 2.0)], 0.0),
            ([Vec2::X, Vec2::Y], 0.301),
        ];
        let metadata = [("Software".to_owned(), "a < b & c".to_owned())];
        let size = DVec2::new(30.0, 20.0);
        let drawing = Drawing { corner: DVec2::ZERO, size, lines: &lines, metadata: &metadata };
        let text = String::from_utf8(svg(&drawing).unwrap()).unwrap();
        assert!(text.contains(r#"width="30mm" height="20mm" viewBox="0 0 30 20""#), "{text}");
        assert!(text.contains("<desc>Software: a &lt; b &amp; c</desc>"), "{text}");
        assert!(text.contains(r#"<path stroke-width="0.05" d="M1.000 1.000L0.123 2.000"/>"#), "{text}");
        let both = r#"<path stroke-width="0.3" d="M0.000 0.000L1.500 2.000M1.000 0.000L0.000 1.000"/>"#;
        assert!(text.contains(both), "{text}");
    }
}
