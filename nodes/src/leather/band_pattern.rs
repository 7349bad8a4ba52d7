//! [`BandPattern`]: bright bands on a dark ground, as a field for wrinkles to follow.
//!
//! Source: JP4905282B2 §8, claims 9 to 11, figs 22 to 24 (rows A59–A66). Beyond the source: bands may repeat with the
//! canvas or follow a field, and nuclei cover the whole canvas; the two layouts of the source are options. Cost:
//! O(bands + pixels), by tiles.
use super::drawing;
use super::reading::SampledMap;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::bands::{self, BandSpec};
use shibo_kernel::strokes::{self, StrokeSet, StrokeStyle};
use shibo_node::{CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, Range, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Segments, Stop, Tiling, Type};

/// How the value falls from the middle of a band to its edge.
#[choice]
pub enum Gradation {
    /// 1 inside, 0 outside.
    Hard,
    /// A smooth curve, level in the middle and at the edge.
    #[default]
    Smooth,
    /// A bell curve whose standard deviation is a sixth of the width.
    Gaussian,
}

/// How bands that overlap are combined.
#[choice]
pub enum Overlap {
    /// The maximum.
    #[default]
    Max,
    /// The sum, which may exceed 1.
    Add,
}

/// Layout of the nuclei of bands.
#[choice]
pub enum Form {
    /// Everywhere on the canvas.
    #[default]
    Cover,
    /// As in the source's claim 10: a whole number of columns and rows, which leaves half a pitch at two edges empty.
    Claim,
    /// As in the source's flow chart (fig. 23): row by row until a jittered nucleus leaves the canvas.
    FlowChart,
}

/// Random bright bands, all in about the same direction: springs controlled by them make wrinkles along the bands.
///
/// ```ron
/// "example": BandPattern(pitch: 10, angle: (15, 40), width: (1.5, 4), length: (12, 24)),
/// ```
///
/// Elsewhere: Substance Designer *Fibers*; Houdini *Copy to Points*.
#[node]
pub struct BandPattern {
    /// Direction of the bands, in degrees from +x towards +y or as vectors, read at the middle of each band; the band's
    /// own angle is added. The field is read at four samples per pitch.
    pub direction: Option<In<Direction>>,
    /// Mean distance between bands.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(4.0)]
    pub pitch: f64,
    /// Smallest and largest angle from +x towards +y; less than 30° between them looks best.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    #[default(Range::new(20.0, 45.0))]
    pub angle: Range,
    /// Smallest and largest width.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Range::new(0.6, 1.4))]
    pub width: Range,
    /// Smallest and largest length.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Range::new(6.0, 14.0))]
    pub length: Range,
    /// How the value falls from the middle of a band to its edge.
    #[default(Gradation::Smooth)]
    pub gradation: Gradation,
    /// How bands that overlap are combined.
    #[default(Overlap::Max)]
    pub overlap: Overlap,
    /// Layout of the nuclei of bands.
    #[default(Form::Cover)]
    pub form: Form,
    /// Another seed gives other bands.
    pub seed: u64,
}

/// Maximum number of bands.
const MAX_BANDS: f64 = 1e6;

