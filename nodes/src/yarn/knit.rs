//! [`Knit`]: knitted fabric by a chart.
//!
//! See [`kernel::knit`](shibo_kernel::yarn::knit). Cost: O(stitches + pixels), by tiles.
use super::parts::{self, ACROSS, ALONG, CROWN, DIRECTION, FIBER, HEIGHT, MASK, Make, THREAD};
use crate::fitted;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::yarn::chart::Chart;
use shibo_kernel::yarn::knit::{Knitted, POINTS};
use shibo_kernel::yarn::lines::fit;
use shibo_kernel::yarn::section::Yarn;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};

/// Knitted fabric: rows of loops by a chart, of a yarn with plies, twist and fibres.
///
/// A chart has a letter for each stitch, as it looks from the front, and repeats: `k` is a knit stitch, `p` a purl
/// stitch. A run of an even number of `c` is a cable: its right half crosses over its left half, and with `C` the
/// left half over the right one. A space separates cables that lie side by side. Rows run from the top and are
/// separated by `/`. Some charts have names: `stocking`, `reverse`, `rib`, `garter`, `moss`, `basket`, `cable`.
///
/// The fabric repeats with the canvas: a whole number of charts fits it, and a warning tells the change of the
/// stitches. Rows of colour follow from `stitch`, as in docs/yarn.md. Add hairs with `Fibers`.
///
/// ```ron
/// "knit": Knit(chart: "ppkkkkpp/ppkkkkpp/pp cccc pp/ppkkkkpp/ppkkkkpp", stitch: (5, 4)),
/// "wool": "= mix(#43302a, #c9b79c, knit.crown) * (0.8 + 0.4 * knit.fiber)",
/// "example": Relief(height: "knit", base_color: "wool", environment: Studio),
/// ```
///
/// Elsewhere: Substance Designer *Knit* patterns, jersey, jumper, sweater, crochet; Houdini *Knit*; CLO *rib*.
#[node]
#[derive(PartialEq)]
pub struct Knit {
    /// The chart: its name, or letters, rows separated by `/`. At most 256 × 256.
    #[default("stocking".into())]
    pub chart: String,
    /// Width and height of a stitch. A gauge of 22 stitches and 30 rows in 100 mm is (4.5, 3.3).
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Xy::new(4.5, 3.4))]
    pub stitch: Xy,
    /// Width of the yarn, at most the width of a stitch and twice its height; by default 0.42 of it, which closes the fabric.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub width: Option<f64>,
    /// Thickness of the yarn, at most twice its width; by default 0.85 of the width.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub thickness: Option<f64>,
    /// Number of plies of the yarn; 1 for a single yarn.
    #[schemars(range(min = 1, max = 12))]
    #[default(3)]
    pub plies: u32,
    /// Length of one turn of the plies; a negative length winds the other way, 0 does not wind. By default four times
    /// the width.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub twist: Option<f64>,
    /// Width of visible bundles of fibres; 0 for a smooth yarn. By default a sixteenth of the width.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub fiber: Option<f64>,
    /// Variation of the thickness along the yarn: thick and thin places.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.2)]
    pub slub: f64,
    /// Unevenness of the stitches: 0 as by a machine, 1 as by a beginner.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.4)]
    pub irregular: f64,
    /// Another seed gives other unevenness.
    pub seed: u64,
}

impl Knit {
    fn yarn(&self, knitted: &Knitted) -> Yarn {
        let Self { plies, twist, fiber, slub, .. } = *self;
        Make { width: knitted.yarn.x, thickness: knitted.yarn.y, flat: 0.0, plies, twist, fiber, slub }.yarn()
    }

    fn knitted(&self, size: DVec2) -> Result<Knitted, String> {
        let chart = Chart::read(&self.chart)?;
        let counts = [fit(size.x, self.stitch.x, chart.columns), fit(size.y, self.stitch.y, chart.rows)];
        let width = self.width.unwrap_or(0.42 * size.x / f64::from(counts[0]));
        let yarn = DVec2::new(width, self.thickness.unwrap_or(0.85 * width));
        Ok(Knitted { chart, counts, size, yarn, irregular: self.irregular })
    }
}

