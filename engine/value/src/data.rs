//! Objects as data for other programs.
use super::{Object, Type, Value, objects};
use serde::{Serialize, Serializer};

/// A number that is read back exactly. Numbers missing in JSON are written as `"nan"`, `"inf"`, `"-inf"`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number<T = f32>(pub T);

/// The word for a number that is not finite.
fn word(n: f64) -> Option<&'static str> {
    match n {
        n if n.is_nan() => Some("nan"),
        f64::INFINITY => Some("inf"),
        f64::NEG_INFINITY => Some("-inf"),
        _ => None,
    }
}

impl Serialize for Number<f32> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match word(self.0.into()) {
            Some(word) => serializer.serialize_str(word),
            None => serializer.serialize_f32(self.0),
        }
    }
}

impl Serialize for Number<f64> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match word(self.0) {
            Some(word) => serializer.serialize_str(word),
            None => serializer.serialize_f64(self.0),
        }
    }
}

/// Positions on the canvas as pairs of numbers.
pub(super) fn pairs(vectors: &[glam::Vec2]) -> Vec<[Number; 2]> {
    vectors.iter().map(|v| v.to_array().map(Number)).collect()
}

/// A position in space as three numbers.
pub(super) fn triple(v: &glam::DVec3) -> [Number<f64>; 3] {
    v.to_array().map(Number)
}

/// A list of numbers.
pub(super) fn numbers(values: &[f32]) -> Vec<Number> {
    values.iter().copied().map(Number).collect()
}

/// An object as `shibo dump` prints it: the name of its type, and its [data](Object::data).
#[derive(Clone, Debug)]
pub struct ObjectData(Value);

impl Value {
    /// The data of an object; `None` for values that must be evaluated first.
    pub fn data(&self) -> Option<ObjectData> {
        let evaluated = matches!(
            self,
            Self::Field(_) | Self::Picture(_) | Self::Material(_) | Self::Solid(_) | Self::SolidMaterial(_)
        );
        (!evaluated).then(|| ObjectData(self.clone()))
    }
}

#[derive(Serialize)]
struct Typed<T> {
    #[serde(rename = "type")]
    ty: &'static str,
    #[serde(flatten)]
    data: T,
}

macro_rules! object_data {
    ($($name:ident $color:literal $doc:literal,)*) => {
        impl Serialize for ObjectData {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                match &self.0 {
                    $(Value::$name(object) => {
                        Typed { ty: Type::$name.name(), data: object.data() }.serialize(serializer)
                    })*
                    other => Err(serde::ser::Error::custom(format!("a {} is not data", other.ty()))),
                }
            }
        }
    };
}

objects! { object_data! {} }

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_exactly() {
        for n in [0.1_f32, 1.0 / 3.0, f32::MIN_POSITIVE, 1e-45, f32::MAX, -0.0, 16_777_217.0] {
            let text = serde_json::to_string(&Number(n)).unwrap();
            assert_eq!(text.parse::<f32>().unwrap().to_bits(), n.to_bits(), "{text}");
        }
        for n in [0.1_f64, 1.0 / 3.0, f64::MIN_POSITIVE, -0.0] {
            let text = serde_json::to_string(&Number(n)).unwrap();
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), n.to_bits(), "{text}");
        }
        let odd = serde_json::to_string(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(Number)).unwrap();
        assert_eq!(odd, r#"["nan","inf","-inf"]"#);
    }
}
