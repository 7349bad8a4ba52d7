//! Scopes: a graph file, or a use of a sub-graph, with the meanings of its names.
use super::document::NodeDecl;
use super::each::{self, Chooser};
use super::files::{Doc, FileChecks};
use super::instance::{self, Setting};
use super::layout::Layout;
use super::params::{Params, Values};
use super::part::{Entry, Shape, SyntaxValue};
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

/// Reading the documentation of all kinds takes as long as this many comparisons of names.
const DOCUMENTATION: usize = 5_000;

/// The meaning of a name in a scope.
#[derive(Clone, Copy)]
pub(super) enum Entity {
    /// A node.
    Node(usize),
    /// A sub-graph: its scope.
    Use(usize),
    /// Several sub-graphs, one of which is visible at each pixel: the index of the `Each`.
    Each(usize),
    /// An input of the graph.
    Input(usize),
    /// A faulty name.
    Broken,
}

/// The value of a graph's input.
#[derive(Clone)]
pub(super) enum Bound {
    /// A literal and its place.
    Constant(Field, SyntaxValue),
    /// A reference to be resolved in `scope`.
    Wire { scope: usize, part: SyntaxValue, name: String },
    /// The node that converts the given value to the type of the input.
    Pass(usize),
    /// A faulty value.
    Broken,
}

/// A graph file, or a use of one.
pub(super) struct Scope {
    pub(super) doc: usize,
    pub(super) prefix: String,
    pub(super) params: Params,
    pub(super) names: BTreeMap<String, Entity>,
    pub(super) inputs: Vec<Bound>,
    /// The target of each input, once it was resolved.
    pub(super) resolved: Vec<Option<Target>>,
    /// The place where the graph is used.
    pub(super) used: Option<Span>,
    /// The canvas of its nodes.
    pub(super) canvas: Canvas,
    /// The layout of its outputs, if any.
    pub(super) layout: Option<Layout>,
}

/// The resolved value of a slot.
#[derive(Clone)]
pub(super) enum Target {
    /// An output of a node.
    Out { flat: usize, output: usize },
    /// A literal and its place.
    Constant(Field, SyntaxValue),
    /// A faulty value.
    Broken,
}

/// The receiver of a value.
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

    /// Returns true if it is the port of a node with that name.
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
    /// The receiver of the value.
    pub(super) port: Port,
    /// The accepted type.
    pub(super) wants: Accepts,
    /// The value as written.
    pub(super) part: SyntaxValue,
    /// The resolved value.
    pub(super) target: Target,
    /// The type that the value counts as, if it is directly an input of a graph.
    pub(super) declared: Option<Accepts>,
}

impl Slot {
    pub(super) fn unresolved(port: Port, wants: Accepts, part: SyntaxValue) -> Self {
        Self { port, wants, part, target: Target::Broken, declared: None }
    }
}

/// A node. The nodes of all scopes are in one list.
pub(super) struct Flat<'a> {
    pub(super) scope: usize,
    pub(super) name: String,
    pub(super) kind: SyntaxValue,
    pub(super) kind_name: String,
    /// `None` for nodes added by the graph itself: conversions at inputs, material inputs without a value (which have
    /// no slot), and layouts of instances.
    pub(super) info: Option<&'a KindInfo>,
    pub(super) args: Cow<'a, [Entry]>,
    pub(super) slots: Vec<Slot>,
    /// The parameters after substitution, and the base folder of a path in them.
    pub(super) params: Vec<(String, SyntaxValue, Option<PathBuf>)>,
    /// True while no error was found in the node.
    pub(super) good: bool,
    pub(super) node: Option<Arc<dyn DynNode>>,
    /// `None` for a type hidden by an error.
    pub(super) outputs: Vec<Option<Type>>,
    /// Its files, with their parameters.
    pub(super) files: Vec<(&'static str, PathBuf)>,
    /// For a node that makes a picture: true if it has one channel; `None` if an error hides it.
    pub(super) gray: Option<bool>,
    /// The channels of its material; `None` if an error hides them.
    pub(super) channels: Option<ChannelSet>,
    /// The layout, for a node that lays out its input.
    pub(super) layout: Option<Layout>,
    /// The `Each` and the output, for a node that selects among instances.
    pub(super) chooses: Option<(usize, String)>,
}

/// A graph with all its sub-graphs during linking.
pub(super) struct Unit<'a> {
    pub(super) registry: &'a Registry,
    pub(super) docs: &'a [Doc],
    /// The number of nodes of each document including its sub-graphs; `None` if it must not be used.
    pub(super) sizes: &'a [Option<usize>],
    pub(super) report: &'a mut Report,
    pub(super) looked_at: &'a mut Vec<PathBuf>,
    pub(super) file_checks: &'a mut FileChecks,
    pub(super) canvas: Canvas,
    /// Command-line values for parameters of instances; paths in them are relative to `working_dir`.
    pub(super) settings: &'a [Setting],
    pub(super) working_dir: &'a Path,
    pub(super) scopes: Vec<Scope>,
    /// Nodes without a name, by their scope and place.
    pub(super) inlines: BTreeMap<(usize, Span), Entity>,
    pub(super) flats: Vec<Flat<'a>>,
    /// Wires to check that lead to no node: values of inputs that need no conversion.
    pub(super) checks: Vec<(usize, Slot)>,
    /// The layout nodes of outputs of instances.
    pub(super) laid: BTreeMap<(usize, String), usize>,
    /// Every `Each`, and the nodes that select among its instances.
    pub(super) choosers: Vec<Chooser>,
    pub(super) chosen: BTreeMap<(usize, String), usize>,
    /// The index of the first scope among those of all units.
    pub(super) first_instance: usize,
    /// The defaults of the documents in use.
    pub(super) defaults: BTreeMap<usize, Params>,
}

impl<'a> Unit<'a> {
    /// Sets `scope` as the subject of the following diagnostics.
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

    /// Fills a scope: adds its nodes and sub-graphs, and resolves its names. `given` holds the values of its inputs.
    pub(super) fn fill(&mut self, scope: usize, given: &[Option<Bound>]) {
        let docs = self.docs;
        let doc = &docs[self.scopes[scope].doc];
        self.enter(scope);
        for (i, input) in doc.document.inputs.iter().enumerate() {
            // Check the default even if it is not used.
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
            // This reads the documentation of all kinds, which costs as much as very many comparisons of names.
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
        kind: SyntaxValue,
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

    /// The value of a field, if it is written.
    pub(super) fn field(&self, name: &str) -> Option<&SyntaxValue> {
        let param = self.params.iter().find(|(param, ..)| param == name).map(|(_, part, _)| part);
        param.or_else(|| self.args.iter().find(|arg| arg.name == name).map(|arg| &arg.value))
    }
}

/// Checks the presets of a document; returns the values of those named in `wanted`, with later presets overriding
/// earlier ones.
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

/// Checks a note, a text for readers without effect.
pub(super) fn check_note(part: &SyntaxValue, report: &mut Report) {
    if !matches!(part.shape(), Shape::Text(_)) {
        report.push(mismatch(part, "`note`", "a text in quotes"));
    }
}
