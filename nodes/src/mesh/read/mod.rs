//! Reading mesh files: the one gate through which their bytes come.
//!
//! Files are not trusted. Their size is looked at first, then what they say of themselves, then sizes of everything before it
//! is allocated. Libraries that read them may panic; that makes the file a bad one. All that is used afterwards is checked.
mod gltf;
mod obj;
mod polygon;
mod views;

use glam::{DVec3, Vec2, Vec3};
use shibo_engine::value::Mesh;
use shibo_kernel::ground::stop::Watch;
use std::io::Read;
use std::path::Path;

/// The largest file, in bytes.
const MOST_BYTES: u64 = 512 << 20;
/// The most triangles.
pub(super) const MOST_TRIANGLES: usize = 2_000_000;
/// The most vertices and corners with attributes of their own.
const MOST_VERTICES: usize = 3 * MOST_TRIANGLES;
/// The most parts.
const MOST_PARTS: usize = 65_535;

/// Why a file is no mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum ReadError {
    /// There is none.
    #[error("{0}")]
    NotFound(String),
    /// It is none, or damaged.
    #[error("{0}")]
    Bad(String),
    /// It is too large.
    #[error("{0}")]
    TooLarge(String),
    /// Another file is needed.
    #[error("{0}")]
    NoBuffer(String),
}

impl ReadError {
    fn bad(message: impl Into<String>) -> Self {
        Self::Bad(message.into())
    }
}

/// What a file says, in its own unit and with its own axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Contents {
    /// The surface.
    pub(super) mesh: Mesh,
    /// Whether its unit is metres, as that of glTF is; else nothing is known about it.
    pub(super) metres: bool,
    /// What was left out.
    pub(super) left_out: Vec<String>,
}

/// The kinds of files.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Gltf,
    Glb,
}

fn format(bytes: &[u8]) -> Result<Format, ReadError> {
    if bytes.starts_with(b"glTF") {
        return Ok(Format::Glb);
    }
    let start = &bytes[..bytes.len().min(4096)];
    match start.iter().find(|b| !b.is_ascii_whitespace()) {
        Some(b'{') => Ok(Format::Gltf),
        _ if start.contains(&0) || std::str::from_utf8(start).is_err_and(|e| e.error_len().is_some()) => {
            Err(ReadError::bad("it is neither OBJ nor glTF (`.gltf` or `.glb`)"))
        }
        _ => Ok(Format::Obj),
    }
}

/// So many bytes are read between two questions whether to stop.
const PIECE: u64 = 4 << 20;

/// The bytes of a regular file that is not too large.
fn bytes(path: &Path, watch: &Watch<'_>) -> Result<Vec<u8>, ReadError> {
    let problem = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => ReadError::NotFound("there is no such file".into()),
        _ => ReadError::bad(format!("it cannot be read: {error}")),
    };
    let meta = std::fs::metadata(path).map_err(problem)?;
    if !meta.is_file() {
        return Err(ReadError::bad("it is not a regular file"));
    }
    let too_large = || ReadError::TooLarge(format!("it has more than {} MiB", MOST_BYTES >> 20));
    if meta.len() > MOST_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    let mut file = std::fs::File::open(path).map_err(problem)?.take(MOST_BYTES + 1);
    bytes.reserve_exact(usize::try_from(meta.len()).unwrap_or(0) + 1);
    while file.by_ref().take(PIECE).read_to_end(&mut bytes).map_err(problem)? > 0 {
        watch.check();
    }
    if bytes.len() as u64 > MOST_BYTES { Err(too_large()) } else { Ok(bytes) }
}

/// Reads a file; `buffer` is the one beside it that an unpacked glTF keeps its numbers in. Left by unwinding when `watch` says
/// so.
pub(super) fn read(path: &Path, buffer: Option<&Path>, watch: &Watch<'_>) -> Result<Contents, ReadError> {
    let file = bytes(path, watch)?;
    let other = buffer.map(|path| bytes(path, watch)).transpose()?;
    of_bytes(&file, other.as_deref(), watch)
}

/// As [`read`], of bytes.
fn of_bytes(file: &[u8], buffer: Option<&[u8]>, watch: &Watch<'_>) -> Result<Contents, ReadError> {
    let contents = match format(file)? {
        Format::Obj => obj::read(file, watch),
        Format::Gltf => gltf::read(file, buffer, false, watch),
        Format::Glb => gltf::read(file, buffer, true, watch),
    }?;
    if contents.mesh.triangles.is_empty() {
        return Err(ReadError::bad("it has no triangles"));
    }
    Ok(contents)
}

/// Looks through a file without making a mesh of it.
pub(super) fn check(path: &Path, buffer: Option<&Path>) -> Result<(), ReadError> {
    let watch = Watch::never();
    let file = bytes(path, &watch)?;
    let other = buffer.map(|path| bytes(path, &watch)).transpose()?;
    match format(&file)? {
        Format::Obj => obj::check(&file),
        Format::Gltf => gltf::check(&file, other.as_deref(), false),
        Format::Glb => gltf::check(&file, other.as_deref(), true),
    }
}

/// The number of a part by its name, which is listed if it is new.
fn part(
    names: &mut Vec<String>,
    known: &mut std::collections::HashMap<String, u16>,
    name: &str,
) -> Result<u16, ReadError> {
    if let Some(number) = known.get(name) {
        return Ok(*number);
    }
    let number = u16::try_from(names.len()).ok().filter(|_| names.len() < MOST_PARTS);
    let number = number.ok_or_else(|| ReadError::TooLarge(format!("it has more than {MOST_PARTS} parts")))?;
    names.push(name.into());
    known.insert(name.into(), number);
    Ok(number)
}

/// Corners of triangles as they are found in a file; what not all of them have is left out at the end.
#[derive(Default)]
struct Surface {
    mesh: Mesh,
    bare_uvs: bool,
    bare_normals: bool,
}

impl Surface {
    /// Adds a triangle.
    fn add(
        &mut self,
        corners: [u32; 3],
        (part, polygon): (u16, u32),
        uvs: Option<[Vec2; 3]>,
        normals: Option<[Vec3; 3]>,
    ) {
        self.mesh.triangles.push(corners);
        self.mesh.parts.push(part);
        self.mesh.polygons.push(polygon);
        self.bare_uvs |= uvs.is_none();
        self.bare_normals |= normals.is_none();
        self.mesh.uvs.push(uvs.unwrap_or_default());
        self.mesh.normals.push(normals.unwrap_or_default());
    }

    fn done(mut self, watch: &Watch<'_>) -> Mesh {
        let unit = |n: &Vec3| n.is_finite() && n.length_squared() > 1e-12;
        if self.bare_uvs || watch.over(&self.mesh.uvs).flatten().any(|uv| !uv.is_finite()) {
            self.mesh.uvs = Vec::new();
        }
        if self.bare_normals || !watch.over(&self.mesh.normals).flatten().all(unit) {
            self.mesh.normals = Vec::new();
        }
        watch.over(&mut self.mesh.normals).flatten().for_each(|n| *n = n.normalize());
        // Polygons matter only where some have several triangles.
        if self.mesh.polygons.windows(2).all(|pair| pair[0] != pair[1]) {
            self.mesh.polygons = Vec::new();
        }
        self.mesh
    }
}

/// A vector in double precision.
fn wide(p: Vec3) -> DVec3 {
    p.as_dvec3()
}

#[cfg(test)]
mod tests;
