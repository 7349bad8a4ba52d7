//! GLB files: document, mesh and textures in one file; or glTF, with mesh and textures in separate files.
//!
//! The textures are written as temporary files next to the target while their rows are computed. When all are complete,
//! they are copied into the target, or get their names. So the memory needed does not grow with the textures.
use super::bundle::write_rows;
use super::gltf::{Exported, Texture};
use super::set;
use super::shape::Shape;
use crate::{AtomicFile, Compression, Encoding, PictureSpec, WriteError, WriteStats, Writer};
use glam::{UVec2, Vec3};
use serde_json::{Value as Json, json};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A glTF file under construction, with its separate files; see [`Writer`]. Dropping the writer leaves no files.
#[derive(Debug)]
pub struct GlbWriter {
    path: PathBuf,
    name: String,
    exported: Exported,
    shape: Shape,
    /// True if textures repeat beyond their edges.
    wraps: [bool; 2],
    writers: Vec<Writer>,
}

impl GlbWriter {
    /// Starts a file with textures of the given size in pixels; each pixel has the given width and height in mm.
    /// `wraps` tells in which directions the textures repeat.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn create(
        path: &Path,
        name: &str,
        (exported, shape): (Exported, Shape),
        (size, pixel_mm): (UVec2, [f32; 2]),
        wraps: [bool; 2],
        (dither, compression): (bool, Compression),
    ) -> Result<Self, WriteError> {
        let spec = |texture: &Texture| PictureSpec {
            width: size.x,
            height: size.y,
            channels: ["R", "G", "B", "A"].iter().take(texture.channels()).map(ToString::to_string).collect(),
            format: texture.format,
            depth: texture.depth,
            encoding: Encoding { transfer: texture.transfer, dither, ..Encoding::default() },
            compression,
            mips: Vec::new(),
            chromaticities: None,
            // glTF supports only square pixels.
            pixel_mm: Some(pixel_mm).filter(|[x, y]| x == y),
            metadata: Vec::new(),
        };
        let writer = |texture: &Texture| match exported.file(texture) {
            Some(file) => Writer::create(&path.with_file_name(file), &spec(texture)),
            None => Writer::create(path, &spec(texture)),
        };
        let writers = exported.textures.iter().map(writer);
        let writers = writers.collect::<Result<_, _>>()?;
        Ok(Self { path: path.to_owned(), name: name.to_owned(), exported, shape, wraps, writers })
    }

    /// Writes the next rows of all textures. `planes` holds their channels, one texture after another.
    ///
    /// # Errors
    /// As [`Writer::write_rows`].
    pub fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        write_rows(self.exported.textures.iter().map(Texture::channels).zip(&mut self.writers), planes, rows)
    }

    /// Completes the file and gives it its name, after its separate files got theirs.
    ///
    /// # Errors
    /// If rows are missing or the system refuses. As long as some files are incomplete, existing files keep their
    /// content.
    pub fn finish(self) -> Result<Vec<WriteStats>, WriteError> {
        let Self { path, name, exported, shape, wraps, writers } = self;
        let done = writers.into_iter().map(Writer::finish_unnamed).collect::<Result<Vec<_>, _>>()?;
        let (mut pictures, written): (Vec<AtomicFile>, Vec<WriteStats>) = done.into_iter().unzip();
        let sizes: Vec<u64> = written.iter().map(|written| written.bytes).collect();
        let document = Document { name: &name, exported: &exported, shape: &shape, wraps };
        let failed = |error| WriteError::at(&path, error);
        if exported.apart.is_some() {
            let [binary, text] = document.apart(&path).map_err(failed)?;
            set::commit(pictures.into_iter().chain([binary]).collect(), vec![text])?;
        } else {
            document.write(&path, &mut pictures, &sizes).map_err(failed)?;
        }
        Ok(written)
    }
}

struct Document<'a> {
    name: &'a str,
    exported: &'a Exported,
    shape: &'a Shape,
    wraps: [bool; 2],
}

