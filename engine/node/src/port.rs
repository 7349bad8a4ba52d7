//! Ports: the fields of a node struct that accept wires.
use crate::value::{Accepts, Carried, Field, Material, Solid, SolidMaterial, Type, Value};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::marker::PhantomData;
use std::sync::Arc;

/// A type of port: the values that it accepts, and the type for its node.
pub trait PortType: 'static {
    /// Types that may be connected.
    const ACCEPTS: Accepts;
    /// Type that the node gets.
    type Got;
    /// Extracts it from a value that was converted to [`ACCEPTS`](Self::ACCEPTS).
    fn take(value: Value) -> Option<Self::Got>;
}

macro_rules! field_ports {
    ($($(#[$doc:meta])* $name:ident = $accepts:expr,)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl PortType for $name {
            const ACCEPTS: Accepts = $accepts;
            type Got = Field;
            fn take(value: Value) -> Option<Field> {
                match value { Value::Field(field) => Some(field), _ => None }
            }
        }
    )*};
}

field_ports! {
    /// A port for a field of numbers; accepts a constant number too.
    Gray = Accepts::One(Type::Gray),
    /// A port for a field of colours; accepts a constant number or colour too.
    Rgb = Accepts::One(Type::Rgb),
    /// A port for a field of tangent-space normals.
    NormalField = Accepts::One(Type::Normal),
    /// A port for a field of vectors.
    Vec2Field = Accepts::One(Type::Vec2),
    /// A port for a field of 2×2 matrices.
    JacobianField = Accepts::One(Type::Jacobian),
    /// A port for region numbers.
    IdsField = Accepts::One(Type::Ids),
    /// A port for `Gray` or `Rgb`.
    AnyField = Accepts::Field,
    /// A port for any field.
    EveryField = Accepts::EveryField,
    /// A port for `Rgb`, `Normal` or `Vec2`.
    AnyVector = Accepts::AnyVector,
    /// A port for directions: degrees from +x towards +y, or a `Vec2`; accepts a number too. Its node gets degrees.
    Direction = Accepts::Direction,
}

/// A port for objects of one type, or for materials.
impl<T: Carried> PortType for T {
    const ACCEPTS: Accepts = Accepts::One(T::TYPE);
    type Got = Arc<T>;
    fn take(value: Value) -> Option<Arc<T>> {
        T::unwrap(value)
    }
}

macro_rules! solid_ports {
    ($($(#[$doc:meta])* $name:ident = $accepts:expr,)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl PortType for $name {
            const ACCEPTS: Accepts = $accepts;
            type Got = Solid;
            fn take(value: Value) -> Option<Solid> {
                match value { Value::Solid(solid) => Some(solid), _ => None }
            }
        }
    )*};
}

solid_ports! {
    /// A port for a solid of numbers.
    SolidNumber = Accepts::One(Type::Solid),
    /// A port for a solid of colours.
    SolidColor = Accepts::One(Type::SolidColor),
    /// A port for a solid of vectors.
    SolidVector = Accepts::One(Type::SolidVector),
    /// A port for any solid.
    AnySolid = Accepts::AnySolid,
}

/// A value on the canvas or in space.
#[derive(Clone, Debug)]
pub enum Anywhere {
    /// A field.
    Field(Field),
    /// A solid.
    Solid(Solid),
}

impl Anywhere {
    /// Type of the value.
    pub fn ty(&self) -> Type {
        match self {
            Self::Field(field) => field.ty(),
            Self::Solid(solid) => solid.ty(),
        }
    }
}

/// A material on the canvas or in space.
#[derive(Clone, Debug)]
pub enum MaterialAnywhere {
    /// A material of fields.
    Canvas(Arc<Material>),
    /// A material of solids.
    Space(Arc<SolidMaterial>),
}

/// A field, or a material on the canvas.
#[derive(Clone, Debug)]
pub enum FieldsOrMaterial {
    /// A field.
    Field(Field),
    /// A material of fields.
    Material(Arc<Material>),
}

impl From<Anywhere> for Value {
    fn from(value: Anywhere) -> Self {
        match value {
            Anywhere::Field(field) => field.into(),
            Anywhere::Solid(solid) => solid.into(),
        }
    }
}

impl From<MaterialAnywhere> for Value {
    fn from(material: MaterialAnywhere) -> Self {
        match material {
            MaterialAnywhere::Canvas(material) => material.into(),
            MaterialAnywhere::Space(material) => material.into(),
        }
    }
}

/// A solid, or a material of solids.
#[derive(Clone, Debug)]
pub enum SolidOrMaterial {
    /// A solid.
    Solid(Solid),
    /// A material of solids.
    Material(Arc<SolidMaterial>),
}

impl SolidOrMaterial {
    /// The value with each solid changed.
    pub fn map(&self, change: impl Fn(&Solid) -> Solid) -> Value {
        match self {
            Self::Solid(solid) => change(solid).into(),
            Self::Material(material) => {
                let channels = material.channels().iter().map(|(channel, solid)| (*channel, change(solid)));
                SolidMaterial::new(channels).into()
            }
        }
    }
}

macro_rules! ports_of_two {
    ($($(#[$doc:meta])* $name:ident = $accepts:expr => $got:ident { $($from:ident $to:ident)* },)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl PortType for $name {
            const ACCEPTS: Accepts = $accepts;
            type Got = $got;
            fn take(value: Value) -> Option<$got> {
                match value {
                    $(Value::$from(value) => Some($got::$to(value)),)*
                    _ => None,
                }
            }
        }
    )*};
}

ports_of_two! {
    /// A port for one number on the canvas or in space; accepts a constant number too.
    Number = Accepts::Number => Anywhere { Field Field Solid Solid },
    /// A port for a colour on the canvas or in space; accepts a constant number or colour too.
    AnyColor = Accepts::Color => Anywhere { Field Field Solid Solid },
    /// A port for a normal on the canvas, or a solid of normals relative to the cut, as `FiberShading` gives.
    AnyNormal = Accepts::AnyNormal => Anywhere { Field Field Solid Solid },
    /// A port for a material on the canvas or in space.
    AnyMaterial = Accepts::AnyMaterial => MaterialAnywhere { Material Canvas SolidMaterial Space },
    /// A port for numbers or colours on the canvas or in space: `Gray`, `Rgb`, `Normal`, or any solid.
    FieldOrSolid = Accepts::FieldOrSolid => Anywhere { Field Field Solid Solid },
    /// A port for any field or any solid.
    EveryFieldOrSolid = Accepts::EveryFieldOrSolid => Anywhere { Field Field Solid Solid },
    /// A port for any field, or a material on the canvas.
    FieldOrMaterial = Accepts::FieldOrMaterial => FieldsOrMaterial { Field Field Material Material },
    /// A port for any solid, or a material of solids.
    InSpace = Accepts::InSpace => SolidOrMaterial { Solid Solid SolidMaterial Material },
}

/// A port. In a node struct, `In<T>` must be connected unless its default is a [`constant`](Self::constant),
/// `Option<In<T>>` is optional, and `Vec<In<T>>` takes a list.
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
    /// A field port with a constant default of `value`.
    pub fn constant(value: f32) -> Self {
        Self { constant: Some(value), ..Self::default() }
    }

    /// Index of its value among the node's inputs, if it is connected.
    pub fn slot(&self) -> Option<u32> {
        self.slot
    }

    /// Its value when nothing is connected.
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
        Cow::Owned(format!("In_{}", T::ACCEPTS))
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        // `Option` adds "null" to this type, which marks the port as optional.
        json_schema!({ "type": "integer", "port": T::ACCEPTS.name() })
    }
}
