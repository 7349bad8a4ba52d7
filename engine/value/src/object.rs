//! The interface between object types and the engine and commands.
use super::{Field, Material, Segments, Sketch, SolidMaterial, Type, Value, objects};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// An object: data that is computed whole, once, and kept on disk.
pub trait Object: Carried + Serialize + DeserializeOwned {
    /// The rendering of an output of this type; `None` if it is only read by nodes and shown to people.
    const RENDERS: Option<Renders> = None;

    /// Its memory in bytes, including shared data.
    fn bytes(&self) -> usize;

    /// The data that `shibo dump` prints, besides the name of the type: a struct whose numbers are
    /// [`Number`](super::Number)s.
    fn data(&self) -> impl Serialize;

    /// A sketch for display.
    fn sketch(&self) -> Option<Sketch> {
        None
    }

    /// The rendered field, if [`RENDERS`](Self::RENDERS) is [`Renders::Field`], with metadata for the files: names and
    /// texts.
    fn rendered(self: &Arc<Self>) -> Option<(Field, Vec<(String, String)>)> {
        None
    }

    /// The rendered lines, if [`RENDERS`](Self::RENDERS) is [`Renders::Lines`].
    fn lines(self: &Arc<Self>) -> Option<Arc<Segments>> {
        None
    }
}

/// A type that wires carry behind an `Arc`, and its conversions to and from [`Value`]. The table of objects implements
/// it.
pub trait Carried: Send + Sync + Sized + 'static {
    /// The type of the wire.
    const TYPE: Type;

    /// Wraps an object in a value.
    fn wrap(object: Arc<Self>) -> Value;

    /// The object in a value, if it has this type.
    fn unwrap(value: Value) -> Option<Arc<Self>>;
}

macro_rules! materials {
    ($($name:ident)*) => {$(
        impl Carried for $name {
            const TYPE: Type = Type::$name;

            fn wrap(material: Arc<Self>) -> Value {
                Value::$name(material)
            }

            fn unwrap(value: Value) -> Option<Arc<Self>> {
                match value {
                    Value::$name(material) => Some(material),
                    _ => None,
                }
            }
        }
    )*};
}

materials! { Material SolidMaterial }

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

/// The rendering of an output of a graph.
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
            /// The rendering of an output of this type; `None` if it is only read by nodes and shown to people.
            pub const fn renders(self) -> Option<Renders> {
                match self {
                    Self::Gray | Self::Rgb | Self::Normal | Self::Vec2 | Self::Jacobian | Self::Ids => {
                        Some(Renders::Field(self))
                    }
                    Self::Picture => Some(Renders::Field(Self::Rgb)),
                    Self::Material => Some(Renders::Channels),
                    Self::Solid | Self::SolidColor | Self::SolidVector | Self::SolidMaterial => None,
                    $(Self::$name => <super::$name as Object>::RENDERS,)*
                }
            }
        }
    };
}

objects! { renders! {} }
