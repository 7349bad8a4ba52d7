//! Checks only those elements of a file that are drawn.
use super::check::{Check, href};
use super::paint::{is_color, known};
use super::style::{Style, Value, is_svg};
use resvg::usvg::roxmltree::{Node, NodeId};
use shibo_value::diagnostics::{Code, Problem};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use svgtypes::Paint;

/// Unsupported elements, and the remedies.
const TEXT: (&str, &str) = ("text", "convert text to paths in the program that drew it, or use the node `Text`");
const IMAGE: (&str, &str) = ("image", "pictures come in through `Image`");
const FILTER: (&str, &str) = ("filter", "use the nodes for filters, such as `Blur`");
const PATTERN: (&str, &str) = ("pattern", "draw it once, and repeat it with `TileSampler`");
const MARKER: (&str, &str) = ("marker", "convert markers to paths in the program that drew them");
const FOREIGN: (&str, &str) = ("foreignObject", "only shapes are drawn");

/// The value of an inherited property, and the element that has it.
type Inherited<'a, 'input> = Option<(Value<'a>, Node<'a, 'input>)>;

/// The properties that an element inherits.
#[derive(Clone, Copy, Default)]
struct Context<'a, 'input> {
    fill: Inherited<'a, 'input>,
    stroke: Inherited<'a, 'input>,
    color: Inherited<'a, 'input>,
    markers: [Inherited<'a, 'input>; 3],
    hidden: bool,
    /// True within a clip, where only outlines count.
    clips: bool,
}

impl<'a, 'input> Context<'a, 'input> {
    /// The context within an element.
    fn within(self, style: &Style<'a>, node: Node<'a, 'input>) -> Self {
        let own = |name: &str, above: Inherited<'a, 'input>| style.get(name).map(|value| (value, node)).or(above);
        let [start, middle, end] = self.markers;
        Self {
            fill: own("fill", self.fill),
            stroke: own("stroke", self.stroke),
            color: own("color", self.color),
            markers: [own("marker-start", start), own("marker-mid", middle), own("marker-end", end)],
            hidden: style.get("visibility").map_or(self.hidden, |value| matches!(value.text, "hidden" | "collapse")),
            clips: self.clips,
        }
    }
}

/// Colours to rewrite in a form that `usvg` reads, by the number of the element and the property.
pub(super) type Rewritten = BTreeMap<u32, BTreeMap<&'static str, String>>;

/// Visits all elements that are drawn.
pub(super) struct DrawnElements<'c, 'a, 'input> {
    check: &'c mut Check<'a, 'input>,
    rewritten: Rewritten,
    /// Gradients that were checked.
    gradients: HashSet<NodeId>,
}

