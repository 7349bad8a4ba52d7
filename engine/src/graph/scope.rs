//! Scopes: a graph file, and every use of a sub-graph, with what the names in it mean.
use super::defaults;
use super::document::NodeDecl;
use super::each::{self, Chooser};
use super::files::{Doc, FileChecks};
use super::instance::{self, Layout, Setting, Spread};
use super::params::{Facts, Params, Values};
use super::part::{Entry, Part, Shape};
use super::ports::{self, Literal};
use super::read::{self, mismatch};
use super::report::Report;
use super::subst::substitute;
use crate::diagnostics::{Code, Span};
use crate::node::{DynNode, KindInfo};
use crate::registry::Registry;
use crate::value::{Accepts, Canvas, ChannelSet, Field, Type};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a name of a scope means.
#[derive(Clone, Copy)]
pub(super) enum Entity {
    /// A node.
    Node(usize),
    /// A sub-graph: its scope.
    Use(usize),
    /// Several sub-graphs of which one shows at every pixel: which of the `Each`.
    Each(usize),
    /// An input of the graph.
    Input(usize),
    /// Something in error.
    Broken,
}

/// What an input of a graph stands for.
#[derive(Clone)]
pub(super) enum Bound {
    /// A literal.
    Constant(Field),
    /// A reference to be understood in `scope`.
    Wire { scope: usize, part: Part, name: String },
    /// The node that converts what is given to the type of the input.
    Pass(usize),
    /// Something in error.
    Broken,
}

/// A graph file, or a use of one.
pub(super) struct Scope {
    pub(super) doc: usize,
    pub(super) prefix: String,
    pub(super) params: Params,
    pub(super) names: BTreeMap<String, Entity>,
    pub(super) inputs: Vec<Bound>,
    /// What each input leads to, once that was needed.
    pub(super) resolved: Vec<Option<Target>>,
    /// Where it is used.
    pub(super) used: Option<Span>,
    /// The canvas of its nodes.
    pub(super) canvas: Canvas,
    /// How its outputs are laid out, if they are.
    pub(super) layout: Option<Layout>,
}

/// What goes into a slot.
#[derive(Clone)]
pub(super) enum Target {
    /// An output of a node.
    Out { flat: usize, output: usize },
    /// A literal.
    Constant(Field),
    /// Something in error.
    Broken,
}

/// What takes a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Port {
    /// The port of a node.
    Node(String),
    /// An input of a graph.
    Input(String),
}

impl Port {
    /// Its name.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Node(name) | Self::Input(name) => name,
        }
    }

    /// Whether it is the port of a node that has that name.
    pub(super) fn is(&self, name: &str) -> bool {
        matches!(self, Self::Node(port) if port == name)
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(port) => write!(f, "`{port}`"),
            Self::Input(input) => write!(f, "input `{input}`"),
        }
    }
}

/// A wire, or a literal in its place.
pub(super) struct Slot {
    /// What takes it.
    pub(super) port: Port,
    /// What the port takes.
    pub(super) wants: Accepts,
    /// What is written.
    pub(super) part: Part,
    /// What it means.
    pub(super) target: Target,
    /// The type that the value counts as, if it is an input of a graph by itself.
    pub(super) declared: Option<Accepts>,
}

impl Slot {
    pub(super) fn unresolved(port: Port, wants: Accepts, part: Part) -> Self {
        Self { port, wants, part, target: Target::Broken, declared: None }
    }
}

