//! Types of the wires of a file, as far as they are known while it is edited.
use super::file::{File, Section};
use super::view::{Body, Shape, Value};
use super::world::{Cx, is_use};
use shibo_node::{KindInfo, OutputType, parse_color};
use shibo_value::{Accepts, Type};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::sync::Arc;

/// Maximum number of references followed in a row.
const DEEPEST: usize = 64;

/// An output of a node.
#[derive(Clone, Debug)]
pub(crate) struct Port {
    /// Name after the dot.
    pub name: String,
    /// Type, or `None` if unknown.
    pub ty: Option<Accepts>,
    /// Description.
    pub doc: String,
    /// Unit of its values.
    pub unit: Option<&'static str>,
    /// Former name.
    former: Option<&'static str>,
}

impl Port {
    /// Returns whether `name` is the present or the former name.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        self.name == name || self.former == Some(name)
    }
}

/// Types of a file, cached.
pub(crate) struct Types<'a> {
    cx: Cx<'a>,
    depth: Cell<usize>,
    ports: RefCell<HashMap<String, Arc<Vec<Port>>>>,
}

impl<'a> Types<'a> {
    /// Starts with an empty cache.
    pub(crate) fn new(cx: Cx<'a>) -> Self {
        Self { cx, depth: Cell::new(0), ports: RefCell::default() }
    }

    /// Type of a reference.
    pub(crate) fn of(&self, reference: &str) -> Option<Accepts> {
        let (name, port) = match reference.split_once('.') {
            Some((name, port)) => (name, Some(port)),
            None => (reference, None),
        };
        let ports = self.ports(name);
        match port {
            Some(port) => ports.iter().find(|p| p.is_called(port))?.ty,
            None => ports.first()?.ty,
        }
    }

    /// Outputs of a node or an input, the main one first.
    pub(crate) fn ports(&self, name: &str) -> Arc<Vec<Port>> {
        if let Some(known) = self.ports.borrow().get(name) {
            return known.clone();
        }
        if self.depth.get() >= DEEPEST {
            return Arc::default();
        }
        self.depth.set(self.depth.get() + 1);
        // References in a cycle find this empty entry.
        self.ports.borrow_mut().insert(name.to_owned(), Arc::default());
        let found = Arc::new(self.find(name).unwrap_or_default());
        self.ports.borrow_mut().insert(name.to_owned(), found.clone());
        self.depth.set(self.depth.get() - 1);
        found
    }

    fn find(&self, name: &str) -> Option<Vec<Port>> {
        if let Some(item) = self.cx.file.entry(Section::Inputs, name) {
            let ty = self.cx.file.head(item).and_then(Accepts::from_name);
            let doc = item.value.as_ref().and_then(|value| self.cx.file.text_of(value, "doc"));
            return Some(vec![Port {
                name: String::new(),
                ty,
                doc: doc.unwrap_or_default().to_owned(),
                unit: None,
                former: None,
            }]);
        }
        let value = self.cx.file.entry(Section::Nodes, name)?.value.as_ref()?;
        self.of_node(value)
    }

    /// Outputs of a node as written.
    fn of_node(&self, value: &'a Value) -> Option<Vec<Port>> {
        let word = self.cx.file.word(value)?;
        if is_use(word) {
            let file = self.cx.imported(self.cx.file.text_of(value, "graph")?)?;
            return Some(self.of_graph(&file));
        }
        let info = self.cx.kind(word)?;
        let ty = |ty: OutputType| self.of_output(info, ty, value.body());
        let port = |o: &shibo_node::Output| Port {
            name: o.name.to_owned(),
            ty: ty(o.ty),
            doc: o.doc.to_owned(),
            unit: o.unit,
            former: o.former,
        };
        Some(info.outputs.iter().map(port).collect())
    }

