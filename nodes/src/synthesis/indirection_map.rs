//! [`IndirectionMap`]: neighbours, on the surface, of the pixels of an atlas.
//!
//! Source: JP5149288B2 III, claims 6, 7, 13, 14 (rows C24, C25): a pixel beyond the border of a chart is looked up in
//! the chart where the surface continues. Beyond the source, places between pixels are kept exactly. Cost: O(pixels).
use super::jacobian_from_mesh::of_one_mesh;
use shibo_kernel::mesh::levels::{LevelsSpec, indirection};
use shibo_node::{Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Frames, Stop, Type};

/// Precision with which the place of a neighbour is stored.
#[choice]
pub enum Jumps {
    /// The pixel, and the offset of the place from its centre, because the pixels of two charts do not line up.
    #[default]
    Exact,
    /// Only the pixel, as in the source.
    Nearest,
}

/// Finds the neighbours, on the surface, of the pixels of an atlas, level by level.
///
/// `SynthesizeSurface` does this automatically. Use this node to run its stages one by one, or to look at the map with
/// `shibo dump`, which lists the neighbours found for the pixels just outside of the charts.
///
/// No other program has this: Houdini's UV islands and Blender's margin of baked pictures copy colours across borders,
/// but do not tell which pixels lie there.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": IndirectionMap(atlas: "atlas", size: 128, levels: 4),
/// ```
#[node]
pub struct IndirectionMap {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Directions on its mesh. Where they jump by a half or a quarter turn, as may happen with `symmetry: 2` and `4`,
    /// the surface ends.
    pub frames: Option<In<Frames>>,
    /// Columns of the finest level; rows follow from the canvas. 512 by default.
    #[schemars(extend("minimum" = 16.0, "maximum" = 16384.0))]
    pub size: Option<u32>,
    /// Number of levels; each has half the resolution of the one before.
    #[schemars(range(min = 1, max = 12))]
    #[default(6)]
    pub levels: u32,
    /// Precision with which the place of a neighbour is stored.
    #[default(Jumps::Exact)]
    pub jumps: Jumps,
    /// Width of the border around charts that `shibo dump` lists, in pixels.
    #[schemars(range(min = 1, max = 8))]
    #[default(2)]
    pub gutter: u32,
}

/// The columns and rows of a map over an atlas, or an error if the map would not fit into memory.
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
