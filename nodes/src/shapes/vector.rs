//! SVG files: read with limits, and drawn in blocks.
use glam::{DVec2, Vec2};
use resvg::tiny_skia::PathSegment;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{self, roxmltree, tiny_skia_path};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_kernel::path::pen::Pen;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// The most bytes of a file.
const MOST_BYTES: u64 = 16 << 20;

/// The most elements, each as often as it is used.
const MOST_ELEMENTS: u64 = 200_000;

/// The deepest nesting, through all that is used.
const MOST_DEPTH: u32 = 48;

/// The most straight pieces of outlines.
const MOST_OUTLINES: usize = 1_000_000;

/// Elements that are refused, and what to do instead.
const REFUSED: &[(&str, &str)] = &[
    ("image", "pictures come in through `Image`"),
    ("text", "convert text to paths in the program that drew it, or use the node `Text`"),
    ("filter", "use the nodes for filters, such as `Blur`"),
    ("pattern", "draw it once, and repeat it with `TileSampler`"),
    ("marker", "convert markers to paths in the program that drew them"),
    ("foreignObject", "only shapes are drawn"),
];

/// A vector picture.
pub(super) struct Vector {
    tree: usvg::Tree,
    /// Width and height in its own units.
    pub(super) size: DVec2,
}

/// What an element costs with all that it uses.
#[derive(Clone, Copy)]
enum Cost {
    /// Being found out.
    Open,
    /// Depth and elements.
    Known(u32, u64),
}

struct Check<'a, 'input> {
    path: &'a Path,
    document: &'a roxmltree::Document<'input>,
    by_id: HashMap<&'a str, roxmltree::Node<'a, 'input>>,
    costs: HashMap<roxmltree::NodeId, Cost>,
}

impl<'a, 'input> Check<'a, 'input> {
    fn problem(&self, node: roxmltree::Node<'_, '_>, code: Code, message: &str) -> Problem {
        let at = self.document.text_pos_at(node.range().start);
        let message = format!("`{}`, line {}, column {}: {message}", self.path.display(), at.row, at.col);
        Problem::new(code, message).at("path")
    }

    /// The elements that an element names, in links and in `url(#…)`.
    fn used(&self, node: roxmltree::Node<'a, 'input>) -> Result<Vec<roxmltree::Node<'a, 'input>>, Problem> {
        let mut used = Vec::new();
        for attribute in node.attributes() {
            let value = attribute.value();
            if attribute.name() == "href" && node.tag_name().name() != "a" {
                let Some(id) = value.trim().strip_prefix('#') else {
                    let message = "it refers to another file; only what the file itself holds is drawn";
                    return Err(self.problem(node, Code::BadFile, message));
                };
                used.extend(self.by_id.get(id));
            }
            for rest in value.split("url(").skip(1) {
                let name = rest.split(')').next().unwrap_or("").trim().trim_matches(['"', '\'']);
                used.extend(name.strip_prefix('#').and_then(|id| self.by_id.get(id.trim())));
            }
        }
        Ok(used)
    }

    /// How deep an element nests, and how many elements are drawn for it.
    fn cost(&mut self, node: roxmltree::Node<'a, 'input>, above: u32) -> Result<(u32, u64), Problem> {
        match self.costs.get(&node.id()) {
            Some(Cost::Known(depth, count)) => return Ok((*depth, *count)),
            Some(Cost::Open) => return Err(self.problem(node, Code::BadFile, "it uses itself")),
            None => {}
        }
        if above > MOST_DEPTH {
            return Err(self.problem(node, Code::TooLarge, &format!("elements nest deeper than {MOST_DEPTH}")));
        }
        let name = node.tag_name().name();
        if let Some((_, instead)) = REFUSED.iter().find(|(refused, _)| *refused == name) {
            return Err(self.problem(node, Code::BadFile, &format!("`{name}` is not drawn")).help(*instead));
        }
        if name == "style"
            && node
                .descendants()
                .any(|n| n.text().is_some_and(|text| text.contains("url(") || text.contains("@import")))
        {
            let help = "write it at the elements, as `fill=\"url(#…)\"`";
            return Err(self
                .problem(node, Code::BadFile, "a style sheet with `url(…)` or `@import` is not read")
                .help(help));
        }
        self.costs.insert(node.id(), Cost::Open);
        let (mut depth, mut count) = (0, 1u64);
        let children = node.children().filter(roxmltree::Node::is_element);
        for next in children.chain(self.used(node)?) {
            let (d, c) = self.cost(next, above + 1)?;
            (depth, count) = (depth.max(d), count.saturating_add(c));
        }
        if above + depth > MOST_DEPTH {
            return Err(self.problem(node, Code::TooLarge, &format!("elements nest deeper than {MOST_DEPTH}")));
        }
        if count > MOST_ELEMENTS {
            let message = format!("more than {MOST_ELEMENTS} elements would be drawn");
            return Err(self.problem(node, Code::TooLarge, &message).help("draw it simpler"));
        }
        self.costs.insert(node.id(), Cost::Known(depth + 1, count));
        Ok((depth + 1, count))
    }
}

