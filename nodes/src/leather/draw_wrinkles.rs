//! [`DrawWrinkles`]: segments fleshed out to grooves.
//!
//! Source: JP4905282B2 §7, claims 17 to 19 (rows A49–A56; decisions L-9, L-10). Beyond the source: width and depth that
//! follow the link, tapering, depth fields. Strokes keep to millimetres, so any resolution draws the same grooves; those
//! thinner than `min_width` pixels keep that width and fade instead. Cost: O(strokes + pixels under strokes), by tiles.
use crate::kernel::hash::Hash;
use crate::kernel::strokes::{self, Draw, NO_STROKE, Stroke, StrokeSet, StrokeStyle};
use crate::kernel::tile::narrow;
use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::node::{Context, Fact, Gray, In, Node, Output, Outputs, Range};
use shibo_engine::value::{Canvas, Cost, Field, FieldSource, Grid, Reader, Segments, Stop, Tile, Tiling, Type};
use std::sync::{Arc, OnceLock};

/// The cross-section of a groove.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Profile {
    /// Level inside, with a sharp edge.
    Flat,
    /// A V.
    Linear,
    /// Level in the middle and at the edge.
    Smooth,
    /// A bell; see `sigma`.
    #[default]
    Gaussian,
    /// Flat, in the shape of a brush stroke.
    Brush,
}

/// What decides which groove of a set is wide and deep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum VaryBy {
    /// Chance.
    #[default]
    Random,
    /// The length of the link: long links make wide and deep grooves.
    Length,
    /// How far the link was stretched by the motion.
    Stretch,
}

/// How grooves that overlap are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Combine {
    /// The deepest.
    #[default]
    Max,
    /// The sum.
    Add,
    /// The sum, levelling off at the greatest depth.
    Screen,
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
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DrawWrinkles {
    /// The segments.
    pub segments: In<Segments>,
    /// Factor on the depth by place, 0..1.
    pub depth_field: Option<In<Gray>>,
    /// Factor on the depth where `depth_field` is 0.
    #[schemars(range(min = 0, max = 1))]
    pub depth_floor: f64,
    /// Width of the narrowest and of the widest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    pub width: Range,
    /// Depth of the shallowest and of the deepest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    pub depth: Range,
    /// What decides which grooves are wide and deep.
    pub vary_by: VaryBy,
    /// How much `vary_by` decides; chance decides the rest.
    #[schemars(range(min = 0, max = 1))]
    pub mix: f64,
    /// The cross-section.
    pub profile: Profile,
    /// Standard deviation of the `Gaussian`, as a share of the width; the source's is 1/6, which draws thin.
    #[schemars(range(min = 0.02, max = 1))]
    pub sigma: f64,
    /// How much narrower a groove is at its ends.
    #[schemars(range(min = 0, max = 1))]
    pub taper: f64,
    /// How much shallower a groove is at its ends; as `taper` if not given.
    #[schemars(range(min = 0, max = 1))]
    pub tip: Option<f64>,
    /// Whether ends are rounded by the cross-section, or cut square as in the source.
    pub round: bool,
    /// The least width in pixels of the output; narrower grooves keep it and fade.
    #[schemars(range(min = 0, max = 100), extend("unit" = "px"))]
    pub min_width: f64,
    /// How grooves that overlap are combined.
    pub combine: Combine,
    /// Another number gives the same grooves other widths and depths.
    pub seed: u64,
}

impl Default for DrawWrinkles {
    fn default() -> Self {
        Self {
            segments: In::default(),
            depth_field: None,
            depth_floor: 0.0,
            width: Range::new(0.15, 0.35),
            depth: Range::new(0.1, 0.1),
            vary_by: VaryBy::Random,
            mix: 0.6,
            profile: Profile::Gaussian,
            sigma: 0.25,
            taper: 0.0,
            tip: None,
            round: true,
            min_width: 1.0,
            combine: Combine::Max,
            seed: 0,
        }
    }
}

impl DrawWrinkles {
    fn style(&self) -> StrokeStyle {
        let sigma = narrow(self.sigma);
        StrokeStyle {
            profile: match self.profile {
                Profile::Flat => strokes::Profile::Flat,
                Profile::Linear => strokes::Profile::Linear,
                Profile::Smooth => strokes::Profile::Smooth,
                // Beyond 3.2 deviations the bell is below half a percent.
                Profile::Gaussian => strokes::Profile::Gaussian { sigma, cutoff: (3.2 * sigma).max(0.5) },
                Profile::Brush => strokes::Profile::Brush,
            },
            taper: narrow(self.taper),
            tip: narrow(self.tip.unwrap_or(self.taper)),
            round_caps: self.round,
            min_width: narrow(self.min_width),
            antialias: true,
            combine: match self.combine {
                Combine::Max => strokes::Combine::Max,
                Combine::Add => strokes::Combine::Add,
                Combine::Screen => strokes::Combine::Screen,
            },
        }
    }

