//! Types of the wires of a file, as far as they are known while it is edited.
use super::file::{File, Section};
use super::formula::{CANVAS, Inferred, PLACES, Resolve, Role, Space, infer};
use super::functions;
use super::paths::Path;
use super::view::{Body, Shape, Value};
use super::world::{Cx, is_use};
use shibo_graph::syntax::formula::{Formula, begins};
use shibo_node::{KindInfo, OutputType, parse_color};
use shibo_value::expression::{self, Compiled, Meaning, UserFunction};
use shibo_value::{Accepts, Channel, Type};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;
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
    /// True for a formula of constants.
    constant: bool,
}

impl Port {
    /// Returns whether `name` is the present or the former name.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        self.name == name || self.former == Some(name)
    }
}

/// A graph: the path of its file, and its name if it is a local graph.
type GraphId = (PathBuf, Option<String>);

/// A function and the types of its values.
type Call = (String, Vec<Inferred>);

/// Types of a graph, cached.
pub(crate) struct Types<'a> {
    cx: Cx<'a>,
    depth: Cell<usize>,
    ports: RefCell<HashMap<String, Arc<Vec<Port>>>>,
    /// Outputs of the graphs that it uses, directly or not. An entry is empty while it is computed.
    graphs: Rc<RefCell<HashMap<GraphId, Arc<Vec<Port>>>>>,
    /// Numbers of components of calls: by the function and the types of its values.
    calls: RefCell<HashMap<Call, Option<usize>>>,
}

impl<'a> Types<'a> {
    /// Starts with an empty cache.
    pub(crate) fn new(cx: Cx<'a>) -> Self {
        Self { cx, depth: Cell::new(0), ports: RefCell::default(), graphs: Rc::default(), calls: RefCell::default() }
    }

    /// Type of a path.
    pub(crate) fn of(&self, text: &str) -> Option<Accepts> {
        let path = Path::of(self.cx, text);
        let ports = self.ports(&text[path.node.clone()]);
        let mut ty = match &path.port {
            Some(port) => ports.iter().find(|p| p.is_called(&text[port.clone()]))?.ty,
            None => ports.first()?.ty,
        };
        if let Some(channel) = path.channel.and_then(|channel| Channel::from_name(&text[channel])) {
            ty = match ty {
                None | Some(Accepts::One(Type::Material) | Accepts::AnyMaterial) => Some(channel.ty().into()),
                Some(Accepts::One(Type::SolidMaterial)) => Some(channel.solid_type().into()),
                Some(_) => None,
            };
        }
        match path.components {
            Some(letters) => Inferred::of(ty?).components(&text[letters]).ty(),
            None => ty,
        }
    }

    /// Type of a path, or of a formula with an equals sign before it.
    pub(crate) fn of_text(&self, text: &str) -> Option<Accepts> {
        if begins(text).is_some() { self.of_formula(text).ty() } else { self.of(text) }
    }

    /// Types of the parts of a formula.
    pub(crate) fn parts(&self, formula: &Formula, role: Role<'_>) -> Vec<Inferred> {
        infer(formula, &InFormula { types: self, role })
    }

