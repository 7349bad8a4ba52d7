//! What the engine and the command must know about every type of objects, besides its data.
use super::{Field, Material, Segments, Sketch, Type, Value, objects};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// An object: data that is computed whole, once, and kept on disk.
pub trait Object: Carried + Serialize + DeserializeOwned {
    /// What it is rendered to when an output of a graph is of this type; nothing, if only nodes and people read it.
    const RENDERS: Option<Renders> = None;

    /// The memory it takes, with what it shares with others.
    fn bytes(&self) -> usize;

    /// What `shibo dump` prints of it, besides the name of its type: a struct whose numbers are [`Number`](super::Number)s.
    fn data(&self) -> impl Serialize;

    /// What is drawn for it.
    fn sketch(&self) -> Option<Sketch> {
        None
    }

    /// The field that is rendered where [`RENDERS`](Self::RENDERS) says [`Renders::Field`], and what files of it tell besides:
    /// names and texts.
    fn rendered(self: &Arc<Self>) -> Option<(Field, Vec<(String, String)>)> {
        None
    }

    /// The lines that are rendered where [`RENDERS`](Self::RENDERS) says [`Renders::Lines`].
    fn lines(self: &Arc<Self>) -> Option<Arc<Segments>> {
        None
    }
}

/// A type that wires carry behind an `Arc`, and its conversions to and from [`Value`]. The table of objects implements it.
pub trait Carried: Send + Sync + Sized + 'static {
    /// The type of the wire.
    const TYPE: Type;

    /// The value that carries it.
    fn wrap(object: Arc<Self>) -> Value;

    /// What the value carries, if it is this.
    fn unwrap(value: Value) -> Option<Arc<Self>>;
}

impl Carried for Material {
    const TYPE: Type = Type::Material;

    fn wrap(material: Arc<Self>) -> Value {
        Value::Material(material)
    }

    fn unwrap(value: Value) -> Option<Arc<Self>> {
        match value {
            Value::Material(material) => Some(material),
            _ => None,
        }
    }
}

impl<T: Carried> From<T> for Value {
    fn from(object: T) -> Self {
        T::wrap(Arc::new(object))
    }
}

impl<T: Carried> From<Arc<T>> for Value {
    fn from(object: Arc<T>) -> Self {
        T::wrap(object)
    }
}

impl From<super::Solid> for Value {
    fn from(solid: super::Solid) -> Self {
        Self::Solid(solid)
    }
}

impl From<Field> for Value {
    fn from(field: Field) -> Self {
        Self::Field(field)
    }
}

/// What an output of a graph is rendered to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renders {
    /// A picture of a field of this type.
    Field(Type),
    /// A picture for each channel of a material.
    Channels,
    /// Lines.
    Lines,
}

macro_rules! renders {
    ($($name:ident $color:literal $doc:literal,)*) => {
        impl Type {
            /// What an output of a graph of this type is rendered to; nothing, if only nodes and people read it.
            pub const fn renders(self) -> Option<Renders> {
                match self {
                    Self::Gray | Self::Rgb | Self::Normal | Self::Vec2 | Self::Jacobian | Self::Ids => {
                        Some(Renders::Field(self))
                    }
                    Self::Picture => Some(Renders::Field(Self::Rgb)),
                    Self::Material => Some(Renders::Channels),
                    Self::Solid | Self::SolidColor | Self::SolidVector => None,
                    $(Self::$name => <super::$name as Object>::RENDERS,)*
                }
            }
        }
    };
}

objects! { renders! {} }
