//! Reads mesh files. All bytes of mesh files pass through this module.
//!
//! Files are not trusted. Their size is checked first, then their headers, and all sizes before memory is allocated. A
//! panic of a parser library makes the file a bad one. All values are checked before use.
mod extensions;
mod gltf;
mod obj;
mod obj_text;
mod polygon;
mod transform;
mod views;

use glam::{DVec3, Vec2, Vec3};
use shibo_kernel::ground::stop::Watch;
use shibo_value::Mesh;
use shibo_value::files::FileHandle;
use std::collections::HashMap;
use std::io::ErrorKind;

/// Maximum size of a file, in bytes.
const MOST_BYTES: u64 = 512 << 20;
/// Maximum number of triangles.
pub(super) const MOST_TRIANGLES: usize = 2_000_000;
/// Maximum number of vertices, counting corners with attributes of their own.
const MOST_VERTICES: usize = 3 * MOST_TRIANGLES;
/// Maximum number of parts, and of bytes of their names.
const MOST_PARTS: usize = 65_535;
const MOST_NAMES: usize = 64 << 20;

/// Reasons why a file cannot be read as a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum ReadError {
    /// The file does not exist.
    #[error("{0}")]
    NotFound(String),
    /// The file is not a mesh file, or it is damaged.
    #[error("{0}")]
    Bad(String),
    /// The file is too large.
    #[error("{0}")]
    TooLarge(String),
    /// Another file is needed.
    #[error("{0}")]
    NoBuffer(String),
    /// The file lacks the requested set of UVs.
    #[error("{0}")]
    NoUvs(String),
}

impl ReadError {
    fn bad(message: impl Into<String>) -> Self {
        Self::Bad(message.into())
    }
}

/// Contents of a file, in its own unit and with its own axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Contents {
    /// The surface. Triangles without UVs get UVs that are not finite, corners without a normal get a normal of 0.
    pub(super) mesh: Mesh,
    /// True if the unit is metres, as in glTF; otherwise the unit is unknown.
    pub(super) metres: bool,
    /// Names of ignored contents.
    pub(super) left_out: Vec<String>,
    /// Other notes, as sentences.
    pub(super) notes: Vec<String>,
}

/// Formats of mesh files.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Gltf,
    Glb,
}

/// The bytes of a text without its byte order mark.
fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

fn format(bytes: &[u8]) -> Result<Format, ReadError> {
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    let start = &bytes[..bytes.len().min(4096)];
    // UTF-16: a byte order mark, or a first letter in two bytes one of which is 0.
    let wide = matches!(start, [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, 1..=0x7F, ..] | [1..=0x7F, 0, ..]);
    match start.iter().find(|b| !b.is_ascii_whitespace()) {
        Some(b'{') => Ok(Format::Gltf),
        _ if wide => Err(ReadError::bad("it is text in UTF-16: save it as UTF-8")),
        _ if start.contains(&0) => Err(ReadError::bad("it is neither OBJ nor glTF (`.gltf` or `.glb`)")),
        _ => Ok(Format::Obj),
    }
}

/// The bytes of a regular file of at most the maximum size.
fn bytes(file: &FileHandle, watch: &Watch<'_>) -> Result<Vec<u8>, ReadError> {
    let problem = |error: std::io::Error| match error.kind() {
        ErrorKind::NotFound => ReadError::NotFound("there is no such file".into()),
        ErrorKind::FileTooLarge => ReadError::TooLarge(format!("it has more than {} MiB", MOST_BYTES >> 20)),
        _ => ReadError::bad(format!("it cannot be read: {error}")),
    };
    if !file.facts().map_err(problem)?.is_file() {
        return Err(ReadError::bad("it is not a regular file"));
    }
    file.bytes_until(MOST_BYTES, &|| watch.check()).map_err(problem)
}

/// Reads a file with the UVs of the set `uv_set`; `buffer` is the separate file in which a `.gltf` keeps its numbers.
/// Unwinds if `watch` cancels.
pub(super) fn read(
    file: &FileHandle,
    buffer: Option<&FileHandle>,
    uv_set: u32,
    watch: &Watch<'_>,
) -> Result<Contents, ReadError> {
    let file = bytes(file, watch)?;
    let other = buffer.map(|file| bytes(file, watch)).transpose()?;
    of_bytes(&file, other.as_deref(), uv_set, watch)
}

