//! Checks the links of a file, and limits the elements that they expand to.
use super::style::{Styles, is_sheet};
use resvg::usvg::roxmltree::{Document, Node, NodeId};
use shibo_value::diagnostics::{Code, Problem};
use std::collections::HashMap;
use std::path::Path;

/// Maximum number of elements, counting each as often as it is used.
pub(super) const MOST_ELEMENTS: u64 = 200_000;

/// Maximum number of pairs of a style sheet rule and an element.
const MOST_MATCHES: usize = 50_000_000;

/// Maximum depth of nesting, including used elements.
const MOST_DEPTH: u32 = 48;

/// Cost of an element with all elements that it uses.
#[derive(Clone, Copy)]
enum Cost {
    /// Being computed; meeting it again means a cycle.
    Open,
    /// Depth, and number of elements.
    Known(u32, u64),
}

pub(super) struct Check<'a, 'input> {
    path: &'a Path,
    document: &'a Document<'input>,
    pub(super) by_id: HashMap<&'a str, Node<'a, 'input>>,
    pub(super) styles: Styles<'a>,
    costs: HashMap<NodeId, Cost>,
}

impl<'a, 'input> Check<'a, 'input> {
    /// Checks a document.
    pub(super) fn run(path: &'a Path, document: &'a Document<'input>) -> Result<Self, Problem> {
        let mut by_id = HashMap::new();
        for node in document.descendants() {
            if let Some(id) = node.attribute("id") {
                by_id.entry(id).or_insert(node);
            }
        }
        let (styles, costs) = (Styles::new(document), HashMap::new());
        let mut check = Check { path, document, by_id, styles, costs };
        for sheet in document.descendants().filter(is_sheet) {
            if sheet.descendants().any(|inside| inside.text().is_some_and(|text| text.contains("@import"))) {
                let problem = check.problem(sheet, Code::BadFile, "a style sheet with `@import` is not read");
                return Err(problem.help("put its rules into the file"));
            }
        }
        let elements = document.descendants().filter(Node::is_element).count();
        if check.styles.rules().saturating_mul(elements) > MOST_MATCHES {
            let message =
                format!("{} rules of style sheets for {elements} elements are too many", check.styles.rules());
            let problem = check.problem(document.root_element(), Code::TooLarge, &message);
            return Err(problem.help("write the properties at the elements"));
        }
        check.cost(document.root_element(), 0)?;
        Ok(check)
    }

    pub(super) fn problem(&self, node: Node<'_, '_>, code: Code, message: &str) -> Problem {
        let at = self.document.text_pos_at(node.range().start);
        let message = format!("`{}`, line {}, column {}: {message}", self.path.display(), at.row, at.col);
        Problem::new(code, message).at("path")
    }

    /// The element to which a link leads.
    pub(super) fn linked(&self, node: Node<'_, '_>, link: &str) -> Result<Option<Node<'a, 'input>>, Problem> {
        match link.strip_prefix('#') {
            Some(id) => Ok(self.by_id.get(id).copied()),
            None => {
                let message = "it refers to another file; only what the file itself holds is drawn";
                Err(self.problem(node, Code::BadFile, message))
            }
        }
    }

    /// The element that `url(#…)` names.
    pub(super) fn named(&self, value: &str) -> Option<Node<'a, 'input>> {
        let (_, rest) = value.split_once("url(")?;
        let name = rest.split(')').next()?.trim().trim_matches(['"', '\'']);
        self.by_id.get(name.strip_prefix('#')?.trim()).copied()
    }

    /// True if the file sets this custom property.
    pub(super) fn sets(&self, property: &str) -> bool {
        let text = self.document.input_text();
        text.split(property).skip(1).any(|after| after.trim_start().starts_with(':'))
    }

    /// The elements that an element refers to, by links and by `url(#…)`.
    fn used(&mut self, node: Node<'a, 'input>) -> Vec<Node<'a, 'input>> {
        let is_link = node.tag_name().name() != "a";
        let link = href(node).filter(|_| is_link).and_then(|link| self.by_id.get(link.strip_prefix('#')?).copied());
        let style = self.styles.of(node);
        link.into_iter().chain(style.values().filter_map(|value| self.named(value))).collect()
    }

    /// The depth of nesting of an element, and the number of elements drawn for it.
    fn cost(&mut self, node: Node<'a, 'input>, above: u32) -> Result<(u32, u64), Problem> {
        match self.costs.get(&node.id()) {
            Some(Cost::Known(depth, count)) => return Ok((*depth, *count)),
            Some(Cost::Open) => return Err(self.problem(node, Code::BadFile, "it uses itself")),
            None => {}
        }
        let deep = || self.problem(node, Code::TooLarge, &format!("elements nest deeper than {MOST_DEPTH}"));
        if above > MOST_DEPTH {
            return Err(deep());
        }
        self.costs.insert(node.id(), Cost::Open);
        let (mut depth, mut count) = (0, 1u64);
        let children = node.children().filter(Node::is_element);
        for next in children.chain(self.used(node)) {
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

/// The fault of a text whose elements nest too deep. It scans only tags, because parsers recurse at every level.
pub(super) fn too_deep(text: &str) -> Option<String> {
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

/// The link of an element; `href` of SVG 2 takes precedence over that of SVG 1.
pub(super) fn href<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    let links = || node.attributes().filter(|attribute| attribute.name() == "href");
    let link = links().find(|link| link.namespace().is_none()).or_else(|| links().next())?;
    Some(link.value().trim())
}
