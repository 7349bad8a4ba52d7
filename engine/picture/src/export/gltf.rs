//! Materials as glTF 2.0: the list of textures, and the document that refers to them.
//!
//! Roughness, metallic and occlusion share one texture, as the format requires. A constant channel becomes a factor.
//! Extensions are named only where the material has their channels.
use super::colors::Colors;
use super::directions::{elongated, vectors};
use crate::value::{Channel, Field, Material, Type};
use crate::{Depth, Format, Transfer};
use serde_json::{Map, Value as Json, json};

/// The role of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    BaseColor,
    /// Occlusion, roughness and metallic.
    Surface,
    Normal,
    Emission,
    /// The coat and its roughness.
    Coat,
    CoatNormal,
    Sheen,
    Anisotropy,
    Specular,
}

impl Role {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::BaseColor => "base_color",
            Self::Surface => "occlusion_roughness_metallic",
            Self::Normal => "normal",
            Self::Emission => "emission",
            Self::Coat => "coat",
            Self::CoatNormal => "coat_normal",
            Self::Sheen => "sheen",
            Self::Anisotropy => "anisotropy",
            Self::Specular => "specular",
        }
    }
}

/// A texture of an exported material.
#[derive(Clone, Debug)]
pub struct Texture {
    pub(super) role: Role,
    /// The fields whose channels it holds, one after another.
    pub fields: Vec<Field>,
    /// PNG or JPEG.
    pub format: Format,
    /// Its sample type.
    pub depth: Depth,
    /// The transfer curve of its colours.
    pub transfer: Transfer,
}

impl Texture {
    /// Number of its channels.
    pub fn channels(&self) -> usize {
        self.fields.iter().map(Field::channels).sum()
    }

    /// Its MIME type.
    pub(super) const fn mime(&self) -> &'static str {
        if matches!(self.format, Format::Jpeg(_)) { "image/jpeg" } else { "image/png" }
    }

    /// Its name in the file.
    pub const fn name(&self) -> &'static str {
        self.role.name()
    }
}

/// A material in the terms of glTF.
#[derive(Clone, Debug)]
pub struct Exported {
    material: Material,
    /// Its textures, in the order of the file.
    pub textures: Vec<Texture>,
    /// Prefix of its file names, if it is written as several files.
    pub apart: Option<String>,
}

/// The channels that glTF cannot express, besides the height.
const LOST: [Channel; 1] = [Channel::Subsurface];

impl Exported {
    /// Lists the textures that a material needs: in one file, or in files whose names begin with `apart`.
    pub(super) fn new(material: Material, colors: Colors, apart: Option<String>) -> Self {
        let mut exported = Self { material, textures: Vec::new(), apart };
        exported.plan(colors);
        exported
    }

    /// The names of the files, if there are several.
    pub fn files(&self) -> impl Iterator<Item = String> {
        let documents = |stem: &String| [format!("{stem}.gltf"), format!("{stem}.bin")];
        let textures = self.textures.iter().filter_map(|texture| self.file(texture));
        self.apart.iter().flat_map(documents).chain(textures)
    }

    /// Name of the file of a texture, if the texture has its own.
    pub(super) fn file(&self, texture: &Texture) -> Option<String> {
        self.apart.as_ref().map(|stem| format!("{stem}_{}.{}", texture.name(), texture.format.extension()))
    }

    /// The channels that the file cannot express.
    pub fn lost(&self) -> Vec<Channel> {
        let varies = |channel: &Channel| self.material.get(*channel).is_some_and(|f| f.as_constant().is_none());
        let lost = LOST.into_iter().filter(|channel| self.has(*channel));
        lost.chain([Channel::Ior].into_iter().filter(varies)).collect()
    }

    fn has(&self, channel: Channel) -> bool {
        self.material.get(channel).is_some()
    }

    /// True if any of the channels varies over the canvas.
    fn varies(&self, channels: &[Channel]) -> bool {
        channels.iter().any(|c| self.material.get(*c).is_some_and(|field| field.as_constant().is_none()))
    }

    /// The constant value of a channel, or its default if the material lacks it.
    fn factor(&self, channel: Channel) -> Vec<f64> {
        let field = self.material.or_default(channel);
        let values = field.as_constant().unwrap_or(channel.default_values());
        values.iter().map(|value| f64::from(*value)).collect()
    }

