//! The names of a graph: its nodes and inputs, the types of their values, and the ranges of its parameters.
use super::kinds::{Removed, Ty, removed};
use shibo_graph::syntax::{Node, NodeKind, Tree, is_name, number};
use shibo_node::registry::Registry;
use shibo_node::{Output, OutputType};
use shibo_value::Type;
use std::collections::{HashMap, HashSet};

/// Maximum number of references followed to find one type.
const MOST_STEPS: usize = 64;

/// An entry of `nodes`.
pub(super) struct Entry<'t> {
    /// Its name.
    pub(super) name: String,
    /// The entry in the text.
    pub(super) node: Node<'t>,
    /// Its value.
    pub(super) value: Node<'t>,
}

/// A graph: a file, or one of its local graphs.
pub(super) struct Scope<'t> {
    /// The brackets of the graph.
    pub(super) body: Node<'t>,
    /// The brackets of `nodes`, if there are any.
    pub(super) nodes: Option<Node<'t>>,
    /// The entries of `nodes`.
    pub(super) entries: Vec<Entry<'t>>,
    /// The index of each node; the first of equal names.
    index: HashMap<String, usize>,
    /// The types of the inputs, as written.
    inputs: HashMap<String, String>,
    /// The ranges of the parameters.
    ranges: HashMap<String, (f64, f64)>,
}

/// The graphs of a file: the file itself, and its local graphs.
pub(super) fn graphs(tree: &Tree) -> Vec<Node<'_>> {
    let Some(top) = tree.value() else { return Vec::new() };
    let locals = top.entry("graphs").and_then(Node::value).into_iter().flat_map(Node::entries).filter_map(Node::value);
    [top].into_iter().chain(locals).filter(|body| body.kind() == NodeKind::Parens).collect()
}

/// The text of a string; `None` for other values.
pub(super) fn text_of(value: Node<'_>) -> Option<String> {
    value.string()
}

/// The formula in a text that begins with one equals sign.
pub(super) fn formula_of(text: &str) -> Option<&str> {
    text.strip_prefix('=').filter(|rest| !rest.starts_with('='))
}

/// True if a text may refer to a node: it is a name, perhaps with parts after dots.
pub(super) fn is_path(text: &str) -> bool {
    text.split('.').all(is_name)
}

impl<'t> Scope<'t> {
    /// Reads a graph.
    pub(super) fn new(body: Node<'t>) -> Self {
        let section = |name: &str| body.entry(name).and_then(Node::value);
        let entries: Vec<Entry<'t>> = section("nodes").into_iter().flat_map(Node::entries).filter_map(entry).collect();
        let mut index = HashMap::new();
        for (at, entry) in entries.iter().enumerate() {
            index.entry(entry.name.clone()).or_insert(at);
        }
        let declared = section("inputs").into_iter().flat_map(Node::entries);
        let inputs = declared.filter_map(|item| Some((item.key_text()?, item.value()?.name()?.to_owned()))).collect();
        let params = section("params").into_iter().flat_map(Node::entries);
        let ranges = params.filter_map(|item| Some((item.key_text()?, range(item.value()?)?))).collect();
        let nodes = section("nodes").filter(|nodes| nodes.kind() == NodeKind::Map);
        Self { body, nodes, entries, index, inputs, ranges }
    }

    /// The index of a node.
    pub(super) fn node(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    /// True if a node or an input has this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.index.contains_key(name) || self.inputs.contains_key(name)
    }

    /// The range of a parameter; that of a component is that of the parameter.
    pub(super) fn range_of(&self, param: &str) -> Option<(f64, f64)> {
        self.ranges.get(param.split('.').next().unwrap_or(param)).copied()
    }

