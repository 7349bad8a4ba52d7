//! Manual of composition: `Use` and `Each` are no nodes, so their manual is written here.

/// Heading of these words in lists.
pub const FAMILY: &str = "Composition";

/// Summary below the heading.
pub const ABOUT: &str = "Graphs within graphs.";

/// The words with their manuals, in the form of doc comments of nodes.
pub const KINDS: [(&str, &str); 2] = [("Use", USE), ("Each", EACH)];

/// Manual of a word.
pub fn doc(kind: &str) -> Option<&'static str> {
    KINDS.iter().find(|(name, _)| *name == kind).map(|(_, doc)| *doc)
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
```

What can be given:

- graph: a name from `imports`. There, `"shibo:walnut"` is a graph that comes with the program (`shibo new --list`); other paths are relative to the file, `.ron` may be left out, and `--import-path`, `$SHIBO_IMPORT_PATH` or a `shibo.toml` beside the graph or above it name more folders: `[imports]`, `paths = ["…"]`.
- with: values for parameters and inputs of the sub-graph, `{ "name": value }`. An input takes a node, or a literal if it is a field.
- preset: a preset of the sub-graph, or several, `"a+b"`. `with` comes before the preset, and `--set USE.PARAM=VALUE` before `with`.
- seed: another number gives another instance: every random node in it changes. Instances without a seed are equal.
- canvas: how the outputs of the instance lie: `scale` (2 is larger; one number or a pair), `angle` (from +x towards +y) and `offset` (to the right and down, in mm). They are turned and scaled about the middle of the canvas and then moved, as `Transform` does; normals turn, heights keep their mm, and what is given to inputs moves along. Fields and materials can be moved.
- note: a text for readers.

On a canvas that tiles, an instance that is turned by 90° or made smaller by a whole number still tiles; others are warned of. On one that does not tile, a sub-graph that is turned is made on a canvas two, four or eight times as large, so that corners are not empty.

A sub-graph says what it takes in `inputs`: `"height": Gray(default: 0.5)`, `"ground": Material()`, also of the types `Rgb`, `Normal`, `Vec2`, `Jacobian`, `Ids`, `Solid`, `SolidColor`, `SolidVector` and all others. What others may change is in `params`: `Number`, `Integer`, `Bool`, `Color`, `Text`, `Path` and `Choice`. A default is a literal or one of the graph's own nodes. A material without a default must be given; rendered alone, the graph uses the defaults of channels that are missing.

Nodes inside of an instance are `wood/year` for `dump` and `render --node`; an output of it is `wood.material`.

Elsewhere: Substance Designer *Graph Instance*; Blender *Node Group*; Houdini *Subnet*; Material Maker *Group*; Unreal *Material Function*."#;

const EACH: &str = r#"Several instances of another graph, of which one shows in every piece: the boards of a floor, the scales of a skin.

```ron
imports: { "walnut": "shibo:walnut" },
nodes: {
  "cells":  Worley(size: 30),
  "boards": Each(graph: "walnut", over: 4, ids: "cells.ids", with: { "distance": "= 20 + 25 * $index" }),
},
outputs: { "material": "boards.material" },
```

What can be given besides the fields of `Use`, which hold for all instances:

- over: how many instances there are, 1 to 64. Each costs as much as it shows.
- ids: the numbers of the pieces. A hash of the number decides which instance shows, so that neighbours are unlike.

In `with` and `preset`, `$index` is the number of the instance, from 0. Instances differ by their seeds even if nothing else differs. Fields and materials can be chosen among.

`--set boards.tone=2` reaches all instances, `--set boards.3.tone=2` the fourth; its nodes are `boards/3/year`.

Elsewhere: Houdini *For-Each*, *Copy to Points*; Blender *Instance on Points*; Substance Designer *Multi Switch*."#;