    /// Type of a formula, with or without the equals sign before it.
    fn of_formula(&self, text: &str) -> Inferred {
        let formula = Formula::parse(&text[begins(text).unwrap_or(0)..]);
        let found = self.parts(&formula, Role::Point);
        formula.root().and_then(|root| found.get(root).copied()).unwrap_or(Inferred::Unknown)
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
                constant: false,
            }]);
        }
        let value = self.cx.file.entry(Section::Nodes, name)?.value.as_ref()?;
        self.of_node(value)
    }

    /// Outputs of a node as written.
    fn of_node(&self, value: &'a Value) -> Option<Vec<Port>> {
        if let Some(text) = value.text() {
            begins(text)?;
            let of = self.of_formula(text);
            let constant = of.space() == Some(Space::Constant);
            let doc = "The value of the formula.".to_owned();
            return Some(vec![Port { name: String::new(), ty: of.ty(), doc, unit: None, former: None, constant }]);
        }
        let word = self.cx.file.word(value)?;
        if is_use(word) {
            let file = self.cx.imported(self.cx.file.text_of(value, "graph")?)?;
            return Some(self.of_graph(&file).to_vec());
        }
        let info = self.cx.kind(word)?;
        let ty = |ty: OutputType| self.of_output(info, ty, value.body());
        let port = |o: &shibo_node::Output| Port {
            name: o.name.to_owned(),
            ty: ty(o.ty),
            doc: o.doc.to_owned(),
            unit: o.unit,
            former: o.former,
            constant: false,
        };
        Some(info.outputs.iter().map(port).collect())
    }

    /// Outputs of another graph.
    fn of_graph(&self, file: &File) -> Arc<Vec<Port>> {
        let id = (file.path.clone(), file.local_name().map(str::to_owned));
        if let Some(known) = self.graphs.borrow().get(&id) {
            return known.clone();
        }
        // A graph that uses itself finds this empty entry.
        self.graphs.borrow_mut().insert(id.clone(), Arc::default());
        let inner = Types { graphs: self.graphs.clone(), ..Types::new(self.cx.with(file)) };
        inner.depth.set(self.depth.get() + 1);
        let outputs = file.entries(Section::Outputs).iter().filter_map(|item| {
            let value = item.value.as_ref()?;
            let from = value.text().or_else(|| file.text_of(value, "from")).or_else(|| file.text_of(value, "material"));
            let ty = from.and_then(|from| inner.of_text(from));
            let name = item.name()?.to_owned();
            Some(Port { name, ty, doc: String::new(), unit: None, former: None, constant: false })
        });
        let found = Arc::new(outputs.collect::<Vec<_>>());
        self.graphs.borrow_mut().insert(id, found.clone());
        found
    }

    fn of_output(&self, info: &KindInfo, of: OutputType, body: Option<&'a Body>) -> Option<Accepts> {
        let at = |port: &str| -> Vec<Option<Accepts>> {
            let value = body.and_then(|body| body.value(port));
            let several = value.and_then(Value::body).filter(|body| body.bracket == b'[');
            match several {
                Some(list) => list.items.iter().map(|i| self.of_value(i.value.as_ref()?)).collect(),
                None => value.map(|value| self.of_value(value)).into_iter().collect(),
            }
        };
        match of {
            OutputType::Fixed(ty) => Some(Accepts::One(ty)),
            OutputType::Told => None,
            OutputType::ColorOf(ports) | OutputType::NumberOf(ports) | OutputType::MaterialOf(ports) => {
                let solid = ports.iter().flat_map(|port| at(port)).flatten().any(|ty| ty.fits(Accepts::InSpace));
                let [canvas, space] = match of {
                    OutputType::ColorOf(_) => [Type::Rgb, Type::SolidColor],
                    OutputType::NumberOf(_) => [Type::Gray, Type::Solid],
                    _ => [Type::Material, Type::SolidMaterial],
                };
                Some(Accepts::One(if solid { space } else { canvas }))
            }
            OutputType::Like(ports) => {
                // If one of them is unknown, so is the widest type.
                let found: Option<Vec<Accepts>> = ports.iter().flat_map(|port| at(port)).collect();
                widest(&found?, info, ports)
            }
            OutputType::ValueOf(ports) => {
                let space = |ty: Accepts| ty.fits(Accepts::InSpace);
                let is_own = |name: &str| ports.contains(&name);
                let solid = |name: &str, takes: Accepts| {
                    let counts = takes.is_anywhere() || is_own(name);
                    counts && at(name).into_iter().flatten().chain([takes]).any(space)
                };
                let found = ports.iter().flat_map(|port| at(port));
                if info.ports().any(|(field, port)| solid(&field.name, port.ty)) {
                    return Some(Accepts::One(widest_solid(found.flatten())));
                }
                widest(&found.collect::<Option<Vec<Accepts>>>()?, info, ports)
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
            Shape::Text(text) => self.of_text(text),
            Shape::Number(_) => Some(Accepts::One(Type::Gray)),
            Shape::Body(body) if body.bracket == b'(' && body.items.len() == 3 => Some(Accepts::One(Type::Rgb)),
            Shape::Call { .. } => self.of_node(value)?.first()?.ty,
            _ => None,
        }
    }
}

/// Types of the names of a formula.
struct InFormula<'t, 'a, 'r> {
    types: &'t Types<'a>,
    role: Role<'r>,
}

