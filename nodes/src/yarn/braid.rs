//! [`Braid`]: rope, braids and cords side by side.
//!
//! See [`kernel::braid`](shibo_kernel::yarn::braid). Cost: O(strands + pixels), by tiles.
use super::parts::{self, ACROSS, ALONG, CROWN, DIRECTION, FIBER, HEIGHT, MASK, Make, THREAD};
use crate::fitted;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::yarn::braid::{BandShape, Bands, default_strand};
use shibo_kernel::yarn::lines::fit;
use shibo_kernel::yarn::section::Yarn;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};

/// Rope, plaits, flat braids and round cords, side by side along x over the whole canvas.
///
/// Strands are threads with plies, a twist and fibres of their own; in rope they wind against the rope. A whole number
/// of bands and of turns fits the canvas, and a warning tells the change of `pitch`. Cut out a single band by
/// `band == 2`, and turn it by `Transform`.
///
/// ```ron
/// "rope": Braid(shape: Rope, strands: 3, pitch: 8, plies: 6),
/// "hemp": "= mix(#3a2a18, #b59a68, rope.crown) * (0.7 + 0.6 * rope.fiber)",
/// "example": Relief(height: "rope", base_color: "hemp", environment: Studio),
/// ```
///
/// Elsewhere: Substance Designer *Rope*, *Braid*; Blender *screw* of strands; trim, piping, lanyard, plait, cane edge.
#[node]
#[derive(PartialEq)]
pub struct Braid {
    /// The make of a band.
    #[default(BandShape::Rope)]
    pub shape: BandShape,
    /// Number of strands of a band: 2 to 48.
    #[schemars(range(min = 2, max = 48))]
    #[default(3)]
    pub strands: u32,
    /// Distance from band to band.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(8.0)]
    pub pitch: f64,
    /// Width of a band as a share of the pitch: less than 1 leaves gaps, and more than 1 presses bands together.
    #[schemars(range(min = 0.1, max = 1.5))]
    #[default(1.0)]
    pub cover: f64,
    /// Length of a turn of a strand, or of its way over a braid and back; a negative length has the other hand. By
    /// default 3.4 times the width of rope and cord, and 1.9 times that of a flat braid.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub lay: Option<f64>,
    /// Every second band winds the other way.
    pub alternate: bool,
    /// Width of a strand, at most that of a band; by default strands touch.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub width: Option<f64>,
    /// Thickness of a strand, at most twice its width; by default 0.85 of the width.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub thickness: Option<f64>,
    /// Form of a strand of one ply: 0 an ellipse, 1 a strip with round edges, as of leather or cane.
    #[schemars(range(min = 0, max = 1))]
    pub flat: f64,
    /// Number of yarns or plies of a strand; 1 for a smooth strand.
    #[schemars(range(min = 1, max = 12))]
    #[default(4)]
    pub plies: u32,
    /// Length of one turn of the plies of a strand; a negative length winds the other way, 0 does not wind. By default
    /// four times the width, against the rope.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub twist: Option<f64>,
    /// Width of visible bundles of fibres; 0 for a smooth strand. By default a sixteenth of the width.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub fiber: Option<f64>,
    /// Variation of the thickness along the strands.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.2)]
    pub slub: f64,
    /// Unevenness of the bands.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.4)]
    pub irregular: f64,
    /// Another seed gives other unevenness.
    pub seed: u64,
}

impl Braid {
    fn bands(&self, size: DVec2) -> Bands {
        let count = fit(size.y, self.pitch, 1);
        let width = size.y / f64::from(count) * self.cover;
        let (strand, lay) = default_strand(self.shape, self.strands, width);
        let lay = self.lay.filter(|lay| *lay != 0.0).unwrap_or(lay);
        let strand = self.width.unwrap_or(strand);
        let thickness = self.thickness.unwrap_or(0.85 * strand);
        Bands {
            shape: self.shape,
            strands: self.strands,
            count,
            turns: (size.x / lay.abs()).round().max(1.0) * lay.signum(),
            size,
            width,
            strand: DVec2::new(strand, thickness),
            irregular: self.irregular,
            alternate: self.alternate,
        }
    }