/// Like [`read`], from bytes.
fn of_bytes(file: &[u8], buffer: Option<&[u8]>, uv_set: u32, watch: &Watch<'_>) -> Result<Contents, ReadError> {
    let file = unmarked(file);
    let contents = match format(file)? {
        Format::Obj => one_set(uv_set).and_then(|()| obj::read(file, watch)),
        Format::Gltf => gltf::read(file, buffer, false, uv_set, watch),
        Format::Glb => gltf::read(file, buffer, true, uv_set, watch),
    }?;
    if contents.mesh.triangles.is_empty() {
        return Err(ReadError::bad("it has no triangles"));
    }
    Ok(contents)
}

/// Checks a file without making a mesh.
pub(super) fn check(file: &FileHandle, buffer: Option<&FileHandle>, uv_set: u32) -> Result<(), ReadError> {
    let watch = Watch::never();
    let file = bytes(file, &watch)?;
    let other = buffer.map(|file| bytes(file, &watch)).transpose()?;
    let file = unmarked(&file);
    match format(file)? {
        Format::Obj => one_set(uv_set).and_then(|()| obj::check(file)),
        Format::Gltf => gltf::check(file, other.as_deref(), false, uv_set),
        Format::Glb => gltf::check(file, other.as_deref(), true, uv_set),
    }
}

/// Refuses sets of UVs other than the first: an OBJ has only one.
fn one_set(uv_set: u32) -> Result<(), ReadError> {
    match uv_set {
        0 => Ok(()),
        _ => Err(ReadError::NoUvs(format!("an OBJ has one set of UVs, number 0; set {uv_set} is asked for"))),
    }
}

/// The names of the parts found so far.
#[derive(Default)]
struct Names {
    list: Vec<String>,
    numbers: HashMap<String, u16>,
    bytes: usize,
}

impl Names {
    /// The number of a part by its name; a new name is added.
    fn part(&mut self, name: &str) -> Result<u16, ReadError> {
        if let Some(number) = self.numbers.get(name) {
            return Ok(*number);
        }
        self.bytes += name.len();
        let number = u16::try_from(self.list.len()).ok();
        let number = number.filter(|_| self.list.len() < MOST_PARTS && self.bytes <= MOST_NAMES).ok_or_else(|| {
            let message = format!("it has more than {MOST_PARTS} parts, or names of {} MiB", MOST_NAMES >> 20);
            ReadError::TooLarge(message)
        })?;
        self.list.push(name.into());
        self.numbers.insert(name.into(), number);
        Ok(number)
    }
}

/// Triangles collected from a file.
#[derive(Default)]
struct Surface {
    mesh: Mesh,
    /// Number of triangles with UVs that are not finite.
    broken: usize,
}

impl Surface {
    /// Adds a triangle. A normal that is zero or not finite counts as missing.
    fn add(&mut self, corners: [u32; 3], (part, polygon): (u16, u32), uvs: Option<[Vec2; 3]>, normals: [Vec3; 3]) {
        self.mesh.triangles.push(corners);
        self.mesh.parts.push(part);
        self.mesh.polygons.push(polygon);
        let finite = uvs.filter(|uvs| uvs.iter().all(|uv| uv.is_finite()));
        self.broken += usize::from(uvs.is_some() && finite.is_none());
        self.mesh.uvs.push(finite.unwrap_or([Vec2::NAN; 3]));
        let unit = |n: Vec3| if n.is_finite() && n.length_squared() > 1e-12 { n.normalize() } else { Vec3::ZERO };
        self.mesh.normals.push(normals.map(unit));
    }

    /// The mesh, and a note about it.
    fn done(mut self, names: Names) -> (Mesh, Option<String>) {
        self.mesh.part_names = names.list;
        // Polygons matter only if some have several triangles.
        if self.mesh.polygons.windows(2).all(|pair| pair[0] != pair[1]) {
            self.mesh.polygons = Vec::new();
        }
        let note = format!("{} triangles have UVs that are not finite, which are left out", self.broken);
        (self.mesh, (self.broken > 0).then_some(note))
    }
}

/// A vector in double precision.
fn wide(p: Vec3) -> DVec3 {
    p.as_dvec3()
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod usual_tests;
