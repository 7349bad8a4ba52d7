//! [`IndirectionMap`]: which pixels of an atlas lie beside each other on the surface.
//!
//! Source: JP5149288B2 III, claims 6, 7, 13, 14 (rows C24, C25): a pixel beyond the border of a chart is looked up where the
//! surface goes on, in another chart. Beyond the source, what is kept of a place between pixels is exact. Cost: O(pixels).
use super::jacobian_from_mesh::of_one_mesh;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{Atlas, Frames, Stop, Type};
use shibo_kernel::mesh::levels::{LevelsSpec, indirection};

/// What is kept of where a neighbour lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Jumps {
    /// The pixel, and where the place lies from its centre, since the pixels of two charts do not line up.
    #[default]
    Exact,
    /// The pixel alone, as in the source.
    Nearest,
}

/// Finds for the pixels of an atlas which others lie beside them on the surface, level by level.
///
/// `SynthesizeSurface` does this by itself. Use this node to run its stages one by one, or to look at the map with
/// `shibo dump`, which lists for the pixels just outside of the charts what is found there.
///
/// No other program has it: Houdini's UV islands and Blender's margin of baked pictures copy colours across borders, and do not
/// tell what lies there.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": IndirectionMap(atlas: "atlas", size: 128, levels: 4),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IndirectionMap {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Directions on its mesh. Where they turn by half or a quarter of a turn, as those of `symmetry: 2` and `4` may, the
    /// surface ends.
    pub frames: Option<In<Frames>>,
    /// Columns of the finest level; rows follow from the canvas. 512 by default.
    #[schemars(extend("minimum" = 16.0, "maximum" = 16384.0))]
    pub size: Option<u32>,
    /// How many levels, each half as fine as the one before.
    #[schemars(range(min = 1, max = 12))]
    pub levels: u32,
    /// What is kept of where a neighbour lies.
    pub jumps: Jumps,
    /// How many pixels around the charts are listed by `shibo dump`.
    #[schemars(range(min = 1, max = 8))]
    pub gutter: u32,
}

impl Default for IndirectionMap {
    fn default() -> Self {
        Self { atlas: In::default(), frames: None, size: None, levels: 6, jumps: Jumps::Exact, gutter: 2 }
    }
}

/// The columns and rows of a map over an atlas, refused if it were too large for the memory.
pub(super) fn map_size(cx: &Context<'_>, atlas: &Atlas, columns: u32, bytes: u64) -> Result<[u32; 2], Stop> {
    let rows = (f64::from(columns) * atlas.size_mm.y / atlas.size_mm.x).round().max(1.0);
    let need = f64::from(columns) * rows * bytes as f64;
    if rows > 16_384.0 || need > cx.evaluator.memory() as f64 {
        let message = format!(
            "a map of `{columns}x{rows}` pixels takes {:.0} MiB; {} MiB are allowed",
            need / 1_048_576.0,
            cx.evaluator.memory() >> 20
        );
        return Err(Problem::new(Code::TooLarge, message).at("size").help("lower `size`, or raise --memory").into());
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
    let rows = rows as u32;
    Ok([columns, rows])
}

impl Node for IndirectionMap {
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("map", Type::IndirectionMap, "For each pixel, which others lie beside it.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        let size = map_size(cx, &atlas, self.size.unwrap_or(512), 12)?;
        let exact = self.jumps == Jumps::Exact;
        let ends = match cx.get_opt(&self.frames)? {
            Some(frames) => {
                of_one_mesh(&atlas, &frames)?;
                frames.ends()
            }
            None => Vec::new(),
        };
        let spec = LevelsSpec { size, levels: self.levels, exact, ring: self.gutter, ends: &ends };
        let map = indirection(&atlas, &spec, &|| cx.check().is_err());
        cx.check()?;
        Ok(Outputs::one(map))
    }
}