    /// The yarns of bands of either hand.
    fn yarns(&self, bands: &Bands) -> [Yarn; 2] {
        let Self { plies, fiber, slub, flat, .. } = *self;
        let twist = self.twist.unwrap_or(-4.0 * bands.strand.x * bands.turns.signum());
        [twist, -twist].map(|twist| {
            let twist = Some(twist);
            Make { width: bands.strand.x, thickness: bands.strand.y, flat, plies, twist, fiber, slub }.yarn()
        })
    }
}

impl Node for Braid {
    const OUTPUTS: &'static [Output] = &[
        HEIGHT,
        MASK,
        THREAD,
        ALONG,
        ACROSS,
        DIRECTION,
        CROWN,
        FIBER,
        Output::new("band", Type::Ids, "The number of the band, from 1 at the top; 0 where there is none."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        if self.shape == BandShape::Cord && !self.strands.is_multiple_of(4) {
            let message = format!("strands is `{}`; a `Cord` takes a multiple of 4", self.strands);
            return vec![Problem::new(Code::OutOfRange, message).at("strands").help("write `strands: 16`")];
        }
        let bands = self.bands(canvas.size_mm());
        let points = bands.points();
        let turns = f64::from(bands.count) * bands.turns.abs();
        let turn = canvas.size_mm().x / bands.turns.abs();
        let field = if self.lay.is_some() { "lay" } else { "pitch" };
        let problems = [
            parts::too_many("turns of bands", points, points / turns.max(1.0), field),
            parts::at_most(
                "width",
                bands.strand.x,
                bands.width.min(turn),
                "the width of a band and the length of a turn",
            ),
            parts::at_most("thickness", bands.strand.y, 2.0 * bands.strand.x, "twice the width"),
        ];
        problems.into_iter().flatten().collect()
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let laid = canvas.size_mm().y / f64::from(self.bands(canvas.size_mm()).count);
        if (laid / self.pitch - 1.0).abs() < 2e-3 {
            return Vec::new();
        }
        let message = format!("bands are {laid:.4} mm apart instead of {} mm{}", self.pitch, fitted::FITS);
        vec![Problem::new(Code::Advice, message).at("pitch")]
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::BOTH
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let bands = self.bands(cx.size_mm());
        let hash = Hash::new(cx.seed(self.seed));
        let parts = parts::outputs(cx, &bands.lines(hash), &self.yarns(&bands), hash.with(9))?;
        Ok(parts.outputs().with("band", parts.part(Type::Ids)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn braids_conform() {
        let shapes = [(BandShape::Rope, 3), (BandShape::Flat, 3), (BandShape::Flat, 6), (BandShape::Cord, 12)];
        for (shape, strands) in shapes {
            conforms(&Braid { shape, strands, alternate: true, irregular: 1.0, ..Braid::default() }, &[]);
        }
        conforms(&Braid { shape: BandShape::Flat, plies: 1, flat: 1.0, cover: 0.8, ..Braid::default() }, &[]);
    }

    #[test]
    fn bands_have_numbers() {
        let node = Braid { pitch: 8.0, ..Braid::default() };
        let most = |name: &str| {
            let tile = part(&field(&node, &[], name), &canvas(), 0, 0, 64, 64);
            tile.data().iter().copied().fold(0.0, f32::max)
        };
        assert_eq!([most("band"), most("thread")], [4.0, 12.0]);
    }

    #[test]
    fn refuses_invalid_braids() {
        let refused = |node: Braid| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(Braid::default()), None);
        let cord = Braid { shape: BandShape::Cord, strands: 6, ..Braid::default() };
        assert_eq!(refused(cord).as_deref(), Some("strands"));
        assert_eq!(refused(Braid { pitch: 1e-3, ..Braid::default() }).as_deref(), Some("pitch"));
        assert_eq!(refused(Braid { lay: Some(1e-4), ..Braid::default() }).as_deref(), Some("lay"));
        assert_eq!(refused(Braid { width: Some(20.0), ..Braid::default() }).as_deref(), Some("width"));
        assert!(Braid { pitch: 7.0, ..Braid::default() }.advice_on(&canvas())[0].message.contains("instead of 7 mm"));
    }
}
