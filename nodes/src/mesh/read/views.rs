//! The numbers of a glTF: accessors into views of buffers, each checked before it is read.
use super::ReadError;
use gltf_json::Root;
use gltf_json::accessor::{Accessor, ComponentType, Type};
use gltf_json::validation::Checked;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    bytes: Vec<Option<Vec<u8>>>,
    /// The part of a GLB that is a buffer, and the file beside a document.
    packed: Option<&'a [u8]>,
    beside: Option<&'a [u8]>,
}

/// The numbers of an accessor, in a view.
pub(super) struct Numbers<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
    normalized: bool,
    /// How many elements there are.
    pub(super) count: usize,
}

/// An error at a place of the document.
pub(super) fn fault(at: &str, what: &str) -> ReadError {
    ReadError::Bad(format!("{at}: {what}"))
}

/// The bytes of base64; `None` if it is none.
fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for four in text.chunks(4) {
        let mut bits = 0u32;
        for byte in four {
            let value = match byte {
                b'A'..=b'Z' => byte - b'A',
                b'a'..=b'z' => byte - b'a' + 26,
                b'0'..=b'9' => byte - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        let bytes = (bits << (6 * (4 - four.len()))).to_be_bytes();
        out.extend_from_slice(&bytes[1..four.len().max(1)]);
    }
    Some(out)
}

impl<'a> Buffers<'a> {
    /// Finds the buffers. Only the file beside the document, which the graph names, stands for files that it names.
    pub(super) fn new(root: &'a Root, packed: Option<&'a [u8]>, beside: Option<&'a [u8]>) -> Result<Self, ReadError> {
        let mut bytes = Vec::new();
        let mut files = 0;
        for (n, buffer) in root.buffers.iter().enumerate() {
            let at = format!("buffers[{n}]");
            let own = match buffer.uri.as_deref() {
                None if n == 0 && packed.is_some() => None,
                None => return Err(fault(&at, "it has no bytes")),
                Some(uri) => match uri.strip_prefix("data:") {
                    Some(data) => {
                        let text = data.split_once(";base64,").ok_or_else(|| fault(&at, "its data must be base64"))?.1;
                        Some(base64(text).ok_or_else(|| fault(&at, "its data is not base64"))?)
                    }
                    None => {
                        files += 1;
                        if beside.is_none() {
                            let shown: String = uri.chars().take(60).collect();
                            return Err(ReadError::NoBuffer(format!("{at} is kept in another file, `{shown}`")));
                        }
                        None
                    }
                },
            };
            let length = own.as_deref().or(if buffer.uri.is_some() { beside } else { packed }).map_or(0, <[u8]>::len);
            if buffer.byte_length.0 > length as u64 {
                let what = format!(
                    "it should have {} bytes, and there are {length}: the file is truncated",
                    buffer.byte_length.0
                );
                return Err(fault(&at, &what));
            }
            bytes.push(own);
        }
        if files > 1 {
            return Err(ReadError::bad("its numbers are kept in several files: export it with one, or as `.glb`"));
        }
        Ok(Self { root, bytes, packed, beside })
    }

    fn buffer(&self, n: usize) -> Option<&[u8]> {
        let buffer = self.root.buffers.get(n)?;
        let bytes = self.bytes.get(n)?.as_deref().or(if buffer.uri.is_some() { self.beside } else { self.packed })?;
        bytes.get(..usize::try_from(buffer.byte_length.0).ok()?)
    }

    /// The accessor with a number, which must have elements of that type; `at` is what refers to it.
    pub(super) fn numbers(&self, n: usize, ty: Type, at: &str) -> Result<Numbers<'_>, ReadError> {
        let all = self.root.accessors.len();
        let accessor =
            self.root.accessors.get(n).ok_or_else(|| fault(at, &format!("there is no accessor {n} of {all}")))?;
        let bad = |what: &str| fault(at, &format!("accessor {n} {what}"));
        let (Checked::Valid(component), Checked::Valid(found)) = (&accessor.component_type, &accessor.type_) else {
            return Err(bad("has numbers of an unknown kind"));
        };
        if *found != ty {
            return Err(bad(&format!("holds {found:?} and must hold {ty:?}")));
        }
        if accessor.sparse.is_some() {
            return Err(bad("is sparse, which is not read: export without shape keys"));
        }
        let (bytes, stride, size) =
            self.view(accessor, ty.multiplicity() * component.0.size()).map_err(|what| bad(&what))?;
        let count = accessor.count.0;
        let end = count.checked_sub(1).and_then(|last| last.checked_mul(stride)).and_then(|at| at.checked_add(size));
        if end.is_some_and(|end| end > bytes.len() as u64) || (count > 0 && end.is_none()) {
            return Err(bad(&format!("has {count} elements, for which its view of {} bytes has no room", bytes.len())));
        }
        let fits = |n: u64| usize::try_from(n).map_err(|_| bad("is too large"));
        let (stride, count) = (fits(stride)?, fits(count)?);
        Ok(Numbers { bytes, stride, component: component.0, normalized: accessor.normalized, count })
    }

    /// The bytes from an accessor's first one on, the way from one element to the next, and the size of one.
    fn view(&self, accessor: &Accessor, size: usize) -> Result<(&[u8], u64, u64), String> {
        let n = accessor.buffer_view.ok_or("has no view")?.value();
        let all = self.root.buffer_views.len();
        let view = self.root.buffer_views.get(n).ok_or_else(|| format!("refers to view {n} of {all}"))?;
        let buffer =
            self.buffer(view.buffer.value()).ok_or_else(|| format!("refers to view {n}, which has no buffer"))?;
        let offset = view.byte_offset.map_or(0, |at| at.0);
        let end = offset.checked_add(view.byte_length.0);
        let end = end
            .filter(|end| *end <= buffer.len() as u64)
            .ok_or_else(|| format!("refers to view {n}, which leaves its buffer"))?;
        let start = offset.checked_add(accessor.byte_offset.map_or(0, |at| at.0)).filter(|start| *start <= end);
        let start = start.ok_or_else(|| format!("begins beyond view {n}"))?;
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return Err(format!("has elements of {size} bytes every {stride} bytes"));
        }
        // Both lie within the buffer, which is in memory.
        let range = usize::try_from(start).unwrap_or(0)..usize::try_from(end).unwrap_or(0);
        Ok((&buffer[range], stride as u64, size as u64))
    }
}

