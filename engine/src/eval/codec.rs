//! Objects as bytes, for the disk cache.
use crate::value::Value;
use std::sync::Arc;

/// The bytes of an object; `None` for values that are not data (fields and what holds them).
pub fn encode(value: &Value) -> Option<Vec<u8>> {
    match value {
        Value::Points(points) => tagged(b'P', points),
        Value::Lattice(lattice) => tagged(b'L', lattice),
        Value::SpringNet(springs) => tagged(b'N', springs),
        Value::Segments(segments) => tagged(b'G', segments),
        Value::Exemplar(exemplar) => tagged(b'E', exemplar),
        Value::CoordMap(map) => tagged(b'M', map),
        Value::Curve(curve) => tagged(b'C', curve),
        Value::Skeleton(skeleton) => tagged(b'K', skeleton),
        Value::ColorPattern(pattern) => tagged(b'Y', pattern),
        Value::Field(_) | Value::Picture(_) | Value::Material(_) | Value::Solid(_) => None,
    }
}

/// Changes with the fields of any object.
const FORM: u8 = 2;

fn tagged<T: serde::Serialize>(tag: u8, object: &T) -> Option<Vec<u8>> {
    postcard::to_extend(object, vec![FORM, tag]).ok()
}

/// The object of [`encode`]; `None` for bytes that are not its.
pub fn decode(bytes: &[u8]) -> Option<Value> {
    fn object<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Option<Arc<T>> {
        postcard::from_bytes(bytes).ok().map(Arc::new)
    }
    let (tag, body) = bytes.strip_prefix(&[FORM])?.split_first()?;
    Some(match tag {
        b'P' => Value::Points(object(body)?),
        b'L' => Value::Lattice(object(body)?),
        b'N' => Value::SpringNet(object(body)?),
        b'G' => Value::Segments(object(body)?),
        b'E' => Value::Exemplar(object(body)?),
        b'M' => Value::CoordMap(object(body)?),
        b'C' => Value::Curve(object(body)?),
        b'K' => Value::Skeleton(object(body)?),
        b'Y' => Value::ColorPattern(object(body)?),
        _ => return None,
    })
}
