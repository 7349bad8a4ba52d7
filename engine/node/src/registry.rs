//! The registry of node kinds.
use crate::changes::Changes;
use crate::value::{Atlas, Field, Key};
use crate::{Arg, Built, Functions, KindInfo, Node};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// A registered kind of node.
pub struct Kind {
    name: String,
    functions: Functions,
}

impl Kind {
    /// The kind whose struct is `T`.
    pub fn of<T: Node>() -> Self {
        Self { name: T::schema_name().into_owned(), functions: Functions::of::<T>() }
    }
}

/// A family of related kinds.
pub struct Family {
    /// The heading in the manual.
    pub name: &'static str,
    /// A description of the family, one sentence.
    pub doc: &'static str,
    /// Its kinds, in the order of the manual.
    pub kinds: Vec<Kind>,
}

struct Entry {
    functions: Functions,
    family: usize,
    info: OnceLock<KindInfo>,
}

/// Texts and pictures that a program ships: graphs that can be imported by name.
pub trait Library: Send + Sync {
    /// The names of its graphs, without folder and extension.
    fn names(&self) -> Vec<&str>;

    /// The path within the library of the graph with that name.
    fn find(&self, name: &str) -> Option<String>;

    /// The text of the graph at that path.
    fn text(&self, path: &str) -> Option<&str>;

    /// The content of the file at that path, for a node that reads it.
    fn file(&self, path: &str) -> Option<&'static [u8]>;
}

/// All kinds that graph files may use.
pub struct Registry {
    families: Vec<(&'static str, &'static str)>,
    order: Vec<String>,
    entries: BTreeMap<String, Entry>,
    code: Key,
    /// The kinds that only the engine adds to graphs.
    internal: BTreeMap<Internal, Kind>,
    /// The function that fills the texels around the charts of an atlas.
    gutters: Option<Gutters>,
    library: Option<Arc<dyn Library>>,
    retired: &'static [&'static str],
    successor: Option<Successor>,
    retired_field: Option<fn(&str, &str) -> bool>,
    /// Earlier versions of kinds.
    kept: BTreeMap<(String, u32), Kind>,
    table: &'static str,
    changes: OnceLock<Changes>,
}

/// Writes the successor of a node of a retired kind, given the text of the node: a formula in quotes, or another node.
/// `None` if the node cannot be replaced.
pub type Successor = fn(&str, &Registry) -> Option<String>;

/// The role of a kind that graph files do not name: the engine adds its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Internal {
    /// Lays out the fields of an instance. The two kinds that lay out have a port `input` and the parameters `scale`,
    /// `angle`, `offset` and `pivot`.
    LayField,
    /// Lays out the materials of an instance.
    LayMaterial,
    /// Chooses among the fields of several instances. The two kinds that choose have the ports `ids` and `inputs`, a
    /// list.
    ChooseField,
    /// Chooses among the materials of several instances.
    ChooseMaterial,
    /// Computes a formula of fields, with a port `inputs`, a list, and the parameters `program`, the text of a compiled
    /// expression, and `inner`, true if one formula alone reads it.
    Formula,
    /// Computes a formula of solids, with the same fields.
    SolidFormula,
    /// Cuts a material in space along a mesh, with the ports `atlas` and `solid`.
    CutOnMesh,
    /// Takes a channel of a material, with a port `material` and the parameter `channel`.
    Channel,
}

/// Fills the texels around the charts of an atlas, so that texture filters read no foreign values there.
pub type Gutters = fn(&Field, &Arc<Atlas>) -> Field;

impl Default for Registry {
    fn default() -> Self {
        Self {
            families: Vec::new(),
            order: Vec::new(),
            entries: BTreeMap::new(),
            code: Key::of("code", &[shibo_value::CODE.as_bytes(), crate::CODE.as_bytes()]),
            internal: BTreeMap::new(),
            gutters: None,
            library: None,
            retired: &[],
            successor: None,
            retired_field: None,
            kept: BTreeMap::new(),
            table: "[]",
            changes: OnceLock::new(),
        }
    }
}

impl Registry {
    /// A registry of these families.
    pub fn new(families: impl IntoIterator<Item = Family>) -> Self {
        let mut registry = Self::default();
        for (index, family) in families.into_iter().enumerate() {
            registry.families.push((family.name, family.doc));
            for kind in family.kinds {
                registry.order.push(kind.name.clone());
                let entry = Entry { functions: kind.functions, family: index, info: OnceLock::new() };
                registry.entries.insert(kind.name, entry);
            }
        }
        registry
    }

    /// Adds the fingerprint of the code of its kinds.
    #[must_use]
    pub fn with_code(mut self, fingerprint: &str) -> Self {
        self.code = Key::of("code", &[self.code.as_bytes(), fingerprint.as_bytes()]);
        self
    }

