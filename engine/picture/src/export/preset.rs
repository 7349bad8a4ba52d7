//! Materials as the picture set of a program, with a script that sets them up if the program runs scripts.
use super::bundle::{Bundle, ChannelSource, ExportContext, Map, Maps, Samples, samples};
use super::decl::{FieldDecl, MATERIAL, Takes, names};
use super::directions::vectors;
use super::names::quoted;
use super::network::number;
use super::target::{ExportTarget, Files, OptionValue, Options, Plan, Source, TargetInfo};
use crate::value::{Channel, Field, Halo, Material, Tile, Type};
use std::io;

/// A program that reads picture sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Program {
    /// Unreal Engine: occlusion, roughness and metallic packed into one picture, normals with y down.
    Unreal,
    /// Unity: a mask map of metallic, occlusion and smoothness.
    Unity,
    /// Godot.
    Godot,
    /// Blender, with a script that builds the material.
    Blender,
    /// Arnold: `standard_surface`, EXR in tiles with mip levels.
    Arnold,
    /// `RenderMan`: `PxrSurface`, EXR in tiles with mip levels.
    RenderMan,
}

impl Program {
    /// All of them, by name.
    const ALL: [(&'static str, Self); 6] = [
        ("Unreal", Self::Unreal),
        ("Unity", Self::Unity),
        ("Godot", Self::Godot),
        ("Blender", Self::Blender),
        ("Arnold", Self::Arnold),
        ("RenderMan", Self::RenderMan),
    ];
}

/// The target.
pub(super) struct Preset;

impl ExportTarget for Preset {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Preset",
                title: "this target",
                doc: "A material as the pictures that a program expects.",
                fields: &[
                    MATERIAL,
                    FieldDecl::new(
                        "target",
                        "The program whose pictures are written.",
                        Takes::Word(|| names(&Program::ALL)),
                    ),
                ],
                variants: &[
                    ("unreal", "The pictures that Unreal Engine expects", &[("target", OptionValue::Word("Unreal"))]),
                    ("unity", "The pictures that Unity expects", &[("target", OptionValue::Word("Unity"))]),
                    ("godot", "The pictures that Godot expects", &[("target", OptionValue::Word("Godot"))]),
                    (
                        "blender",
                        "Pictures, and a script that builds the material in Blender",
                        &[("target", OptionValue::Word("Blender"))],
                    ),
                    ("arnold", "EXR pictures for Arnold", &[("target", OptionValue::Word("Arnold"))]),
                    ("renderman", "EXR pictures for `RenderMan`", &[("target", OptionValue::Word("RenderMan"))]),
                ],
            }
        }
    }

    fn plan(&self, _: &Options) -> Plan {
        Plan::several("png")
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        Ok(Files::Bundle(preset(source.material, &source.place, options.word("target", &Program::ALL))))
    }
}

fn gray(value: f32) -> Field {
    Field::constant(Type::Gray, &[value])
}

fn mapped(field: &Field, change: impl Fn(usize, f32) -> f32 + Send + Sync + 'static) -> Field {
    Field::map(field.ty(), [field.clone()], Halo::NONE, move |out: &mut Tile, [from]: [&Tile; 1]| {
        for (channel, plane) in out.planes_mut().into_iter().enumerate() {
            plane.iter_mut().zip(from.plane(channel)).for_each(|(out, v)| *out = change(channel, *v));
        }
        Ok(())
    })
}

/// A normal map, stored as ½ + ½n, with y inverted.
pub fn y_down(normal: &Field) -> Field {
    mapped(normal, |channel, v| if channel == 1 { 1.0 - v } else { v })
}

/// The pictures, and a script for some programs.
fn preset(material: &Material, place: &ExportContext, program: Program) -> Bundle {
    let mut maps = Maps::new(material, &place.stem);
    match program {
        Program::Unreal => unreal(&mut maps),
        Program::Unity => unity(&mut maps),
        Program::Godot => godot(&mut maps),
        Program::Arnold => floats(&mut maps, ARNOLD, place.wraps),
        Program::RenderMan => floats(&mut maps, RENDERMAN, place.wraps),
        Program::Blender => {
            let script = blender(&mut maps, place);
            return maps.bundle(vec![(format!("{}_blender.py", place.stem), script)]);
        }
    }
    let script = (program == Program::Unreal).then(|| (format!("{}_unreal.py", place.stem), import(&maps.maps)));
    maps.bundle(script.into_iter().collect())
}