impl Node for Knit {
    const OUTPUTS: &'static [Output] = &[
        HEIGHT,
        MASK,
        THREAD,
        ALONG,
        ACROSS,
        DIRECTION,
        CROWN,
        FIBER,
        Output::new(
            "stitch",
            Type::Ids,
            "The number of the stitch, from 1, row by row from the top; 0 where there is none.",
        ),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let knitted = match self.knitted(canvas.size_mm()) {
            Ok(knitted) => knitted,
            Err(message) => return vec![Problem::new(Code::BadValue, message).at("chart")],
        };
        let stitches = f64::from(knitted.counts[0]) * f64::from(knitted.counts[1]);
        let points = f64::from(POINTS);
        let (laid, yarn) = (knitted.stitch(), knitted.yarn);
        let problems = [
            parts::too_many("stitches", stitches * points, points, "stitch"),
            parts::at_most("width", yarn.x, laid.x.min(2.0 * laid.y), "the width of a stitch and twice its height"),
            parts::at_most("thickness", yarn.y, 2.0 * yarn.x, "twice the width"),
        ];
        problems.into_iter().flatten().collect()
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Ok(knitted) = self.knitted(canvas.size_mm()) else { return Vec::new() };
        let wanted = DVec2::new(self.stitch.x, self.stitch.y);
        fitted::advice(("stitch", "stitches"), [wanted, knitted.stitch()], [0.0, 0.0], fitted::FITS)
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::BOTH
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let knitted = self.knitted(cx.size_mm()).map_err(|why| Problem::new(Code::BadValue, why).at("chart"))?;
        let hash = Hash::new(cx.seed(self.seed));
        let parts = parts::outputs(cx, &knitted.lines(hash), &[self.yarn(&knitted)], hash.with(9))?;
        Ok(parts.outputs().with("stitch", parts.part(Type::Ids)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn knitting_conforms() {
        for chart in ["stocking", "cable", "kp/pk"] {
            conforms(&Knit { chart: chart.into(), stitch: Xy::new(4.0, 2.7), irregular: 1.0, ..Knit::default() }, &[]);
        }
    }

    #[test]
    fn stitches_have_numbers() {
        // Eight columns and ten rows.
        let node = Knit { stitch: Xy::new(4.0, 3.2), ..Knit::default() };
        assert_eq!(node.advice_on(&canvas()), []);
        let most = |name: &str| {
            let tile = part(&field(&node, &[], name), &canvas(), 0, 0, 64, 64);
            tile.data().iter().copied().fold(0.0, f32::max)
        };
        assert_eq!([most("stitch"), most("thread")], [80.0, 10.0]);
        let uneven = Knit { stitch: Xy::new(4.3, 3.2), ..Knit::default() };
        assert!(uneven.advice_on(&canvas())[0].message.starts_with("stitches are 4.5714 × 3.2000 mm instead of"));
    }

    #[test]
    fn refuses_invalid_knitting() {
        let refused = |node: Knit| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(Knit::default()), None);
        assert_eq!(refused(Knit { chart: "kx".into(), ..Knit::default() }).as_deref(), Some("chart"));
        assert_eq!(refused(Knit { stitch: Xy::new(1e-3, 1e-3), ..Knit::default() }).as_deref(), Some("stitch"));
        assert_eq!(refused(Knit { stitch: Xy::new(1e-300, 3.0), ..Knit::default() }).as_deref(), Some("stitch"));
        assert_eq!(refused(Knit { width: Some(9.0), ..Knit::default() }).as_deref(), Some("width"));
        assert_eq!(refused(Knit { thickness: Some(9.0), ..Knit::default() }).as_deref(), Some("thickness"));
    }
}