/// A node. Those of all scopes are in one list.
pub(super) struct Flat<'a> {
    pub(super) scope: usize,
    pub(super) name: String,
    pub(super) kind: Part,
    pub(super) kind_name: String,
    /// `None` for what the graph itself makes: the conversion at an input, a material input that is given nothing (it has no
    /// slot), and what lays out an instance.
    pub(super) info: Option<&'a KindInfo>,
    pub(super) args: Cow<'a, [Entry]>,
    pub(super) slots: Vec<Slot>,
    /// The parameters, with the parameters of the graph put in, and what a path in them is relative to.
    pub(super) params: Vec<(String, Part, Option<PathBuf>)>,
    /// Whether no error was found in it so far.
    pub(super) good: bool,
    pub(super) node: Option<Arc<dyn DynNode>>,
    /// `None` for a type that is unknown because of an error.
    pub(super) outputs: Vec<Option<Type>>,
    /// Its files with the parameter that names each.
    pub(super) files: Vec<(&'static str, PathBuf)>,
    /// Of a node that makes a picture: whether it has one channel; `None` if that is unknown because of an error.
    pub(super) gray: Option<bool>,
    /// The channels of the material that it makes; `None` where they are unknown because of an error.
    pub(super) channels: Option<ChannelSet>,
    /// How it lays out what it reads, if that is what it does.
    pub(super) layout: Option<Layout>,
    /// The `Each` among whose instances it chooses, and the output, if that is what it does.
    pub(super) chooses: Option<(usize, String)>,
}

/// One graph with all its sub-graphs while it is linked.
pub(super) struct Unit<'a> {
    pub(super) registry: &'a Registry,
    pub(super) docs: &'a [Doc],
    /// The number of nodes of each document with all its sub-graphs; `None` if it must not be used.
    pub(super) sizes: &'a [Option<usize>],
    pub(super) report: &'a mut Report,
    pub(super) looked_at: &'a mut Vec<PathBuf>,
    pub(super) file_checks: &'a mut FileChecks,
    pub(super) canvas: Canvas,
    /// Values of the command line for parameters of instances, and what paths in them are relative to.
    pub(super) settings: &'a [Setting],
    pub(super) working_dir: &'a Path,
    pub(super) scopes: Vec<Scope>,
    /// Nodes without a name, by the scope and the place where they are written.
    pub(super) inlines: BTreeMap<(usize, Span), Entity>,
    pub(super) flats: Vec<Flat<'a>>,
    /// Wires that must be checked but lead to no node: values given to inputs that need no conversion.
    pub(super) checks: Vec<(usize, Slot)>,
    /// The nodes that lay out outputs of instances.
    pub(super) laid: BTreeMap<(usize, String), usize>,
    /// Every `Each`, and the nodes that choose among their instances.
    pub(super) choosers: Vec<Chooser>,
    pub(super) chosen: BTreeMap<(usize, String), usize>,
    /// The number of the first scope among those of all units.
    pub(super) first_instance: usize,
    /// The defaults of the documents in use.
    pub(super) defaults: BTreeMap<usize, Params>,
}

impl<'a> Unit<'a> {
    /// The diagnostics that follow are about `scope`.
    pub(super) fn enter(&mut self, scope: usize) {
        self.report.enter(self.first_instance + scope, self.scopes[scope].used);
    }

    /// Adds the scope of a document, without names; see [`fill`](Self::fill).
    pub(super) fn declare(&mut self, doc: usize, prefix: String, params: Params, used: Option<Span>) -> usize {
        let scope = self.scopes.len();
        let count = self.docs[doc].document.inputs.len();
        let (inputs, resolved) = (vec![Bound::Broken; count], vec![None; count]);
        self.scopes.push(Scope {
            doc,
            prefix,
            params,
            names: BTreeMap::new(),
            inputs,
            resolved,
            used,
            canvas: self.canvas,
            layout: None,
        });
        scope
    }