fn unreal(maps: &mut Maps<'_>) {
    let base = maps.field(Channel::BaseColor);
    maps.add("BaseColor", vec![base], Samples::Color);
    let packed = [Channel::Ao, Channel::Roughness, Channel::Metallic].map(|channel| maps.field(channel));
    maps.add("ORM", packed.into(), Samples::Data);
    if maps.has(Channel::Normal) {
        let normal = maps.field(Channel::Normal);
        maps.add("Normal", vec![y_down(&normal)], Samples::Fine);
    }
    let rest = [
        (Channel::Height, "Height"),
        (Channel::Opacity, "Opacity"),
        (Channel::Emission, "Emissive"),
        (Channel::Coat, "ClearCoat"),
        (Channel::CoatRoughness, "ClearCoatRoughness"),
        (Channel::Anisotropy, "Anisotropy"),
        (Channel::Specular, "Specular"),
        (Channel::Sheen, "Fuzz"),
    ];
    named(maps, &rest);
    if maps.has(Channel::Anisotropy) {
        let tangent = y_down(&tangent(maps));
        maps.add("Tangent", vec![tangent], Samples::Fine);
    }
}

/// The direction in which highlights are long as a map of tangents: ½ + ½t, y up.
fn tangent(maps: &mut Maps<'_>) -> Field {
    vectors(&maps.field(Channel::AnisotropyAngle), &gray(0.5))
}

/// The colour, with opacity if the material has one.
fn color(maps: &mut Maps<'_>) -> Vec<Field> {
    let opacity = maps.has(Channel::Opacity).then(|| maps.field(Channel::Opacity));
    [maps.field(Channel::BaseColor)].into_iter().chain(opacity).collect()
}

fn unity(maps: &mut Maps<'_>) {
    let base = color(maps);
    maps.add("BaseMap", base, Samples::Color);
    let [metallic, ao] = [Channel::Metallic, Channel::Ao].map(|channel| maps.field(channel));
    let smooth = mapped(&maps.field(Channel::Roughness), |_, v| 1.0 - v);
    maps.add("MaskMap", vec![metallic, ao, gray(1.0), smooth], Samples::Data);
    let rest = [
        (Channel::Normal, "NormalMap"),
        (Channel::Height, "HeightMap"),
        (Channel::Emission, "EmissiveMap"),
        (Channel::Coat, "CoatMask"),
        (Channel::Anisotropy, "AnisotropyMap"),
        (Channel::Subsurface, "SubsurfaceMaskMap"),
    ];
    named(maps, &rest);
    if maps.has(Channel::Anisotropy) {
        let tangent = tangent(maps);
        maps.add("TangentMap", vec![tangent], Samples::Fine);
    }
}

