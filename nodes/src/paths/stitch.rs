//! [`Stitch`]: sewing thread along a path.
//!
//! Stitches are straight between their holes. [`kernel::seam`](shibo_kernel::path::seam) places them and
//! [`kernel::thread`](shibo_kernel::path::thread) draws them. Cost of a tile: the pixels of the stitches near it.
use crate::bounds::{exceeds, told};
use crate::degrees::sin_cos;
use crate::planes::plane;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::path::seam::{self, Seam};
use shibo_kernel::path::thread::{Bit, Drawn, MOST_STRANDS, Thread};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Field, Stop, Type};
use std::sync::Arc;

/// Maximum length of a stitch, as a share of the pitch.
const LONGEST: f64 = 1.5;

/// Maximum number of stitches.
const MOST_STITCHES: f64 = 1e6;

/// Sews along a path: twisted thread that comes out of holes and goes in again, and pulls the ground down.
///
/// The distance between stitches is changed a little, so that a whole number of them fits each curve. Lay the thread on
/// its ground with `BlendMaterials` by `mask`; subtract `pull`, and `holes` times their depth, from the ground's
/// height, as in the example.
///
/// ```ron
/// "seam": Path(d: "M 0 20 C 13 8 27 32 40 20"),
/// "sewn": Stitch(path: "seam", pitch: 8.5, width: 2.2, tilt: -9, twist: 6.5, pull: 0.6, spread: 7),
/// "ground": "= -sewn.pull - 1.5 * sewn.holes",
/// "height": Blend(base: "ground", top: "sewn", mask: "sewn.mask"),
/// "color": Blend(base: "#6b3f22", top: "#d9c9a6", mask: "sewn.mask"),
/// "example": Relief(height: "height", base_color: "color"),
/// ```
///
/// Elsewhere: Substance Designer *Stitches*, Substance Painter *Stitch* brushes.
#[node]
pub struct Stitch {
    /// The path of the seam.
    pub path: In<value::Path>,
    /// Distance from one stitch to the next; 25.4 divided by the stitches per inch.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(3.6)]
    pub pitch: f64,
    /// Visible length of a stitch, at most one and a half times the pitch; by default nearly the whole pitch, as in a
    /// saddle stitch, where two stitches share a hole.
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub length: Option<f64>,
    /// The angle between stitches and the path; positive angles turn from the direction of the path as +x turns towards
    /// +y.
    #[schemars(range(min = -90, max = 90), extend("unit" = "°"))]
    pub tilt: f64,
    /// Width of the thread.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.7)]
    pub width: f64,
    /// Width of the holes; by default 0.6 of the width of the thread, which then hides them. 0 for no holes.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub holes: Option<f64>,
    /// Length of one turn of a strand around the others; a negative length winds the other way, 0 does not wind.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(2.0)]
    pub twist: f64,
    /// Number of strands of the thread; 1 is smooth.
    #[schemars(range(min = 1, max = 8))]
    #[default(3)]
    pub strands: u32,
    /// Depth to which the ground is pulled down at the holes; the thread sinks with it.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    #[default(0.2)]
    pub pull: f64,
    /// Distance from the thread to which the ground is pulled.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub spread: f64,
    /// Unevenness of the stitches: 0 as sewn by a machine, 1 as by a beginner.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.2)]
    pub jitter: f64,
    /// Another seed gives other unevenness.
    pub seed: u64,
}

impl Stitch {
    /// Length of a stitch as a share of the pitch; at most [`LONGEST`].
    fn share(&self) -> f64 {
        self.length.map_or_else(|| ((self.pitch - 0.3 * self.width) / self.pitch).max(0.5), |l| l / self.pitch)
    }

    fn seam(&self) -> Seam {
        Seam { pitch: self.pitch, length: self.share(), tilt: sin_cos(self.tilt), jitter: self.jitter }
    }

    fn thread(&self) -> Thread {
        Thread {
            radius: narrow(0.5 * self.width),
            strands: self.strands.clamp(1, MOST_STRANDS),
            lay: narrow(self.twist),
            hole: narrow(0.5 * self.holes.unwrap_or(0.6 * self.width)),
            pull: narrow(self.pull),
            spread: narrow(self.spread),
        }
    }
}