    /// Fills a scope: adds its nodes and sub-graphs, and finds what its names mean. `given` are the inputs that are given a
    /// value.
    pub(super) fn fill(&mut self, scope: usize, given: &[Option<Bound>]) {
        let docs = self.docs;
        let doc = &docs[self.scopes[scope].doc];
        self.enter(scope);
        for (i, input) in doc.document.inputs.iter().enumerate() {
            // The default is checked even where it is not used.
            let default = self.default_input(scope, i);
            let value = given.get(i).cloned().flatten().or(default);
            self.scopes[scope].inputs[i] = value.unwrap_or_else(|| self.without_default(scope, input));
            self.scopes[scope].names.insert(input.name.clone(), Entity::Input(i));
        }
        for decl in &doc.document.nodes {
            self.enter(scope);
            let entity = match &decl.args {
                Some(args) => self.entity(scope, decl, Cow::Borrowed(args)),
                None => Entity::Broken,
            };
            if decl.named {
                self.scopes[scope].names.insert(decl.name.clone(), entity);
            }
        }
        let names: BTreeSet<String> = self.scopes[scope].names.keys().cloned().collect();
        self.scopes[scope].params.nodes = Arc::new(names);
    }

    /// The default of an input; `None` if it has none.
    fn default_input(&mut self, scope: usize, index: usize) -> Option<Bound> {
        let docs = self.docs;
        let input = &docs[self.scopes[scope].doc].document.inputs[index];
        let Some(ty) = input.ty else { return Some(Bound::Broken) };
        let default = input.default.as_ref()?;
        if self.is_node(default) {
            let name = format!("{}.default", input.name);
            self.add_inline(scope, &name, default);
            self.checks.push((scope, Slot::unresolved(Port::Input(input.name.clone()), ty, default.clone())));
            return Some(Bound::Wire { scope, part: default.clone(), name });
        }
        let Some(value) = substitute(default, &self.scopes[scope].params, self.report) else {
            return Some(Bound::Broken);
        };
        let port = Port::Input(input.name.clone());
        Some(match ports::literal(&value.part, ty, &port, value.is_text) {
            Ok(Literal::Constant(field)) => Bound::Constant(field),
            Ok(Literal::Reference(name)) => {
                self.checks.push((scope, Slot::unresolved(port, ty, value.part.clone())));
                Bound::Wire { scope, part: value.part, name }
            }
            Err(error) => {
                self.report.push(*error);
                Bound::Broken
            }
        })
    }

    pub(super) fn entity(&mut self, scope: usize, decl: &NodeDecl, args: Cow<'a, [Entry]>) -> Entity {
        let Some(kind) = &decl.kind else { return Entity::Broken };
        if kind.str() == "Use" {
            return self.declare_use(scope, &decl.name, kind, &args, None).map_or(Entity::Broken, Entity::Use);
        }
        if kind.str() == each::KIND {
            return self.declare_each(scope, &decl.name, kind, &args).unwrap_or(Entity::Broken);
        }
        let Some(info) = self.registry.info(kind.str()) else {
            let kinds = self.registry.kinds().chain(["Use", each::KIND]);
            let message = format!("there is no node kind `{}`", read::shorten(kind.str()));
            self.report.unknown(kind.error(Code::UnknownKind, message), kind.str(), "kind", kinds);
            return Entity::Broken;
        };
        let name = format!("{}{}", self.scopes[scope].prefix, decl.name);
        let kind_name = info.kind.clone();
        Entity::Node(self.add_flat(Flat::new(scope, name, kind.clone(), kind_name, Some(info), args)))
    }

    pub(super) fn add_flat(&mut self, flat: Flat<'a>) -> usize {
        self.flats.push(flat);
        self.flats.len() - 1
    }

