//! Reads the numbers of a glTF: accessors into views of buffers, each checked before it is read.
use super::{MOST_VERTICES, ReadError};
use gltf_json::Root;
use gltf_json::accessor::sparse::Sparse;
use gltf_json::accessor::{Accessor, ComponentType, Type};
use gltf_json::validation::Checked;
use std::borrow::Cow;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    bytes: Vec<Option<Vec<u8>>>,
    /// The binary part of a GLB, which is a buffer.
    packed: Option<&'a [u8]>,
    beside: Option<&'a [u8]>,
}

/// The numbers of an accessor, borrowed from a view or assembled.
pub(super) struct Numbers<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
    component: ComponentType,
    normalized: bool,
    /// Number of elements.
    pub(super) count: usize,
}

/// An error at a place of the document.
pub(super) fn fault(at: &str, what: &str) -> ReadError {
    ReadError::Bad(format!("{at}: {what}"))
}

/// Decodes base64; `None` if the text is invalid.
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
    /// Finds the buffers. For a buffer in a file, only the file that the graph names is used, never the name in the
    /// document.
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

    /// The accessor with index `n`, which must have elements of type `ty`; `at` is the place of the reference, for
    /// messages.
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
        let size = ty.multiplicity() * component.0.size();
        let (bytes, stride) = self.elements(accessor, size).map_err(|what| bad(&what))?;
        let count = usize::try_from(accessor.count.0).map_err(|_| bad("is too large"))?;
        Ok(Numbers { bytes, stride, component: component.0, normalized: accessor.normalized, count })
    }

    /// The bytes of an accessor with elements of `size` bytes, and the stride between elements.
    fn elements(&self, accessor: &Accessor, size: usize) -> Result<(Cow<'_, [u8]>, usize), String> {
        let (offset, count) = (accessor.byte_offset.map_or(0, |at| at.0), accessor.count.0);
        let base = accessor.buffer_view.map(|view| self.view(view.value(), offset, size, count)).transpose()?;
        match (&accessor.sparse, base) {
            (None, None) => Err("has no view".to_owned()),
            (None, Some((bytes, stride))) => Ok((Cow::Borrowed(bytes), stride)),
            (Some(sparse), base) => Ok((Cow::Owned(self.patched(sparse, base, size, count)?), size)),
        }
    }

    /// The elements of a sparse accessor: those of `base`, or zeros, with some of them replaced.
    fn patched(
        &self,
        sparse: &Sparse,
        base: Option<(&[u8], usize)>,
        size: usize,
        count: u64,
    ) -> Result<Vec<u8>, String> {
        let count = usize::try_from(count).ok().filter(|count| *count <= MOST_VERTICES);
        let count = count.ok_or_else(|| format!("has more than {MOST_VERTICES} elements"))?;
        let (Checked::Valid(kind), some) = (&sparse.indices.component_type, sparse.count.0) else {
            return Err("has sparse indices of an unknown kind".to_owned());
        };
        let view = |view: usize, offset: u64, size: usize| self.view(view, offset, size, some);
        let (indices, values) = (&sparse.indices, &sparse.values);
        let (bytes, stride) = view(indices.buffer_view.value(), indices.byte_offset.0, kind.0.size())?;
        let component = kind.0;
        // The view holds that many elements, so the number fits.
        let some = usize::try_from(some).unwrap_or(0);
        let indices = Numbers { bytes: Cow::Borrowed(bytes), stride, component, normalized: false, count: some };
        let (values, stride) = view(values.buffer_view.value(), values.byte_offset.0, size)?;
        let mut out = vec![0; count * size];
        if let Some((bytes, stride)) = base {
            let elements = out.chunks_exact_mut(size).enumerate();
            elements.for_each(|(n, to)| to.copy_from_slice(&bytes[n * stride..][..size]));
        }
        for n in 0..some {
            let index = indices.index(n).map_or(usize::MAX, |index| index as usize);
            let to = out.chunks_exact_mut(size).nth(index);
            let to = to.ok_or_else(|| format!("has the sparse index {index} of {count} elements"))?;
            to.copy_from_slice(&values[n * stride..][..size]);
        }
        Ok(out)
    }

    /// The bytes of a view from `offset` on, and the stride between elements; checks that the view has room for `count`
    /// elements of `size` bytes.
    fn view(&self, n: usize, offset: u64, size: usize, count: u64) -> Result<(&[u8], usize), String> {
        let all = self.root.buffer_views.len();
        let view = self.root.buffer_views.get(n).ok_or_else(|| format!("refers to view {n} of {all}"))?;
        let buffer =
            self.buffer(view.buffer.value()).ok_or_else(|| format!("refers to view {n}, which has no buffer"))?;
        let from = view.byte_offset.map_or(0, |at| at.0);
        let end = from.checked_add(view.byte_length.0);
        let end = end
            .filter(|end| *end <= buffer.len() as u64)
            .ok_or_else(|| format!("refers to view {n}, which leaves its buffer"))?;
        let start = from.checked_add(offset).filter(|start| *start <= end);
        let start = start.ok_or_else(|| format!("begins beyond view {n}"))?;
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return Err(format!("has elements of {size} bytes every {stride} bytes"));
        }
        // Both lie within the buffer, which is in memory, so they fit.
        let bytes = &buffer[usize::try_from(start).unwrap_or(0)..usize::try_from(end).unwrap_or(0)];
        let needs = |last: u64| last.checked_mul(stride as u64).and_then(|at| at.checked_add(size as u64));
        match count.checked_sub(1).map(needs) {
            Some(needs) if needs.is_none_or(|needs| needs > bytes.len() as u64) => {
                Err(format!("has {count} elements, for which its view of {} bytes has no room", bytes.len()))
            }
            _ => Ok((bytes, stride)),
        }
    }
}

impl Numbers<'_> {
    fn element(&self, n: usize, k: usize) -> &[u8] {
        &self.bytes[n * self.stride + k * self.component.size()..]
    }

    /// Element `n` as numbers; integers are scaled if the accessor is normalized.
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

    /// Element `n` as an index; `None` for floats.
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
