//! Materials on a mesh as Wavefront OBJ: the mesh, a material library, and the pictures.
//!
//! Lengths are mm, y is up, and texture coordinates have v up, as readers expect. Besides the standard keywords, the
//! library uses the common ones for physically based materials (`Pr`, `Pm`, `Pc`, `norm` and so on).
use super::bundle::{Bundle, ChannelSource, ExportContext, Maps};
use super::colors::Colors;
use super::decl::{COLORS, MATERIAL, MESH, QUALITY};
use super::directions::turns;
use super::names::{unique, word};
use super::network;
use super::shape::Shape;
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::{Channel, Material};
use glam::{DVec2, Vec2, Vec3};
use std::collections::HashMap;
use std::fmt::Write;
use std::io;

/// The keywords of a channel: the one for a number, how many numbers it takes, and the one for a picture.
const WORDS: [(Channel, &str, usize, &str); 14] = [
    (Channel::BaseColor, "Kd", 3, "map_Kd"),
    (Channel::Ao, "Ka", 3, "map_Ka"),
    (Channel::Emission, "Ke", 3, "map_Ke"),
    (Channel::Opacity, "d", 1, "map_d"),
    (Channel::Ior, "Ni", 1, ""),
    (Channel::Roughness, "Pr", 1, "map_Pr"),
    (Channel::Metallic, "Pm", 1, "map_Pm"),
    (Channel::Sheen, "Ps", 1, "map_Ps"),
    (Channel::Coat, "Pc", 1, "map_Pc"),
    (Channel::CoatRoughness, "Pcr", 1, "map_Pcr"),
    (Channel::Anisotropy, "aniso", 1, "map_aniso"),
    (Channel::AnisotropyAngle, "anisor", 1, ""),
    (Channel::Normal, "", 3, "norm"),
    (Channel::Height, "", 1, "disp"),
];

/// The target.
pub(super) struct Obj;

impl ExportTarget for Obj {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Obj",
                title: "OBJ",
                doc: "A material on a mesh as Wavefront OBJ.",
                fields: &[MATERIAL, MESH, COLORS, QUALITY],
                variants: &[("obj", "An OBJ file with its material library and its pictures", &[])],
            }
        }
    }

    fn plan(&self, _: &Options) -> Plan {
        Plan::several("obj")
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        Ok(Files::Bundle(obj(source.material, source.shape, &source.place, options.colors())))
    }
}

/// The files of a material on a mesh.
fn obj(material: &Material, shape: &Shape, place: &ExportContext, colors: Colors) -> Bundle {
    let stem = &place.stem;
    let mut maps = Maps::new(material, stem).with_colors(colors);
    // Clamps pictures that do not repeat. Those of an atlas need no clamp, because the charts lie inside.
    let ends = if shape.repeats.is_some() && place.wraps != [true; 2] { "-clamp on " } else { "" };
    // Some readers show no highlights unless `Ks` is given.
    let mut library = format!("# Shibo: lengths in mm\nnewmtl {}\nillum 2\nKs 0.5 0.5 0.5\n", word(stem));
    for (channel, number, count, picture) in WORDS {
        // The format has no picture for this channel.
        let varies = material.get(channel).is_some_and(|field| field.as_constant().is_none());
        if picture.is_empty() && varies {
            continue;
        }
        match maps.channel(channel) {
            Some(ChannelSource::File(file)) => {
                // Readers multiply the picture by this number. Any other number would show in readers that ignore
                // pictures.
                if channel == Channel::BaseColor {
                    library.push_str("Kd 1 1 1\n");
                }
                let _ = writeln!(library, "{picture} {ends}{file}");
            }
            Some(ChannelSource::Value(values)) if !number.is_empty() => {
                let said = |value: &f64| if channel == Channel::AnisotropyAngle { turns(*value) } else { *value };
                let values = values.iter().cycle().take(count);
                let numbers: Vec<String> = values.map(|value| network::number(said(value))).collect();
                let _ = writeln!(library, "{number} {}", numbers.join(" "));
            }
            _ => {}
        }
    }
    maps.bundle(vec![(format!("{stem}.mtl"), library), (format!("{stem}.obj"), mesh(shape, stem))])
}

/// Formats the lines of the mesh.
fn mesh(shape: &Shape, stem: &str) -> String {
    let repeats = shape.repeats.unwrap_or(DVec2::ONE);
    let (places, place) = once(shape.positions.iter().map(|p| millimetres(*p)));
    let (uvs, uv) = once(shape.uvs.iter().map(|uv| turned_over(*uv, repeats)));
    let (normals, normal) = once(shape.normals.iter().map(Vec3::to_array));
    let mut text = format!("# Shibo: lengths in mm, y up\nmtllib {stem}.mtl\n");
    for [x, y, z] in places {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [u, v] in uvs {
        let _ = writeln!(text, "vt {u} {v}");
    }
    for [x, y, z] in normals {
        let _ = writeln!(text, "vn {x} {y} {z}");
    }
    // Readers merge parts of the same name.
    let names = unique(shape.parts.iter().map(|part| word(&part.name)), &[]);
    for (part, name) in shape.parts.iter().zip(names) {
        let _ = writeln!(text, "o {name}\nusemtl {}", word(stem));
        for triangle in part.indices.chunks_exact(3) {
            text.push('f');
            for vertex in triangle.iter().map(|n| *n as usize) {
                let _ = write!(text, " {}/{}/{}", place[vertex] + 1, uv[vertex] + 1, normal[vertex] + 1);
            }
            text.push('\n');
        }
    }
    text
}

/// A position in mm.
fn millimetres(metres: Vec3) -> [f32; 3] {
    (metres.as_dvec3() * 1e3).as_vec3().to_array()
}

/// Coordinates with v up.
fn turned_over(uv: Vec2, repeats: DVec2) -> [f32; 2] {
    let uv = uv.as_dvec2() * repeats;
    DVec2::new(uv.x, 1.0 - uv.y).as_vec2().to_array()
}

/// The distinct values, in order of first use, and the index of each value in that list.
fn once<const N: usize>(values: impl Iterator<Item = [f32; N]>) -> (Vec<[f32; N]>, Vec<usize>) {
    let mut known = HashMap::new();
    let (mut kept, mut numbers) = (Vec::new(), Vec::new());
    for value in values {
        // Adding 0 turns -0 into 0, so that equal numbers have equal bits.
        let value = value.map(|v| v + 0.0);
        numbers.push(*known.entry(value.map(f32::to_bits)).or_insert_with(|| {
            kept.push(value);
            kept.len() - 1
        }));
    }
    (kept, numbers)
}
