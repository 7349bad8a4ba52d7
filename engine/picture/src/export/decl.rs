//! Declarations of the fields that may stand in brackets of a graph file.
use super::colors::Colors;
use super::solids::SimpleShape;
use crate::value::{Atlas, Carried, Type};

/// A field in brackets, `(name: value)`.
#[derive(Clone, Copy, Debug)]
pub struct FieldDecl {
    /// The name before the colon.
    pub name: &'static str,
    /// What the field is for, in a sentence of Markdown.
    pub doc: &'static str,
    /// The values that it takes.
    pub takes: Takes,
}

impl FieldDecl {
    /// A field of this name and description that takes such values.
    pub const fn new(name: &'static str, doc: &'static str, takes: Takes) -> Self {
        Self { name, doc, takes }
    }

    /// The description with the words that may stand there, for manuals and editors.
    pub fn manual(&self) -> String {
        match self.takes {
            Takes::Truth(default) => format!("{} Default `{default}`.", self.doc),
            Takes::Words(words) | Takes::Word(words) => format!("{} One of `{}`.", self.doc, words().join("`, `")),
            _ => self.doc.to_owned(),
        }
    }
}

/// The values that a field takes.
#[derive(Clone, Copy, Debug)]
pub enum Takes {
    /// `true` or `false`, with the value if it is left out.
    Truth(bool),
    /// One of these words; the first if it is left out.
    Words(fn() -> Vec<&'static str>),
    /// One of these words, which must be written.
    Word(fn() -> Vec<&'static str>),
    /// The quality of JPEG, a number from 1 to 100 that is rounded; only beside `colors: Jpeg`.
    Quality,
    /// The name of a node or an output that makes a material.
    Material,
    /// The name of an output that is one number per pixel.
    Gray,
    /// The name of an output of any type.
    Output,
    /// The name of an output that is ids.
    Ids,
    /// A [`SimpleShape`], or the name of an atlas whose mesh shows the material.
    Mesh,
    /// Values of a form of its own.
    Value,
}

impl Takes {
    /// The type of the outputs whose names may stand there, `Some(None)` for any; `None` if names cannot.
    pub fn reference(self) -> Option<Option<Type>> {
        match self {
            Self::Output => Some(None),
            Self::Material => Some(Some(Type::Material)),
            Self::Gray => Some(Some(Type::Gray)),
            Self::Ids => Some(Some(Type::Ids)),
            Self::Mesh => Some(Some(Atlas::TYPE)),
            _ => None,
        }
    }

    /// The words that may stand there; empty if words cannot.
    pub fn words(self) -> Vec<&'static str> {
        match self {
            Self::Truth(_) => vec!["true", "false"],
            Self::Words(words) | Self::Word(words) => words(),
            Self::Mesh => names(&SimpleShape::ALL),
            _ => Vec::new(),
        }
    }
}

/// The names of a list of choices.
pub fn names<T>(choices: &[(&'static str, T)]) -> Vec<&'static str> {
    choices.iter().map(|(name, _)| *name).collect()
}

/// The material, for targets that take one.
pub(super) const MATERIAL: FieldDecl = FieldDecl::new("material", "The material.", Takes::Material);

/// The mesh, for targets that contain one.
pub(super) const MESH: FieldDecl = FieldDecl::new(
    "mesh",
    "The mesh with the material: `Plane` (the default), `Sphere`, `Cylinder`, `Cube`, or the name of an atlas.",
    Takes::Mesh,
);

/// The format of colours, see [`Options::colors`](super::Options::colors).
pub(super) const COLORS: FieldDecl = FieldDecl::new(
    "colors",
    "The format of base colour and emission. `Jpeg` is smaller and not exact; `Png` is the default.",
    Takes::Words(|| names(&Colors::ALL)),
);

/// The quality of JPEG.
pub(super) const QUALITY: FieldDecl =
    FieldDecl::new("quality", "The quality of JPEG, from 1 to 100. Default 90.", Takes::Quality);