type Names = [(Channel, &'static str)];

const GODOT: &Names = &[
    (Channel::Roughness, "roughness"),
    (Channel::Metallic, "metallic"),
    (Channel::Normal, "normal"),
    (Channel::Ao, "ao"),
    (Channel::Height, "height"),
    (Channel::Emission, "emission"),
    (Channel::Subsurface, "subsurface"),
];

/// Follows the inputs of `BaseMaterial3D`: opacity beside the colour; weight and roughness of the coat in one picture;
/// a flow map with the direction in which highlights are long in red and green, and the strength of anisotropy as
/// opacity.
fn godot(maps: &mut Maps<'_>) {
    if maps.has(Channel::BaseColor) || maps.has(Channel::Opacity) {
        let color = color(maps);
        maps.add("albedo", color, Samples::Color);
    }
    named(maps, GODOT);
    if maps.has(Channel::Coat) {
        let coat = [Channel::Coat, Channel::CoatRoughness].map(|channel| maps.field(channel));
        maps.add("clearcoat", [&coat[..], &[gray(0.0)]].concat(), Samples::Data);
    }
    if maps.has(Channel::Anisotropy) {
        let [strength, angle] = [Channel::Anisotropy, Channel::AnisotropyAngle].map(|channel| maps.field(channel));
        maps.add("flow", vec![vectors(&angle, &strength), strength], Samples::Data);
    }
}

const ARNOLD: &Names = &[
    (Channel::BaseColor, "base_color"),
    (Channel::Metallic, "metalness"),
    (Channel::Roughness, "specular_roughness"),
    (Channel::Specular, "specular"),
    (Channel::Ior, "specular_IOR"),
    (Channel::Anisotropy, "specular_anisotropy"),
    (Channel::Normal, "normal"),
    (Channel::Height, "displacement"),
    (Channel::Opacity, "opacity"),
    (Channel::Sheen, "sheen"),
    (Channel::Coat, "coat"),
    (Channel::CoatRoughness, "coat_roughness"),
    (Channel::CoatNormal, "coat_normal"),
    (Channel::Emission, "emission_color"),
    (Channel::Subsurface, "subsurface"),
];

const RENDERMAN: &Names = &[
    (Channel::BaseColor, "diffuseColor"),
    (Channel::Metallic, "metallic"),
    (Channel::Roughness, "specularRoughness"),
    (Channel::Specular, "specularGain"),
    (Channel::Ior, "specularIor"),
    (Channel::Anisotropy, "specularAnisotropy"),
    (Channel::Normal, "bumpNormal"),
    (Channel::Height, "displacement"),
    (Channel::Opacity, "presence"),
    (Channel::Sheen, "fuzzGain"),
    (Channel::Coat, "clearcoatGain"),
    (Channel::CoatRoughness, "clearcoatRoughness"),
    (Channel::CoatNormal, "clearcoatBumpNormal"),
    (Channel::Emission, "glowColor"),
    (Channel::Subsurface, "subsurfaceGain"),
];

/// Adds each listed channel that the material has, as a picture with the program's name for it.
fn named(maps: &mut Maps<'_>, names: &Names) {
    for (channel, name) in names {
        if maps.has(*channel) {
            let field = maps.field(*channel);
            maps.add(name, vec![field], samples(*channel));
        }
    }
}

/// Adds the channels as float textures: scene-linear colours, normals and heights for renderers.
fn floats(maps: &mut Maps<'_>, names: &Names, wraps: [bool; 2]) {
    for (channel, name) in names {
        if maps.has(*channel) {
            let samples = if *channel == Channel::Height { Samples::Float } else { Samples::Half };
            maps.texture(name, *channel, samples, wraps);
        }
    }
}

/// A script for Unreal's Python console: imports the pictures of its folder, with the settings that each needs.
fn import(maps: &[Map]) -> String {
    let list: Vec<String> = maps
        .iter()
        .map(|map| {
            let kind = match map.samples {
                Samples::Color | Samples::Jpeg(_) => "color",
                Samples::Fine => "normal",
                Samples::Data => "mask",
                Samples::Half | Samples::Float => "float",
            };
            format!("    ({}, {kind:?}),", quoted(&map.file))
        })
        .collect();
    UNREAL.replace("@MAPS@", &list.join("\n"))
}

const UNREAL: &str = r#"# Imports the pictures beside this script: File > Execute Python Script in the Unreal editor.
# Normals and tangents have y down; ORM holds occlusion, roughness and metallic; heights are in mm.
import os
import unreal

FOLDER = os.path.dirname(os.path.abspath(__file__))
TARGET = "/Game/Shibo"
MAPS_BESIDE = [
@MAPS@
]

tasks = []
for name, kind in MAPS_BESIDE:
    task = unreal.AssetImportTask()
    task.filename = os.path.join(FOLDER, name)
    task.destination_path = TARGET
    task.automated = True
    task.replace_existing = True
    task.save = False
    tasks.append((task, kind))
unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task for task, _ in tasks])
for task, kind in tasks:
    for path in task.imported_object_paths:
        texture = unreal.load_asset(path)
        texture.set_editor_property("srgb", kind == "color")
        if kind == "normal":
            texture.set_editor_property("compression_settings", unreal.TextureCompressionSettings.TC_NORMALMAP)
        elif kind == "mask":
            texture.set_editor_property("compression_settings", unreal.TextureCompressionSettings.TC_MASKS)
        elif kind == "float":
            texture.set_editor_property("compression_settings", unreal.TextureCompressionSettings.TC_HDR)
        unreal.EditorAssetLibrary.save_loaded_asset(texture)
"#;

