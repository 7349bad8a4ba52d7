//! Materials on a mesh as USD text, packed with the pictures or as separate files. Each has a `UsdPreviewSurface` and
//! the same network as in MaterialX documents.
//!
//! One unit is a metre, y is up. Texture coordinates have v up, as everywhere in USD.
use super::bundle::{Bundle, ChannelSource, ExportContext, Maps};
use super::colors::Colors;
use super::decl::{COLORS, FieldDecl, MATERIAL, MESH, QUALITY, Takes};
use super::names::{identifier, unique};
use super::network::{Input, InputValue, Network, Shading, network, number};
use super::shape::Shape;
use super::target::{ExportTarget, Files, OptionValue, Options, Plan, Source, TargetInfo};
use crate::value::{Channel, Material};
use std::fmt::Write;
use std::io;

/// The target.
pub(super) struct Usd;

impl ExportTarget for Usd {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Usd",
                title: "USD",
                doc: "A material on a mesh as USD.",
                fields: &[
                    MATERIAL,
                    MESH,
                    COLORS,
                    QUALITY,
                    FieldDecl::new("packed", "Writes the file and its pictures as one `.usdz`.", Takes::Truth(false)),
                ],
                variants: &[
                    ("usd", "A USD file", &[]),
                    ("usdz", "A USD file with its pictures in it", &[("packed", OptionValue::Truth(true))]),
                ],
            }
        }
    }

    fn plan(&self, options: &Options) -> Plan {
        if options.is("packed") { Plan::one("usdz") } else { Plan::several("usda") }
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let bundle = usd(source.material, source.shape, &source.place, options.is("packed"), options.colors());
        Ok(Files::Bundle(bundle))
    }
}

/// The USD file and its pictures, in one archive if `packed`.
fn usd(material: &Material, shape: &Shape, place: &ExportContext, packed: bool, colors: Colors) -> Bundle {
    let mut maps = Maps::new(material, &place.stem).with_colors(colors);
    let once = shape.repeats.is_none();
    let name = identifier(&place.stem);
    let network = network(&mut maps, place, once, Shading::OpenPbr);
    let preview = Preview::new(&mut maps);
    let mut text = Text::default();
    let head = "#usda 1.0\n(\n    defaultPrim = \"NAME\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n\
        def Xform \"NAME\" (\n    kind = \"component\"\n)\n{";
    text.line(&head.replace("NAME", &name));
    text.depth = 1;
    text.mesh(shape, &name);
    text.line("def Scope \"Materials\"");
    text.open();
    text.line("def Material \"material\"");
    text.open();
    let at = format!("/{name}/Materials/material");
    text.preview(&preview, place, once, &at);
    text.network(&network, &at);
    (0..3).for_each(|_| text.close());
    let mut bundle = maps.bundle(Vec::new());
    bundle.documents.push((format!("{}.usda", place.stem), text.out));
    bundle.archive = packed.then(|| format!("{}.usdz", place.stem));
    bundle
}