    /// Adds a kind that only the engine adds to graphs.
    #[must_use]
    pub fn with_internal(mut self, role: Internal, kind: Kind) -> Self {
        self.internal.insert(role, kind);
        self
    }

    /// Sets the function that fills the texels around the charts of an exported atlas.
    #[must_use]
    pub fn with_gutters(mut self, gutters: Gutters) -> Self {
        self.gutters = Some(gutters);
        self
    }

    /// A texture of an atlas with the texels around its charts filled.
    pub fn with_gutter(&self, field: &Field, atlas: &Arc<Atlas>) -> Field {
        self.gutters.map_or_else(|| field.clone(), |gutters| gutters(field, atlas))
    }

    /// Adds graphs that can be imported by name.
    #[must_use]
    pub fn with_library(mut self, library: Arc<dyn Library>) -> Self {
        self.library = Some(library);
        self
    }

    /// The graphs that can be imported by name.
    pub fn library(&self) -> Option<&dyn Library> {
        self.library.as_deref()
    }

    /// Sets the table of changes, a text that [`Changes::read`] accepts.
    #[must_use]
    pub fn with_changes(mut self, table: &'static str) -> Self {
        self.table = table;
        self
    }

    /// The table of changes of its kinds and of the graphs that can be imported by name. It is read when it is first
    /// needed; a faulty one counts as empty.
    pub fn changes(&self) -> &Changes {
        self.changes.get_or_init(|| Changes::read(self.table).unwrap_or_default())
    }

    /// Names kinds that graph files had in earlier versions. Errors about them tell what replaces them.
    #[must_use]
    pub fn with_retired(mut self, kinds: &'static [&'static str]) -> Self {
        self.retired = kinds;
        self
    }

    /// Sets what writes the successors of nodes of retired kinds.
    #[must_use]
    pub fn with_successor(mut self, successor: Successor) -> Self {
        self.successor = Some(successor);
        self
    }

    /// Sets what tells whether a kind, the first name, had a field, the second name, that `shibo migrate` replaces.
    #[must_use]
    pub fn with_retired_fields(mut self, had: fn(&str, &str) -> bool) -> Self {
        self.retired_field = Some(had);
        self
    }

    /// True for a field that nodes of a kind had in earlier versions, and that `shibo migrate` replaces.
    pub fn is_retired_field(&self, kind: &str, field: &str) -> bool {
        self.retired_field.is_some_and(|had| had(kind, field))
    }

    /// The kinds that graph files had in earlier versions.
    pub fn retired(&self) -> &'static [&'static str] {
        self.retired
    }

    /// True for a kind that graph files had in earlier versions, and that no family has now.
    pub fn is_retired(&self, kind: &str) -> bool {
        self.retired.contains(&kind) && !self.entries.contains_key(kind)
    }

    /// The successor of a node of a retired kind, given the text of the node. `None` if it is not known.
    pub fn successor(&self, node: &str) -> Option<String> {
        self.successor?(node, self)
    }

    /// Builds a node of a kind that only the engine adds to graphs; returns its kind too. `None` if there is none.
    pub fn internal(&self, role: Internal, args: &[(&str, Arg<'_>)]) -> Option<(&str, Built)> {
        let kind = self.internal.get(&role)?;
        Some((&kind.name, (kind.functions.build)(args)))
    }

    /// A key for the code of the kinds and of all that they are made of. `shibo_engine::eval::code` adds the crates above.
    pub fn code(&self) -> Key {
        self.code
    }

    /// Name and doc of the families, in order.
    pub fn families(&self) -> &[(&'static str, &'static str)] {
        &self.families
    }

    /// The names of all kinds, family by family.
    pub fn kinds(&self) -> impl Iterator<Item = &str> {
        self.order.iter().map(String::as_str)
    }

    /// The facts about a kind.
    pub fn info(&self, kind: &str) -> Option<&KindInfo> {
        let entry = self.entries.get(kind)?;
        Some(entry.info.get_or_init(|| (entry.functions.info)(self.families[entry.family].0)))
    }

    /// Builds a node of a kind, in its newest version or in an earlier one that is kept; `None` if there is no such kind
    /// or version.
    pub fn build(&self, kind: &str, version: Option<u32>, args: &[(&str, Arg<'_>)]) -> Option<Built> {
        let functions = match version {
            None => &self.entries.get(kind)?.functions,
            Some(version) => &self.kept.get(&(kind.to_owned(), version))?.functions,
        };
        Some((functions.build)(args))
    }

    /// Adds an earlier version of a kind, for graphs that are pinned.
    #[must_use]
    pub fn with_kept(mut self, kind: &str, version: u32, kept: Kind) -> Self {
        self.kept.insert((kind.to_owned(), version), kept);
        self
    }

    /// True if it has this earlier version of a kind.
    pub fn has_kept(&self, kind: &str, version: u32) -> bool {
        self.kept.contains_key(&(kind.to_owned(), version))
    }
}
