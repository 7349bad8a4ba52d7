//! Declarations of the fields that may stand in brackets of a graph file.

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
}

/// The values that a field takes.
#[derive(Clone, Copy, Debug)]
pub enum Takes {
    /// `true` or `false`.
    Truth,
    /// One of these words.
    Words(fn() -> Vec<&'static str>),
    /// A number between these two, ends included; it is rounded.
    Whole(u8, u8),
    /// The name of a node or an output that makes a material.
    Material,
    /// The name of an output that is one number per pixel.
    Gray,
    /// A [`SimpleShape`](super::SimpleShape), or the name of an atlas whose mesh shows the material.
    Mesh,
}

impl Takes {
    /// The type of the nodes whose names may stand there; `None` if names cannot.
    pub fn reference(self) -> Option<Type> {
        match self {
            Self::Material => Some(Type::Material),
            Self::Gray => Some(Type::Gray),
            Self::Mesh => Some(Atlas::TYPE),
            Self::Truth | Self::Words(_) | Self::Whole(..) => None,
        }
    }

    /// The words that may stand there; empty if words cannot.
    pub fn words(self) -> Vec<&'static str> {
        match self {
            Self::Truth => vec!["true", "false"],
            Self::Words(words) => words(),
            Self::Mesh => super::SimpleShape::ALL.map(|(name, _)| name).to_vec(),
            Self::Whole(..) | Self::Material | Self::Gray => Vec::new(),
        }
    }
}

/// The material, for targets that take one.
pub(super) const MATERIAL: FieldDecl = FieldDecl::new("material", "The material.", Takes::Material);

/// The mesh, for targets that contain one.
pub(super) const MESH: FieldDecl = FieldDecl::new(
    "mesh",
    "`Plane`, `Sphere`, `Cylinder`, `Cube`, or the name of an atlas whose mesh wears it.",
    Takes::Mesh,
);
