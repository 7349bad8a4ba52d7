//! [`Text`]: lettering.
//!
//! Outlines of the font, as [`kernel::outline`](shibo_kernel::shape::outline): the distance is exact, and the mask
//! follows from it. Letters are spaced by their widths and by the kerning pairs of the font; other features of fonts
//! (ligatures, scripts that join) are not supported. Cost: O(pixels · edges nearby).
use super::glyphs::{self, Setting};
use super::masked;
use crate::degrees::sin_cos;
use glam::{DMat2, DVec2};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::shape::outline::{Edge, Outline};
use shibo_node::{CanvasFacts, Context, Fact, FilePath, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{Field, Stop, Tiling, Type};
use std::sync::Arc;

/// Alignment of lines.
#[choice]
pub enum Align {
    /// Lines begin together on the left.
    Left,
    /// Lines are centred.
    #[default]
    Center,
    /// Lines end together on the right.
    Right,
}

/// Lettering as a mask and as the distance from its edge in mm: monograms, labels, engravings.
///
/// The default font is Quattrocento by Pablo Impallari (SIL Open Font License). On a canvas that tiles, the text
/// repeats with it.
///
/// ```ron
/// "letters": Text(text: "Shibo", size_mm: 13),
/// "edge": Remap(input: "letters.distance", from: (-0.6, 0), to: (-0.6, 0), clamp: true),
/// "example": Relief(height: "edge", strength: 2),
/// ```
///
/// Elsewhere: Substance Designer *Text*; Material Maker *Text*; Blender *String to Curves*; Houdini *Font*.
#[node]
#[derive(PartialEq)]
pub struct Text {
    /// The text; `\n` starts another line. At most 2000 letters.
    #[default("Text".into())]
    pub text: String,
    /// A TrueType or OpenType font, relative to the graph file; the embedded font if not given.
    pub font: Option<FilePath>,
    /// Size of the font; capital letters are about 0.7 times as high.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(10.0)]
    pub size_mm: f64,
    /// Alignment of lines.
    #[default(Align::Center)]
    pub align: Align,
    /// Additional space between letters, as a share of the size.
    #[schemars(range(min = -1, max = 10))]
    pub tracking: f64,
    /// Distance from one line to the next, as a share of the size.
    #[schemars(range(min = 0, max = 10))]
    #[default(1.2)]
    pub leading: f64,
    /// Centre of the text; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
    /// Rotation of the text, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Width over which the edge of the mask fades, half of it inside; at least one pixel.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub softness: f64,
}

impl Text {
    fn edges(&self, font: Option<&FileHandle>) -> Result<Vec<Edge>, Problem> {
        let align = match self.align {
            Align::Left => 0.0,
            Align::Center => 0.5,
            Align::Right => 1.0,
        };
        let Self { text, size_mm, tracking, leading, .. } = self;
        let setting = Setting { text, size: *size_mm, tracking: *tracking, leading: *leading, align };
        glyphs::edges(&glyphs::load(font)?, &setting)
    }
}

impl Node for Text {
    const OUTPUTS: &'static [Output] = &[
        Output::new("mask", Type::Gray, "1 on the letters and 0 elsewhere."),
        Output::new("distance", Type::Gray, "Distance from the edge of the letters; negative inside.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (count, most) = (self.text.chars().count(), 8.0 * canvas.size_mm().max_element());
        if count > 2000 {
            let message = format!("text has {count} letters; at most 2000 are set");
            return vec![Problem::new(Code::TooLarge, message).at("text")];
        }
        if self.size_mm > most {
            let message = format!("size_mm is `{}` mm; it must be at most {most} mm", self.size_mm);
            return vec![Problem::new(Code::OutOfRange, message).at("size_mm").help("that is eight times the canvas")];
        }
        if self.font.is_some() { Vec::new() } else { self.edges(None).err().into_iter().collect() }
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if !self.text.trim().is_empty() {
            return Vec::new();
        }
        vec![Problem::new(Code::Advice, "text has no letters: nothing is drawn").at("text")]
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.font.iter().map(|font| ("font", font)).collect()
    }

    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        files.iter().filter_map(|(_, file)| self.edges(Some(file)).err()).collect()
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut edges = self.edges(cx.file("font"))?;
        let center = self.center.map_or(cx.size_mm() * 0.5, |c| DVec2::new(c.x, c.y));
        let (sin, cos) = sin_cos(self.angle);
        let turn = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
        edges.iter_mut().for_each(|e| (e.from, e.to) = (center + turn * e.from, center + turn * e.to));
        let outline = Arc::new(Outline::new(edges, (cx.size_mm(), cx.tiling())));
        let far = narrow(cx.size_mm().max_element());
        let mask = masked::outlined(&outline, self.softness, cx.tiling());
        let distance = Field::generate(Type::Gray, cx.tiling(), move |out, given| {
            outline.fill(&|| given.check().is_err(), &tile::frame(out), far, out.plane_mut(0));
            given.check()
        });
        Ok(Outputs::one(mask).with("distance", distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn lettering_conforms() {
        conforms(&Text { text: "Ab\nc".into(), angle: 20.0, ..Text::default() }, &[]);
        conforms(&Text { text: "Ag".into(), center: Some(Xy::new(0.0, 31.0)), softness: 1.0, ..Text::default() }, &[]);
        conforms(&Text { text: String::new(), ..Text::default() }, &[]);
    }

    #[test]
    fn strokes_and_holes_are_where_they_should_be() {
        // An I is a bar in the middle, an O has a hole there.
        let at = |text: &str, x: usize, y: usize| {
            let node = Text { text: text.into(), size_mm: 28.0, ..Text::default() };
            part(&field(&node, &[], "distance"), &canvas(), 0, 0, 64, 64).row(0, y)[x]
        };
        assert!(at("I", 32, 32) < 0.0 && at("O", 32, 32) > 3.0 && at("I", 2, 2) > 5.0);
    }

    #[test]
    fn refuses_invalid_text() {
        let refused = |node: Text| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(Text::default()), None);
        assert_eq!(refused(Text { text: "シボ".into(), ..Text::default() }).as_deref(), Some("text"));
        assert_eq!(refused(Text { text: "a".repeat(2001), ..Text::default() }).as_deref(), Some("text"));
        assert_eq!(refused(Text { size_mm: 300.0, ..Text::default() }).as_deref(), Some("size_mm"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("font.otf");
        std::fs::write(&path, b"OTTO and nothing else").unwrap();
        let problems = Node::check_files(&Text::default(), &[("font", (&path).into())]);
        assert_eq!((problems.len(), problems[0].code), (1, Code::BadFile));
    }
}
