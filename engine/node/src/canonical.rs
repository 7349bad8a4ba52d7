//! The parameters of a node as bytes for keys: the names of the fields that differ from their defaults, with their
//! values. So a new field with a default leaves the keys of all nodes as they are. Source: LASTING §1.
use super::Node;
use serde::Serialize;
use serde::ser::{Error as _, Impossible, SerializeStruct, Serializer};
use std::fmt;

/// The bytes of a node's parameters. Equal parameters give equal bytes.
pub(super) fn canonical<T: Node>(node: &T) -> Vec<u8> {
    let (Ok(found), Ok(defaults)) = (node.serialize(Fields), T::default().serialize(Fields)) else {
        // A struct that is not written field by field.
        return postcard::to_stdvec(node).unwrap_or_else(|e| e.to_string().into_bytes());
    };
    let mut bytes = Vec::new();
    for (name, value) in found {
        let is_default = defaults.iter().any(|(other, default)| *other == name && *default == value);
        if !is_default {
            for part in [name.as_bytes(), &value] {
                bytes.extend((part.len() as u64).to_le_bytes());
                bytes.extend(part);
            }
        }
    }
    bytes
}

/// The fields of a struct with their values as bytes, in the order of the struct.
type Found = Vec<(&'static str, Vec<u8>)>;

/// Takes a struct apart.
struct Fields;

struct Struct(Found);

/// A value that has no fields, or a field that cannot be written.
#[derive(Debug)]
struct Failed(String);

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failed {}

impl serde::ser::Error for Failed {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

impl SerializeStruct for Struct {
    type Ok = Found;
    type Error = Failed;

    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Failed> {
        self.0.push((name, postcard::to_stdvec(value).map_err(Failed::custom)?));
        Ok(())
    }

    fn end(self) -> Result<Found, Failed> {
        Ok(self.0)
    }
}

/// Methods that refuse values other than structs.
macro_rules! refuse {
    ($($method:ident($($argument:ident: $type:ty),*) -> $ok:ty;)*) => {$(
        fn $method(self, $($argument: $type),*) -> Result<$ok, Failed> {
            $(let _ = $argument;)*
            Err(Failed::custom("the parameters of a node are a struct"))
        }
    )*};
}

impl Serializer for Fields {
    type Ok = Found;
    type Error = Failed;
    type SerializeSeq = Impossible<Found, Failed>;
    type SerializeTuple = Impossible<Found, Failed>;
    type SerializeTupleStruct = Impossible<Found, Failed>;
    type SerializeTupleVariant = Impossible<Found, Failed>;
    type SerializeMap = Impossible<Found, Failed>;
    type SerializeStruct = Struct;
    type SerializeStructVariant = Impossible<Found, Failed>;

    fn serialize_struct(self, _name: &'static str, fields: usize) -> Result<Struct, Failed> {
        Ok(Struct(Vec::with_capacity(fields)))
    }

    fn serialize_unit_struct(self, _name: &'static str) -> Result<Found, Failed> {
        Ok(Found::new())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<Found, Failed> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _name: &'static str, value: &T) -> Result<Found, Failed> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _name: &'static str,
        _index: u32,
        _variant: &'static str,
        _value: &T,
    ) -> Result<Found, Failed> {
        self.serialize_unit()
    }

    refuse! {
        serialize_bool(v: bool) -> Found;
        serialize_i8(v: i8) -> Found;
        serialize_i16(v: i16) -> Found;
        serialize_i32(v: i32) -> Found;
        serialize_i64(v: i64) -> Found;
        serialize_u8(v: u8) -> Found;
        serialize_u16(v: u16) -> Found;
        serialize_u32(v: u32) -> Found;
        serialize_u64(v: u64) -> Found;
        serialize_f32(v: f32) -> Found;
        serialize_f64(v: f64) -> Found;
        serialize_char(v: char) -> Found;
        serialize_str(v: &str) -> Found;
        serialize_bytes(v: &[u8]) -> Found;
        serialize_none() -> Found;
        serialize_unit() -> Found;
        serialize_unit_variant(name: &'static str, index: u32, variant: &'static str) -> Found;
        serialize_seq(len: Option<usize>) -> Self::SerializeSeq;
        serialize_tuple(len: usize) -> Self::SerializeTuple;
        serialize_tuple_struct(name: &'static str, len: usize) -> Self::SerializeTupleStruct;
        serialize_tuple_variant(name: &'static str, index: u32, variant: &'static str, len: usize) -> Self::SerializeTupleVariant;
        serialize_map(len: Option<usize>) -> Self::SerializeMap;
        serialize_struct_variant(name: &'static str, index: u32, variant: &'static str, len: usize) -> Self::SerializeStructVariant;
    }
}

#[cfg(test)]
mod tests {
    use super::canonical;
    use crate::value::{Stop, Type};
    use crate::{Context, Gray, In, Node, Output, Outputs};
    use schemars::JsonSchema;
    use serde::{Deserialize, Serialize};

    /// Declares a node with these fields.
    macro_rules! node {
        ($name:ident { $($field:ident: $type:ty),* }) => {
            #[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
            struct $name {
                $($field: $type),*
            }

            impl Node for $name {
                const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Nothing.")];

                fn evaluate(&self, _: &Context<'_>) -> Result<Outputs, Stop> {
                    unreachable!("it is not evaluated")
                }
            }
        };
    }

    node!(Old { size: f64, offset: Option<f64>, inputs: Vec<In<Gray>> });
    node!(New { twist: f64, offset: Option<f64>, inputs: Vec<In<Gray>>, size: f64 });

    #[test]
    fn new_fields_and_their_order_leave_keys_alone() {
        let old = Old { size: 2.0, inputs: vec![In::default()], ..Old::default() };
        let new = New { size: 2.0, inputs: vec![In::default()], ..New::default() };
        let names = |bytes: &[u8]| ["size", "offset", "inputs", "twist"].map(|name| find(bytes, name));
        assert_eq!(names(&canonical(&old)), [true, false, true, false]);
        assert_eq!(names(&canonical(&New { twist: 1.0, ..new })), [true, false, true, true]);
        assert!(canonical(&New::default()).is_empty());
        let only = |size| (canonical(&Old { size, ..Old::default() }), canonical(&New { size, ..New::default() }));
        assert_eq!(only(2.0).0, only(2.0).1);
        assert_ne!(only(2.0).0, only(3.0).0);
    }

    #[test]
    fn different_parameters_give_different_bytes() {
        let zero = Old { offset: Some(0.0), ..Old::default() };
        let two = Old { inputs: vec![In::default(), In::default()], ..Old::default() };
        let one = Old { inputs: vec![In::default()], ..Old::default() };
        let all = [Old::default(), zero, one, two].map(|node| canonical(&node));
        for (i, bytes) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|other| other != bytes), "{i}");
        }
    }

    fn find(bytes: &[u8], name: &str) -> bool {
        bytes.windows(name.len()).any(|window| window == name.as_bytes())
    }
}
