//! A graph file while it is edited: its sections and the names in them.
use super::view::{self, Body, Item, Shape, Value};
use shibo_graph::syntax::Tree;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A section of a graph file that declares names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Section {
    /// `imports`
    Imports,
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
    pub const ALL: [Self; 6] = [Self::Imports, Self::Params, Self::Presets, Self::Inputs, Self::Nodes, Self::Outputs];

    /// Key of the section in the file.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Imports => "imports",
            Self::Params => "params",
            Self::Presets => "presets",
            Self::Inputs => "inputs",
            Self::Nodes => "nodes",
            Self::Outputs => "outputs",
        }
    }
}

/// A graph file.
#[derive(Debug)]
pub struct File {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file.
    pub text: Arc<str>,
    /// Syntax tree, with comments.
    pub tree: Tree,
    /// The text as a value.
    pub root: Option<Value>,
    /// Index of each name in its section; the first of equal names.
    names: HashMap<Section, HashMap<String, usize>>,
}

impl File {
    /// Parses a text.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> Self {
        let text = text.into();
        let tree = Tree::parse(text.clone());
        let root = view::read(&tree);
        let mut file = Self { path: path.into(), text, tree, root, names: HashMap::new() };
        for section in Section::ALL {
            let mut names = HashMap::new();
            for (index, item) in file.entries(section).iter().enumerate() {
                if let Some(name) = item.name() {
                    names.entry(name.to_owned()).or_insert(index);
                }
            }
            file.names.insert(section, names);
        }
        file
    }

    /// The outermost brackets.
    pub fn body(&self) -> Option<&Body> {
        self.root.as_ref()?.body()
    }

    /// Returns whether the top level has `nodes`, which makes it a graph.
    pub fn is_graph(&self) -> bool {
        self.body().is_some_and(|body| body.get(Section::Nodes.key()).is_some())
    }

    /// Brackets of a section.
    pub fn section(&self, section: Section) -> Option<&Body> {
        self.body()?.value(section.key())?.body()
    }

    /// Entries of a section.
    pub fn entries(&self, section: Section) -> &[Item] {
        self.section(section).map_or(&[], |body| &body.items)
    }

    /// Index of a name in its section.
    pub fn position(&self, section: Section, name: &str) -> Option<usize> {
        self.names.get(&section)?.get(name).copied()
    }

    /// Entry of a name in a section.
    pub fn entry(&self, section: Section, name: &str) -> Option<&Item> {
        self.entries(section).get(self.position(section, name)?)
    }

    /// Names of a section.
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
