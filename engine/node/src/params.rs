//! Types of parameters that can be written in more than one way.
use super::ParamType;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// Reads one number, or a pair of numbers.
struct OneOrTwo;

impl<'de> Visitor<'de> for OneOrTwo {
    type Value = (f64, f64);

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a pair of numbers")
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<Self::Value, E> {
        Ok((v, v))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Self::Value, E> {
        Ok((v as f64, v as f64))
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<Self::Value, E> {
        Ok((v as f64, v as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let missing = || A::Error::custom("expected a pair of numbers");
        let a = seq.next_element()?.ok_or_else(missing)?;
        let b = seq.next_element()?.ok_or_else(missing)?;
        if seq.next_element::<f64>()?.is_some() {
            return Err(A::Error::custom("expected a pair of numbers, found more"));
        }
        Ok((a, b))
    }
}

macro_rules! pairs {
    ($($(#[$doc:meta])* $name:ident { $(#[$doc_a:meta])* $a:ident, $(#[$doc_b:meta])* $b:ident })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name {
            $(#[$doc_a])*
            pub $a: f64,
            $(#[$doc_b])*
            pub $b: f64,
        }

        impl $name {
            /// Takes the two numbers.
            pub const fn new($a: f64, $b: f64) -> Self {
                Self { $a, $b }
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                (self.$a, self.$b).serialize(serializer)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                deserializer.deserialize_any(OneOrTwo).map(|(a, b)| Self::new(a, b))
            }
        }

        impl JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> Cow<'static, str> {
                Cow::Borrowed(ParamType::$name.name())
            }

            fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
                json_schema!({ "param": ParamType::$name.name() })
            }
        }
    )*};
}

pairs! {
    /// From a smallest to a largest number, `(lo, hi)`; one number stands for both. Must not be reversed.
    Range {
        /// The smallest.
        lo,
        /// The largest.
        hi
    }
    /// A straight line: the values that stand for 0 and for 1, `(at0, at1)`; one number stands for both. May fall.
    Linear {
        /// What 0 becomes.
        at0,
        /// What 1 becomes.
        at1
    }
    /// One number for each direction, `(x, y)`; one number stands for both.
    Xy {
        /// Across.
        x,
        /// Down.
        y
    }
}

impl Range {
    /// Value at the fraction `t` of the range.
    pub fn at(self, t: f64) -> f64 {
        self.lo + (self.hi - self.lo) * t
    }
}

impl Linear {
    /// The value at `t`.
    pub fn at(self, t: f64) -> f64 {
        self.at0 + (self.at1 - self.at0) * t
    }
}

/// A colour: `"#rrggbb"` in sRGB, or `(r, g, b)` scene-linear. Kept scene-linear.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Color(pub [f32; 3]);

impl Color {
    /// A colour from bytes in sRGB.
    pub fn srgb(bytes: [u8; 3]) -> Self {
        Self(bytes.map(|byte| crate::value::srgb_to_linear(f32::from(byte) / 255.0)))
    }
}

struct ColorVisitor;

impl<'de> Visitor<'de> for ColorVisitor {
    type Value = Color;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a colour: \"#rrggbb\" or (r, g, b)")
    }

    fn visit_str<E: Error>(self, v: &str) -> Result<Color, E> {
        crate::value::parse_color(v)
            .map(Color)
            .ok_or_else(|| E::custom(format!("`{v}` is not a colour; write \"#rrggbb\"")))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
        let mut color = [0.0; 3];
        for channel in &mut color {
            *channel = seq.next_element()?.ok_or_else(|| A::Error::custom("expected three numbers (r, g, b)"))?;
        }
        if seq.next_element::<f32>()?.is_some() {
            return Err(A::Error::custom("expected three numbers (r, g, b), found more"));
        }
        Ok(Color(color))
    }
}

impl Serialize for Color {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ColorVisitor)
    }
}

impl JsonSchema for Color {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        Cow::Borrowed(ParamType::Color.name())
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "param": ParamType::Color.name() })
    }
}

/// The path of a file, relative to the graph file that names it. A key depends on the file's content, not on its name.
#[derive(Clone, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(transparent)]
pub struct FilePath(pub String);

impl Serialize for FilePath {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str("")
    }
}

impl JsonSchema for FilePath {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        Cow::Borrowed(ParamType::Path.name())
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "param": ParamType::Path.name() })
    }
}
