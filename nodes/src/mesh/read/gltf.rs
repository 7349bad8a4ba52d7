//! glTF and GLB: `gltf-json` parses the document, [`views`](super::views) reads the numbers.
//!
//! Pictures and other files that a document names are never opened. Animations, skins, cameras and lights are ignored.
use super::extensions::{self, Extensions, Instances, Textures, UvTransform};
use super::transform::transform;
use super::views::{Buffers, Numbers, fault};
use super::{Contents, MOST_TRIANGLES, MOST_VERTICES, Names, ReadError, Surface};
use glam::{DMat3, DMat4, DQuat, DVec3, Vec2, Vec3};
use gltf_json::accessor::Type;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked;
use gltf_json::{Node, Root};
use shibo_kernel::ground::stop::Watch;
use shibo_picture::caught;
use std::collections::BTreeSet;

/// Maximum depth of nested nodes.
const DEEPEST: usize = 64;
/// Maximum number of JSON objects, and of bytes outside of strings, in a document: parsed they take much more memory
/// than in the file.
const MOST_OBJECTS: usize = 200_000;
const MOST_STRUCTURE: usize = 32 << 20;

/// The document and the binary part of a GLB.
fn chunks(file: &[u8]) -> Result<(&[u8], Option<&[u8]>), ReadError> {
    let word = |at: usize| file.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let truncated = || ReadError::bad("it is truncated");
    let (version, length) = (word(4).ok_or_else(truncated)?, word(8).ok_or_else(truncated)? as usize);
    if version != 2 {
        return Err(ReadError::Bad(format!("it is glTF of version {version}; only version 2 is read")));
    }
    let file = file.get(..length).ok_or_else(|| {
        ReadError::Bad(format!("it should have {length} bytes, and there are {}: it is truncated", file.len()))
    })?;
    let (mut document, mut packed, mut at) = (None, None, 12);
    while at + 8 <= file.len() {
        let (Some(length), Some(kind)) = (word(at), word(at + 4)) else { break };
        let chunk = file.get(at + 8..).and_then(|rest| rest.get(..length as usize)).ok_or_else(truncated)?;
        match kind {
            0x4E4F_534A => document = document.or(Some(chunk)),
            0x004E_4942 => packed = packed.or(Some(chunk)),
            _ => {}
        }
        // Chunks start at multiples of 4.
        at += 8 + (length as usize).next_multiple_of(4);
    }
    Ok((document.ok_or_else(|| ReadError::bad("it has no JSON"))?, packed))
}

/// Refuses documents that would take far more memory than their length.
fn measured(json: &[u8]) -> Result<(), ReadError> {
    let (mut objects, mut structure, mut text, mut escaped) = (0, 0, false, false);
    for byte in json {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if text => escaped = true,
            b'"' => text = !text,
            _ if text => {}
            b'{' => objects += 1,
            _ => structure += 1,
        }
    }
    if objects > MOST_OBJECTS || structure > MOST_STRUCTURE {
        let message = format!("its document has more than {MOST_OBJECTS} objects or {} MiB", MOST_STRUCTURE >> 20);
        return Err(ReadError::TooLarge(message));
    }
    Ok(())
}

fn document(json: &[u8]) -> Result<Root, ReadError> {
    measured(json)?;
    let root = caught(|| Root::from_slice(json)).ok_or_else(|| ReadError::bad("its document cannot be read"))?;
    let root = root.map_err(|error| ReadError::Bad(format!("its document is no glTF: {error}")))?;
    extensions::supported(&root)?;
    Ok(root)
}

/// A mesh and the transform of its node.
struct Placed {
    node: usize,
    mesh: usize,
    matrix: DMat4,
}

fn matrix(node: &Node) -> DMat4 {
    if let Some(columns) = &node.matrix {
        return DMat4::from_cols_array(&columns.map(f64::from));
    }
    let three =
        |v: Option<[f32; 3]>, otherwise: f64| v.map_or(DVec3::splat(otherwise), |v| Vec3::from_array(v).as_dvec3());
    let turn = node.rotation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(f64::from)));
    transform(three(node.scale, 1.0), turn, three(node.translation, 0.0))
}