impl<'a, 'input> DrawnElements<'_, 'a, 'input> {
    /// Checks a document without cycles of links, and returns the colours to rewrite.
    pub(super) fn judge(check: &mut Check<'a, 'input>, root: Node<'a, 'input>) -> Result<Rewritten, Problem> {
        let mut drawn = DrawnElements { check, rewritten: Rewritten::new(), gradients: HashSet::new() };
        drawn.element(root, Context::default())?;
        Ok(drawn.rewritten)
    }

    fn refuse<T>(&self, node: Node<'_, '_>, (name, instead): (&str, &'static str)) -> Result<T, Problem> {
        Err(self.check.problem(node, Code::BadFile, &format!("`{name}` is not drawn")).help(instead))
    }

    fn children(&mut self, node: Node<'a, 'input>, context: Context<'a, 'input>) -> Result<(), Problem> {
        node.children().filter(is_svg).try_for_each(|child| self.element(child, context))
    }

    fn element(&mut self, node: Node<'a, 'input>, context: Context<'a, 'input>) -> Result<(), Problem> {
        let style = self.check.styles.of(node);
        if style.get("display").is_some_and(|value| value.text == "none") || node.has_attribute("requiredExtensions") {
            return Ok(());
        }
        let context = context.within(&style, node);
        let name = node.tag_name().name();
        match name {
            "svg" | "g" | "a" => self.children(node, context)?,
            "switch" => self.switch(node, context)?,
            "use" => self.instance(node, context)?,
            "path" | "rect" | "circle" | "ellipse" | "line" | "polyline" | "polygon" => {
                if context.hidden {
                    return Ok(());
                }
                self.shape(node, name, context)?;
            }
            "text" if !context.hidden && has_words(node) => return self.refuse(node, TEXT),
            "image" if !context.hidden && href(node).is_some() => return self.refuse(node, IMAGE),
            "foreignObject" if node.children().any(|child| child.is_element()) => return self.refuse(node, FOREIGN),
            _ => return Ok(()),
        }
        self.effects(node, &style)
    }

    /// Checks the first child whose conditions are met: the one that is drawn. If its conditions depend on languages or
    /// features, the next children may be drawn instead, so they are checked too.
    fn switch(&mut self, node: Node<'a, 'input>, context: Context<'a, 'input>) -> Result<(), Problem> {
        for child in node.children().filter(is_svg) {
            let skipped = child.has_attribute("requiredExtensions") || child.tag_name().name() == "foreignObject";
            if !skipped {
                self.element(child, context)?;
                if !child.has_attribute("requiredFeatures") && !child.has_attribute("systemLanguage") {
                    break;
                }
            }
        }
        Ok(())
    }

    fn instance(&mut self, node: Node<'a, 'input>, context: Context<'a, 'input>) -> Result<(), Problem> {
        let Some(link) = href(node) else { return Ok(()) };
        match self.check.linked(node, link)? {
            Some(target) if target.tag_name().name() == "symbol" => {
                let style = self.check.styles.of(target);
                self.children(target, context.within(&style, target))?;
                self.effects(target, &style)
            }
            Some(target) => self.element(target, context),
            None => Ok(()),
        }
    }

    fn shape(&mut self, node: Node<'a, 'input>, name: &str, context: Context<'a, 'input>) -> Result<(), Problem> {
        if context.clips {
            return Ok(());
        }
        if let Some((value, at)) = context.fill.filter(|_| name != "line") {
            self.paint(("fill", value), at, context.color)?;
        }
        if let Some((value, at)) = context.stroke {
            self.paint(("stroke", value), at, context.color)?;
        }
        if !matches!(name, "path" | "line" | "polyline" | "polygon") {
            return Ok(());
        }
        for (value, _) in context.markers.into_iter().flatten() {
            if self.check.named(value.text).is_some_and(|found| found.tag_name().name() == "marker") {
                return self.refuse(node, MARKER);
            }
        }
        Ok(())
    }

    fn paint(
        &mut self,
        (name, value): (&'static str, Value<'a>),
        at: Node<'a, 'input>,
        color: Inherited<'a, 'input>,
    ) -> Result<(), Problem> {
        let known = self.known((name, value), at)?;
        match Paint::from_str(&known) {
            Ok(Paint::CurrentColor) => self.current(color),
            Ok(Paint::FuncIRI(id, _)) => match self.check.by_id.get(id).copied() {
                Some(server) if server.tag_name().name() == "pattern" => self.refuse(at, PATTERN),
                Some(server) => self.gradient(server),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// Checks the value of `color`, to which `currentColor` refers.
    fn current(&mut self, color: Inherited<'a, 'input>) -> Result<(), Problem> {
        let Some((value, at)) = color else { return Ok(()) };
        let known = self.known(("color", value), at)?;
        if is_color(&known) { Ok(()) } else { Err(self.unknown(("color", value), at)) }
    }

    /// A paint in a form that `usvg` reads; recorded for rewriting if the file has another form.
    fn known(
        &mut self,
        (name, value): (&'static str, Value<'a>),
        at: Node<'a, 'input>,
    ) -> Result<Cow<'a, str>, Problem> {
        let is_set = |property: &str| self.check.sets(property);
        match known(value.text, &is_set) {
            Some(Cow::Owned(text)) if !value.important && !text.contains(['"', '\'', '<', '&']) => {
                self.rewritten.entry(at.id().get()).or_default().insert(name, text.clone());
                Ok(Cow::Owned(text))
            }
            Some(Cow::Borrowed(text)) => Ok(Cow::Borrowed(text)),
            _ => Err(self.unknown((name, value), at)),
        }
    }

    fn unknown(&self, (name, value): (&str, Value<'_>), at: Node<'_, '_>) -> Problem {
        let shown: String = value.text.chars().take(60).collect();
        let message = format!("`{name}` is `{}`, which is no colour that is read", shown.escape_debug());
        let help = match shown.contains("var(") {
            true => "properties such as `--name` are not read: write the colour itself, as `#804020`",
            false => "it must be a colour such as `#804020`, `rgb(128 64 32)` or `brown`",
        };
        self.check.problem(at, Code::BadFile, &message).help(help)
    }

    /// Checks the stops of a gradient, and of gradients from which it takes stops.
    fn gradient(&mut self, node: Node<'a, 'input>) -> Result<(), Problem> {
        if !self.gradients.insert(node.id()) {
            return Ok(());
        }
        for stop in node.children().filter(|child| is_svg(child) && child.tag_name().name() == "stop") {
            let Some(value) = self.check.styles.of(stop).get("stop-color") else { continue };
            let known = self.known(("stop-color", value), stop)?;
            if !is_color(&known) {
                return Err(self.unknown(("stop-color", value), stop));
            }
            if known == "currentColor" {
                let color = stop.ancestors().find_map(|above| Some((self.check.styles.of(above).get("color")?, above)));
                self.current(color)?;
            }
        }
        match href(node) {
            Some(link) => self.check.linked(node, link)?.map_or(Ok(()), |other| self.gradient(other)),
            None => Ok(()),
        }
    }

    /// Checks filters, clips and masks of an element.
    fn effects(&mut self, node: Node<'a, 'input>, style: &Style<'a>) -> Result<(), Problem> {
        if style.get("filter").is_some_and(|value| !matches!(value.text, "" | "none")) {
            return self.refuse(node, FILTER);
        }
        for (name, clips) in [("clip-path", true), ("mask", false)] {
            let Some(value) = style.get(name) else { continue };
            let Some(target) = self.check.named(value.text) else { continue };
            let mut context = Context { clips, ..Context::default() };
            let above: Vec<_> = target.ancestors().filter(|node| node.is_element()).collect();
            for node in above.into_iter().rev() {
                context = context.within(&self.check.styles.of(node), node);
            }
            self.children(target, context)?;
            let style = self.check.styles.of(target);
            self.effects(target, &style)?;
        }
        Ok(())
    }
}

/// True if a text has letters.
fn has_words(node: Node<'_, '_>) -> bool {
    node.descendants().any(|inside| {
        let words = inside.is_text() && inside.text().is_some_and(|text| !text.trim().is_empty());
        words && !inside.ancestors().any(|above| matches!(above.tag_name().name(), "title" | "desc"))
            || inside.tag_name().name() == "tref"
    })
}