    /// The kind of a node.
    pub(super) fn kind_of(&self, name: &str) -> Option<&'t str> {
        self.entries[self.node(name)?].value.name()
    }

    /// Names of the outputs of a node; `None` if they are not known, as those of another graph.
    pub(super) fn outputs_of(&self, name: &str, registry: &Registry) -> Option<Vec<&'static str>> {
        if self.inputs.contains_key(name) {
            return Some(Vec::new());
        }
        let kind = self.kind_of(name)?;
        if let Some(removed) = removed(kind, registry) {
            return Some(removed.outputs.iter().map(|(name, _)| *name).collect());
        }
        Some(registry.info(kind)?.outputs.iter().map(|output| output.name).collect())
    }

    /// The type of `node` or `node.output`; `None` if it is not known.
    pub(super) fn type_of(&self, path: &str, registry: &Registry) -> Option<Type> {
        let mut waiting = vec![path.to_owned()];
        let mut seen = HashSet::new();
        let mut widest = None;
        while let Some(path) = waiting.pop() {
            if !seen.insert(path.clone()) || seen.len() > MOST_STEPS {
                return None;
            }
            let (name, output) =
                path.split_once('.').map_or((path.as_str(), None), |(name, output)| (name, Some(output)));
            if let Some(input) = self.inputs.get(name) {
                widest = Some(wider(widest, Type::from_name(input)?));
                continue;
            }
            let value = self.entries[self.node(name)?].value;
            match self.output_type(value, output, registry)? {
                Found::Type(ty) => widest = Some(wider(widest, ty)),
                Found::Like(paths, ty) => {
                    widest = ty.map(|ty| wider(widest, ty)).or(widest);
                    waiting.extend(paths);
                }
            }
        }
        widest
    }

    fn output_type(&self, value: Node<'t>, output: Option<&str>, registry: &Registry) -> Option<Found> {
        let kind = value.name()?;
        let ty = match removed(kind, registry) {
            Some(removed) => removed_type(removed, output)?,
            None => {
                let outputs = registry.info(kind)?.outputs;
                match outputs.get(output.map_or(Some(0), |output| Output::position(outputs, output))?)?.ty {
                    OutputType::Fixed(ty) => Ty::Fixed(ty),
                    OutputType::Like(ports) | OutputType::ValueOf(ports) => Ty::Like(ports),
                    // A value in space has as many components as one on the canvas.
                    OutputType::ColorOf(_) => Ty::Fixed(Type::Rgb),
                    OutputType::NumberOf(_) => Ty::Fixed(Type::Gray),
                    OutputType::Told => Ty::Unknown,
                    OutputType::MaterialOf(_) => Ty::Fixed(Type::Material),
                }
            }
        };
        match ty {
            Ty::Fixed(ty) => Some(Found::Type(ty)),
            Ty::Unknown => None,
            Ty::Like(ports) => {
                let (mut paths, mut widest) = (Vec::new(), None);
                let given = ports.iter().filter_map(|port| value.body()?.entry(port)?.value());
                for value in given {
                    match literal_type(value) {
                        Some(ty) => widest = Some(wider(widest, ty)),
                        None => paths.push(text_of(value)?),
                    }
                }
                Some(Found::Like(paths, widest))
            }
        }
    }
}

/// The type of an output, or the ports that it depends on.
enum Found {
    Type(Type),
    /// The widest type of some values, and the widest one of literals.
    Like(Vec<String>, Option<Type>),
}

fn removed_type(removed: &Removed, output: Option<&str>) -> Option<Ty> {
    removed.outputs.get(removed.output(output)?).map(|(_, ty)| *ty)
}

/// The type of a literal at a port; `None` if it refers to a node.
fn literal_type(value: Node<'_>) -> Option<Type> {
    match value.kind() {
        NodeKind::Number => Some(Type::Gray),
        NodeKind::Parens => Some(if value.children().count() == 3 { Type::Rgb } else { Type::Gray }),
        NodeKind::Text => match text_of(value)?.chars().next() {
            Some('#') => Some(Type::Rgb),
            Some('$' | '=') => Some(Type::Gray),
            _ => None,
        },
        _ => None,
    }
}

/// The type of a combination: a normal if one of them is, else a colour if one of them is.
fn wider(before: Option<Type>, ty: Type) -> Type {
    match before {
        Some(before) if before.channels() >= ty.channels() && ty != Type::Normal => before,
        _ => ty,
    }
}

fn entry(node: Node<'_>) -> Option<Entry<'_>> {
    Some(Entry { name: node.key_text()?, node, value: node.value()? })
}

fn range(declaration: Node<'_>) -> Option<(f64, f64)> {
    let pair = declaration.body()?.entry("range")?.value()?;
    let mut ends = pair.children().filter(|end| end.kind() == NodeKind::Number).filter_map(|end| number(end.text()));
    Some((ends.next()?, ends.next()?))
}