/// The meshes of the default scene.
fn placed(root: &Root) -> Result<Vec<Placed>, ReadError> {
    let all = root.nodes.len();
    let children = |node: &Node| -> Vec<usize> { node.children.iter().flatten().map(|n| n.value()).collect() };
    let first: Vec<usize> = match (root.scene.map(|n| n.value()), root.scenes.first()) {
        (Some(n), _) => {
            let scene = root.scenes.get(n).ok_or_else(|| fault("scene", &format!("there is no scene {n}")))?;
            scene.nodes.iter().map(|n| n.value()).collect()
        }
        (None, Some(scene)) => scene.nodes.iter().map(|n| n.value()).collect(),
        (None, None) => {
            let inner: BTreeSet<usize> = root.nodes.iter().flat_map(children).collect();
            (0..all).filter(|n| !inner.contains(n)).collect()
        }
    };
    let mut open: Vec<(usize, DMat4, usize)> = first.into_iter().rev().map(|n| (n, DMat4::IDENTITY, 0)).collect();
    let mut seen = vec![false; all];
    let mut found = Vec::new();
    while let Some((n, outer, depth)) = open.pop() {
        let at = format!("nodes[{n}]");
        let node = root.nodes.get(n).ok_or_else(|| fault(&at, &format!("there are only {all} nodes")))?;
        if std::mem::replace(&mut seen[n], true) {
            return Err(fault(&at, "it lies within itself, or in two others"));
        }
        if depth > DEEPEST {
            return Err(fault(&at, &format!("nodes are nested more than {DEEPEST} deep")));
        }
        let matrix = outer * matrix(node);
        if let Some(mesh) = node.mesh {
            found.push(Placed { node: n, mesh: mesh.value(), matrix });
        }
        open.extend(children(node).into_iter().rev().map(|child| (child, matrix, depth + 1)));
    }
    Ok(found)
}

/// The attributes of a primitive.
struct Attributes<'a> {
    positions: Numbers<'a>,
    normals: Option<Numbers<'a>>,
    uvs: Option<Numbers<'a>>,
    indices: Option<Numbers<'a>>,
    mode: Mode,
    /// Number of corners: of indices, or of vertices without indices.
    corners: usize,
}

/// The attributes of a primitive; `None` for points and lines.
fn attributes<'a>(
    buffers: &'a Buffers<'_>,
    primitive: &Primitive,
    uv_set: u32,
    at: &str,
) -> Result<Option<Attributes<'a>>, ReadError> {
    let Checked::Valid(mode) = primitive.mode else { return Err(fault(at, "its mode is unknown")) };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let find = |semantic: Semantic, name: &str, ty: Type| {
        let accessor = primitive.attributes.get(&Checked::Valid(semantic));
        accessor.map(|n| buffers.numbers(n.value(), ty, &format!("{at}.attributes.{name}"))).transpose()
    };
    let positions = find(Semantic::Positions, "POSITION", Type::Vec3)?;
    let Some(positions) = positions else { return Err(fault(at, "it has no positions")) };
    let uv_name = format!("TEXCOORD_{uv_set}");
    let (normals, uvs) =
        (find(Semantic::Normals, "NORMAL", Type::Vec3)?, find(Semantic::TexCoords(uv_set), &uv_name, Type::Vec2)?);
    for (numbers, name) in [(&normals, "NORMAL"), (&uvs, uv_name.as_str())] {
        if let Some(numbers) = numbers.as_ref().filter(|numbers| numbers.count < positions.count) {
            let what = format!("it has {} elements for {} positions", numbers.count, positions.count);
            return Err(fault(&format!("{at}.attributes.{name}"), &what));
        }
    }
    let at = format!("{at}.indices");
    let indices = primitive.indices.map(|n| buffers.numbers(n.value(), Type::Scalar, &at)).transpose()?;
    let corners = indices.as_ref().map_or(positions.count, |indices| indices.count);
    if let Some(indices) = &indices {
        let wrong = (0..corners).filter(|n| indices.index(*n).is_none_or(|v| v as usize >= positions.count)).count();
        if wrong > 0 {
            let what = format!("{wrong} of {corners} indices lie beyond the {} positions", positions.count);
            return Err(fault(&at, &what));
        }
    }
    Ok(Some(Attributes { positions, normals, uvs, indices, mode, corners }))
}

impl Attributes<'_> {
    fn triangles(&self) -> usize {
        if self.mode == Mode::Triangles { self.corners / 3 } else { self.corners.saturating_sub(2) }
    }
}

/// Counters for checking the limits while a file is scanned.
#[derive(Default)]
struct Counted {
    triangles: usize,
    vertices: usize,
    left_out: bool,
    /// The sets of UVs in the file.
    uv_sets: BTreeSet<u32>,
}