    /// Declares an instance of a sub-graph: that of a `Use`, or one of those of an `Each`.
    pub(super) fn declare_use(
        &mut self,
        scope: usize,
        name: &str,
        kind: &Part,
        args: &[Entry],
        spread: Option<Spread<'_>>,
    ) -> Option<usize> {
        let of_each = if spread.is_some() { &each::FIELDS[..] } else { &[] };
        let known: Vec<&str> = of_each.iter().copied().chain(instance::FIELDS).collect();
        let what = kind.str();
        for arg in args.iter().filter(|arg| !known.contains(&arg.name.as_str())) {
            let message = format!("`{what}` has no field `{}`", read::shorten(&arg.name));
            let error = arg.key.error(Code::UnknownField, message);
            self.report.unknown(error, &arg.name, "field", known.iter().copied().filter(|name| *name != "note"));
        }
        let Some(graph) = read::get(args, "graph") else {
            let help = "write `graph: \"name\"`, a name from `imports`";
            self.report.push(kind.error(Code::MissingInput, format!("`{what}` has no `graph`")).help(help));
            return None;
        };
        let import = read::text(graph, "graph", self.report)?;
        let docs = self.docs;
        let outer = &docs[self.scopes[scope].doc];
        let Some(index) = outer.document.import(&import) else {
            let names = outer.document.imports.iter().map(|entry| entry.name.as_str());
            let message = format!("there is no import `{}`", read::shorten(&import));
            self.report.unknown(graph.error(Code::UnknownVariant, message), &import, "import", names);
            return None;
        };
        let doc = outer.imports[index].filter(|doc| docs[*doc].readable && self.sizes[*doc].is_some())?;
        let with = match read::get(args, "with") {
            Some(with) => read::unique(read::map(with, "with", self.report), "value", self.report),
            None => Vec::new(),
        };
        let instance = self.instance(scope, args, spread);
        let mut params = self.defaults_of(doc);
        params.facts = Some(Facts::of(&instance.canvas));
        let preset = self.preset_values(&instance, &docs[doc], &import);
        params.give_all(preset);
        self.with_params(scope, doc, &with, &mut params);
        let prefix = format!("{}{name}/", self.scopes[scope].prefix);
        if let Some(Spread { name, .. }) = spread {
            let all = format!("{}{name}/", self.scopes[scope].prefix);
            params.give_all(self.settings_of(&all, &docs[doc].document));
        }
        params.give_all(self.settings_of(&prefix, &docs[doc].document));
        defaults::follow(&docs[doc], &mut params, self.report);
        let child = self.declare(doc, prefix, params, Some(kind.span()));
        (self.scopes[child].canvas, self.scopes[child].layout) = (instance.canvas, instance.layout);
        let given = self.with_inputs(scope, child, &import, &with);
        self.check_given(child, kind, &given);
        self.fill(child, &given);
        Some(child)
    }

    /// The defaults of the parameters of a sub-graph, which are checked when the document is linked by itself.
    fn defaults_of(&mut self, doc: usize) -> Params {
        let (child, facts) = (&self.docs[doc], Facts::of(&self.canvas));
        self.defaults.entry(doc).or_insert_with(|| defaults::params(child, Some(facts), &mut Report::default())).clone()
    }

    /// The parameters of a sub-graph that `with` gives a value.
    fn with_params(&mut self, scope: usize, doc: usize, with: &[Entry], params: &mut Params) {
        let docs = self.docs;
        let (child, folder) = (&docs[doc], docs[self.scopes[scope].doc].folder());
        for entry in with {
            let Some(decl) = child.document.param(&entry.name).flatten() else { continue };
            let outer = &self.scopes[scope].params;
            let value = substitute(&entry.value, outer, self.report).and_then(|value| {
                let base = value.base.unwrap_or_else(|| folder.to_owned());
                decl.value(&value.part, true, &base, self.report)
            });
            params.give(entry.name.clone(), value);
        }
    }

    /// The inputs of a sub-graph that `with` gives a value.
    fn with_inputs(&mut self, scope: usize, child: usize, import: &str, with: &[Entry]) -> Vec<Option<Bound>> {
        let docs = self.docs;
        let document = &docs[self.scopes[child].doc].document;
        let mut given = vec![None; document.inputs.len()];
        for entry in with {
            if let Some(index) = document.input(&entry.name) {
                let ty = document.inputs[index].ty;
                given[index] = Some(ty.map_or(Bound::Broken, |ty| self.bind(scope, child, entry, ty)));
            } else if document.param(&entry.name).is_none() {
                let inputs = document.inputs.iter().map(|input| input.name.as_str());
                let names = inputs.chain(document.params.iter().map(|(param, _)| param.name.as_str()));
                let (import, name) = (read::shorten(import), read::shorten(&entry.name));
                let error =
                    entry.key.error(Code::UnknownField, format!("`{import}` has no input or parameter `{name}`"));
                self.report.unknown(error, &entry.name, "input or parameter", names);
            }
        }
        given
    }