/// The inputs of `UsdPreviewSurface`: name, type, output of the picture that the input reads, channel, and source.
struct Preview(Vec<(&'static str, &'static str, &'static str, Channel, ChannelSource)>);

impl Preview {
    fn new(maps: &mut Maps<'_>) -> Self {
        let known = [
            (Channel::BaseColor, "diffuseColor", "color3f", "rgb"),
            (Channel::Emission, "emissiveColor", "color3f", "rgb"),
            (Channel::Metallic, "metallic", "float", "r"),
            (Channel::Roughness, "roughness", "float", "r"),
            (Channel::Coat, "clearcoat", "float", "r"),
            (Channel::CoatRoughness, "clearcoatRoughness", "float", "r"),
            (Channel::Opacity, "opacity", "float", "r"),
            (Channel::Ior, "ior", "float", "r"),
            (Channel::Normal, "normal", "normal3f", "rgb"),
            (Channel::Height, "displacement", "float", "r"),
            (Channel::Ao, "occlusion", "float", "r"),
        ];
        let mut inputs = Vec::new();
        for (channel, input, ty, output) in known {
            inputs.extend(maps.channel(channel).map(|source| (input, ty, output, channel, source)));
        }
        Self(inputs)
    }
}

/// A text of indented lines.
#[derive(Default)]
struct Text {
    out: String,
    depth: usize,
}

/// Quotes the path of a file as a USD asset.
fn asset(file: &str) -> String {
    if file.contains('@') { format!("@@@./{file}@@@") } else { format!("@./{file}@") }
}

impl Text {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.out, "{:1$}{text}", "", 4 * self.depth);
    }

    fn open(&mut self) {
        self.line("{");
        self.depth += 1;
    }

    fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    fn list<T>(&mut self, head: &str, items: impl Iterator<Item = T>, each: impl Fn(T) -> String, tail: &str) {
        let items: Vec<String> = items.map(each).collect();
        self.line(&format!("{head} = [{}]{tail}", items.join(", ")));
    }

    fn mesh(&mut self, shape: &Shape, name: &str) {
        // The scope of the materials is a sibling of the meshes, so its name is taken.
        let names = unique(shape.parts.iter().map(|part| identifier(&part.name)), &["Materials"]);
        for (part, prim) in shape.parts.iter().zip(names) {
            // Skip vertices that belong to other parts.
            let mut numbers: Vec<u32> = part.indices.clone();
            numbers.sort_unstable();
            numbers.dedup();
            let vertices = || numbers.iter().map(|n| *n as usize);
            self.line(&format!("def Mesh \"{prim}\" ("));
            if prim != part.name {
                self.line(&format!("    displayName = {}", text(&part.name)));
            }
            self.line("    prepend apiSchemas = [\"MaterialBindingAPI\"]");
            self.line(")");
            self.open();
            let triple = |v: glam::Vec3| format!("({}, {}, {})", v.x, v.y, v.z);
            let low = vertices().map(|n| shape.positions[n]).reduce(glam::Vec3::min).unwrap_or_default();
            let high = vertices().map(|n| shape.positions[n]).reduce(glam::Vec3::max).unwrap_or_default();
            self.list("float3[] extent", [low, high].into_iter(), triple, "");
            self.list("int[] faceVertexCounts", part.indices.chunks(3), |_| "3".into(), "");
            let place = |n: &u32| numbers.binary_search(n).unwrap_or_default().to_string();
            self.list("int[] faceVertexIndices", part.indices.iter(), place, "");
            self.list("point3f[] points", vertices(), |n| triple(shape.positions[n]), "");
            let vertex = " (\n        interpolation = \"vertex\"\n    )";
            self.list("normal3f[] normals", vertices(), |n| triple(shape.normals[n]), vertex);
            let uv = |n: usize| format!("({}, {})", shape.uvs[n].x, 1.0 - shape.uvs[n].y);
            self.list("texCoord2f[] primvars:st", vertices(), uv, vertex);
            self.line("uniform token subdivisionScheme = \"none\"");
            self.line(&format!("rel material:binding = </{name}/Materials/material>"));
            self.close();
        }
    }

    fn shader(&mut self, name: &str, id: &str) {
        self.line(&format!("def Shader \"{name}\""));
        self.open();
        self.line(&format!("uniform token info:id = \"{id}\""));
    }

    fn preview(&mut self, preview: &Preview, place: &ExportContext, once: bool, at: &str) {
        let files: Vec<_> = preview.0.iter().filter(|input| matches!(input.4, ChannelSource::File(_))).collect();
        self.line(&format!("token outputs:surface.connect = <{at}/preview.outputs:surface>"));
        let displaced = files.iter().any(|input| input.3 == Channel::Height);
        if displaced {
            self.line(&format!("token outputs:displacement.connect = <{at}/preview.outputs:displacement>"));
        }
        self.shader("preview", "UsdPreviewSurface");
        for (input, ty, output, channel, source) in &preview.0 {
            match source {
                ChannelSource::File(_) => self
                    .line(&format!("{ty} inputs:{input}.connect = <{at}/preview_{}.outputs:{output}>", channel.name())),
                ChannelSource::Value(values) if *channel == Channel::Height => {
                    self.line(&format!("float inputs:displacement = {}", number(values[0] / 1000.0)));
                }
                ChannelSource::Value(values) => self.line(&format!("{ty} inputs:{input} = {}", value(values))),
            }
        }
        self.line("token outputs:surface");
        if displaced {
            self.line("token outputs:displacement");
        }
        self.close();
        if files.is_empty() {
            return;
        }
        self.shader("st", "UsdPrimvarReader_float2");
        self.line("string inputs:varname = \"st\"");
        self.line("float2 outputs:result");
        self.close();
        let mut from = "st";
        if !once {
            let by = 1000.0 / place.size_mm;
            from = "placed";
            self.shader(from, "UsdTransform2d");
            self.line(&format!("float2 inputs:in.connect = <{at}/st.outputs:result>"));
            self.line(&format!("float2 inputs:scale = {}", value(&by.to_array())));
            self.line(&format!("float2 inputs:translation = {}", value(&[0.0, 1.0 - by.y])));
            self.line("float2 outputs:result");
            self.close();
        }
        for (_, _, output, channel, source) in files {
            let ChannelSource::File(file) = source else { continue };
            self.shader(&format!("preview_{}", channel.name()), "UsdUVTexture");
            self.line(&format!("asset inputs:file = {}", asset(file)));
            self.line(&format!("float2 inputs:st.connect = <{at}/{from}.outputs:result>"));
            for (input, wraps) in ["wrapS", "wrapT"].into_iter().zip(place.wraps) {
                let word = if wraps && !once { "repeat" } else { "clamp" };
                self.line(&format!("token inputs:{input} = \"{word}\""));
            }
            let color = *output == "rgb" && *channel != Channel::Normal && !file.ends_with("exr");
            self.line(&format!("token inputs:sourceColorSpace = \"{}\"", if color { "sRGB" } else { "raw" }));
            match channel {
                Channel::Normal => {
                    self.line("float4 inputs:scale = (2, 2, 2, 1)");
                    self.line("float4 inputs:bias = (-1, -1, -1, 0)");
                }
                Channel::Height => self.line("float4 inputs:scale = (0.001, 0.001, 0.001, 1)"),
                _ => {}
            }
            self.line(&format!("{} outputs:{output}", if *output == "rgb" { "float3" } else { "float" }));
            self.close();
        }
    }

    /// The network in the nodes of MaterialX, for renderers that know them.
    fn network(&mut self, network: &Network, at: &str) {
        self.line(&format!("token outputs:mtlx:surface.connect = <{at}/mtlx_surface.outputs:out>"));
        if network.height.is_some() {
            self.line(&format!("token outputs:mtlx:displacement.connect = <{at}/mtlx_displacement.outputs:out>"));
        }
        for node in &network.nodes {
            self.shader(&format!("mtlx_{}", node.name), &definition(node.category, node.ty));
            self.inputs(&node.inputs, at);
            self.line(&format!("{} outputs:out", usd_type(node.ty)));
            self.close();
        }
        self.shader("mtlx_surface", &format!("ND_{}_surfaceshader", network.shading.category()));
        self.inputs(&network.surface, at);
        self.line("token outputs:out");
        self.close();
        if let Some(height) = &network.height {
            self.shader("mtlx_displacement", "ND_displacement_float");
            let inputs = [
                ("displacement", "float", InputValue::Node(height.clone())),
                ("scale", "float", InputValue::Value("0.001".into())),
            ];
            self.inputs(&inputs, at);
            self.line("token outputs:out");
            self.close();
        }
    }

    fn inputs(&mut self, inputs: &[Input], at: &str) {
        for (name, ty, given) in inputs {
            let kind = usd_type(ty);
            match given {
                InputValue::Node(node) => {
                    self.line(&format!("{kind} inputs:{name}.connect = <{at}/mtlx_{node}.outputs:out>"));
                }
                InputValue::Value(value) if *ty == "string" => {
                    self.line(&format!("string inputs:{name} = \"{value}\""))
                }
                InputValue::Value(value) | InputValue::Metres(value) if value.contains(',') => {
                    self.line(&format!("{kind} inputs:{name} = ({value})"));
                }
                InputValue::Value(value) | InputValue::Metres(value) => {
                    self.line(&format!("{kind} inputs:{name} = {value}"))
                }
                InputValue::File(file, None) => self.line(&format!("asset inputs:{name} = {}", asset(file))),
                InputValue::File(file, Some(space)) => {
                    self.line(&format!("asset inputs:{name} = {} (", asset(file)));
                    self.line(&format!("    colorSpace = \"{space}\""));
                    self.line(")");
                }
            }
        }
    }
}

/// Quotes a text.
fn text(text: &str) -> String {
    let safe: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("\"{}\"", safe.replace('\\', "\\\\").replace('"', "\\\""))
}

fn value(values: &[f64]) -> String {
    match values {
        [one] => number(*one),
        several => format!("({})", several.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", ")),
    }
}

fn usd_type(ty: &str) -> &'static str {
    match ty {
        "color3" => "color3f",
        "vector2" => "float2",
        "vector3" => "float3",
        "filename" => "asset",
        "string" => "string",
        _ => "float",
    }
}

/// Name of the MaterialX node definition.
fn definition(category: &str, ty: &str) -> String {
    match category {
        "normalmap" => "ND_normalmap_float".into(),
        "convert" => format!("ND_convert_float_{ty}"),
        _ => format!("ND_{category}_{ty}"),
    }
}