impl Counted {
    fn add(&mut self, of: &Attributes<'_>, instances: usize) -> Result<(), ReadError> {
        let more = |sum: usize, each: usize| each.saturating_mul(instances).saturating_add(sum);
        (self.triangles, self.vertices) =
            (more(self.triangles, of.triangles()), more(self.vertices, of.positions.count));
        if self.triangles > MOST_TRIANGLES || self.vertices > MOST_VERTICES {
            let message = format!("it has more than {MOST_TRIANGLES} triangles or {MOST_VERTICES} vertices");
            return Err(ReadError::TooLarge(message));
        }
        Ok(())
    }

    /// Refuses a set of UVs that no triangle has; for the default set 0 returns a note instead.
    fn has_uvs(&self, uv_set: u32) -> Result<Option<String>, ReadError> {
        if self.uv_sets.contains(&uv_set) {
            return Ok(None);
        }
        let sets = self.uv_sets.iter().take(8).map(|set| format!("`uv_set: {set}`")).collect::<Vec<_>>().join(", ");
        match uv_set {
            0 if sets.is_empty() => Ok(None),
            0 => Ok(Some(format!("it has no UVs of set 0; others are there: {sets}"))),
            _ if sets.is_empty() => {
                Err(ReadError::NoUvs(format!("it has no UVs; those of set {uv_set} are asked for")))
            }
            _ => Err(ReadError::NoUvs(format!("it has no UVs of set {uv_set}; take {sets}"))),
        }
    }
}

/// Calls `body` for each primitive of triangles, with its node and mesh, its matrix, the primitive and its attributes.
fn each(
    (root, extensions): (&Root, &Extensions),
    buffers: &Buffers<'_>,
    uv_set: u32,
    mut body: impl FnMut(&Placed, &Instances<'_>, &Primitive, &Attributes<'_>) -> Result<(), ReadError>,
) -> Result<Counted, ReadError> {
    let mut counted = Counted::default();
    for placed in placed(root)? {
        let n = placed.mesh;
        let mesh = root.meshes.get(n);
        let mesh =
            mesh.ok_or_else(|| fault(&format!("nodes[{}].mesh", placed.node), &format!("there is no mesh {n}")))?;
        let instances = extensions.instances(buffers, placed.node)?;
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{n}].primitives[{k}]");
            let Some(attributes) = attributes(buffers, primitive, uv_set, &at)? else {
                counted.left_out = true;
                continue;
            };
            counted.add(&attributes, instances.count)?;
            counted.uv_sets.extend(primitive.attributes.keys().filter_map(|semantic| match semantic {
                Checked::Valid(Semantic::TexCoords(set)) => Some(*set),
                _ => None,
            }));
            if attributes.triangles() > 0 {
                body(&placed, &instances, primitive, &attributes)?;
            }
        }
    }
    Ok(counted)
}

/// Parses a file: the document, its extensions, and the binary part of a GLB.
fn open(file: &[u8], packed: bool) -> Result<(Root, Extensions, Option<&[u8]>), ReadError> {
    let (json, binary) = if packed { chunks(file)? } else { (file, None) };
    Ok((document(json)?, Extensions::of(json)?, binary))
}

/// Checks a file.
pub(super) fn check(file: &[u8], beside: Option<&[u8]>, packed: bool, uv_set: u32) -> Result<(), ReadError> {
    let (root, extensions, binary) = open(file, packed)?;
    let buffers = Buffers::new(&root, binary, beside)?;
    let counted = each((&root, &extensions), &buffers, uv_set, |_, _, _, _| Ok(()))?;
    if counted.triangles == 0 {
        return Err(ReadError::bad("it has no triangles"));
    }
    counted.has_uvs(uv_set).map(drop)
}

