//! Objects as bytes, for the disk cache.
use crate::{Type, Value, objects};
use std::sync::Arc;

/// Returns true for types whose values are data that [`encode`] can serialize.
pub const fn is_data(ty: Type) -> bool {
    !ty.is_field() && !ty.is_in_space() && !matches!(ty, Type::Picture | Type::Material)
}

/// The version of the encoding; it must change when the fields of any object do.
const FORM: u8 = 4;

macro_rules! codec {
    ($($name:ident $color:literal $doc:literal,)*) => {
        /// Serializes an object; `None` for values that are not data (fields and values that contain fields).
        pub fn encode(value: &Value) -> Option<Vec<u8>> {
            match value {
                $(Value::$name(object) => named(Type::$name, object),)*
                Value::Field(_)
                | Value::Picture(_)
                | Value::Material(_)
                | Value::Solid(_)
                | Value::SolidMaterial(_) => None,
            }
        }

        /// Deserializes the bytes of [`encode`]; `None` for other bytes.
        pub fn decode(bytes: &[u8]) -> Option<Value> {
            let (name, body) = postcard::take_from_bytes::<&str>(bytes.strip_prefix(&[FORM])?).ok()?;
            match Type::from_name(name)? {
                $(Type::$name => Some(Value::$name(Arc::new(postcard::from_bytes(body).ok()?))),)*
                _ => None,
            }
        }
    };
}

objects! { codec! {} }

fn named<T: serde::Serialize>(ty: Type, object: &Arc<T>) -> Option<Vec<u8>> {
    postcard::to_extend(&(ty.name(), object), vec![FORM]).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorPattern, Curve};

    #[test]
    fn round_trips_objects() {
        let curve = Value::from(Curve { points: vec![glam::DVec3::new(0.1, f64::INFINITY, -0.0)] });
        let bytes = encode(&curve).unwrap();
        let Some(Value::Curve(back)) = decode(&bytes) else { panic!("another type") };
        assert_eq!(back.points, [glam::DVec3::new(0.1, f64::INFINITY, -0.0)]);
        assert!(decode(&bytes[..bytes.len() - 1]).is_none() && decode(b"").is_none() && decode(&[FORM, 200]).is_none());
        let pattern = Value::from(ColorPattern { table: Vec::new(), entries: 1, widths: Vec::new() });
        assert!(matches!(decode(&encode(&pattern).unwrap()), Some(Value::ColorPattern(_))));
    }
}
