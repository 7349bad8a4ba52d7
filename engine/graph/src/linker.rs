//! The data of a graph during linking: its scopes, nodes and slots.
use super::cancel::Cancel;
use super::files::{Doc, FileChecks};
use super::formula_text::Formula;
use super::gate::Gate;
use super::layout::Layout;
use super::params::Params;
use super::part::{Entry, SyntaxValue};
use super::report::Report;
use crate::diagnostics::Span;
use crate::node::{DynNode, KindInfo};
use crate::registry::Registry;
use crate::value::files::FileHandle;
use crate::value::{Accepts, Canvas, Channel, ChannelSet, Field, Type};
use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A command-line value for a parameter of an instance.
pub(super) struct Setting {
    /// The names of the enclosing `Use`s, each followed by a slash, as in [`Scope::prefix`].
    pub(super) prefix: String,
    /// The parameter.
    pub(super) param: String,
    /// The value as typed.
    pub(super) value: String,
    /// The place of the value.
    pub(super) span: Span,
    /// The place of the path to the parameter.
    pub(super) path: Span,
    /// True once an instance used the setting.
    pub(super) used: Cell<bool>,
}

/// An `Each`.
pub(super) struct Chooser {
    /// The instances.
    pub(super) children: Vec<usize>,
    /// Place of the word `Each`, and its scope.
    pub(super) kind: SyntaxValue,
    pub(super) scope: usize,
    pub(super) name: String,
    /// The ids that select the visible instance.
    pub(super) ids: SyntaxValue,
}

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
    /// For a shipped graph, the place in a file of the user where it is used, directly or by way of other shipped graphs.
    pub(super) own_place: Option<Span>,
    /// The file whose pins count for its nodes.
    pub(super) pinned_by: Option<usize>,
    /// The canvas of its nodes.
    pub(super) canvas: Canvas,
    /// The layout of its outputs, if any.
    pub(super) layout: Option<Layout>,
}

/// The resolved value of a slot.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "literals are rare, and a box for each would only move them")]
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
    /// `None` for nodes added by the graph itself: formulas, channels, conversions at inputs, material inputs without a
    /// value (which have no slot), and layouts of instances.
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
    pub(super) files: Vec<(&'static str, FileHandle)>,
    /// For a node that makes a picture: true if it has one channel; `None` if an error hides it.
    pub(super) gray: Option<bool>,
    /// The channels of its material; `None` if an error hides them.
    pub(super) channels: Option<ChannelSet>,
    /// The layout, for a node that lays out its input.
    pub(super) layout: Option<Layout>,
    /// The `Each` and the output, for a node that selects among instances.
    pub(super) chooses: Option<(usize, String)>,
    /// The formula, for a node that computes one.
    pub(super) formula: Option<Formula>,
    /// The channel, for a node that takes one.
    pub(super) channel: Option<Channel>,
    /// True if the targets of its slots were set when it was added.
    pub(super) resolved: bool,
    /// True if an output of the graph reads it.
    pub(super) shown: bool,
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
            formula: None,
            channel: None,
            resolved: false,
            shown: false,
        }
    }

    /// The value of a field, if it is written.
    pub(super) fn field(&self, name: &str) -> Option<&SyntaxValue> {
        let param = self.params.iter().find(|(param, ..)| param == name).map(|(_, part, _)| part);
        param.or_else(|| self.args.iter().find(|arg| arg.name == name).map(|arg| &arg.value))
    }
}

/// A graph with all its sub-graphs during linking.
pub(super) struct Linker<'a> {
    pub(super) registry: &'a Registry,
    pub(super) docs: &'a [Doc],
    /// The number of nodes of each document including its sub-graphs; `None` if it must not be used.
    pub(super) sizes: &'a [Option<usize>],
    pub(super) report: &'a mut Report,
    pub(super) looked_at: &'a mut Vec<PathBuf>,
    pub(super) file_checks: &'a mut FileChecks,
    /// Decides which files may be read.
    pub(super) gate: &'a Gate,
    pub(super) cancel: &'a Cancel,
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
    /// The nodes that take a channel or components of an output.
    pub(super) selected: BTreeMap<(usize, usize, String), usize>,
    /// Every `Each`, and the nodes that select among its instances.
    pub(super) choosers: Vec<Chooser>,
    pub(super) chosen: BTreeMap<(usize, String), usize>,
    /// The index of the first scope among those of all linkers.
    pub(super) first_instance: usize,
    /// The defaults of the documents in use.
    pub(super) defaults: BTreeMap<usize, Params>,
}
