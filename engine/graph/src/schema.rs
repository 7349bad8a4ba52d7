//! The fields that may stand in each place of a graph file, except those of nodes. The loader accepts these and no
//! others; editors offer and explain them.
use super::storage::{FileColors, Storage};
use crate::export::{FieldDecl, Takes, names, target_named};
use crate::node::ParamType;
use crate::picture::{Depth, Format};
use crate::value::TileMode;

/// Fields of a graph file.
pub const ROOT: &[FieldDecl] = &[
    FieldDecl::new("version", "The version of the format: 1.", Takes::Value),
    FieldDecl::new("canvas", "Size in mm, resolution, tiling and seed.", Takes::Value),
    FieldDecl::new("imports", "Graphs to be used as sub-graphs: `{ \"name\": \"path\" }`.", Takes::Value),
    FieldDecl::new("params", "What others may change: `\"pitch\": Number(default: 0.8)`.", Takes::Value),
    FieldDecl::new("presets", "Sets of values for the parameters.", Takes::Value),
    FieldDecl::new("inputs", "What a sub-graph takes: `\"field\": Gray(default: 0.5)`.", Takes::Value),
    FieldDecl::new("nodes", "The nodes: `\"name\": Kind(port: \"node\", parameter: value)`.", Takes::Value),
    FieldDecl::new("outputs", "What is rendered: `\"height\": \"node.port\"`.", Takes::Value),
];

/// Fields of the canvas.
pub const CANVAS: &[FieldDecl] = &[
    FieldDecl::new("size_mm", "Width and height in mm: one number, or a pair. Default 100.", Takes::Value),
    FieldDecl::new("resolution", "Pixels of the longer side, or a pair. Default 1024.", Takes::Value),
    FieldDecl::new(
        "tile",
        "The directions in which it repeats: `Both`, `X`, `Y` or `None`. Default `Both`.",
        Takes::Words(|| names(&TileMode::ALL)),
    ),
    FieldDecl::new("seed", "Another number gives other random numbers everywhere. Default 0.", Takes::Value),
];

/// Fields of the layout of an instance.
pub const LAYOUT: &[FieldDecl] = &[
    FieldDecl::new("scale", "2 is twice as large; one number or a pair.", Takes::Value),
    FieldDecl::new("angle", "Degrees from +x towards +y.", Takes::Value),
    FieldDecl::new("offset", "To the right and down, in mm.", Takes::Value),
    FieldDecl::new(
        "size_mm",
        "The canvas on which its graph is made, in mm; only where the canvas does not tile.",
        Takes::Value,
    ),
];

/// Fields of the declaration of an input.
pub const INPUT: &[FieldDecl] = &[
    FieldDecl::new("default", "The value if nothing else is given.", Takes::Value),
    FieldDecl::new("doc", "What it does.", Takes::Value),
];

/// The types that a parameter of a graph may have.
pub const PARAM_TYPES: [ParamType; 7] = [
    ParamType::Number,
    ParamType::Integer,
    ParamType::Bool,
    ParamType::Color,
    ParamType::Text,
    ParamType::Path,
    ParamType::Choice,
];

const INSTANCE: &[FieldDecl] = &[
    FieldDecl::new("graph", "A name from `imports`.", Takes::Value),
    FieldDecl::new("over", "How many instances there are, 1 to 64.", Takes::Value),
    FieldDecl::new("ids", "The numbers of the pieces.", Takes::Ids),
    FieldDecl::new("with", "Values for parameters and inputs of the sub-graph: `{ \"name\": value }`.", Takes::Value),
    FieldDecl::new("preset", "A preset of the sub-graph, or several: `\"a+b\"`.", Takes::Value),
    FieldDecl::new("seed", "Another number gives another instance.", Takes::Value),
    FieldDecl::new(
        "canvas",
        "How the outputs of the instance lie: `scale`, `angle`, `offset` and `size_mm`.",
        Takes::Value,
    ),
    FieldDecl::new("note", "A text for readers.", Takes::Value),
];

/// Fields of `Use`, or of `Each`.
pub fn instance(each: bool) -> Vec<FieldDecl> {
    INSTANCE.iter().filter(|field| each || !matches!(field.name, "over" | "ids")).copied().collect()
}

/// Fields of the declaration of a parameter, by the name of its type.
pub fn param(ty: &str) -> Vec<FieldDecl> {
    let of_numbers = [
        FieldDecl::new("range", "The smallest and the largest value: `(0, 1)`.", Takes::Value),
        FieldDecl::new("unit", "The unit, for people.", Takes::Value),
    ];
    let of_choices = [FieldDecl::new("options", "The words to choose from.", Takes::Value)];
    let own = match ty {
        "Number" | "Integer" => &of_numbers[..],
        "Choice" => &of_choices[..],
        _ => &[],
    };
    [&INPUT[..1], own, &INPUT[1..]].concat()
}

const FILE: &[FieldDecl] = &[
    FieldDecl::new("from", "The node, or `\"node.port\"`.", Takes::Output),
    FieldDecl::new("format", "The file format.", Takes::Words(|| Format::ALL.map(Format::name).to_vec())),
    FieldDecl::new("depth", "The type of the samples.", Takes::Words(|| Depth::ALL.map(Depth::name).to_vec())),
    FieldDecl::new(
        "combined",
        "Whether the channels of a material go into one file; only in `Exr`.",
        Takes::Truth(false),
    ),
    FieldDecl::new("range", "The values that become the smallest and the largest integer.", Takes::Value),
    FieldDecl::new(
        "mip",
        "Whether an `Exr` or a `Tiff` is written in tiles with mip levels, as renderers read textures.",
        Takes::Truth(false),
    ),
    FieldDecl::new(
        "widen_roughness",
        "Whether mip levels of a roughness grow by the normals that they average away; `true` if left out.",
        Takes::Truth(true),
    ),
    FieldDecl::new(
        "normal",
        "Which way `y` of a normal map points: up, `OpenGl`, or down, `DirectX`.",
        Takes::Words(|| names(&Storage::NORMALS)),
    ),
    FieldDecl::new("color_space", "What colours are stored as.", Takes::Words(|| names(&FileColors::ALL))),
];

/// Fields of an output that is not just a name: of a target such as `Gltf`, or else of `File`.
pub fn output(word: &str) -> &'static [FieldDecl] {
    target_named(word).map_or(FILE, |target| target.info().fields)
}