/// Adds the pictures for Blender; returns the script that builds a material from them.
fn blender(maps: &mut Maps<'_>, place: &ExportContext) -> String {
    let sockets = [
        (Channel::BaseColor, "Base Color"),
        (Channel::Roughness, "Roughness"),
        (Channel::Metallic, "Metallic"),
        (Channel::Opacity, "Alpha"),
        (Channel::Ior, "IOR"),
        (Channel::Coat, "Coat Weight"),
        (Channel::CoatRoughness, "Coat Roughness"),
        (Channel::Sheen, "Sheen Weight"),
        (Channel::Anisotropy, "Anisotropic"),
        (Channel::AnisotropyAngle, "Anisotropic Rotation"),
        (Channel::Emission, "Emission Color"),
        (Channel::Subsurface, "Subsurface Weight"),
        (Channel::Normal, "Normal"),
        (Channel::CoatNormal, "Coat Normal"),
        (Channel::Height, "Displacement"),
        (Channel::Ao, "AO"),
    ];
    let (mut files, mut values) = (Vec::new(), Vec::new());
    for (channel, socket) in sockets {
        match maps.channel(channel) {
            Some(ChannelSource::File(file)) => files.push(format!("    {socket:?}: {},", quoted(&file))),
            Some(ChannelSource::Value(list)) => {
                let list: Vec<String> = list.iter().map(|v| number(*v)).collect();
                values.push(format!("    {socket:?}: ({},),", list.join(", ")));
            }
            None => {}
        }
    }
    let scale = 1000.0 / place.size_mm;
    let extension = if place.wraps == [true; 2] { "REPEAT" } else { "EXTEND" };
    BLENDER
        .replace("@FILES@", &files.join("\n"))
        .replace("@VALUES@", &values.join("\n"))
        .replace("@SCALE@", &format!("({}, {}, 1.0)", number(scale.x), number(scale.y)))
        .replace("@TOP@", &number(1.0 - scale.y))
        .replace("@EXTENSION@", extension)
        .replace("@NAME@", &place.stem.replace(['"', '\\'], "_"))
}

const BLENDER: &str = r#"# Builds the material "@NAME@" of the pictures beside this script: run it in Blender's text editor, or with
# `blender scene.blend --python @NAME@_blender.py`. A metre of the UV map shows a metre of the material.
import os
import bpy

FOLDER = os.path.dirname(os.path.abspath(__file__))
MAPS = {
@FILES@
}
NUMBERS = {
@VALUES@
}
COLORS = ("Base Color", "Emission Color")


def build(name="@NAME@", folder=FOLDER):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    output = nodes["Material Output"]
    where = nodes.new("ShaderNodeTexCoord")
    placed = nodes.new("ShaderNodeMapping")
    placed.inputs["Scale"].default_value = @SCALE@
    placed.inputs["Location"].default_value = (0.0, @TOP@, 0.0)
    links.new(where.outputs["UV"], placed.inputs["Vector"])

    def picture(socket):
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(os.path.join(folder, MAPS[socket]))
        if socket not in COLORS or MAPS[socket].endswith(".exr"):
            node.image.colorspace_settings.name = "Non-Color" if socket not in COLORS else "Linear Rec.709"
        node.extension = "@EXTENSION@"
        links.new(placed.outputs["Vector"], node.inputs["Vector"])
        return node.outputs["Color"]

    for socket, value in NUMBERS.items():
        if socket == "Displacement" or socket == "AO":
            continue
        if socket == "Anisotropic Rotation":
            value = (((90.0 - value[0]) / 360.0) % 1.0,)
        if socket in COLORS:
            value = tuple(value) + (1.0,)
            surface.inputs[socket].default_value = value
        elif socket in ("Normal", "Coat Normal"):
            continue
        else:
            surface.inputs[socket].default_value = value[0]
    if "Emission Color" in MAPS or "Emission Color" in NUMBERS:
        surface.inputs["Emission Strength"].default_value = 1.0
    if "Anisotropic Rotation" in MAPS or "Anisotropic Rotation" in NUMBERS:
        # Without it directions turn about the object's axis and not with the UV map.
        tangent = nodes.new("ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        links.new(tangent.outputs["Tangent"], surface.inputs["Tangent"])
    for socket in MAPS:
        if socket == "Displacement":
            # Heights are in mm.
            relief = nodes.new("ShaderNodeDisplacement")
            relief.inputs["Midlevel"].default_value = 0.0
            relief.inputs["Scale"].default_value = 0.001
            links.new(picture(socket), relief.inputs["Height"])
            links.new(relief.outputs["Displacement"], output.inputs["Displacement"])
        elif socket in ("Normal", "Coat Normal"):
            normal = nodes.new("ShaderNodeNormalMap")
            links.new(picture(socket), normal.inputs["Color"])
            links.new(normal.outputs["Normal"], surface.inputs[socket])
        elif socket == "Anisotropic Rotation":
            # Degrees along brush lines become turns across them, the other way round: v is up here.
            turn = nodes.new("ShaderNodeMath")
            turn.operation = "MULTIPLY_ADD"
            turn.inputs[1].default_value = -1.0 / 360.0
            turn.inputs[2].default_value = 90.0 / 360.0
            links.new(picture(socket), turn.inputs[0])
            links.new(turn.outputs["Value"], surface.inputs[socket])
        elif socket != "AO":
            # Cycles finds occlusion by itself; the picture is there for others.
            links.new(picture(socket), surface.inputs[socket])
    return material


if __name__ == "__main__":
    build()
"#;
