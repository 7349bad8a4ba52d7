//! Extensions of glTF that affect meshes: instances of a mesh, and transforms of its textures.
//!
//! `gltf-json` ignores extensions, so the document is parsed a second time for them.
use super::transform::transform;
use super::views::{Buffers, Numbers, fault};
use super::{MOST_TRIANGLES, ReadError};
use glam::{DMat4, DQuat, DVec2, DVec3, Vec2, Vec3};
use gltf_json::Root;
use gltf_json::accessor::Type;
use serde::Deserialize;

/// Extensions that are read, or do not affect the shape of meshes.
const KNOWN: [&str; 10] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
    "MSFT_packing_",
    "KHR_mesh_quantization",
    INSTANCES,
];
const INSTANCES: &str = "EXT_mesh_gpu_instancing";
/// Maximum number of extension names in a message, and of letters of each name.
const TOLD: usize = 8;
const LETTERS: usize = 60;

fn is_known(name: &str) -> bool {
    KNOWN.iter().any(|known| name.starts_with(known))
}

fn shown(name: &str) -> String {
    name.chars().take(LETTERS).collect()
}

/// Refuses versions other than 2.0, and required extensions that are not known.
pub(super) fn supported(root: &Root) -> Result<(), ReadError> {
    let asset = &root.asset;
    let version = |text: &str| {
        let (major, minor) = text.split_once('.').unwrap_or((text, "0"));
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    };
    if version(&asset.version).is_none_or(|(major, _)| major != 2) {
        let message = format!("it is glTF of version {}; only version 2 is read", shown(&asset.version));
        return Err(ReadError::Bad(message));
    }
    if let Some(least) = asset.min_version.as_ref().filter(|least| version(least).is_none_or(|v| v > (2, 0))) {
        let message = format!("it needs a reader of glTF {}; version 2.0 is read", shown(least));
        return Err(ReadError::Bad(message));
    }
    match root.extensions_required.iter().find(|name| !is_known(name)) {
        Some(name) => Err(ReadError::Bad(format!(
            "it needs `{}`, which is not read: export it without compression and extensions",
            shown(name)
        ))),
        None => Ok(()),
    }
}

/// The extensions that a document uses but that are ignored.
pub(super) fn left_out(root: &Root) -> Vec<String> {
    let mut names: Vec<&String> = root.extensions_used.iter().filter(|name| !is_known(name)).collect();
    names.sort_unstable();
    names.dedup();
    let more = names.len().saturating_sub(TOLD);
    let mut told: Vec<String> = names.iter().take(TOLD).map(|name| format!("extension `{}`", shown(name))).collect();
    if more > 0 {
        told.push(format!("{more} more extensions"));
    }
    told
}

/// The extensions of a document.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Extensions {
    nodes: Vec<OfNode>,
    materials: Vec<OfMaterial>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct OfNode {
    extensions: Option<NodeExtensions>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    instances: Option<Instancing>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Instancing {
    attributes: Placing,
}

/// Accessor indices.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "UPPERCASE")]
struct Placing {
    translation: Option<usize>,
    rotation: Option<usize>,
    scale: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct OfMaterial {
    pbr_metallic_roughness: Option<Pbr>,
    normal_texture: Option<Info>,
    occlusion_texture: Option<Info>,
    emissive_texture: Option<Info>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Pbr {
    base_color_texture: Option<Info>,
    metallic_roughness_texture: Option<Info>,
}

/// A reference to a texture, with its UV set and transform.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Info {
    #[serde(rename = "texCoord")]
    uv_set: u32,
    extensions: Option<InfoExtensions>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct InfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    transform: Option<UvTransform>,
}

/// Transform of UVs for a texture: scaled, then rotated, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default)]
pub(super) struct UvTransform {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
    #[serde(rename = "texCoord")]
    uv_set: Option<u32>,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], uv_set: None }
    }
}

impl UvTransform {
    /// Transforms a UV, v down.
    pub(super) fn at(&self, uv: Vec2) -> Vec2 {
        let p = uv.as_dvec2() * DVec2::from_array(self.scale);
        let (sin, cos) = (libm::sin(self.rotation), libm::cos(self.rotation));
        (DVec2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x) + DVec2::from_array(self.offset)).as_vec2()
    }
}

