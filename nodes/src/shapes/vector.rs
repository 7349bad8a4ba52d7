//! Reads SVG files with limits, and draws them in blocks.
mod check;
mod drawn;
mod encoding;
mod paint;
mod style;

use check::{Check, MOST_ELEMENTS, too_deep};
use drawn::{DrawnElements, Rewritten};
use glam::{DVec2, Vec2};
use resvg::tiny_skia::PathSegment;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, roxmltree, tiny_skia_path};
use shibo_kernel::path::pen::Pen;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Maximum size of a file in bytes, packed and unpacked.
const MOST_BYTES: u64 = 16 << 20;

/// Maximum number of straight pieces of outlines.
const MOST_OUTLINES: usize = 1_000_000;

/// A vector picture.
pub(super) struct Vector {
    tree: usvg::Tree,
    /// Width and height in its own units.
    pub(super) size: DVec2,
}

impl Vector {
    /// Reads a file.
    pub(super) fn read(file: &FileHandle) -> Result<Self, Problem> {
        let bad = |code: Code, why: String| Problem::new(code, format!("`{}`: {why}", file.display())).at("path");
        let io = |error: std::io::Error| bad(Code::BadFile, error.to_string());
        let length = file.facts().map_err(io)?.length;
        if length > MOST_BYTES {
            return Err(bad(
                Code::TooLarge,
                format!("the file has {} MiB; files of up to 16 MiB are read", length >> 20),
            ));
        }
        let bytes = file.bytes(MOST_BYTES).map_err(io)?;
        let text = encoding::text(bytes).map_err(|(code, why)| bad(code, why))?;
        Self::parse(file.path(), &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, Problem> {
        let bad = |why: String| Problem::new(Code::BadFile, format!("`{}`: {why}", path.display())).at("path");
        if let Some(problem) = too_deep(text) {
            return Err(bad(problem));
        }
        let document = tree_of(text).map_err(&bad)?;
        let root = document.root_element();
        if root.tag_name().name() != "svg" {
            return Err(bad(format!("this is no SVG file: its first element is `{}`", root.tag_name().name())));
        }
        let mut check = Check::run(path, &document)?;
        let text = rewrite(&document, &DrawnElements::judge(&mut check, root)?);
        let document = tree_of(&text).map_err(&bad)?;
        let nothing =
            usvg::ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
        let options = usvg::Options { image_href_resolver: nothing, ..usvg::Options::default() };
        let tree = catch_unwind(AssertUnwindSafe(|| usvg::Tree::from_xmltree(&document, &options)))
            .map_err(|_| bad("its decoder gave up".into()))?
            .map_err(|error| bad(error.to_string()))?;
        let size = Vec2::new(tree.size().width(), tree.size().height()).as_dvec2();
        Ok(Self { tree, size })
    }

    /// Draws the picture into `side` × `side` pixels, with `scale` pixels per unit and moved by `shift` pixels:
    /// premultiplied red, green, blue and opacity, 0..255. `None` if the pixels cannot be allocated.
    #[expect(clippy::cast_possible_truncation, reason = "places in a block need no more than f32")]
    pub(super) fn draw(&self, (scale, shift): (DVec2, DVec2), side: u32) -> Option<Vec<u8>> {
        let transform = Transform::from_row(scale.x as f32, 0.0, 0.0, scale.y as f32, shift.x as f32, shift.y as f32);
        let draw = || {
            let mut pixmap = Pixmap::new(side, side)?;
            resvg::render(&self.tree, transform, &mut pixmap.as_mut());
            Some(pixmap.take())
        };
        catch_unwind(AssertUnwindSafe(draw)).ok().flatten()
    }

    /// The outlines of all drawn shapes, with `scale` mm per unit and moved by `shift`, up to [`MOST_OUTLINES`]
    /// straight pieces; and true if they are complete.
    pub(super) fn outlines(&self, scale: DVec2, shift: DVec2) -> (Pen, bool) {
        let mut pen = Pen::default();
        let all = trace(self.tree.root(), (scale, shift), &mut pen);
        (pen, all)
    }

    /// Approximate memory of the picture, in bytes.
    pub(super) fn bytes(&self) -> usize {
        fn nodes(group: &usvg::Group) -> usize {
            let each = |node: &usvg::Node| match node {
                usvg::Node::Group(group) => 500 + nodes(group),
                usvg::Node::Path(path) => 500 + 16 * path.data().len(),
                _ => 500,
            };
            group.children().iter().map(each).sum()
        }
        nodes(self.tree.root())
    }
}

/// Draws the outlines of a group; false if there are too many.
fn trace(group: &usvg::Group, place: (DVec2, DVec2), pen: &mut Pen) -> bool {
    group.children().iter().all(|node| match node {
        usvg::Node::Group(group) => trace(group, place, pen),
        usvg::Node::Path(path) => {
            let on_canvas = |p: tiny_skia_path::Point| {
                let mut p = p;
                path.abs_transform().map_point(&mut p);
                Vec2::new(p.x, p.y).as_dvec2() * place.0 + place.1
            };
            for segment in path.data().segments() {
                match segment {
                    PathSegment::MoveTo(to) => pen.move_to(on_canvas(to)),
                    PathSegment::LineTo(to) => pen.line_to(on_canvas(to)),
                    PathSegment::QuadTo(a, to) => pen.curve_to(&[on_canvas(a), on_canvas(to)]),
                    PathSegment::CubicTo(a, b, to) => pen.curve_to(&[on_canvas(a), on_canvas(b), on_canvas(to)]),
                    PathSegment::Close => pen.close(),
                }
            }
            pen.pieces() <= MOST_OUTLINES
        }
        _ => true,
    })
}

/// Parses a text into elements.
fn tree_of(text: &str) -> Result<roxmltree::Document<'_>, String> {
    let nodes_limit = u32::try_from(2 * MOST_ELEMENTS).unwrap_or(u32::MAX);
    let options = roxmltree::ParsingOptions { allow_dtd: true, nodes_limit, ..Default::default() };
    roxmltree::Document::parse_with_options(text, options)
        .map_err(|error| format!("line {}, column {}: {error}", error.pos().row, error.pos().col))
}

/// The text of a document, with rewritten colours added to the styles of elements.
fn rewrite(document: &roxmltree::Document<'_>, colors: &Rewritten) -> String {
    let mut text = document.input_text().to_owned();
    let mut places: Vec<(usize, String)> = Vec::new();
    for (id, colors) in colors {
        let Some(node) = document.get_node(roxmltree::NodeId::new(*id)) else { continue };
        let style: String = colors.iter().map(|(name, color)| format!("{name}: {color} !important;")).collect();
        let old = node.attributes().find(|attribute| attribute.name() == "style" && attribute.namespace().is_none());
        places.push(match old {
            Some(old) => (old.range_value().start, style),
            None => {
                let start = node.range().start;
                let name = text[start..].find(|c: char| c.is_whitespace() || matches!(c, '>' | '/'));
                (start + name.unwrap_or(0), format!(" style=\"{style}\""))
            }
        });
    }
    places.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
    places.iter().for_each(|(at, style)| text.insert_str(*at, style));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(inside: &str) -> Result<Vector, Problem> {
        let head = r#"<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 20 10">"#;
        Vector::parse(Path::new("a.svg"), &format!("{head}\n{inside}\n</svg>"))
    }

    fn refused(inside: &str) -> String {
        parse(inside).err().map(|problem| problem.message).unwrap_or_default()
    }

    #[test]
    fn shapes_are_read() {
        let vector =
            parse(r##"<defs><g id="a"><rect width="5" height="5" fill="#ff0000"/></g></defs><use href="#a" x="2"/>"##)
                .unwrap();
        assert_eq!(vector.size, DVec2::new(20.0, 10.0));
        let pixels = vector.draw((DVec2::splat(1.0), DVec2::ZERO), 16).unwrap();
        let at = |x: usize, y: usize| &pixels[4 * (16 * y + x)..][..4];
        assert_eq!((at(3, 3), at(1, 1), at(6, 4)), (&[255, 0, 0, 255][..], &[0; 4][..], &[255, 0, 0, 255][..]));
    }

    #[test]
    fn outlines_lie_where_shapes_are_drawn() {
        let text = r#"<g transform="translate(2 1)"><rect width="5" height="4"/></g><circle cx="15" cy="5" r="2" fill="none" stroke="red"/>"#;
        let (pen, all) = parse(text).unwrap().outlines(DVec2::splat(2.0), DVec2::new(1.0, 0.0));
        let path = pen.finish(DVec2::splat(100.0), shibo_value::Tiling::NONE);
        let curves: Vec<(bool, f64)> =
            path.curves.iter().map(|c| (c.closed, (c.length() * 10.0).round() / 10.0)).collect();
        assert_eq!((all, curves), (true, vec![(true, 36.0), (true, 25.1)]));
        assert_eq!(path.curves[0].points[0], DVec2::new(5.0, 2.0));
    }

    #[test]
    fn names_unsupported_elements_with_place() {
        assert_eq!(refused("<g>\n  <image href='x.png'/></g>"), "`a.svg`, line 3, column 3: `image` is not drawn");
        assert!(refused("<use xlink:href='other.svg#a'/>").contains("refers to another file"));
        assert!(refused("<text>a</text>").contains("`text` is not drawn"));
        assert!(refused("<style>@import 'a.css';</style>").contains("style sheet"));
        assert!(refused("<g").contains("line 3"));
        assert!(Vector::parse(Path::new("a.svg"), "<html/>").err().unwrap().message.contains("no SVG file"));
    }

    #[test]
    fn refuses_unsupported_elements_that_are_used() {
        let rect = "<rect width='5' height='5'";
        let defs = "<defs><filter id='f'><feFlood/></filter><pattern id='p' width='1' height='1'/><marker id='m'/>\
                    <clipPath id='c'><text>a</text></clipPath><mask id='k'><image href='#f'/></mask></defs>";
        for (drawn, name) in [
            (format!("{rect} filter='url(#f)'/>"), "filter"),
            (format!("{rect} style='filter: blur(2px)'/>"), "filter"),
            (format!("<style>.a {{ filter: url(#f) }}</style>{rect} class='a'/>"), "filter"),
            (format!("{rect} fill='url(#p) red'/>"), "pattern"),
            (format!("<g stroke='url(#p)'>{rect}/></g>"), "pattern"),
            ("<g style='marker: url(#m)'><path d='M0 0L5 5'/></g>".to_owned(), "marker"),
            (format!("{rect} clip-path='url(#c)'/>"), "text"),
            (format!("{rect} mask='url(#k)'/>"), "image"),
            ("<defs><g id='g'><text>a</text></g></defs><use href='#g'/>".to_owned(), "text"),
            ("<g visibility='hidden'><text visibility='visible'>a</text></g>".to_owned(), "text"),
            ("<switch><g><text>a</text></g></switch>".to_owned(), "text"),
        ] {
            let said = refused(&format!("{defs}{drawn}"));
            assert!(said.contains(&format!("`{name}` is not drawn")), "{drawn}: {said}");
        }
    }

    /// The colour of the middle pixel of a square drawn by `inside`.
    #[track_caller]
    fn color(inside: &str) -> [u8; 4] {
        let vector = parse(inside).unwrap_or_else(|problem| panic!("{inside}: {}", problem.message));
        let pixels = vector.draw((DVec2::splat(1.0), DVec2::ZERO), 16).unwrap();
        pixels[4 * (16 * 2 + 2)..][..4].try_into().unwrap()
    }

    const RED: [u8; 4] = [255, 0, 0, 255];

    #[test]
    fn ignores_unused_elements() {
        let rect = "<rect width='5' height='5' fill='red'/>";
        for beside in [
            "<filter id='f'><feGaussianBlur stdDeviation='2'/></filter>",
            "<defs><pattern id='p' width='10' height='10'/><marker id='m'/><g><text>a</text><image href='a.png'/></g></defs>",
            "<text></text><text> <tspan/> </text><text><title>a</title></text>",
            "<text display='none'>a</text><g style='display:none'><text>a</text><image href='a.png'/></g>",
            "<text visibility='hidden'>a</text><image visibility='collapse' href='a.png'/>",
            "<style>.a { display: none } .b { fill: url(#p) }</style><text class='a'>a</text><rect class='a b' filter='url(#f)'/>",
            "<rect fill='var(--c)' display='none'/><rect stroke='var(--c)' visibility='hidden' width='3' height='3'/>",
            "<x xmlns='https://example.com'><text>a</text></x>",
            "<symbol id='s'><text>a</text></symbol><foreignObject/>",
        ] {
            assert_eq!(color(&format!("{beside}{rect}")), RED, "{beside}");
        }
        let chosen = format!(
            "<foreignObject width='1' height='1'><p/></foreignObject><g requiredExtensions='x'><text>a</text></g>{rect}<text>b</text>"
        );
        assert_eq!(color(&format!("<switch>{chosen}</switch>")), RED);
    }

    #[test]
    fn reads_colors_in_all_forms() {
        let fill = |paint: &str| color(&format!("<g color='red'><rect width='5' height='5' fill='{paint}'/></g>"));
        for paint in [
            "Red",
            "#F00",
            "rgb(100% 0% 0%)",
            "hsl(360deg, 100%, 50%)",
            "currentColor",
            "CURRENTCOLOR",
            "rgba(255 0 0 / 100%)",
            "var(--unset, RED)",
            "url(#no) currentcolor",
        ] {
            assert_eq!(fill(paint), RED, "{paint}");
        }
        let own = color(
            "<rect width='5' height='5' fill='blue' style='stroke: none; fill: var(--x, currentcolor); color: red'/>",
        );
        assert_eq!(own, RED, "a style that is written anew");
        let sheet = "<style>.a > rect { fill: RGB(255 0 0 / 100%) }</style>";
        assert_eq!(color(&format!("{sheet}<g class='a'><rect width='5' height='5'/></g>")), RED);
        let stop = "<linearGradient id='g' color='red'><stop stop-color='CurrentColor'/></linearGradient>";
        assert_eq!(color(&format!("{stop}<rect width='5' height='5' fill='url(#g)'/>")), RED);
        assert_eq!(fill("none"), [0; 4]);
    }

    /// Colour names of CSS that `svgtypes` knows, and some that are easily missed.
    #[test]
    fn reads_names_of_colors_in_any_case() {
        for (name, [r, g, b]) in [
            ("AliceBlue", [240, 248, 255]),
            ("DARKSLATEGREY", [47, 79, 79]),
            ("darkslategray", [47, 79, 79]),
            ("lightGoldenrodYellow", [250, 250, 210]),
            ("rebeccapurple", [102, 51, 153]),
            ("yellowgreen", [154, 205, 50]),
        ] {
            assert_eq!(color(&format!("<rect width='5' height='5' fill='{name}'/>")), [r, g, b, 255], "{name}");
        }
    }

    #[test]
    fn refuses_unknown_colors() {
        let said = refused("<rect width='5' height='5'\n fill='var(--c)'/>");
        assert_eq!(said, "`a.svg`, line 2, column 1: `fill` is `var(--c)`, which is no colour that is read");
        for (drawn, found) in [
            (
                "<style>:root { --c: red } rect { fill: var(--c, blue) }</style><rect width='1' height='1'/>",
                "`fill` is `var(--c, blue)`",
            ),
            ("<g stroke='reddish'><rect width='1' height='1'/></g>", "`stroke` is `reddish`"),
            ("<g color='lab(1 1 1)'><path d='M0 0L1 1L2 0' fill='currentColor'/></g>", "`color` is `lab(1 1 1)`"),
            (
                "<linearGradient id='g'><stop stop-color='var(--c)'/></linearGradient><rect width='1' height='1' fill='url(#g)'/>",
                "`stop-color` is `var(--c)`",
            ),
            ("<rect width='1' height='1' style='fill: currentcolor !important'/>", "`fill` is `currentcolor`"),
        ] {
            let said = refused(drawn);
            assert!(said.contains(found), "{drawn}: {said}");
        }
    }

    #[test]
    fn refuses_files_that_take_too_long() {
        assert!(refused("<g id='a'><use href='#b'/></g><g id='b'><use href='#a'/></g>").contains("uses itself"));
        let mut laughs = "<g id='a0'><rect width='1' height='1'/></g>".to_owned();
        for k in 1..20 {
            laughs += &format!("<g id='a{k}'>{}</g>", format!("<use href='#a{}'/>", k - 1).repeat(10));
        }
        assert!(refused(&laughs).contains("elements"), "{}", refused(&laughs));
        assert!(refused(&format!("{}{}", "<g>".repeat(100_000), "</g>".repeat(100_000))).contains("nest deeper"));
        assert!(refused(&format!("{}{}", "<g>".repeat(60), "</g>".repeat(60))).contains("nest deeper"));
        let mut chain = "<g id='a0'/>".to_owned();
        (1..100).for_each(|k| chain += &format!("<g id='a{k}'><use href='#a{}'/></g>", k - 1));
        let sheet = "<style>.m { mask: url(#m) }</style><mask id='m'><g class='m'/></mask><g class='m'/>";
        assert!(refused(sheet).contains("uses itself"), "{}", refused(sheet));
        assert!(refused(&chain).contains("nest deeper"), "{}", refused(&chain));
    }
}