    fn plan(&mut self, colors: Colors) {
        let of = |channel: Channel| self.material.or_default(channel);
        let gray = |value: f32| Field::constant(Type::Gray, &[value]);
        let mut textures = Vec::new();
        let mut add = |role, fields: Vec<Field>, depth, transfer| {
            let format = match role {
                // JPEG cannot hold opacity.
                Role::BaseColor | Role::Emission if fields.len() == 1 => colors.format(),
                _ => Format::Png,
            };
            textures.push(Texture { role, fields, format, depth, transfer });
        };
        if self.varies(&[Channel::BaseColor, Channel::Opacity]) {
            let opacity = self.has(Channel::Opacity).then(|| of(Channel::Opacity));
            let fields = [of(Channel::BaseColor)].into_iter().chain(opacity).collect();
            add(Role::BaseColor, fields, Depth::U8, Transfer::Srgb);
        }
        if self.varies(&[Channel::Ao, Channel::Roughness, Channel::Metallic]) {
            let fields = [Channel::Ao, Channel::Roughness, Channel::Metallic].map(of).to_vec();
            add(Role::Surface, fields, Depth::U8, Transfer::Raw);
        }
        if self.varies(&[Channel::Normal]) {
            add(Role::Normal, vec![of(Channel::Normal)], Depth::U16, Transfer::Raw);
        }
        if self.varies(&[Channel::Emission]) {
            add(Role::Emission, vec![of(Channel::Emission)], Depth::U8, Transfer::Srgb);
        }
        if self.varies(&[Channel::Coat, Channel::CoatRoughness]) {
            let fields = vec![of(Channel::Coat), of(Channel::CoatRoughness), gray(0.0)];
            add(Role::Coat, fields, Depth::U8, Transfer::Raw);
        }
        if self.varies(&[Channel::CoatNormal]) && self.has(Channel::Coat) {
            add(Role::CoatNormal, vec![of(Channel::CoatNormal)], Depth::U16, Transfer::Raw);
        }
        if self.varies(&[Channel::Sheen]) {
            let sheen = of(Channel::Sheen);
            add(Role::Sheen, vec![sheen.clone(), sheen.clone(), sheen], Depth::U8, Transfer::Srgb);
        }
        if self.varies(&[Channel::Anisotropy, Channel::AnisotropyAngle]) {
            let fields = vec![vectors(&of(Channel::AnisotropyAngle), &of(Channel::Anisotropy))];
            add(Role::Anisotropy, fields, Depth::U8, Transfer::Raw);
        }
        if self.varies(&[Channel::Specular]) {
            let fields = vec![gray(1.0), gray(1.0), gray(1.0), of(Channel::Specular)];
            add(Role::Specular, fields, Depth::U8, Transfer::Raw);
        }
        self.textures = textures;
    }

    /// Index of a texture.
    fn index(&self, role: Role) -> Option<usize> {
        self.textures.iter().position(|texture| texture.role == role)
    }

    /// The material as glTF JSON. `transform` is added to each use of a texture.
    pub(super) fn json(&self, name: &str, transform: Option<&Json>) -> Json {
        let texture = |role: Role| {
            self.index(role).map(|index| match transform {
                Some(transform) => json!({ "index": index, "extensions": { "KHR_texture_transform": transform } }),
                None => json!({ "index": index }),
            })
        };
        let mut material = Map::new();
        material.insert("name".into(), json!(name));
        material.insert("pbrMetallicRoughness".into(), self.base(&texture));
        if let Some(normal) = texture(Role::Normal) {
            material.insert("normalTexture".into(), normal);
        }
        if let Some(surface) = texture(Role::Surface).filter(|_| self.varies(&[Channel::Ao])) {
            material.insert("occlusionTexture".into(), surface);
        }
        if self.has(Channel::Emission) {
            match texture(Role::Emission) {
                Some(texture) => {
                    material.insert("emissiveTexture".into(), texture);
                    material.insert("emissiveFactor".into(), json!([1.0, 1.0, 1.0]));
                }
                None => {
                    let limited: Vec<f64> = self.factor(Channel::Emission).iter().map(|v| v.clamp(0.0, 1.0)).collect();
                    material.insert("emissiveFactor".into(), json!(limited));
                }
            }
        }
        if self.has(Channel::Opacity) {
            material.insert("alphaMode".into(), json!("BLEND"));
        }
        let extensions = self.extensions(&texture);
        if !extensions.is_empty() {
            material.insert("extensions".into(), Json::Object(extensions));
        }
        Json::Object(material)
    }

