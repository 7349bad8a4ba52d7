//! Ports: the fields of a node struct that wires go into.
use crate::value::{
    ColorPattern, CoordMap, Curve, Exemplar, Field, Lattice, Material, Points, Segments, Skeleton, Solid, SpringNet,
    Type, Value,
};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::marker::PhantomData;
use std::sync::Arc;

/// What a port accepts, and what its node gets.
pub trait PortType: 'static {
    /// The type of the port.
    const TYPE: Type;
    /// What the node gets.
    type Got;
    /// Takes it out of a value that was converted to [`TYPE`](Self::TYPE).
    fn take(value: Value) -> Option<Self::Got>;
}

macro_rules! field_ports {
    ($($(#[$doc:meta])* $name:ident = $ty:ident,)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl PortType for $name {
            const TYPE: Type = Type::$ty;
            type Got = Field;
            fn take(value: Value) -> Option<Field> {
                match value { Value::Field(field) => Some(field), _ => None }
            }
        }
    )*};
}

field_ports! {
    /// A port for one number everywhere; takes a number too.
    Gray = Gray,
    /// A port for a colour everywhere; takes a number or a colour too.
    Rgb = Rgb,
    /// A port for a tangent-space normal.
    NormalField = Normal,
    /// A port for a vector everywhere.
    Vec2Field = Vec2,
    /// A port for a 2×2 matrix everywhere.
    JacobianField = Jacobian,
    /// A port for region numbers.
    IdsField = Ids,
    /// A port for `Gray` or `Rgb`, whichever comes.
    AnyField = Field,
}

macro_rules! object_ports {
    ($($name:ident,)*) => {$(
        impl PortType for $name {
            const TYPE: Type = Type::$name;
            type Got = Arc<$name>;
            fn take(value: Value) -> Option<Arc<$name>> {
                match value { Value::$name(object) => Some(object), _ => None }
            }
        }
    )*};
}

object_ports! { Points, Lattice, SpringNet, Segments, Curve, Skeleton, ColorPattern, Material, Exemplar, CoordMap, }

macro_rules! solid_ports {
    ($($(#[$doc:meta])* $name:ident = $ty:ident,)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl PortType for $name {
            const TYPE: Type = Type::$ty;
            type Got = Solid;
            fn take(value: Value) -> Option<Solid> {
                match value { Value::Solid(solid) => Some(solid), _ => None }
            }
        }
    )*};
}

solid_ports! {
    /// A port for one number at every point in space.
    SolidNumber = Solid,
    /// A port for a colour at every point in space.
    SolidColor = SolidColor,
    /// A port for a vector at every point in space.
    SolidVector = SolidVector,
    /// A port for any solid.
    AnySolid = AnySolid,
}

/// A port. In a node struct: `In<T>` must be connected unless its default is a [`constant`](Self::constant),
/// `Option<In<T>>` may be, `Vec<In<T>>` takes a list.
#[derive(Debug)]
pub struct In<T> {
    slot: Option<u32>,
    constant: Option<f32>,
    marker: PhantomData<fn() -> T>,
}

impl<T> Clone for In<T> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }
}

impl<T> Default for In<T> {
    fn default() -> Self {
        Self { slot: None, constant: None, marker: PhantomData }
    }
}

impl<T> In<T> {
    /// The default of a field port that stands for `value` everywhere when nothing is connected.
    pub fn constant(value: f32) -> Self {
        Self { constant: Some(value), ..Self::default() }
    }

    /// The place of its value among the node's inputs, if it is connected.
    pub fn slot(&self) -> Option<u32> {
        self.slot
    }

    /// What it stands for when nothing is connected.
    pub fn default_value(&self) -> Option<f32> {
        self.constant
    }
}

impl<T> Serialize for In<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (self.slot, self.constant) {
            (None, Some(value)) => serializer.serialize_f32(value),
            _ => serializer.serialize_unit(),
        }
    }
}

impl<'de, T> Deserialize<'de> for In<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self { slot: Some(u32::deserialize(deserializer)?), ..Self::default() })
    }
}

impl<T: PortType> JsonSchema for In<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        Cow::Owned(format!("In_{}", T::TYPE))
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        // The type lets `Option` leave its mark: it adds "null".
        json_schema!({ "type": "integer", "port": T::TYPE.name() })
    }
}