    /// Outputs of another graph.
    fn of_graph(&self, file: &File) -> Vec<Port> {
        let inner = Types::new(Cx { world: self.cx.world, file });
        inner.depth.set(self.depth.get() + 1);
        let outputs = file.entries(Section::Outputs).iter().filter_map(|item| {
            let value = item.value.as_ref()?;
            let from = value.text().or_else(|| file.text_of(value, "from")).or_else(|| file.text_of(value, "material"));
            let ty = from.and_then(|from| inner.of(from));
            Some(Port { name: item.name()?.to_owned(), ty, doc: String::new(), unit: None, former: None })
        });
        outputs.collect()
    }

    fn of_output(&self, info: &KindInfo, ty: OutputType, body: Option<&'a Body>) -> Option<Accepts> {
        let at = |port: &str| -> Vec<Option<Accepts>> {
            let value = body.and_then(|body| body.value(port));
            let several = value.and_then(Value::body).filter(|body| body.bracket == b'[');
            match several {
                Some(list) => list.items.iter().map(|i| self.of_value(i.value.as_ref()?)).collect(),
                None => value.map(|value| self.of_value(value)).into_iter().collect(),
            }
        };
        match ty {
            OutputType::Fixed(ty) => Some(Accepts::One(ty)),
            OutputType::Told => None,
            OutputType::ColorOf(ports) => {
                let solid = ports.iter().flat_map(|port| at(port)).flatten().any(|ty| ty.fits(Accepts::AnySolid));
                Some(Accepts::One(if solid { Type::SolidColor } else { Type::Rgb }))
            }
            OutputType::Like(ports) => {
                // If one of them is unknown, so is the widest type.
                let found: Option<Vec<Accepts>> = ports.iter().flat_map(|port| at(port)).collect();
                widest(&found?, info, ports)
            }
            OutputType::SolidLike(ports) => {
                let mut found = ports.iter().flat_map(|port| at(port)).flatten();
                Some(found.find(|ty| *ty != Accepts::One(Type::Solid)).unwrap_or(Accepts::One(Type::Solid)))
            }
        }
    }

    /// Type of a value at a port: a reference, a literal or a node without a name.
    pub(crate) fn of_value(&self, value: &'a Value) -> Option<Accepts> {
        match &value.shape {
            Shape::Text(text) if text.starts_with('#') => parse_color(text).map(|_| Accepts::One(Type::Rgb)),
            Shape::Text(text) if text.starts_with('$') => {
                let item = self.cx.file.entry(Section::Params, &text[1..])?;
                let color = self.cx.file.head(item)? == "Color";
                Some(Accepts::One(if color { Type::Rgb } else { Type::Gray }))
            }
            Shape::Text(text) if text.starts_with('=') => Some(Accepts::One(Type::Gray)),
            Shape::Text(text) => self.of(text),
            Shape::Number(_) => Some(Accepts::One(Type::Gray)),
            Shape::Body(body) if body.bracket == b'(' && body.items.len() == 3 => Some(Accepts::One(Type::Rgb)),
            Shape::Call { .. } => self.of_node(value)?.first()?.ty,
            _ => None,
        }
    }
}

/// Widest of some types, which is the type of outputs that follow their inputs.
fn widest(found: &[Accepts], info: &KindInfo, ports: &[&str]) -> Option<Accepts> {
    let mut rank = 0;
    for ty in found {
        rank = rank.max(match ty {
            Accepts::One(Type::Normal) => 2,
            Accepts::One(Type::Rgb | Type::Picture | Type::SolidColor | Type::SolidVector) => 1,
            Accepts::One(Type::Gray | Type::Solid) | Accepts::Direction | Accepts::Number => 0,
            other => return Some(*other),
        });
    }
    // A required port that is not connected yet may get any type.
    let open = |port: &str| info.ports().any(|(field, p)| field.name == port && p.required);
    if found.is_empty() && ports.iter().any(|port| open(port)) {
        return None;
    }
    Some(Accepts::One([Type::Gray, Type::Rgb, Type::Normal][rank]))
}