/// A buffer view of the binary part, and its purpose.
struct View {
    from: u64,
    length: u64,
    /// `ARRAY_BUFFER` or `ELEMENT_ARRAY_BUFFER`; `None` for pictures.
    target: Option<u32>,
}

const ARRAY: u32 = 34962;
const INDICES: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED: u32 = 5125;
const REPEAT: u32 = 10497;
const CLAMP: u32 = 33071;

/// Rounds up to a multiple of four, the alignment of chunks and views.
const fn padded(length: u64) -> u64 {
    length.next_multiple_of(4)
}

impl Document<'_> {
    fn write(&self, path: &Path, pictures: &mut [AtomicFile], sizes: &[u64]) -> io::Result<()> {
        let mesh = self.mesh();
        let mut views = Vec::new();
        let mut end = 0;
        let sections = mesh.iter().map(|(bytes, target)| (bytes.len() as u64, Some(*target)));
        for (length, target) in sections.chain(sizes.iter().map(|size| (*size, None))) {
            views.push(View { from: end, length, target });
            end += padded(length);
        }
        let mut json = self.json(&views, end).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() as u64 + 8 + end;
        let word = |n: u64| {
            let message = "the file would have more than 4 GiB, which GLB does not allow; lower the resolution";
            u32::try_from(n).map(u32::to_le_bytes).map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, message))
        };
        let mut file = AtomicFile::create(path)?;
        let mut out = io::BufWriter::with_capacity(1 << 20, &mut file);
        out.write_all(b"glTF")?;
        for part in [word(2)?, word(total)?, word(json.len() as u64)?, *b"JSON"] {
            out.write_all(&part)?;
        }
        out.write_all(&json)?;
        out.write_all(&word(end)?)?;
        out.write_all(b"BIN\0")?;
        for (bytes, _) in &mesh {
            out.write_all(bytes)?;
            pad(&mut out, bytes.len() as u64)?;
        }
        for (picture, size) in pictures.iter_mut().zip(sizes) {
            picture.seek(SeekFrom::Start(0))?;
            if io::copy(&mut picture.take(*size), &mut out)? != *size {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            pad(&mut out, *size)?;
        }
        out.flush()?;
        drop(out);
        file.commit()
    }

    /// Writes the separate files of the mesh and of the document, complete except for their names.
    fn apart(&self, path: &Path) -> io::Result<[AtomicFile; 2]> {
        let mesh = self.mesh();
        let mut views = Vec::new();
        let mut binary = AtomicFile::create(path.with_extension("bin"))?;
        let mut out = io::BufWriter::new(&mut binary);
        let mut end = 0;
        for (bytes, target) in &mesh {
            let length = bytes.len() as u64;
            views.push(View { from: end, length, target: Some(*target) });
            out.write_all(bytes)?;
            pad(&mut out, length)?;
            end += padded(length);
        }
        out.flush()?;
        drop(out);
        let mut text = AtomicFile::create(path)?;
        text.write_all(format!("{:#}\n", self.json(&views, end)).as_bytes())?;
        Ok([binary, text])
    }

    /// Bytes of positions, normals, tangents and coordinates, then the indices of each part.
    fn mesh(&self) -> Vec<(Vec<u8>, u32)> {
        let bytes = |numbers: &[f32]| numbers.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let flat = |vectors: &[Vec3]| bytes(&vectors.iter().flat_map(|v| v.to_array()).collect::<Vec<_>>());
        let shape = self.shape;
        let tangents: Vec<f32> = shape.tangents.iter().flat_map(|v| v.to_array()).collect();
        let uvs: Vec<f32> = shape.uvs.iter().flat_map(|v| v.to_array()).collect();
        let vertices = [flat(&shape.positions), flat(&shape.normals), bytes(&tangents), bytes(&uvs)];
        let indices = shape.parts.iter().map(|part| part.indices.iter().flat_map(|i| i.to_le_bytes()).collect());
        vertices.into_iter().map(|bytes| (bytes, ARRAY)).chain(indices.map(|bytes| (bytes, INDICES))).collect()
    }

    fn json(&self, views: &[View], length: u64) -> Json {
        let (shape, count) = (self.shape, self.shape.positions.len());
        let bounds = shape.positions.iter().map(|p| [*p, *p]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let [least, greatest] = bounds.unwrap_or_default().map(|corner| corner.to_array());
        let vertices = [("VEC3", 3), ("VEC3", 3), ("VEC4", 4), ("VEC2", 2)];
        let mut accessors: Vec<Json> = vertices
            .iter()
            .enumerate()
            .map(|(view, (ty, _))| json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": ty }))
            .collect();
        accessors[0]["min"] = json!(least);
        accessors[0]["max"] = json!(greatest);
        accessors.extend(shape.parts.iter().enumerate().map(|(n, part)| {
            json!({ "bufferView": vertices.len() + n, "componentType": UNSIGNED, "count": part.indices.len(),
                "type": "SCALAR" })
        }));
        let attributes = json!({ "POSITION": 0, "NORMAL": 1, "TANGENT": 2, "TEXCOORD_0": 3 });
        let part = |(n, part): (usize, &super::shape::MeshPart)| {
            let primitive = json!({ "attributes": attributes, "indices": vertices.len() + n, "material": 0 });
            json!({ "name": part.name, "primitives": [primitive] })
        };
        let meshes: Vec<Json> = shape.parts.iter().enumerate().map(part).collect();
        let nodes: Vec<Json> =
            shape.parts.iter().enumerate().map(|(n, part)| json!({ "name": part.name, "mesh": n })).collect();
        let first_picture = vertices.len() + shape.parts.len();
        let transform = shape.repeats.map(|by| json!({ "scale": by.to_array() }));
        let material = self.exported.json(self.name, transform.as_ref());
        let used = used(&material);
        let mut document = json!({
            "asset": { "version": "2.0", "generator": concat!("Shibo ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
            "nodes": nodes,
            "meshes": meshes,
            "materials": [material],
            "accessors": accessors,
            "bufferViews": views.iter().map(view).collect::<Vec<_>>(),
            "buffers": [{ "byteLength": length }],
        });
        if let Some(stem) = &self.exported.apart {
            document["buffers"][0]["uri"] = json!(uri(&format!("{stem}.bin")));
        }
        let textures = &self.exported.textures;
        if !textures.is_empty() {
            let image = |(n, texture): (usize, &Texture)| match self.exported.file(texture) {
                Some(file) => json!({ "name": texture.name(), "uri": uri(&file) }),
                None => {
                    json!({ "name": texture.name(), "bufferView": first_picture + n, "mimeType": texture.mime() })
                }
            };
            let [s, t] = self.wraps.map(|wraps| if wraps { REPEAT } else { CLAMP });
            document["images"] = textures.iter().enumerate().map(image).collect();
            document["textures"] = (0..textures.len()).map(|n| json!({ "source": n, "sampler": 0 })).collect();
            document["samplers"] = json!([{ "magFilter": 9729, "minFilter": 9987, "wrapS": s, "wrapT": t }]);
        }
        if !used.is_empty() {
            document["extensionsUsed"] = json!(used);
        }
        document
    }
}

/// The name of a file as a relative address.
fn uri(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    name.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

fn view(view: &View) -> Json {
    let mut json = json!({ "buffer": 0, "byteOffset": view.from, "byteLength": view.length });
    if let Some(target) = view.target {
        json["target"] = json!(target);
    }
    json
}

fn pad(out: &mut impl Write, length: u64) -> io::Result<()> {
    let missing = usize::try_from(padded(length) - length).unwrap_or(0);
    out.write_all(&[0; 4][..missing])
}

/// The names of all extensions in a part of the document, each once, sorted.
fn used(part: &Json) -> Vec<String> {
    let mut names = std::collections::BTreeSet::new();
    let mut open = vec![part];
    while let Some(part) = open.pop() {
        if let Some(Json::Object(extensions)) = part.get("extensions") {
            names.extend(extensions.keys().cloned());
        }
        match part {
            Json::Object(fields) => open.extend(fields.values()),
            Json::Array(items) => open.extend(items),
            _ => {}
        }
    }
    names.into_iter().collect()
}