impl Vector {
    /// Reads a file.
    pub(super) fn read(path: &Path) -> Result<Self, Problem> {
        let bad = |code: Code, why: String| Problem::new(code, format!("`{}`: {why}", path.display())).at("path");
        let io = |error: std::io::Error| bad(Code::BadFile, error.to_string());
        let length = std::fs::metadata(path).map_err(io)?.len();
        if length > MOST_BYTES {
            return Err(bad(
                Code::TooLarge,
                format!("the file has {} MiB; files of up to 16 MiB are read", length >> 20),
            ));
        }
        let bytes = std::fs::read(path).map_err(io)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            bad(Code::BadFile, format!("byte {at} is no UTF-8 text; an SVG file is text"))
        })?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, Problem> {
        let bad = |why: String| Problem::new(Code::BadFile, format!("`{}`: {why}", path.display())).at("path");
        if let Some(problem) = too_deep(text) {
            return Err(bad(problem));
        }
        let nodes_limit = u32::try_from(2 * MOST_ELEMENTS).unwrap_or(u32::MAX);
        let options = roxmltree::ParsingOptions { allow_dtd: true, nodes_limit, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(text, options)
            .map_err(|error| bad(format!("line {}, column {}: {error}", error.pos().row, error.pos().col)))?;
        let root = document.root_element();
        if root.tag_name().name() != "svg" {
            return Err(bad(format!("this is no SVG file: its first element is `{}`", root.tag_name().name())));
        }
        let by_id = document.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
        Check { path, document: &document, by_id, costs: HashMap::new() }.cost(root, 0)?;
        let nothing =
            usvg::ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
        let options = usvg::Options { image_href_resolver: nothing, ..usvg::Options::default() };
        let tree = catch_unwind(AssertUnwindSafe(|| usvg::Tree::from_xmltree(&document, &options)))
            .map_err(|_| bad("its decoder gave up".into()))?
            .map_err(|error| bad(error.to_string()))?;
        let size = Vec2::new(tree.size().width(), tree.size().height()).as_dvec2();
        Ok(Self { tree, size })
    }

    /// Draws the picture into `side` × `side` pixels, its units placed by `scale` and `shift` in pixels: red, green, blue and opacity,
    /// 0..255, multiplied by opacity. Nothing if that cannot be done.
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

    /// The outlines of all shapes as they are drawn, `scale` mm to a unit and moved by `shift`, up to [`MOST_OUTLINES`] straight
    /// pieces; and whether these are all.
    pub(super) fn outlines(&self, scale: DVec2, shift: DVec2) -> (Pen, bool) {
        let mut pen = Pen::default();
        let all = trace(self.tree.root(), (scale, shift), &mut pen);
        (pen, all)
    }

    /// About how much memory it takes.
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

/// What is wrong with a text whose elements nest too deep, by its tags alone: parsers go down with every level.
fn too_deep(text: &str) -> Option<String> {
    let (mut depth, mut rest) = (0u32, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at..];
        let end = |mark: &str| rest.find(mark).map_or(rest.len(), |at| at + mark.len());
        let end = if rest.starts_with("<!--") {
            end("-->")
        } else if rest.starts_with("<![CDATA[") {
            end("]]>")
        } else {
            end(">")
        };
        let tag = &rest[..end];
        if tag.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.starts_with("<!") && !tag.starts_with("<?") && !tag.ends_with("/>") {
            depth += 1;
            if depth > MOST_DEPTH * 4 {
                return Some(format!("elements nest deeper than {MOST_DEPTH}"));
            }
        }
        rest = &rest[end..];
    }
    None
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
        let path = pen.finish(DVec2::splat(100.0), shibo_engine::value::Tiling::NONE);
        let curves: Vec<(bool, f64)> =
            path.curves.iter().map(|c| (c.closed, (c.length() * 10.0).round() / 10.0)).collect();
        assert_eq!((all, curves), (true, vec![(true, 36.0), (true, 25.1)]));
        assert_eq!(path.curves[0].points[0], DVec2::new(5.0, 2.0));
    }

    #[test]
    fn what_is_not_drawn_is_told_with_its_place() {
        assert_eq!(refused("<g>\n  <image href='x.png'/></g>"), "`a.svg`, line 3, column 3: `image` is not drawn");
        assert!(refused("<use xlink:href='other.svg#a'/>").contains("refers to another file"));
        assert!(refused("<text>a</text>").contains("`text` is not drawn"));
        assert!(refused("<style>@import 'a.css';</style>").contains("style sheet"));
        assert!(refused("<g").contains("line 3"));
        assert!(Vector::parse(Path::new("a.svg"), "<html/>").err().unwrap().message.contains("no SVG file"));
    }

    #[test]
    fn files_that_would_take_for_ever_are_refused() {
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
        assert!(refused(&chain).contains("nest deeper"), "{}", refused(&chain));
    }
}
