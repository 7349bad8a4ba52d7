//! [`DrawWrinkles`]: grooves along segments.
//!
//! Source: JP4905282B2 §7, claims 17 to 19 (rows A49–A56). Beyond the source: width and depth that follow the link,
//! tapering, depth fields. Strokes have a size in millimetres, so all resolutions show the same grooves; grooves
//! thinner than `min_width` pixels are drawn that wide, and fade. Cost: O(strokes + pixels under strokes), by tiles.
use super::{drawing, reading};
use glam::Vec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::strokes::{Combine, CrossSection, Draw, NO_STROKE, Stroke, StrokeSet, StrokeStyle};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, Range, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Segments, Stop, Tile, Tiling, Type, Window};
use std::sync::{Arc, OnceLock};

/// Property that decides which grooves of a set are wide and deep.
#[choice]
pub enum VaryBy {
    /// Random.
    #[default]
    Random,
    /// The length of the link: long links make wide and deep grooves.
    Length,
    /// The stretch of the link by the motion.
    Stretch,
    /// `vary_field` at the middle of the groove: 0 is the narrowest and shallowest, 1 the widest and deepest.
    Field,
}

/// Draws a groove along each segment.
///
/// ```ron
/// "points": PoissonPoints(pitch: 3),
/// "links": ConnectNeighbors(points: "points"),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 1.2), depth: (0.2, 0.6), vary_by: Length, taper: 0.3),
/// "example": Relief(height: "height"),
/// ```
#[node]
pub struct DrawWrinkles {
    /// The segments.
    pub segments: In<Segments>,
    /// Field for `vary_by: Field`, 0..1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub vary_field: Option<In<Gray>>,
    /// Factor on the depth, 0..1, which can differ from place to place.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub depth_field: Option<In<Gray>>,
    /// Factor on the depth where `depth_field` is 0.
    #[schemars(range(min = 0, max = 1))]
    pub depth_floor: f64,
    /// Width of the narrowest and of the widest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.15, 0.35))]
    pub width: Range,
    /// Depth of the shallowest and of the deepest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.1, 0.1))]
    pub depth: Range,
    /// Property that decides which grooves are wide and deep.
    #[default(VaryBy::Random)]
    pub vary_by: VaryBy,
    /// Weight of `vary_by`, 0 to 1; the rest is random.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.6)]
    pub mix: f64,
    /// The cross-section.
    #[default(CrossSection::Gaussian)]
    pub profile: CrossSection,
    /// Standard deviation of the `Gaussian` cross-section, as a share of the width; the source uses 1/6, which draws
    /// thin lines.
    #[schemars(range(min = 0.02, max = 1))]
    #[default(0.25)]
    pub sigma: f64,
    /// Narrowing of a groove at its ends, 0..1.
    #[schemars(range(min = 0, max = 1))]
    pub taper: f64,
    /// Flattening of a groove at its ends, 0..1; the value of `taper` if not given.
    #[schemars(range(min = 0, max = 1))]
    pub tip: Option<f64>,
    /// True for ends rounded by the cross-section; false for ends cut square, as in the source.
    #[default(true)]
    pub round: bool,
    /// Minimum width in pixels of the output; narrower grooves are drawn this wide.
    #[schemars(range(min = 0, max = 100), extend("unit" = "px"))]
    #[default(1.0)]
    pub min_width: f64,
    /// True if grooves below the minimum width fade, as if they were drawn large and then scaled down. If false, they
    /// keep their depth, like the lines of one pixel in the source.
    #[default(true)]
    pub fade: bool,
    /// How grooves that overlap are combined.
    #[default(Combine::Max)]
    pub combine: Combine,
    /// Another seed gives the same grooves other widths and depths.
    pub seed: u64,
}

impl DrawWrinkles {
    fn style(&self) -> StrokeStyle {
        let sigma = narrow(self.sigma);
        StrokeStyle {
            profile: self.profile.with_sigma(sigma),
            taper: narrow(self.taper),
            tip: narrow(self.tip.unwrap_or(self.taper)),
            round_caps: self.round,
            min_width: narrow(self.min_width),
            fade: self.fade,
            antialias: true,
            combine: self.combine,
        }
    }

    /// The width and the depth of each segment. Segment n uses the random numbers 2n for the width and 2n + 1 for the
    /// depth.
    fn sizes(&self, cx: &Context<'_>, segments: &Segments) -> Result<Vec<[f32; 2]>, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let by = self.decided(cx, segments)?;
        let mix = if by.is_empty() { 0.0 } else { self.mix };
        let size = |n: usize| {
            let draw = |k: u64| mix * by.get(n).copied().unwrap_or(0.5) + (1.0 - mix) * hash.unit(2 * n as u64 + k);
            let width = segments.width.get(n).map_or_else(|| narrow(self.width.at(draw(0))), |w| *w);
            [width, narrow(self.depth.at(draw(1)))]
        };
        Ok((0..segments.len()).map(size).collect())
    }

    /// Value of the `vary_by` property of each segment, 0..1; `None` if it is random.
    fn decided(&self, cx: &Context<'_>, segments: &Segments) -> Result<Vec<f64>, Stop> {
        // Maps 0.55 of the median length to 0 (narrowest) and 1.45 to 1 (widest).
        let spread = |ratio: &f32| ((f64::from(*ratio) - 0.55) / 0.9).clamp(0.0, 1.0);
        Ok(match self.vary_by {
            VaryBy::Random => Vec::new(),
            VaryBy::Length => segments.length_ratio.iter().map(spread).collect(),
            VaryBy::Stretch => segments.stretch.iter().map(spread).collect(),
            VaryBy::Field => {
                let Some(field) = cx.get_opt(&self.vary_field)? else { return Ok(Vec::new()) };
                let lengths = segments.ends.iter().map(|[a, b]| f64::from((*b - *a).length())).sum::<f64>();
                let pitch = narrow(lengths / segments.len().max(1) as f64);
                let read = reading::read(cx, (pitch, segments.periodic), (&field, "vary_field"), None)?;
                let raster = read.raster();
                let at = |[a, b]: &[Vec2; 2]| f64::from(raster.sample((*a + *b) * 0.5)).clamp(0.0, 1.0);
                segments.ends.iter().map(at).collect()
            }
        })
    }
}