    fn bind(&mut self, scope: usize, child: usize, entry: &Entry, ty: Accepts) -> Bound {
        let port = Port::Input(entry.name.clone());
        let (part, name) = if self.is_node(&entry.value) {
            let name = format!("{}.{}", self.name_of_use(scope, child), entry.name);
            self.add_inline(scope, &name, &entry.value);
            (entry.value.clone(), name)
        } else {
            let Some(value) = substitute(&entry.value, &self.scopes[scope].params, self.report) else {
                return Bound::Broken;
            };
            match ports::literal(&value.part, ty, &port, value.is_text) {
                Ok(Literal::Constant(field)) => return Bound::Constant(field),
                Ok(Literal::Reference(name)) => (value.part, name),
                Err(error) => {
                    self.report.push(*error);
                    return Bound::Broken;
                }
            }
        };
        let slot = Slot::unresolved(port, ty, part.clone());
        if matches!(ty, Accepts::One(Type::Gray | Type::Rgb)) {
            let path = format!("{}{}", self.scopes[child].prefix, entry.name);
            let mut flat = Flat::new(scope, path, entry.key.clone(), "Input".to_owned(), None, Cow::Borrowed(&[]));
            flat.slots.push(slot);
            return Bound::Pass(self.add_flat(flat));
        }
        self.checks.push((scope, slot));
        Bound::Wire { scope, part, name }
    }
}

impl<'a> Flat<'a> {
    pub(super) fn new(
        scope: usize,
        name: String,
        kind: Part,
        kind_name: String,
        info: Option<&'a KindInfo>,
        args: Cow<'a, [Entry]>,
    ) -> Self {
        Self {
            scope,
            name,
            kind,
            kind_name,
            info,
            args,
            slots: Vec::new(),
            params: Vec::new(),
            good: true,
            node: None,
            outputs: Vec::new(),
            files: Vec::new(),
            gray: None,
            channels: None,
            layout: None,
            chooses: None,
        }
    }

    /// Where the value of a field is written, if it is.
    pub(super) fn field(&self, name: &str) -> Option<&Part> {
        let param = self.params.iter().find(|(param, ..)| param == name).map(|(_, part, _)| part);
        param.or_else(|| self.args.iter().find(|arg| arg.name == name).map(|arg| &arg.value))
    }
}

/// Checks the presets of a document, and gives the values of those named `wanted`, the later ones over the earlier ones.
pub(super) fn presets(doc: &Doc, wanted: Option<&str>, report: &mut Report) -> Values {
    let mut known = BTreeMap::new();
    for (preset, values) in &doc.document.presets {
        let params: &mut Values = known.entry(preset.name.as_str()).or_default();
        for entry in values {
            let Some(decl) = doc.document.param(&entry.name) else {
                let names = doc.document.params.iter().map(|(param, _)| param.name.as_str());
                let message = format!("there is no parameter `{}`", read::shorten(&entry.name));
                report.unknown(entry.key.error(Code::UnknownParam, message), &entry.name, "parameter", names);
                continue;
            };
            let Some(decl) = decl else { continue };
            params.insert(entry.name.clone(), decl.value(&entry.value, false, doc.folder(), report));
        }
    }
    let wanted = wanted.into_iter().flat_map(instance::preset_names);
    wanted.filter_map(|name| known.get(name)).flat_map(|values| values.clone()).collect()
}

/// A note is a text for readers, without effect.
pub(super) fn check_note(part: &Part, report: &mut Report) {
    if !matches!(part.shape(), Shape::Text(_)) {
        report.push(mismatch(part, "`note`", "a text in quotes"));
    }
}
