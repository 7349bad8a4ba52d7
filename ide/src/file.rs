//! A graph file while it is edited: its sections and the names in them.
use super::view::{self, Body, Item, Shape, Value};
use shibo_graph::syntax::Tree;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The name of a function in its head, `name(a, b)`.
pub(crate) fn head_name(head: &str) -> &str {
    head.split('(').next().unwrap_or_default().trim()
}

/// A section of a graph file that declares names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Section {
    /// `imports`
    Imports,
    /// `graphs`
    Graphs,
    /// `functions`
    Functions,
    /// `params`
    Params,
    /// `presets`
    Presets,
    /// `inputs`
    Inputs,
    /// `nodes`
    Nodes,
    /// `outputs`
    Outputs,
}

impl Section {
    /// All sections.
    pub const ALL: [Self; 8] = [
        Self::Imports,
        Self::Graphs,
        Self::Functions,
        Self::Params,
        Self::Presets,
        Self::Inputs,
        Self::Nodes,
        Self::Outputs,
    ];

    /// Key of the section in the file.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Imports => "imports",
            Self::Graphs => "graphs",
            Self::Functions => "functions",
            Self::Params => "params",
            Self::Presets => "presets",
            Self::Inputs => "inputs",
            Self::Nodes => "nodes",
            Self::Outputs => "outputs",
        }
    }
}

/// A graph: a file, or a local graph of a file, which is treated like a file with the same text.
#[derive(Clone, Debug)]
pub struct File {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file.
    pub text: Arc<str>,
    /// Syntax tree, with comments.
    pub tree: Arc<Tree>,
    /// The text as a value.
    root: Option<Arc<Value>>,
    /// The graphs in the file: the file itself, then its local graphs.
    scopes: Arc<Vec<Scope>>,
    /// Index of this graph.
    scope: usize,
}

/// Index of each name in its section; the first of equal names.
type Names = HashMap<Section, HashMap<String, usize>>;

/// A graph in a file.
#[derive(Debug, Default)]
struct Scope {
    /// Its name and the index of its entry in `graphs`; `None` for the file itself.
    local: Option<(String, usize)>,
    names: Names,
}

