//! Properties of elements, from attributes, style sheets and `style`, with the priorities of CSS as `usvg` applies
//! them.
use resvg::usvg::roxmltree::{Document, Node, NodeId};
use simplecss::{AttributeOperator, Declaration, DeclarationTokenizer, Element, PseudoClass, StyleSheet};
use std::collections::HashMap;
use std::rc::Rc;

/// The namespace of SVG.
const SVG: &str = "http://www.w3.org/2000/svg";

/// The properties that matter here. `marker` is a shorthand for the three that start with it.
const NAMES: &[&str] = &[
    "clip-path",
    "color",
    "display",
    "fill",
    "filter",
    "marker-end",
    "marker-mid",
    "marker-start",
    "mask",
    "stop-color",
    "stroke",
    "visibility",
];

/// The value of a property.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<'a> {
    pub(super) text: &'a str,
    /// True for a declaration marked `!important`: no later one replaces it.
    pub(super) important: bool,
}

/// The properties set at an element, without inherited ones.
pub(super) struct Style<'a>(Vec<(&'static str, Value<'a>)>);

impl<'a> Style<'a> {
    /// A property set at the element; `None` for `inherit`.
    pub(super) fn get(&self, name: &str) -> Option<Value<'a>> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).filter(|value| value.text != "inherit")
    }

    /// All values.
    pub(super) fn values(&self) -> impl Iterator<Item = &'a str> {
        self.0.iter().map(|(_, value)| value.text)
    }

    fn set(&mut self, name: &str, value: Value<'a>) {
        let Some(name) = NAMES.iter().find(|known| **known == name) else { return };
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, old)) if old.important => {}
            Some((_, old)) => *old = value,
            None => self.0.push((name, value)),
        }
    }

    fn declare(&mut self, declaration: &Declaration<'a>) {
        let Declaration { name, value, important } = *declaration;
        let value = Value { text: value.trim(), important };
        if name == "marker" {
            ["marker-start", "marker-mid", "marker-end"].iter().for_each(|name| self.set(name, value));
        } else {
            self.set(name, value);
        }
    }
}

/// The styles of a document.
pub(super) struct Styles<'a> {
    sheet: StyleSheet<'a>,
    known: HashMap<NodeId, Rc<Style<'a>>>,
}

impl<'a> Styles<'a> {
    pub(super) fn new(document: &'a Document<'_>) -> Self {
        let mut sheet = StyleSheet::new();
        for node in document.descendants().filter(is_sheet) {
            sheet.parse_more(node.text().unwrap_or(""));
        }
        Self { sheet, known: HashMap::new() }
    }

    /// Number of rules.
    pub(super) fn rules(&self) -> usize {
        self.sheet.rules.len()
    }

    /// The properties of an element.
    pub(super) fn of(&mut self, node: Node<'a, '_>) -> Rc<Style<'a>> {
        if let Some(style) = self.known.get(&node.id()) {
            return style.clone();
        }
        let mut style = Style(Vec::new());
        for attribute in node.attributes().filter(|attribute| matches!(attribute.namespace(), None | Some(SVG))) {
            style.set(attribute.name(), Value { text: attribute.value().trim(), important: false });
        }
        let rules = self.sheet.rules.iter().filter(|rule| rule.selector.matches(&Styled(node)));
        rules.flat_map(|rule| &rule.declarations).for_each(|declaration| style.declare(declaration));
        if let Some(text) = node.attribute("style") {
            DeclarationTokenizer::from(text).for_each(|declaration| style.declare(&declaration));
        }
        let style = Rc::new(style);
        self.known.insert(node.id(), style.clone());
        style
    }
}

/// True for a style sheet that is read.
pub(super) fn is_sheet(node: &Node<'_, '_>) -> bool {
    node.tag_name().name() == "style" && matches!(node.attribute("type"), None | Some("text/css"))
}

/// True for an element of SVG.
pub(super) fn is_svg(node: &Node<'_, '_>) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

/// An element in the form that selectors need.
struct Styled<'a, 'input>(Node<'a, 'input>);

impl Element for Styled<'_, '_> {
    fn parent_element(&self) -> Option<Self> {
        self.0.parent_element().map(Styled)
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        self.0.prev_sibling_element().map(Styled)
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.0.tag_name().name() == name
    }

    fn attribute_matches(&self, name: &str, operator: AttributeOperator<'_>) -> bool {
        self.0.attribute(name).is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, class: PseudoClass<'_>) -> bool {
        class == PseudoClass::FirstChild && self.0.prev_sibling_element().is_none()
    }
}
