//! Manuals of the words of graph files that are no nodes: `Use`, `Each`, the canvas and the forms of outputs. The fields come
//! from the schema that the loader reads.
use shibo_graph::schema;
use shibo_node::ParamType;
use shibo_picture::export::{FieldDecl, TARGETS};
use std::fmt::Write;
use std::sync::LazyLock;

/// A word with its manual.
pub struct Word {
    /// The heading in lists.
    pub family: &'static str,
    /// The word.
    pub name: &'static str,
    /// The manual, in the form of doc comments of nodes.
    pub doc: String,
}

/// The headings, with a summary below each.
pub const FAMILIES: [(&str, &str); 2] =
    [(COMPOSITION, "Graphs within graphs."), (GRAPH_FILE, "The other parts of a graph file, and its outputs.")];

const COMPOSITION: &str = "Composition";
const GRAPH_FILE: &str = "Graph file";

/// All words, in the order of lists.
pub static WORDS: LazyLock<Vec<Word>> = LazyLock::new(|| {
    let word = |family, name, doc| Word { family, name, doc };
    let own = schema::instance(true).into_iter().filter(|field| matches!(field.name, "over" | "ids"));
    let mut words = vec![
        word(COMPOSITION, "Use", format!("{USE}\n\n{}\n{USE_TEXT}", fields("Fields:", schema::instance(false)))),
        word(
            COMPOSITION,
            "Each",
            format!("{EACH}\n\n{}\n{EACH_TEXT}", fields("The fields of `Use` hold for all instances. Others:", own)),
        ),
        word(GRAPH_FILE, "graph", section("A graph file, `(nodes: {…}, outputs: {…})`.", schema::ROOT)),
        word(GRAPH_FILE, "canvas", section("The canvas of a graph, `canvas: (size_mm: 40)`.", schema::CANVAS)),
        word(GRAPH_FILE, "params", params()),
        word(GRAPH_FILE, "formula", FORMULA.to_owned()),
        word(GRAPH_FILE, "inputs", section("An input of a graph, `\"field\": Gray(default: 0.5)`.", schema::INPUT)),
        word(
            GRAPH_FILE,
            "File",
            section("An output with options, `\"height\": File(from: \"node\", format: Exr)`.", schema::output("File")),
        ),
    ];
    words.extend(TARGETS.iter().map(|target| {
        let info = target.info();
        word(GRAPH_FILE, info.name, section(info.doc, info.fields))
    }));
    words
});

/// Manual of a word.
pub fn doc(name: &str) -> Option<&'static str> {
    WORDS.iter().find(|word| word.name == name).map(|word| word.doc.as_str())
}

fn section(about: &str, declared: &[FieldDecl]) -> String {
    format!("{about}\n\n{}", fields("Fields:", declared.iter().copied()))
}

fn params() -> String {
    let mut text = String::from("A parameter of a graph, `\"pitch\": Number(default: 0.8, range: (0.2, 4))`.\n");
    let mut groups: Vec<(Vec<ParamType>, Vec<FieldDecl>)> = Vec::new();
    for ty in schema::PARAM_TYPES {
        let declared = schema::param(ty.name());
        match groups.iter_mut().find(|(_, same)| names(same) == names(&declared)) {
            Some((types, _)) => types.push(ty),
            None => groups.push((vec![ty], declared)),
        }
    }
    for (types, declared) in groups {
        let types: Vec<_> = types.iter().map(|ty| format!("`{}`", ty.name())).collect();
        let _ = write!(text, "\n{}", fields(&format!("Fields of {}:", types.join(", ")), declared));
    }
    text
}

fn names(declared: &[FieldDecl]) -> Vec<&str> {
    declared.iter().map(|field| field.name).collect()
}

/// A list of fields below a line.
fn fields(about: &str, declared: impl IntoIterator<Item = FieldDecl>) -> String {
    let mut text = format!("{about}\n\n");
    for field in declared {
        let _ = writeln!(text, "- {}: {}", field.name, field.manual());
    }
    text
}

const USE: &str = r#"Puts another graph into this one: an instance of it. Its outputs are the ports of the instance.

```ron
imports: { "walnut": "shibo:walnut", "inlay": "lib/inlay" },
nodes: {
  "wood":    Use(graph: "walnut", preset: "veneer", with: { "rings": 2 }, seed: 5),
  "turned":  Use(graph: "walnut", canvas: (angle: 90, scale: 0.5, offset: (10, 0))),
  "set_in":  Use(graph: "inlay", with: { "ground": "wood.material", "inlay": "turned.material" }),
},
outputs: { "material": "set_in.material" },
```"#;

const USE_TEXT: &str = r#"On a canvas that tiles, an instance that is turned by 90° or made smaller by a whole number still tiles; other layouts give a warning. On a canvas that does not tile, a turned sub-graph is computed on a canvas two, four or eight times as large, so that corners are not empty.

A sub-graph declares its inputs in `inputs`: `"height": Gray(default: 0.5)`, `"ground": Material()`, also of the types `Rgb`, `Normal`, `Vec2`, `Jacobian`, `Ids`, `Solid`, `SolidColor`, `SolidVector` and all others. Its parameters are in `params`: `Number`, `Integer`, `Bool`, `Color`, `Text`, `Path` and `Choice`. A default is a literal or one of the graph's own nodes. A material without a default must be given; rendered alone, the graph uses the defaults of channels that are missing.

Nodes inside of an instance are `wood/year` for `dump` and `render --node`; an output of it is `wood.material`.

Elsewhere: Substance Designer *Graph Instance*; Blender *Node Group*; Houdini *Subnet*; Material Maker *Group*; Unreal *Material Function*."#;

const FORMULA: &str = r#"A value that is computed from nodes, parameters and the position: in place of a node, in a port, or for a parameter.

```ron
nodes: {
  "grey":   "= 0.5",
  "waves":  Perlin(size: 3),
  "relief": "= 0.8 * waves + 0.2 * smoothstep(0, 1, u)",
  "soft":   Blur(input: "= abs(waves - grey)", radius: "= 2 * $radius"),
},
```

Elsewhere: Substance Designer *Uniform Color*, *Pixel Processor*, *Value Processor*; Blender *Math*, *Vector Math*, *Value*, *RGB*; Houdini *Constant*, *VEX Snippet*; Material Maker *Uniform*, *Math*; Unreal *Constant*, *Custom*."#;

const EACH: &str = r#"Several instances of another graph, of which one shows in every piece: the boards of a floor, the scales of a skin.

```ron
imports: { "walnut": "shibo:walnut" },
nodes: {
  "cells":  Worley(size: 30),
  "boards": Each(graph: "walnut", over: 4, ids: "cells.ids", with: { "distance": "= 20 + 25 * $index" }),
},
outputs: { "material": "boards.material" },
```"#;

const EACH_TEXT: &str = r#"In `with` and `preset`, `$index` is the number of the instance, from 0. Instances differ by their seeds even if nothing else differs. Fields and materials can be chosen among.

`--set boards.tone=2` reaches all instances, `--set boards.3.tone=2` the fourth; its nodes are `boards/3/year`.

Elsewhere: Houdini *For-Each*, *Copy to Points*; Blender *Instance on Points*; Substance Designer *Multi Switch*."#;