impl Resolve for InFormula<'_, '_, '_> {
    fn name(&self, path: &str) -> Inferred {
        let file = self.types.cx.file;
        let first = path.split('.').next().unwrap_or_default();
        let is_node = [Section::Nodes, Section::Inputs].into_iter().any(|section| file.entry(section, first).is_some());
        if self.role == Role::Point && is_node {
            let constant = self.types.ports(first).first().is_some_and(|port| port.constant);
            let of = self.types.of(path).map_or(Inferred::Unknown, Inferred::of);
            return match of {
                Inferred::Numbers(count, _) if constant => Inferred::Numbers(count, Space::Constant),
                of => of,
            };
        }
        let place = PLACES.iter().position(|(place, _)| *place == path).filter(|_| self.role == Role::Point);
        match place {
            Some(index) if index < expression::ON_CANVAS => Inferred::Numbers(1, Space::Canvas),
            Some(_) => Inferred::Numbers(1, Space::Solid),
            None if CANVAS.iter().any(|(fact, _)| *fact == path) => Inferred::NUMBER,
            None if matches!(path, "pi" | "true" | "false") => Inferred::NUMBER,
            None if self.role == Role::Value || self.role == Role::Point => Inferred::Word,
            None => Inferred::Unknown,
        }
    }

    fn param(&self, name: &str) -> Inferred {
        let file = self.types.cx.file;
        match file.entry(Section::Params, name).and_then(|item| file.head(item)) {
            Some("Color") => Inferred::Numbers(3, Space::Constant),
            Some("Number" | "Integer" | "Bool") => Inferred::NUMBER,
            Some(_) => Inferred::Word,
            None => Inferred::Unknown,
        }
    }

    fn call(&self, name: &str, values: &[Inferred]) -> Option<usize> {
        const MOST: usize = 16;
        let values = values.get(..values.len().min(MOST))?;
        let key = (name.to_owned(), values.to_vec());
        if let Some(known) = self.types.calls.borrow().get(&key) {
            return *known;
        }
        let letters: Vec<String> = (0..values.len()).map(|index| format!("value{index}")).collect();
        let call = format!("{name}({})", letters.join(", "));
        let mut names = CallNames { cx: self.types.cx, values };
        let found = expression::compile(&call, &mut names).ok().as_ref().and_then(Compiled::known_components);
        self.types.calls.borrow_mut().insert(key, found);
        found
    }
}

/// Resolves the names of a call for the compiler: its values, and functions.
struct CallNames<'a> {
    cx: Cx<'a>,
    values: &'a [Inferred],
}

impl expression::Names for CallNames<'_> {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        let index: usize = name.strip_prefix("value")?.parse().ok()?;
        let first = expression::FIRST_INPUT + 4 * index;
        Some(match self.values.get(index)? {
            Inferred::Numbers(count, _) => Meaning::Planes { first, count: *count },
            Inferred::Ids => Meaning::Ids { plane: first },
            _ => Meaning::Any { first },
        })
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(0)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(seed)
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        functions::find(self.cx, name)?.compiled().map(Arc::new)
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        let known = CANVAS.iter().any(|(fact, _)| *fact == name);
        known.then_some(Meaning::Known(expression::Value::Number(1.0)))
    }
}

/// Widest of some types, as solids.
fn widest_solid(found: impl Iterator<Item = Accepts>) -> Type {
    let rank = |ty| match ty {
        Accepts::One(Type::SolidMaterial) => 3,
        Accepts::One(Type::SolidVector) => 2,
        Accepts::One(Type::SolidColor | Type::Rgb | Type::Normal | Type::Picture) => 1,
        _ => 0,
    };
    [Type::Solid, Type::SolidColor, Type::SolidVector, Type::SolidMaterial][found.map(rank).max().unwrap_or(0)]
}

/// Widest of some types, which is the type of outputs that follow their inputs.
fn widest(found: &[Accepts], info: &KindInfo, ports: &[&str]) -> Option<Accepts> {
    let mut rank = 0;
    for ty in found {
        rank = rank.max(match ty {
            Accepts::One(Type::SolidMaterial | Type::Material) => return Some(Accepts::One(Type::Material)),
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