impl File {
    /// Parses a text.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> Self {
        let text = text.into();
        let tree = Arc::new(Tree::parse(text.clone()));
        let root = view::read(&tree).map(Arc::new);
        let mut file = Self { path: path.into(), text, tree, root, scopes: Arc::default(), scope: 0 };
        let local = |(index, item): (usize, &Item)| {
            let name = item.name()?.to_owned();
            Some(Scope { local: Some((name, index)), names: Names::new() })
        };
        let whole = file.body().and_then(|body| body.value(Section::Graphs.key())?.body());
        let locals = whole.map_or(&[][..], |body| &body.items).iter().enumerate().filter_map(local);
        file.scopes = Arc::new(std::iter::once(Scope::default()).chain(locals).collect());
        let names: Vec<Names> = file.scopes().map(|scope| scope.index()).collect();
        let locals = file.scopes.iter().map(|scope| scope.local.clone());
        let scopes = locals.zip(names).map(|(local, names)| Scope { local, names }).collect();
        file.scopes = Arc::new(scopes);
        file
    }

    fn index(&self) -> Names {
        let of = |section: Section| {
            let mut names = HashMap::new();
            for (index, item) in self.entries(section).iter().enumerate() {
                let name = item.name().map(|name| if section == Section::Functions { head_name(name) } else { name });
                if let Some(name) = name {
                    names.entry(name.to_owned()).or_insert(index);
                }
            }
            (section, names)
        };
        Section::ALL.into_iter().map(of).collect()
    }

    /// The whole file.
    #[must_use]
    pub fn whole(&self) -> Self {
        Self { scope: 0, ..self.clone() }
    }

    /// The graphs in the file: the file itself, then its local graphs.
    pub fn scopes(&self) -> impl Iterator<Item = Self> + '_ {
        (0..self.scopes.len()).map(|scope| Self { scope, ..self.clone() })
    }

    /// The local graph of this name, if this graph may use it: a local graph uses only those before it.
    pub fn local(&self, name: &str) -> Option<Self> {
        self.locals().find(|local| local.local_name() == Some(name))
    }

    /// The local graphs that this graph may use.
    pub fn locals(&self) -> impl Iterator<Item = Self> + '_ {
        let end = if self.scope == 0 { self.scopes.len() } else { self.scope };
        (1..end).map(|scope| Self { scope, ..self.clone() })
    }

    /// The innermost graph at a position.
    #[must_use]
    pub fn scope_at(&self, at: usize) -> Self {
        let around = |file: &Self| {
            let inside = file.value().and_then(Value::body).map(Body::inside);
            inside.is_some_and(|inside| inside.start <= at && at <= inside.end)
        };
        self.scopes().skip(1).find(around).unwrap_or_else(|| self.whole())
    }

    /// Name of a local graph; `None` for a whole file.
    pub fn local_name(&self) -> Option<&str> {
        let (name, _) = self.scopes.get(self.scope)?.local.as_ref()?;
        Some(name)
    }

    /// True if both are the same graph of the same file.
    pub fn is_same(&self, other: &Self) -> bool {
        self.path == other.path && self.scope == other.scope
    }

    /// The value of this graph: the whole text, or the entry of a local graph.
    pub fn value(&self) -> Option<&Value> {
        let root = self.root.as_deref()?;
        match self.scopes.get(self.scope).and_then(|scope| scope.local.as_ref()) {
            Some((_, item)) => root.body()?.value(Section::Graphs.key())?.body()?.items.get(*item)?.value.as_ref(),
            None => Some(root),
        }
    }

    /// The outermost brackets of this graph.
    pub fn body(&self) -> Option<&Body> {
        self.value()?.body()
    }

    /// The brackets that have a section: local graphs share the imports, functions and graphs of their file.
    pub fn home(&self, section: Section) -> Option<&Body> {
        if matches!(section, Section::Imports | Section::Functions | Section::Graphs) {
            return self.root.as_deref()?.body();
        }
        self.body()
    }

    /// Returns whether the top level has `nodes`, which makes it a graph.
    pub fn is_graph(&self) -> bool {
        self.body().is_some_and(|body| body.get(Section::Nodes.key()).is_some())
    }

    /// Returns whether a file is meant as a graph: it is one, or its name ends in `.shibo.ron`, or it has a canvas, or a
    /// misspelt section of nodes: a map with a formula or one of the kinds of nodes, or a map that is still empty and has a
    /// name like `nodes`.
    pub fn is_meant_as_graph(&self, is_kind: &dyn Fn(&str) -> bool) -> bool {
        let is_node = |item: &Item| {
            let formula = item.value.as_ref().and_then(Value::text).is_some_and(|text| text.starts_with('='));
            item.key.is_some() && (formula || self.head(item).is_some_and(is_kind))
        };
        let is_meant = |item: &Item| {
            let Some((name, body)) = item.name().zip(item.value.as_ref().and_then(Value::body)) else { return false };
            match body.bracket {
                b'(' => name == "canvas",
                b'{' if body.items.is_empty() => super::spelling::is_misspelt(name, Section::Nodes.key()),
                b'{' => body.items.iter().any(is_node),
                _ => false,
            }
        };
        let named = self.path.to_string_lossy().ends_with(".shibo.ron");
        self.is_graph()
            || (named && self.root.is_some())
            || self.body().is_some_and(|body| body.items.iter().any(is_meant))
    }

    /// Brackets of a section.
    pub fn section(&self, section: Section) -> Option<&Body> {
        self.home(section)?.value(section.key())?.body()
    }

    /// Entries of a section.
    pub fn entries(&self, section: Section) -> &[Item] {
        self.section(section).map_or(&[], |body| &body.items)
    }

    /// Index of a name in its section; for a function, of its name without brackets.
    pub fn position(&self, section: Section, name: &str) -> Option<usize> {
        let shared = matches!(section, Section::Imports | Section::Functions | Section::Graphs);
        let scope = self.scopes.get(if shared { 0 } else { self.scope })?;
        scope.names.get(&section)?.get(name).copied()
    }

    /// Entry of a name in a section.
    pub fn entry(&self, section: Section, name: &str) -> Option<&Item> {
        self.entries(section).get(self.position(section, name)?)
    }

    /// Names of a section; functions with their brackets.
    pub fn names(&self, section: Section) -> impl Iterator<Item = &str> {
        self.entries(section).iter().filter_map(Item::name)
    }

    /// Text of a range.
    pub fn at(&self, range: &std::ops::Range<usize>) -> &str {
        self.text.get(range.clone()).unwrap_or_default()
    }

    /// The word of a value, as in `Word(…)`.
    pub fn word(&self, value: &Value) -> Option<&str> {
        value.word().map(|range| self.at(&range))
    }

    /// Kind of an entry of `nodes`, or type of a parameter or input.
    pub fn head(&self, item: &Item) -> Option<&str> {
        self.word(item.value.as_ref()?)
    }

    /// Folder of the file, to which its paths are relative.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// The text argument `field` of a value.
    pub fn text_of<'a>(&'a self, value: &'a Value, field: &str) -> Option<&'a str> {
        value.body()?.value(field)?.text()
    }

    /// The name that the file of an import has without folders and ending; the name of a graph of this file.
    pub fn stem_of<'a>(&'a self, import: &'a str) -> &'a str {
        let path = self.entry(Section::Imports, import).and_then(|item| item.value.as_ref()?.text());
        path.and_then(|path| Path::new(path).file_stem()?.to_str()).unwrap_or(import)
    }

    /// Options of a choice parameter.
    pub fn options(&self, param: &str) -> Vec<String> {
        let declared = self.entry(Section::Params, param).and_then(|item| item.value.as_ref()?.body());
        let list = declared.and_then(|body| body.value("options")?.body());
        let word = |item: &Item| {
            let value = item.value.as_ref()?;
            value.text().map(str::to_owned).or_else(|| self.word(value).map(str::to_owned))
        };
        list.map_or(Vec::new(), |list| list.items.iter().filter_map(word).collect())
    }

    /// Arguments of an entry.
    pub fn args(item: &Item) -> &[Item] {
        match item.value.as_ref().map(|value| &value.shape) {
            Some(Shape::Call { body, .. }) => &body.items,
            _ => &[],
        }
    }
}
