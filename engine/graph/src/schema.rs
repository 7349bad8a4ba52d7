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
    FieldDecl::new("pins", "The change whose versions of nodes the graph means: its number.", Takes::Value),
    FieldDecl::new("family", "The family of the material, for lists: `\"stone\"`.", Takes::Value),
    FieldDecl::new("canvas", "Size in mm, resolution, tiling and seed.", Takes::Value),
    FieldDecl::new("imports", "The graphs that nodes use as sub-graphs: `{ \"name\": \"path\" }`.", Takes::Value),
    FieldDecl::new(
        "params",
        "Values that users of the graph may change: `\"pitch\": Number(default: 0.8)`.",
        Takes::Value,
    ),
    FieldDecl::new("presets", "Named sets of values for the parameters: `\"fine\": { \"pitch\": 0.5 }`.", Takes::Value),
    FieldDecl::new(
        "inputs",
        "The inputs of the graph when another one uses it: `\"field\": Gray(default: 0.5)`.",
        Takes::Value,
    ),
    FieldDecl::new(
        "graphs",
        "Graphs that the nodes of this file use, each with `inputs`, `params`, `nodes` and `outputs`.",
        Takes::Value,
    ),
    FieldDecl::new(
        "functions",
        "Functions for formulas: `\"ridge(x, w)\": \"1 - smoothstep(0, w, abs(x))\"`.",
        Takes::Value,
    ),
    FieldDecl::new(
        "nodes",
        "The nodes: `\"name\": Kind(port: \"node\", parameter: value)`, or a formula, `\"name\": \"= a + b\"`.",
        Takes::Value,
    ),
    FieldDecl::new(
        "outputs",
        "The pictures to render: `\"height\": \"node.port\"`, or a form such as `File`.",
        Takes::Value,
    ),
];

/// Fields of a graph that is defined in the file that uses it.
pub const LOCAL: &[FieldDecl] = &[
    FieldDecl::new("params", "Values that a `Use` may change.", Takes::Value),
    FieldDecl::new("presets", "Named sets of values for the parameters.", Takes::Value),
    FieldDecl::new("inputs", "The inputs that a `Use` gives values.", Takes::Value),
    FieldDecl::new("nodes", "The nodes. They see the inputs and parameters of this graph only.", Takes::Value),
    FieldDecl::new("outputs", "The values that a `Use` gives: `\"height\": \"node.port\"`.", Takes::Value),
];

/// Fields of the pins.
pub const PINS: &[FieldDecl] = &[
    FieldDecl::new("change", "The number of the change.", Takes::Value),
    FieldDecl::new("hold", "Versions of some kinds: `{ \"WoodRays\": 3 }`.", Takes::Value),
];

/// Fields of the canvas.
pub const CANVAS: &[FieldDecl] = &[
    FieldDecl::new("size_mm", "Width and height in mm: one number, or a pair. Default 100.", Takes::Value),
    FieldDecl::new("resolution", "Pixels of the longer side, or a pair. Default 1024.", Takes::Value),
    FieldDecl::new(
        "tile",
        "The directions in which the canvas repeats. Default `Both`.",
        Takes::Words(|| names(&TileMode::ALL)),
    ),
    FieldDecl::new("seed", "The seed of all random numbers. Default 0.", Takes::Value),
];

/// Fields of the layout of an instance.
pub const LAYOUT: &[FieldDecl] = &[
    FieldDecl::new("scale", "The factor of size: 2 is twice as large; one number or a pair.", Takes::Value),
    FieldDecl::new("angle", "The angle in degrees, from +x towards +y.", Takes::Value),
    FieldDecl::new("offset", "The shift to the right and down, in mm.", Takes::Value),
    FieldDecl::new(
        "size_mm",
        "The size in mm of the canvas on which the sub-graph is computed; only where the canvas does not tile.",
        Takes::Value,
    ),
];

