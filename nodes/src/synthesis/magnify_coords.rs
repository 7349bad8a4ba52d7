//! [`MagnifyCoords`]: a detailed picture at coordinates that were found on a coarse one.
//!
//! Source: JP5149288B2 III, equations (5) and (6), claims 8, 15, 20 (rows C27 to C30). The coordinates stay as they are:
//! at any output resolution they show a picture of any resolution. Cost: O(pixels).
use super::sampled::Sampled;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::node::{AnyField, CanvasFacts, Context, Fact, In, JacobianField, Node, Output, Outputs};
use shibo_engine::value::{CoordMap, Stop, Tiling};
use shibo_kernel::synthesis::texels::Fetch;

/// Shows a finer picture of the exemplar at coordinates that were synthesised from a coarse one.
///
/// Between coordinates, equation (6) of the source is used with a Jacobian, and (5), which fits `J = 1`, without.
///
/// Coordinates that never met an exemplar, such as those of `StartCoords` alone, are read as pixels of `input`: of its own if
/// it is a picture file, else of 128x128 over the canvas.
///
/// ```ron
/// "coarse": Worley(size: 10, jitter: 0.8),
/// "exemplar": Exemplar(input: "coarse", size: (24, 24), periodic: Yes),
/// "coords": Synthesize(exemplar: "exemplar", size: (48, 48)),
/// "example": MagnifyCoords(coords: "coords", input: "coarse", resolution: 8),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MagnifyCoords {
    /// The coordinates.
    pub coords: In<CoordMap>,
    /// What they show: a fine picture over the same place as the exemplar's.
    pub input: In<AnyField>,
    /// The Jacobian that the coordinates follow; those of a surface know theirs.
    pub jacobian: Option<In<JacobianField>>,
    /// How many pixels of `input` are read per pixel of the exemplar, in x and in y. By default those of the picture, where
    /// it is one.
    #[schemars(range(min = 1, max = 64))]
    pub resolution: Option<u32>,
    /// How values between the picture's pixels are made.
    pub filter: Fetch,
    /// Whether values are heights that grow with their features; they are then divided by √|det J|; on a
    /// surface multiplied by the size of features there.
    pub scale_heights: bool,
}

impl Default for MagnifyCoords {
    fn default() -> Self {
        Self {
            coords: In::default(),
            input: In::default(),
            jacobian: None,
            resolution: None,
            // The picture is fine already.
            filter: Fetch::Bilinear,
            scale_heights: false,
        }
    }
}

impl Node for MagnifyCoords {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The picture at the coordinates.")];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn makes_tile(&self, port: &str) -> bool {
        port == "input"
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (coords, input, jacobian) = (cx.get(&self.coords)?, cx.get(&self.input)?, cx.get_opt(&self.jacobian)?);
        let sampled = Sampled::new(cx, coords, input, jacobian, self.filter, self.scale_heights, self.resolution)?;
        Ok(Outputs::one(sampled.into_field()))
    }
}