impl Node for Stitch {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height of the thread over the ground as it was; 0 where there is none.")
            .in_unit("mm"),
        Output::new("mask", Type::Gray, "How much of the place the thread covers, 0..1."),
        Output::new("ids", Type::Ids, "The number of the stitch, from 1; 0 where there is none."),
        Output::new(
            "shade",
            Type::Gray,
            "1 on the crowns of the strands, 0 in the creases between them and beside the thread.",
        ),
        Output::new("holes", Type::Gray, "1 in the holes, 0 on the ground."),
        Output::new("pull", Type::Gray, "How far the ground is pulled down, 0 or more.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];
    const VERSION: u32 = 2;

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        if exceeds(self.share(), LONGEST) {
            let (length, most) = (told(self.share() * self.pitch), told(LONGEST * self.pitch));
            let message = format!("length is `{length}` mm; it must be at most {most} mm, one and a half of the pitch");
            problems.push(Problem::new(Code::OutOfRange, message).at("length"));
        }
        let most = canvas.size_mm().max_element();
        let holes = self.holes.unwrap_or(0.0);
        for (field, value) in [("width", self.width), ("holes", holes), ("spread", self.spread), ("pitch", self.pitch)]
        {
            if value > most {
                let message = format!("{field} is `{value}` mm; it must be at most {most} mm, as large as the canvas");
                problems.push(Problem::new(Code::OutOfRange, message).at(field));
            }
        }
        problems
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = cx.get(&self.path)?;
        let count: f64 = path.curves.iter().map(|curve| seam::count(curve.length(), self.pitch)).sum();
        if count > MOST_STITCHES {
            let message = format!("pitch makes {count:.0} stitches; at most {MOST_STITCHES:.0} are allowed");
            return Err(Problem::new(Code::TooLarge, message).at("pitch").help("make the pitch larger").into());
        }
        if count == 0.0 {
            cx.evaluator.warn(Problem::new(Code::Advice, "the path has no curves: nothing is sewn").at("path"));
        }
        let sewn = self.seam().sew(&path, Hash::new(cx.seed(self.seed)));
        let (drawn, tiling) = (Arc::new(Drawn::new(sewn, self.thread(), (path.size_mm, path.periodic))), path.periodic);
        let thread = {
            let drawn = drawn.clone();
            Field::generate(Type::Jacobian, tiling, move |out, given| {
                let (frame, stop) = (tile::frame(out), || given.check().is_err());
                let mut bits = vec![Bit::default(); out.window.len()];
                drawn.fill(&stop, &frame, &mut bits);
                for (plane, read) in out.planes_mut().into_iter().zip(PLANES) {
                    plane.iter_mut().zip(&bits).for_each(|(out, bit)| *out = read(bit));
                }
                given.check()
            })
        };
        let thread = cx.shared_field("thread", thread);
        let ground = |fill: fn(&Drawn, &dyn Fn() -> bool, &shibo_kernel::ground::window::Frame, &mut [f32])| {
            let drawn = drawn.clone();
            Field::generate(Type::Gray, tiling, move |out, given| {
                let frame = tile::frame(out);
                fill(&drawn, &|| given.check().is_err(), &frame, out.plane_mut(0));
                given.check()
            })
        };
        Ok(Outputs::one(plane(&thread, Type::Gray, 0))
            .with("mask", plane(&thread, Type::Gray, 1))
            .with("ids", plane(&thread, Type::Ids, 3))
            .with("shade", plane(&thread, Type::Gray, 2))
            .with("holes", ground(Drawn::holes))
            .with("pull", ground(Drawn::pull)))
    }
}

/// Contents of the planes of the shared field.
const PLANES: [fn(&Bit) -> f32; 4] =
    [|bit| bit.height, |bit| bit.mask, |bit| bit.crown, |bit| (bit.id % 0x00FF_FFFF) as f32];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::paths::Path;
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::Value;

    fn path(node: &Path) -> Value {
        outputs(node, &[], &canvas()).unwrap().take("path", true).cloned().unwrap()
    }

    fn line() -> Value {
        path(&Path { points: vec![(0.0, 10.25), (32.0, 10.25)], ..Path::default() })
    }

    fn node() -> Stitch {
        Stitch { path: port(0), pitch: 4.0, width: 2.0, ..Stitch::default() }
    }

    #[test]
    fn stitches_conform() {
        let curve = path(&Path { d: "M -3 4 C 12 30 20 -5 29 36".into(), ..Path::default() });
        conforms(&Stitch { tilt: 20.0, jitter: 1.0, twist: 6.0, ..node() }, std::slice::from_ref(&curve));
        conforms(&Stitch { length: Some(2.0), strands: 1, holes: Some(0.5), pull: 0.0, ..node() }, &[curve]);
        conforms(&node(), &[line()]);
    }

    #[test]
    fn a_seam_round_the_canvas_has_whole_stitches() {
        // Pixels of ½ mm; eight stitches of 4 mm fit 32 mm, the first from 0.3 to 3.7 mm.
        let node = Stitch { jitter: 0.0, strands: 1, pull: 0.0, ..node() };
        let tile = |name: &str| part(&field(&node, &[line()], name), &canvas(), 0, 0, 64, 64);
        let (ids, mask, holes) = (tile("ids"), tile("mask"), tile("holes"));
        for x in 0..64 {
            if (x % 8 != 0) && (x % 8 != 7) {
                assert_eq!((ids.row(0, 20)[x], mask.row(0, 20)[x]), ((x / 8 + 1) as f32, 1.0), "{x}");
            }
            assert_eq!(ids.row(0, 40)[x], 0.0);
        }
        // Neighbouring stitches share a hole between them.
        assert!(holes.row(0, 20)[0] == 1.0 && holes.row(0, 20)[63] == 1.0 && holes.row(0, 20)[4] == 0.0);
        // A pitch of 4.6 mm gives seven stitches.
        let ids = part(&field(&Stitch { pitch: 4.6, ..node }, &[line()], "ids"), &canvas(), 0, 0, 64, 64);
        assert_eq!(ids.data().iter().copied().fold(0.0, f32::max), 7.0);
    }

    #[test]
    fn refuses_invalid_seams() {
        let refused = |node: Stitch| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(node()), None);
        assert_eq!(refused(Stitch { length: Some(6.1), ..node() }).as_deref(), Some("length"));
        let long = |length: f64| Stitch { length: Some(length), pitch: 0.7, ..node() }.check_on(&canvas());
        assert_eq!(long(1.05), [], "one and a half of the pitch, but for rounding");
        assert_eq!(
            long(1.06)[0].message,
            "length is `1.06` mm; it must be at most 1.05 mm, one and a half of the pitch"
        );
        assert_eq!(refused(Stitch { width: 33.0, ..node() }).as_deref(), Some("width"));
        assert!(outputs(&Stitch { pitch: 1e-5, ..node() }, &[line()], &canvas()).is_err());
    }
}