    fn base(&self, texture: &impl Fn(Role) -> Option<Json>) -> Json {
        let mut base = Map::new();
        match texture(Role::BaseColor) {
            Some(texture) => drop(base.insert("baseColorTexture".into(), texture)),
            None => {
                let color = self.factor(Channel::BaseColor).into_iter().chain(self.factor(Channel::Opacity));
                let color: Vec<f64> = color.map(|v| v.clamp(0.0, 1.0)).collect();
                base.insert("baseColorFactor".into(), json!(color));
            }
        }
        match texture(Role::Surface) {
            Some(texture) => {
                base.insert("metallicRoughnessTexture".into(), texture);
                // A material without the channel is not a metal; the default of the format is 1.
                let metallic = if self.has(Channel::Metallic) { 1.0 } else { 0.0 };
                base.insert("metallicFactor".into(), json!(metallic));
            }
            None => {
                base.insert("metallicFactor".into(), json!(self.factor(Channel::Metallic)[0].clamp(0.0, 1.0)));
                base.insert("roughnessFactor".into(), json!(self.factor(Channel::Roughness)[0].clamp(0.0, 1.0)));
            }
        }
        Json::Object(base)
    }

    fn extensions(&self, texture: &impl Fn(Role) -> Option<Json>) -> Map<String, Json> {
        let mut extensions = Map::new();
        let unit = |channel| self.factor(channel)[0].clamp(0.0, 1.0);
        if self.has(Channel::Coat) {
            let mut coat = match texture(Role::Coat) {
                Some(texture) => json!({
                    "clearcoatFactor": 1.0, "clearcoatTexture": texture,
                    "clearcoatRoughnessFactor": 1.0, "clearcoatRoughnessTexture": texture,
                }),
                None => json!({
                    "clearcoatFactor": unit(Channel::Coat), "clearcoatRoughnessFactor": unit(Channel::CoatRoughness),
                }),
            };
            if let Some(normal) = texture(Role::CoatNormal) {
                coat["clearcoatNormalTexture"] = normal;
            }
            extensions.insert("KHR_materials_clearcoat".into(), coat);
        }
        if self.has(Channel::Sheen) {
            let sheen = match texture(Role::Sheen) {
                Some(texture) => json!({ "sheenColorFactor": [1.0, 1.0, 1.0], "sheenColorTexture": texture,
                    "sheenRoughnessFactor": 0.5 }),
                None => json!({ "sheenColorFactor": vec![unit(Channel::Sheen); 3], "sheenRoughnessFactor": 0.5 }),
            };
            extensions.insert("KHR_materials_sheen".into(), sheen);
        }
        if self.has(Channel::Anisotropy) {
            let angle = elongated(self.factor(Channel::AnisotropyAngle)[0]).to_radians();
            let anisotropy = match texture(Role::Anisotropy) {
                Some(texture) => json!({ "anisotropyStrength": 1.0, "anisotropyTexture": texture }),
                None => json!({ "anisotropyStrength": unit(Channel::Anisotropy), "anisotropyRotation": angle }),
            };
            extensions.insert("KHR_materials_anisotropy".into(), anisotropy);
        }
        if self.has(Channel::Ior) {
            extensions.insert("KHR_materials_ior".into(), json!({ "ior": self.factor(Channel::Ior)[0].max(1.0) }));
        }
        if self.has(Channel::Specular) {
            let specular = match texture(Role::Specular) {
                Some(texture) => json!({ "specularFactor": 1.0, "specularTexture": texture }),
                None => json!({ "specularFactor": unit(Channel::Specular) }),
            };
            extensions.insert("KHR_materials_specular".into(), specular);
        }
        extensions
    }
}