/// Fields of the declaration of an input.
pub const INPUT: &[FieldDecl] = &[
    FieldDecl::new("default", "The value when no other is given.", Takes::Value),
    FieldDecl::new("doc", "A description for users.", Takes::Value),
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
    FieldDecl::new(
        "graph",
        "A name from `imports`. A path there that begins with `shibo:` names a shipped graph (`shibo new --list`). Other paths are relative to the file; `.ron` may be left out. `--import-path`, `$SHIBO_IMPORT_PATH` and a `shibo.toml` beside the graph or above it (`[imports]`, `paths = [\"…\"]`) name more folders.",
        Takes::Value,
    ),
    FieldDecl::new("over", "The number of instances, 1 to 64. Each costs as much as its visible area.", Takes::Value),
    FieldDecl::new(
        "ids",
        "The ids of the pieces. A hash of the id selects the instance, so that neighbours differ.",
        Takes::Ids,
    ),
    FieldDecl::new(
        "with",
        "Values for parameters and inputs of the sub-graph: `{ \"name\": value }`. An input takes a node, or a literal if it is a field.",
        Takes::Value,
    ),
    FieldDecl::new(
        "preset",
        "A preset of the sub-graph, or several: `\"a+b\"`. A value in `with` replaces that of the preset, and `--set USE.PARAM=VALUE` replaces both.",
        Takes::Value,
    ),
    FieldDecl::new(
        "seed",
        "The seed of the instance. Another number changes every random node in it. Instances without a seed are equal.",
        Takes::Value,
    ),
    FieldDecl::new(
        "canvas",
        "The layout of the outputs: `scale` (2 is larger; one number or a pair), `angle` (from +x towards +y), `offset` (to the right and down, in mm) and `size_mm`. The outputs are turned and scaled about the middle of the canvas and then moved, as by `Transform`. Normals turn, heights keep their mm, and inputs move along. Fields and materials can be moved.",
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
        FieldDecl::new("unit", "The unit, for display.", Takes::Value),
    ];
    let of_choices = [FieldDecl::new("options", "The words to choose from.", Takes::Value)];
    let own = match ty {
        "Number" | "Integer" => &of_numbers[..],
        "Choice" => &of_choices[..],
        _ => &[],
    };
    let group = [FieldDecl::new("group", "The heading under which views show the parameter.", Takes::Value)];
    [&INPUT[..1], own, &group[..], &INPUT[1..]].concat()
}

const FILE: &[FieldDecl] = &[
    FieldDecl::new("from", "The node, or `\"node.port\"`.", Takes::Output),
    FieldDecl::new("format", "The file format.", Takes::Words(|| Format::ALL.map(Format::name).to_vec())),
    FieldDecl::new("depth", "The type of the samples.", Takes::Words(|| Depth::ALL.map(Depth::name).to_vec())),
    FieldDecl::new("combined", "Writes all channels of a material into one file; only in `Exr`.", Takes::Truth(false)),
    FieldDecl::new(
        "range",
        "The values of the smallest and the largest integer: `(0, 1)`. With `Fit` they are the smallest and the largest value of the field.",
        Takes::Value,
    ),
    FieldDecl::new(
        "mip",
        "Writes an `Exr` or a `Tiff` in tiles with mip levels, as renderers read textures.",
        Takes::Truth(false),
    ),
    FieldDecl::new(
        "widen_roughness",
        "Increases the roughness of mip levels by the variance of the averaged normals.",
        Takes::Truth(true),
    ),
    FieldDecl::new(
        "normal",
        "The direction of `y` in a normal map: up, `OpenGl`, or down, `DirectX`.",
        Takes::Words(|| names(&Storage::NORMALS)),
    ),
    FieldDecl::new("color_space", "The colour space of the file.", Takes::Words(|| names(&FileColors::ALL))),
];

/// Fields of an output that is not just a name: of a target such as `Gltf`, or else of `File`.
pub fn output(word: &str) -> &'static [FieldDecl] {
    target_named(word).map_or(FILE, |target| target.info().fields)
}
