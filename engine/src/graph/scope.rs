//! Scopes: a graph file, and every use of a sub-graph, with what the names in it mean.
use super::document::NodeDecl;
use super::each::{self, Chooser};
use super::files::{Doc, FileChecks};
use super::instance::{self, Setting};
use super::layout::Layout;
use super::params::{Params, Values};
use super::part::{Entry, Part, Shape};
use super::ports::{self, Literal};
use super::read::{self, mismatch};
use super::remedy;
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

/// So many comparisons of names take as long as reading the documentation of all kinds.
const DOCUMENTATION: usize = 5_000;

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
    /// A literal, and where it is written.
    Constant(Field, Part),
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
    /// A literal, and where it is written.
    Constant(Field, Part),
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
            Ok(Literal::Constant(field)) => Bound::Constant(field, value.part),
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
            let error = kind.error(Code::UnknownKind, message);
            // Reads the documentation of all kinds, which costs as much as comparing very many names.
            let may_read = self.report.may_compare(DOCUMENTATION);
            match may_read.then(|| remedy::kind_elsewhere(self.registry, kind.str())).flatten() {
                Some(meant) => self.report.push(error.help(format!("here it is called `{meant}`"))),
                None => self.report.unknown(error, kind.str(), "kind", kinds),
            }
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
