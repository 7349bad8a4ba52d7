//! [`MagnifyCoords`]: shows a detailed picture at coordinates that were synthesised from a coarse one.
//!
//! Source: JP5149288B2 III, equations (5) and (6), claims 8, 15, 20 (rows C27 to C30). The coordinates stay unchanged:
//! they can show a picture of any resolution at any output resolution. Cost: O(pixels).
use super::sampled::Sampled;
use shibo_kernel::synthesis::texels::Fetch;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, JacobianField, Node, Output, Outputs, node};
use shibo_value::{CoordMap, Stop, Tiling};

/// Shows a finer picture of the exemplar at coordinates that were synthesised from a coarse one.
///
/// Between coordinates, equation (6) of the source is used if a Jacobian is connected, otherwise (5), which is right
/// for `J = 1`.
///
/// Coordinates without an exemplar, such as those of `StartCoords` alone, count pixels of `input`: the pixels of the
/// file if it is a picture, otherwise 128x128 pixels over the canvas.
///
/// ```ron
/// "coarse": Worley(size: 10, jitter: 0.8),
/// "exemplar": Exemplar(input: "coarse", size: (24, 24), periodic: Yes),
/// "coords": Synthesize(exemplar: "exemplar", size: (48, 48)),
/// "example": MagnifyCoords(coords: "coords", input: "coarse", resolution: 8),
/// ```
#[node]
pub struct MagnifyCoords {
    /// The coordinates.
    pub coords: In<CoordMap>,
    /// The picture to show: a fine one that covers the same area as the exemplar.
    pub input: In<AnyField>,
    /// The Jacobian of the coordinates; coordinates on a surface contain it.
    pub jacobian: Option<In<JacobianField>>,
    /// Number of pixels of `input` per pixel of the exemplar, in x and in y. By default that of the picture file, if it
    /// is one.
    #[schemars(range(min = 1, max = 64))]
    pub resolution: Option<u32>,
    /// Interpolation between the picture's pixels.
    // The picture is fine already, so interpolation is enough.
    #[default(Fetch::Bilinear)]
    pub filter: Fetch,
    /// True for heights that grow with their features: they are divided by √|det J|, and on a surface multiplied by the
    /// size of features there.
    pub scale_heights: bool,
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