impl Numbers<'_> {
    fn element(&self, n: usize, k: usize) -> &[u8] {
        &self.bytes[n * self.stride + k * self.component.size()..]
    }

    /// Element `n` as numbers, integers scaled if the accessor says so.
    pub(super) fn vector<const N: usize>(&self, n: usize) -> [f32; N] {
        let scaled = |value: f32, most: f32| if self.normalized { (value / most).max(-1.0) } else { value };
        std::array::from_fn(|k| {
            let b = self.element(n, k);
            match self.component {
                ComponentType::I8 => scaled(f32::from(b[0].cast_signed()), 127.0),
                ComponentType::U8 => scaled(f32::from(b[0]), 255.0),
                ComponentType::I16 => scaled(f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
                ComponentType::U16 => scaled(f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
                ComponentType::U32 => f32::NAN,
                ComponentType::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            }
        })
    }

    /// Element `n` as an index; `None` if its numbers are none.
    pub(super) fn index(&self, n: usize) -> Option<u32> {
        let b = self.element(n, 0);
        match self.component {
            ComponentType::U8 => Some(u32::from(b[0])),
            ComponentType::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
            ComponentType::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_read() {
        for (text, bytes) in [
            ("", &b""[..]),
            ("TQ==", b"M"),
            ("TWE=", b"Ma"),
            ("TWFu", b"Man"),
            ("TWFuTWE", b"ManMa"),
            ("-_+/", &[0xfb, 0xff, 0xbf]),
        ] {
            assert_eq!(base64(text).as_deref(), Some(bytes), "{text}");
        }
        assert_eq!(base64("TW u"), None);
    }
}
