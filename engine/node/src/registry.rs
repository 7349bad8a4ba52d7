//! The registry of node kinds.
use crate::value::{Atlas, Field, Key, Type};
use crate::{Arg, Built, Functions, KindInfo, Node};
use std::collections::BTreeMap;
use std::path::PathBuf;
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

    /// A file on disk with the content of the library file at that path, for a node that reads it.
    ///
    /// # Errors
    /// The reason why there is no such file, as a message.
    fn file(&self, path: &str) -> Result<PathBuf, String>;
}

/// All kinds that graph files may use.
pub struct Registry {
    families: Vec<(&'static str, &'static str)>,
    order: Vec<String>,
    entries: BTreeMap<String, Entry>,
    code: Key,
    /// Kinds that lay out the fields, materials and ids of instances.
    layout: Option<[Kind; 3]>,
    /// Kinds that choose among the fields and the materials of several instances.
    choice: Option<[Kind; 2]>,
    /// The function that fills the texels around the charts of an atlas.
    gutters: Option<Gutters>,
    library: Option<Arc<dyn Library>>,
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
            layout: None,
            choice: None,
            gutters: None,
            library: None,
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

    /// Adds the kinds that lay out fields, materials and ids of instances. All have a port `input` and the parameters
    /// `scale`, `angle`, `offset` and `pivot`.
    #[must_use]
    pub fn with_layout(mut self, field: Kind, material: Kind, ids: Kind) -> Self {
        self.layout = Some([field, material, ids]);
        self
    }

    /// Adds the kinds that choose among fields and materials of several instances. Both have the ports `ids` and
    /// `inputs`, a list.
    #[must_use]
    pub fn with_choice(mut self, field: Kind, material: Kind) -> Self {
        self.choice = Some([field, material]);
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

    /// Builds the node that lays out a value of a type; returns its kind too.
    pub fn lay_out(&self, ty: Type, args: &[(&str, Arg<'_>)]) -> Option<(&str, Built)> {
        let [field, material, ids] = self.layout.as_ref()?;
        let kind = match ty {
            Type::Material => material,
            Type::Ids => ids,
            _ => field,
        };
        Some((&kind.name, (kind.functions.build)(args)))
    }

    /// Builds the node that chooses among fields, or among materials; returns its kind too.
    pub fn choose(&self, material: bool, args: &[(&str, Arg<'_>)]) -> Option<(&str, Built)> {
        Self::one_of(self.choice.as_ref()?, material, args)
    }

    fn one_of<'k>(
        [field, of_material]: &'k [Kind; 2],
        material: bool,
        args: &[(&str, Arg<'_>)],
    ) -> Option<(&'k str, Built)> {
        let kind = if material { of_material } else { field };
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

    /// Builds a node of a kind; `None` if there is no such kind.
    pub fn build(&self, kind: &str, args: &[(&str, Arg<'_>)]) -> Option<Built> {
        self.entries.get(kind).map(|entry| (entry.functions.build)(args))
    }
}