    /// The strokes of all segments. Segment n draws numbers 2n for the width and 2n + 1 for the depth.
    fn strokes(&self, segments: &Segments, hash: Hash) -> Vec<Stroke> {
        let mix = match self.vary_by {
            VaryBy::Random => 0.0,
            VaryBy::Length | VaryBy::Stretch => self.mix,
        };
        let by = |n: usize| -> f64 {
            let list = match self.vary_by {
                VaryBy::Random => return 0.0,
                VaryBy::Length => &segments.length_ratio,
                VaryBy::Stretch => &segments.stretch,
            };
            // LEATHER-LOOK: from 0.55 of the median length, the narrowest, to 1.45, the widest.
            list.get(n).map_or(0.5, |&ratio| ((f64::from(ratio) - 0.55) / 0.9).clamp(0.0, 1.0))
        };
        let stroke = |(n, ends): (usize, &[Vec2; 2])| {
            let draw = |k: u64| mix * by(n) + (1.0 - mix) * hash.unit(2 * n as u64 + k);
            let width = segments.width.get(n).map_or_else(|| narrow(self.width.at(draw(0))), |w| *w);
            Stroke { ends: *ends, half_width: 0.5 * width, depth: narrow(self.depth.at(draw(1))) }
        };
        segments.ends.iter().enumerate().map(stroke).collect()
    }
}

impl Node for DrawWrinkles {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height in mm: 0 on the hills, minus the depth in the grooves."),
        Output::new("mask", Type::Gray, "The cross-section alone: 1 in the middle of a groove, 0 on the hills."),
        Output::new("ids", Type::Ids, "Which groove is deepest at a place, from 1; 0 on the hills."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn tiling(&self, _canvas: &Canvas) -> Tiling {
        Tiling::BOTH
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let segments = cx.get(&self.segments)?;
        let depth_field = cx.get_opt(&self.depth_field)?;
        let hash = Hash::new(cx.seed(self.seed));
        let period = (segments.periodic == Tiling::BOTH).then(|| segments.size_mm.as_vec2());
        let node = self.clone();
        let set = Arc::new(Lazy { set: OnceLock::new(), node, segments: segments.clone(), hash, period });
        let tiling = segments.periodic;
        let grooves = |what| Grooves { set: set.clone(), what, depth_field: None, floor: 0.0 };
        let height =
            Grooves { depth_field: depth_field.clone(), floor: narrow(self.depth_floor), ..grooves(What::Height) };
        let with = depth_field.map_or(tiling, |field| tiling.and(field.tiling()));
        Ok(Outputs::one(Field::new(Type::Gray, with, height))
            .with("mask", Field::new(Type::Gray, tiling, grooves(What::Mask)))
            .with("ids", Field::new(Type::Ids, tiling, grooves(What::Ids))))
    }
}

/// Strokes that are sorted into bins when the first tile asks for them: a graph whose tiles are all cached never does.
struct Lazy {
    set: OnceLock<StrokeSet>,
    node: DrawWrinkles,
    segments: Arc<Segments>,
    hash: Hash,
    period: Option<Vec2>,
}

impl Lazy {
    fn get(&self) -> &StrokeSet {
        let make = || StrokeSet::new(&self.node.strokes(&self.segments, self.hash), self.node.style(), self.period);
        self.set.get_or_init(make)
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
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        let window = strokes::Window {
            x: out.window.x,
            y: out.window.y,
            width: out.width(),
            height: out.height(),
            step: out.grid.step.as_vec2(),
            origin: out.grid.origin,
        };
        let (set, grid, at) = (self.set.get(), out.grid, out.window);
        match self.what {
            What::Mask => set.fill(&window, Draw::Mask, out.plane_mut(0)),
            What::Height => set.fill(&window, Draw::Depth, out.plane_mut(0)),
            What::Ids => {
                let mut ids = vec![NO_STROKE; at.len()];
                set.fill_with_ids(&window, Draw::Depth, out.plane_mut(0), &mut ids);
                // Whole numbers that f32 holds; a set of more strokes than that starts over.
                let number = |id: u32| if id == NO_STROKE { 0.0 } else { (id % 0x00FF_FFFF + 1) as f32 };
                out.plane_mut(0).iter_mut().zip(ids).for_each(|(o, id)| *o = number(id));
            }
        }
        if self.what != What::Height {
            return Ok(());
        }
        match &self.depth_field {
            None => out.plane_mut(0).iter_mut().for_each(|h| *h = -*h),
            Some(field) => {
                let factor = reader.read(field, &grid, at)?;
                let floor = self.floor;
                for (h, f) in out.plane_mut(0).iter_mut().zip(factor.plane(0)) {
                    *h *= -(floor + (1.0 - floor) * f.clamp(0.0, 1.0));
                }
            }
        }
        Ok(())
    }

    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
        self.depth_field.iter().map(|field| (field, *grid)).collect()
    }

    fn cost(&self) -> Cost {
        Cost::Local
    }
}