impl Node for BandPattern {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "1 in bands, 0 elsewhere."),
        Output::new("segments", Type::Segments, "The middle lines of the bands, with their widths."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let wanted = canvas.size_mm().element_product() / (self.pitch * self.pitch);
        if wanted > MAX_BANDS {
            let message = format!("pitch would make about {wanted:.0} bands; at most {MAX_BANDS:.0} are allowed");
            let problem = Problem::new(Code::TooLarge, message).at("pitch");
            return vec![problem.help("use a larger pitch, or a smaller canvas")];
        }
        // On a canvas that does not repeat, nuclei outside of it count as far as their bands reach into it.
        let reach = if self.form == Form::Cover && !self.periodic(canvas) {
            libm::hypot(self.width.hi, self.length.hi)
        } else {
            0.0
        };
        let wanted = (canvas.size_mm() + reach).element_product() / (self.pitch * self.pitch);
        if wanted > MAX_BANDS {
            let at = if self.width.hi > self.length.hi { "width" } else { "length" };
            let message = format!(
                "{at} makes about {wanted:.0} bands reach the canvas, with nuclei {} mm apart; at most {MAX_BANDS:.0} are allowed",
                self.pitch
            );
            return vec![Problem::new(Code::TooLarge, message).at(at).help("use shorter bands, or a larger pitch")];
        }
        Vec::new()
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let spread = self.angle.hi - self.angle.lo;
        if spread < 30.0 {
            return Vec::new();
        }
        let message = format!("the angles of the bands are {spread}° apart; less than 30° is advised");
        vec![Problem::new(Code::Advice, message).at("angle").help("wider apart, wrinkles follow no direction")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if self.periodic(canvas) { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let size = cx.size_mm().as_vec2();
        let spec = BandSpec {
            size,
            pitch: narrow(self.pitch),
            angle: [self.angle.lo, self.angle.hi].map(|a| narrow(a.to_radians())),
            width: [self.width.lo, self.width.hi].map(narrow),
            length: [self.length.lo, self.length.hi].map(narrow),
        };
        let form = match self.form {
            Form::Cover => bands::Nuclei::Cover,
            Form::Claim => bands::Nuclei::Claim,
            Form::FlowChart => bands::Nuclei::FlowChart,
        };
        let periodic = self.periodic(cx.canvas);
        let mut placed = bands::place(&spec, form, periodic, Hash::new(cx.seed(self.seed)));
        if let Some(direction) = cx.get_opt(&self.direction)? {
            let map = SampledMap::read(cx, &direction, self.pitch, periodic)?;
            placed.iter_mut().for_each(|band| band.angle += map.nearest(band.centre).to_radians());
        }
        let list = bands::strokes(&placed);
        drawing::bounded(list.iter().copied(), &self.style(), (size, periodic), ["length", "width"])?;
        let tiling = Node::tiling(self, cx.canvas);
        let segments = Segments {
            ends: list.iter().map(|s| s.ends).collect(),
            length_ratio: Vec::new(),
            stretch: Vec::new(),
            width: placed.iter().map(|band| band.width).collect(),
            size_mm: cx.size_mm(),
            periodic: tiling,
        };
        let set = StrokeSet::new(&list, self.style(), periodic.then_some(size));
        Ok(Outputs::one(drawing::field(set, tiling)).with("segments", segments))
    }
}

impl BandPattern {
    /// True if the bands repeat with the canvas; the source's own layouts never do.
    fn periodic(&self, canvas: &CanvasFacts) -> bool {
        canvas.tile() == Tiling::BOTH && self.form == Form::Cover
    }

    fn style(&self) -> StrokeStyle {
        StrokeStyle {
            profile: match self.gradation {
                Gradation::Hard => strokes::Profile::Flat,
                Gradation::Smooth => strokes::Profile::Smooth,
                Gradation::Gaussian => bands::GAUSSIAN,
            },
            combine: match self.overlap {
                Overlap::Max => strokes::Combine::Max,
                Overlap::Add => strokes::Combine::Add,
            },
            min_width: 0.0,
            ..StrokeStyle::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, outputs, port};
    use shibo_value::{Canvas, Field, Tile, Type, Value};

    #[test]
    fn bands_run_along_the_direction_at_their_middles() {
        // 30 degrees on the left half; on the right half 4 degrees more for each mm to the right of the middle.
        let turned = |x: f64| if x < 16.0 { 30.0 } else { 30.0 + 4.0 * (x - 16.0) };
        let field = Field::generate(Type::Gray, Tiling::BOTH, move |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            for row in 0..out.height() {
                for (value, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                    *value = narrow(turned(grid.center(x, 0).x.rem_euclid(32.0)));
                }
            }
            Ok(())
        });
        let angle = Range::new(5.0, 5.0);
        let node = BandPattern { direction: Some(port(0)), angle, pitch: 2.0, ..BandPattern::default() };
        let made = outputs(&node, &[field.into()], &crate::testing::canvas()).unwrap();
        let Some(Value::Segments(segments)) = made.take("segments", false).cloned() else { panic!("no segments") };
        assert_eq!(segments.ends.len(), 256);
        for [a, b] in &segments.ends {
            let middle = f64::from(0.5 * (a.x + b.x)).rem_euclid(32.0);
            // The nearest sample; samples are half a mm apart.
            let sample = ((middle / 0.5).floor() + 0.5) * 0.5;
            let (want, got) = (5.0 + turned(sample), f64::from((b.y - a.y).atan2(b.x - a.x)).to_degrees());
            assert!((got - want).abs() < 0.01, "{middle}: {got} {want}");
        }
    }

    #[test]
    fn bands_that_would_be_too_many_are_refused() {
        let canvas = Canvas { tile: Tiling::NONE, ..crate::testing::canvas() };
        let at = |node: BandPattern| node.check_on(&canvas).first().map(|p| (p.code, p.field.clone().unwrap()));
        let refused = |name: &str| Some((Code::TooLarge, name.to_owned()));
        assert_eq!(at(BandPattern { pitch: 0.01, ..BandPattern::default() }), refused("pitch"));
        assert_eq!(at(BandPattern { length: Range::new(6.0, 1e5), ..BandPattern::default() }), refused("length"));
        assert_eq!(at(BandPattern { width: Range::new(6.0, 1e5), ..BandPattern::default() }), refused("width"));
        assert_eq!(at(BandPattern { length: Range::new(6.0, 1e3), ..BandPattern::default() }), None);
        let once = BandPattern { length: Range::new(6.0, 1e5), form: Form::Claim, ..BandPattern::default() };
        assert_eq!(at(once), None);
    }
}