impl OfMaterial {
    /// The transforms of the textures that use a set of UVs, that of the base colour first.
    fn transforms(&self, uv_set: u32) -> Vec<UvTransform> {
        let pbr = self.pbr_metallic_roughness.as_ref();
        let infos = [
            pbr.and_then(|pbr| pbr.base_color_texture.as_ref()),
            self.normal_texture.as_ref(),
            pbr.and_then(|pbr| pbr.metallic_roughness_texture.as_ref()),
            self.occlusion_texture.as_ref(),
            self.emissive_texture.as_ref(),
        ];
        let of = |info: &Info| {
            let transform = info.extensions.as_ref().and_then(|extensions| extensions.transform).unwrap_or_default();
            let lies = transform.uv_set.unwrap_or(info.uv_set) == uv_set;
            lies.then_some(UvTransform { uv_set: None, ..transform })
        };
        infos.into_iter().flatten().filter_map(of).collect()
    }
}

/// The placements of a mesh that a node shows many times.
pub(super) struct Instances<'a> {
    translation: Option<Numbers<'a>>,
    rotation: Option<Numbers<'a>>,
    scale: Option<Numbers<'a>>,
    /// Number of instances.
    pub(super) count: usize,
}

impl Instances<'_> {
    /// The matrix of an instance relative to its node.
    pub(super) fn matrix(&self, n: usize) -> DMat4 {
        let vector = |numbers: &Option<Numbers<'_>>, otherwise: f64| {
            let given = numbers.as_ref().map(|numbers| Vec3::from_array(numbers.vector(n)).as_dvec3());
            given.unwrap_or(DVec3::splat(otherwise))
        };
        let turn = self.rotation.as_ref().map(|numbers| numbers.vector::<4>(n).map(f64::from));
        let turn = turn.map_or(DQuat::IDENTITY, DQuat::from_array);
        transform(vector(&self.scale, 1.0), turn, vector(&self.translation, 0.0))
    }
}

impl Extensions {
    /// Parses the extensions of a document that `gltf-json` could read.
    pub(super) fn of(json: &[u8]) -> Result<Self, ReadError> {
        serde_json::from_slice(json).map_err(|error| ReadError::Bad(format!("its extensions cannot be read: {error}")))
    }

    /// The placements at which a node shows its mesh.
    pub(super) fn instances<'a>(&self, buffers: &'a Buffers<'_>, node: usize) -> Result<Instances<'a>, ReadError> {
        let extensions = self.nodes.get(node).and_then(|node| node.extensions.as_ref());
        let Some(Instancing { attributes }) = extensions.and_then(|of| of.instances.as_ref()) else {
            return Ok(Instances { translation: None, rotation: None, scale: None, count: 1 });
        };
        let at = format!("nodes[{node}].extensions.{INSTANCES}.attributes");
        let find = |n: Option<usize>, name: &str, ty: Type| {
            n.map(|n| buffers.numbers(n, ty, &format!("{at}.{name}"))).transpose()
        };
        let translation = find(attributes.translation, "TRANSLATION", Type::Vec3)?;
        let rotation = find(attributes.rotation, "ROTATION", Type::Vec4)?;
        let scale = find(attributes.scale, "SCALE", Type::Vec3)?;
        let counts: Vec<usize> = [&translation, &rotation, &scale].into_iter().flatten().map(|n| n.count).collect();
        let Some(count) = counts.first().copied() else { return Err(fault(&at, "they must place the instances")) };
        if counts.iter().any(|other| *other != count) {
            return Err(fault(&at, &format!("they have different numbers of elements: {counts:?}")));
        }
        if count > MOST_TRIANGLES {
            return Err(ReadError::TooLarge(format!("{at}: more than {MOST_TRIANGLES} instances")));
        }
        Ok(Instances { translation, rotation, scale, count })
    }
}

/// The UV transforms of all materials.
pub(super) struct Textures {
    of: Vec<Texture>,
}

struct Texture {
    transform: UvTransform,
    /// True if another texture of the material has another transform.
    differ: bool,
    /// True if all UVs lie in the unit square: before the transform, and after it.
    inside: [bool; 2],
}

/// Tolerance for UVs outside of the unit square.
const SLACK: f32 = 1e-4;

impl Textures {
    /// The transforms for a set of UVs.
    pub(super) fn new(extensions: &Extensions, uv_set: u32) -> Self {
        let of = |material: &OfMaterial| {
            let all = material.transforms(uv_set);
            let transform = all.first().copied().unwrap_or_default();
            Texture { transform, differ: all.iter().any(|other| *other != transform), inside: [true; 2] }
        };
        Self { of: extensions.materials.iter().map(of).collect() }
    }