/// Reads a file.
pub(super) fn read(
    file: &[u8],
    beside: Option<&[u8]>,
    packed: bool,
    uv_set: u32,
    watch: &Watch<'_>,
) -> Result<Contents, ReadError> {
    let (root, extensions, binary) = open(file, packed)?;
    let (buffers, root_and) = (Buffers::new(&root, binary, beside)?, (&root, &extensions));
    let mut textures = Textures::new(&extensions, uv_set);
    if !textures.is_plain() {
        each(root_and, &buffers, uv_set, |_, _, primitive, attributes| {
            let material = primitive.material.map(|n| n.value());
            let uvs =
                attributes.uvs.iter().flat_map(|uvs| (0..attributes.positions.count).map(move |n| uvs.vector::<2>(n)));
            watch.over(uvs).for_each(|uv| textures.look(material, Vec2::from_array(uv)));
            Ok(())
        })?;
    }
    let material = |n: usize| root.materials.get(n).and_then(|material| material.name.as_deref());
    let mut surface = Surface::default();
    let mut names = Names::default();
    let counted = each(root_and, &buffers, uv_set, |placed, instances, primitive, attributes| {
        let n = primitive.material.map(|n| n.value());
        let parts =
            [root.nodes[placed.node].name.as_deref(), root.meshes[placed.mesh].name.as_deref(), n.and_then(material)];
        let parts: Vec<&str> = parts.into_iter().flatten().filter(|name| !name.is_empty()).collect();
        let name = if parts.is_empty() { format!("mesh {}", placed.mesh) } else { parts.join("/") };
        let set = Set { part: names.part(&name)?, texture: textures.transform(n), of: attributes };
        for instance in 0..instances.count {
            set.add(&mut surface, placed.matrix * instances.matrix(instance), watch);
        }
        Ok(())
    })?;
    let left = [
        (counted.left_out, "points and lines"),
        (!root.animations.is_empty(), "animations"),
        (!root.skins.is_empty(), "skins"),
        (root.meshes.iter().any(|mesh| mesh.primitives.iter().any(|p| p.targets.is_some())), "morph targets"),
    ];
    let left_out = left.iter().filter(|(found, _)| *found).map(|(_, name)| (*name).to_owned());
    let left_out = left_out.chain(extensions::left_out(&root)).collect();
    let mut notes = textures.notes(|n| material(n).map_or_else(|| format!("material {n}"), str::to_owned));
    notes.extend(counted.has_uvs(uv_set)?);
    let (mesh, note) = surface.done(names);
    notes.extend(note);
    Ok(Contents { mesh, metres: true, left_out, notes })
}

/// A primitive of triangles.
struct Set<'a> {
    part: u16,
    texture: Option<UvTransform>,
    of: &'a Attributes<'a>,
}

impl Set<'_> {
    /// Adds the triangles, transformed by `matrix`.
    fn add(&self, surface: &mut Surface, matrix: DMat4, watch: &Watch<'_>) {
        let of = self.of;
        let first = u32::try_from(surface.mesh.positions.len()).unwrap_or(u32::MAX);
        let place = |n: usize| matrix.transform_point3(Vec3::from_array(of.positions.vector(n)).as_dvec3()).as_vec3();
        surface.mesh.positions.extend(watch.over(0..of.positions.count).map(place));
        let linear = DMat3::from_mat4(matrix);
        let mirrored = linear.determinant() < 0.0;
        // Normals transform by the inverse transpose; its scale does not matter.
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * if mirrored { -1.0 } else { 1.0 };
        let normal = |numbers: &Numbers<'_>, v: u32| {
            (cofactors * Vec3::from_array(numbers.vector(v as usize)).as_dvec3()).normalize_or_zero().as_vec3()
        };
        let uv = |numbers: &Numbers<'_>, v: u32| {
            let uv = Vec2::from_array(numbers.vector(v as usize));
            self.texture.map_or(uv, |texture| texture.at(uv))
        };
        let index = |n: usize| match &of.indices {
            Some(indices) => indices.index(n).unwrap_or(0),
            None => u32::try_from(n).unwrap_or(0),
        };
        for n in watch.over(0..of.triangles()) {
            let mut corners = match of.mode {
                Mode::TriangleStrip if n % 2 == 1 => [n + 1, n, n + 2],
                Mode::TriangleStrip => [n, n + 1, n + 2],
                Mode::TriangleFan => [0, n + 1, n + 2],
                _ => [3 * n, 3 * n + 1, 3 * n + 2],
            }
            .map(index);
            if mirrored {
                corners.swap(1, 2);
            }
            let uvs = of.uvs.as_ref().map(|numbers| corners.map(|v| uv(numbers, v)));
            let normals = of.normals.as_ref().map(|numbers| corners.map(|v| normal(numbers, v))).unwrap_or_default();
            let polygon = u32::try_from(surface.mesh.triangles.len()).unwrap_or(0);
            surface.add(corners.map(|v| first + v), (self.part, polygon), uvs, normals);
        }
    }
}