impl Node for DrawWrinkles {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height: 0 on the hills, minus the depth in the grooves.").in_unit("mm"),
        Output::new("mask", Type::Gray, "The cross-section alone: 1 in the middle of a groove, 0 on the hills."),
        Output::new("ids", Type::Ids, "Which groove is deepest at a place, from 1; 0 on the hills."),
        Output::new("segments", Type::Segments, "The segments with the widths at which they are drawn."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let field = self.vary_by == VaryBy::Field;
        let (message, at) = match (field, &self.vary_field) {
            (true, None) => ("vary_by is `Field`, but vary_field is not given", "vary_by"),
            (false, Some(_)) => {
                ("vary_field is given, but vary_by is not `Field`: nothing would read it", "vary_field")
            }
            _ => return Vec::new(),
        };
        vec![Problem::new(Code::BadValue, message).at(at).help("write `vary_by: Field, vary_field: …`")]
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.width.hi > 0.0 || (!self.fade && self.min_width > 0.0) {
            return Vec::new();
        }
        let message = "width is `0`: nothing is drawn but of segments that have widths of their own";
        let help = "give a width in mm, or write `fade: false` to draw lines of `min_width` pixels";
        vec![Problem::new(Code::Advice, message).at("width").help(help)]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let segments = cx.get(&self.segments)?;
        let depth_field = cx.get_opt(&self.depth_field)?;
        let period = (segments.periodic == Tiling::BOTH).then(|| segments.size_mm.as_vec2());
        let sizes = self.sizes(cx, &segments)?;
        let drawn = Segments { width: sizes.iter().map(|s| s[0]).collect(), ..Segments::clone(&segments) };
        let depths = sizes.iter().map(|s| s[1]).collect();
        let lazy = Lazy { set: OnceLock::new(), style: self.style(), drawn: Arc::new(drawn), depths, period };
        drawing::bounded(
            lazy.strokes(),
            &lazy.style,
            (segments.size_mm.as_vec2(), period.is_some()),
            ["segments", "width"],
        )?;
        let (drawn, set) = (lazy.drawn.clone(), Arc::new(lazy));
        let tiling = segments.periodic;
        let grooves = |what| Grooves { set: set.clone(), what, depth_field: None, floor: 0.0 };
        let height =
            Grooves { depth_field: depth_field.clone(), floor: narrow(self.depth_floor), ..grooves(What::Height) };
        let with = depth_field.map_or(tiling, |field| tiling.and(field.tiling()));
        Ok(Outputs::one(Field::new(Type::Gray, with, height))
            .with("mask", Field::new(Type::Gray, tiling, grooves(What::Mask)))
            .with("ids", Field::new(Type::Ids, tiling, grooves(What::Ids)))
            .with("segments", drawn))
    }
}

/// Strokes that are sorted into bins when the first tile is filled; never if all tiles are in the cache.
struct Lazy {
    set: OnceLock<StrokeSet>,
    style: StrokeStyle,
    drawn: Arc<Segments>,
    depths: Vec<f32>,
    period: Option<Vec2>,
}

impl Lazy {
    fn strokes(&self) -> impl Iterator<Item = Stroke> + Clone {
        let sizes = self.drawn.width.iter().zip(&self.depths);
        let stroke = |(ends, (width, depth)): (&[Vec2; 2], (&f32, &f32))| Stroke {
            ends: *ends,
            half_width: 0.5 * width,
            depth: *depth,
        };
        self.drawn.ends.iter().zip(sizes).map(stroke)
    }

    fn get(&self) -> &StrokeSet {
        self.set.get_or_init(|| StrokeSet::new(&self.strokes().collect::<Vec<_>>(), self.style, self.period))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    Height,
    Mask,
    Ids,
}

struct Grooves {
    set: Arc<Lazy>,
    what: What,
    depth_field: Option<Field>,
    floor: f32,
}

impl FieldSource for Grooves {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.depth_field.iter().map(|field| Read::new(field, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (frame, stop) = (tile::frame(out), || given.check().is_err());
        let set = self.set.get();
        match self.what {
            What::Mask => set.fill_until(&stop, &frame, Draw::Mask, out.plane_mut(0)),
            What::Height => set.fill_until(&stop, &frame, Draw::Depth, out.plane_mut(0)),
            What::Ids => {
                let mut ids = vec![NO_STROKE; out.window.len()];
                set.fill_with_ids(&stop, &frame, out.plane_mut(0), &mut ids);
                // Whole numbers that f32 holds exactly; with more strokes, numbers repeat.
                let number = |id: u32| if id == NO_STROKE { 0.0 } else { (id % 0x00FF_FFFF + 1) as f32 };
                out.plane_mut(0).iter_mut().zip(ids).for_each(|(o, id)| *o = number(id));
            }
        }
        given.check()?;
        if self.what != What::Height {
            return Ok(());
        }
        match given.tiles().next() {
            None => out.plane_mut(0).iter_mut().for_each(|h| *h = -*h),
            Some(factor) => {
                let floor = self.floor;
                for (h, f) in out.plane_mut(0).iter_mut().zip(factor.plane(0)) {
                    *h *= -(floor + (1.0 - floor) * f.clamp(0.0, 1.0));
                }
            }
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Local
    }
}