    /// True if no material has a transform.
    pub(super) fn is_plain(&self) -> bool {
        self.of.iter().all(|texture| texture.transform == UvTransform::default())
    }

    /// Records whether a UV of a material lies in the unit square.
    pub(super) fn look(&mut self, material: Option<usize>, uv: Vec2) {
        let Some(n) = material else { return };
        if let Some(texture) = self.of.get_mut(n).filter(|texture| texture.transform != UvTransform::default()) {
            let inside = |uv: Vec2| uv.cmpge(Vec2::splat(-SLACK)).all() && uv.cmple(Vec2::splat(1.0 + SLACK)).all();
            texture.inside[0] &= inside(uv);
            texture.inside[1] &= inside(texture.transform.at(uv));
        }
    }

    /// The transform for the UVs of a material, if one is to be applied. A transform that only repeats the texture over
    /// UVs within the unit square is not applied.
    pub(super) fn transform(&self, material: Option<usize>) -> Option<UvTransform> {
        let texture = material.and_then(|n| self.of.get(n))?;
        (texture.transform != UvTransform::default() && texture.inside != [true, false]).then_some(texture.transform)
    }

    /// Notes about the transforms; `name` gives the name of a material.
    pub(super) fn notes(&self, name: impl Fn(usize) -> String) -> Vec<String> {
        let (mut repeat, mut differ) = (Vec::new(), Vec::new());
        for (n, texture) in self.of.iter().enumerate() {
            if texture.transform != UvTransform::default() && texture.inside == [true, false] {
                repeat.push(n);
            }
            if texture.differ && self.transform(Some(n)).is_some() {
                differ.push(n);
            }
        }
        let told = |some: &[usize], what: &str| {
            let names: Vec<String> = some.iter().take(TOLD).map(|n| format!("`{}`", shown(&name(*n)))).collect();
            (!names.is_empty()).then(|| format!("{what} of {}", names.join(", ")))
        };
        let repeat = told(&repeat, "UVs are taken as if textures did not repeat (`KHR_texture_transform`)");
        let differ = told(&differ, "textures lie differently on the mesh, and the first is taken");
        repeat.into_iter().chain(differ).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uvs_are_scaled_then_turned_then_moved() {
        let transform: UvTransform =
            serde_json::from_str(r#"{"offset": [0.5, 0.25], "rotation": 1.5707963267948966, "scale": [0.5, 2]}"#)
                .unwrap();
        // As the specification of the extension says: a quarter turn takes u to -v and v to u.
        assert!(transform.at(Vec2::X).distance(Vec2::new(0.5, -0.25)) < 1e-6);
        assert!(transform.at(Vec2::Y).distance(Vec2::new(2.5, 0.25)) < 1e-6);
        assert_eq!(UvTransform::default().at(Vec2::new(0.3, 0.7)), Vec2::new(0.3, 0.7));
    }

    #[test]
    fn textures_that_repeat_keep_the_uvs_of_the_mesh() {
        let extensions = Extensions::of(
            br#"{"materials": [
                {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [4, 4]}}}},
                 "normalTexture": {"index": 1}},
                {"normalTexture": {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [0.5, 0.5]}}}},
                {"normalTexture": {"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [9, 9], "texCoord": 0}}},
                 "emissiveTexture": {"index": 0}}]}"#,
        );
        let extensions = extensions.unwrap();
        let mut textures = Textures::new(&extensions, 0);
        assert!(!textures.is_plain());
        for material in 0..3 {
            textures.look(Some(material), Vec2::ZERO);
            textures.look(Some(material), if material == 2 { Vec2::splat(2.0) } else { Vec2::ONE });
        }
        let scale = |textures: &Textures, n| textures.transform(Some(n)).map(|transform| transform.scale);
        assert_eq!([0, 1, 2].map(|n| scale(&textures, n)), [None, None, Some([9.0; 2])]);
        assert_eq!(textures.transform(None), None);
        assert_eq!(scale(&Textures::new(&extensions, 1), 1), Some([0.5; 2]));
        let notes = textures.notes(|n| format!("m{n}"));
        assert!(notes[0].ends_with("of `m0`") && notes[1].ends_with("of `m2`") && notes.len() == 2, "{notes:?}");
    }
}
