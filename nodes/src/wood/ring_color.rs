//! [`RingColor`]: maps growth time to the colours of wood.
//!
//! Source: Momoi & Takatera 2014, §4.3 (rows B22, B30). Beyond the source: the exact mean of the pattern over a pixel's
//! span of years, so that thin rings never alias; variation from year to year; late wood as a solid; sapwood, knots and
//! bark. Cost: about 40 ns a point.
use crate::by_calendar::ByCalendar;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::{Noise3, visible};
use shibo_kernel::wood::pattern;
use shibo_kernel::wood::solids::{Code, spans};
use shibo_kernel::wood::year_table::{Variation, YearTable, late_share};
use shibo_node::{
    CanvasFacts, Color, Context, Fact, In, Node, Output, Outputs, SolidNumber, SolidVector, choice, node,
};
use shibo_value::diagnostics::{Code as Kind, Problem};
use shibo_value::{ColorPattern, Listener, Patch, Planes, Solid, Stop, Type};
use std::sync::Arc;

/// Filtering of rings that are thinner than a pixel.
#[choice]
pub enum RingFilter {
    /// The mean of the pattern over the span of years that a pixel covers.
    #[default]
    Exact,
    /// The pattern at the pixel's centre, as in the source.
    None,
}

/// Gives every point the colour of the time of year in which it grew.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "even": TrunkTime(tree: "tree", age_boost: 0.6),
/// "shape": VaryGrowth(time: "even", tree: "tree", eccentricity: 0.1, waves: [(2.2, 45, 520), (0.55, 12, 150)]),
/// "time": VaryGrowth(time: "shape", series: Generated),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings", late_variation: 0.3, phase_variation: 0.25, feather: 0.04),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 30),
/// ```
///
/// Elsewhere: Blender *Wave Texture* (Rings).
#[node]
pub struct RingColor {
    /// Years of growth.
    pub time: In<SolidNumber>,
    /// The colours of a year.
    pub pattern: In<ColorPattern>,
    /// Share of a point that belongs to a knot, 0..1.
    pub knots: Option<In<SolidNumber>>,
    /// Mask of ingrown bark, 0..1.
    pub bark: Option<In<SolidNumber>>,
    /// Coordinates along the fibres, from `FiberSpace`, for `feather`; by default those of space.
    pub fiber: Option<In<SolidVector>>,
    /// Filtering of rings that are thinner than a pixel.
    #[default(RingFilter::Exact)]
    pub filter: RingFilter,
    /// With `filter: None`: true to interpolate colours between entries.
    #[default(true)]
    pub interpolate: bool,
    /// Variation of the darkness of late wood from year to year; 0.3 to 0.7 in nature.
    #[schemars(range(min = 0, max = 2))]
    pub late_variation: f64,
    /// Variation of the share of late wood from year to year; about 0.25 in nature.
    #[schemars(range(min = 0, max = 1))]
    pub phase_variation: f64,
    /// Distance by which ring borders fray along the fibres.
    #[schemars(range(min = 0, max = 0.5), extend("unit" = "years"))]
    pub feather: f64,
    /// With `filter: Exact`: minimum width of the border between two years. With a twentieth of a year, cuts in all
    /// directions show it alike, even if pixels are not much smaller. By default 0.06 on meshes, so that charts agree
    /// where they meet, and 0 otherwise.
    #[schemars(range(min = 0, max = 1), extend("unit" = "years"))]
    pub border: Option<f64>,
    /// Number of years after which `late_variation` repeats.
    #[schemars(range(min = 1, max = 1024))]
    #[default(256)]
    pub years: u32,
    /// The age of the tree; `sap_years` count back from it.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "years"))]
    #[default(60.0)]
    pub age: f64,
    /// Number of the last years that are sapwood; 0 for none.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "years"))]
    pub sap_years: f64,
    /// Number of years over which heartwood turns into sapwood.
    #[schemars(range(min = 0.01, max = 100), extend("unit" = "years"))]
    #[default(1.0)]
    pub sap_softness: f64,
    /// The mean colour of sapwood.
    #[default(Color::srgb([0xE2, 0xC4, 0x9A]))]
    pub sap_color: Color,
    /// The colour of knots.
    #[default(Color::srgb([0x9A, 0x5A, 0x2C]))]
    pub knot_color: Color,
    /// The colour of bark.
    #[default(Color::srgb([0x2A, 0x1A, 0x10]))]
    pub bark_color: Color,
    /// Another seed gives other variation from year to year.
    pub seed: u64,
}

/// The default width of borders between years on meshes, in years.
const ON_SURFACES: f64 = 0.06;

/// Above this number of years per texel, charts of a surface no longer agree about borders of rings.
const NARROW: f32 = 1.0 / 16.0;

/// True if most texels of a non-empty patch are wide compared with the rings: wider, in years, than [`NARROW`].
fn are_narrow(spans: &[f32]) -> bool {
    let there = spans.iter().filter(|span| **span > 0.0 && span.is_finite());
    let (wide, all) = there.fold((0, 0), |(wide, all), span| (wide + usize::from(*span > NARROW), all + 1));
    all >= 256 && 2 * wide > all
}

fn narrow_rings() -> Problem {
    let message = "rings are less than 16 texels wide on a surface, so borders of its charts may show in them";
    let help = "set `footprint: Space` in BakeSolid, or render it finer";
    Problem::new(Kind::Advice, message).at("time").help(help)
}

/// Mapping from time to colour.
enum Lookup {
    Mean(YearTable),
    Point(YearTable),
    Table(Vec<[f32; 3]>, Vec<f32>, bool),
}

struct Painter {
    lookup: Lookup,
    mean: [f32; 3],
    feather: f32,
    /// Minimum width of the border between two years, on planes and on stretched surfaces.
    border: [f32; 2],
    noise: [Noise3; 2],
    has_fiber: bool,
    knots: Option<[f32; 3]>,
    bark: Option<[f32; 3]>,
    /// The time at which sapwood starts, the inverse of the softness, and the colour.
    sap: Option<(f32, f32, [f32; 3])>,
}

impl Painter {
    #[inline(always)]
    fn color(&self, time: f32, a: f32, b: f32) -> [f32; 4] {
        let t = f64::from(time);
        match &self.lookup {
            Lookup::Mean(table) => table.mean(t, f64::from(a), f64::from(b)),
            Lookup::Point(table) => table.at(t),
            Lookup::Table(table, late, smooth) => {
                let t = if t.is_finite() { t } else { 0.0 };
                let c = if *smooth { pattern::linear(table, t) } else { pattern::nearest(table, t) };
                [c[0], c[1], c[2], late[pattern::index(t, late.len())]]
            }
        }
    }

    fn paint(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        let time = inputs[0].plane(0);
        let mut next = 1;
        let mut input = |given: bool| {
            given.then(|| {
                next += 1;
                &inputs[next - 1]
            })
        };
        let (fiber, knots, bark) = (input(self.has_fiber), input(self.knots.is_some()), input(self.bark.is_some()));
        let jag = self.jag(time, patch, fiber);
        let moved: &[f32] = jag.as_deref().unwrap_or(time);
        let [across, down] = spans(time, patch);
        // Fraying finer than pixels widens the span by twice its standard deviation instead.
        let blur = 2.0 * self.feather * 0.27 * (1.0 - visible(0.5, patch.pixel));
        let border = self.border[usize::from(patch.metric.is_some())];
        if let (Some(Listener(tell)), true) = (patch.listener, patch.metric.is_some() && are_narrow(&across)) {
            tell(narrow_rings());
        }
        let [red, green, blue, late] = out else { return };
        dispatch(
            #[inline(always)]
            || {
                let spans = across.iter().zip(&down);
                let planes = red.iter_mut().zip(green.iter_mut()).zip(blue.iter_mut()).zip(late.iter_mut());
                for ((t, (a, b)), (((red, green), blue), late)) in moved.iter().zip(spans).zip(planes) {
                    [*red, *green, *blue, *late] =
                        self.color(*t, math::max(math::max(*a, *b) + blur, border), math::min(*a, *b));
                }
                for (k, plane) in [&mut **red, &mut **green, &mut **blue].into_iter().enumerate() {
                    self.tint(k, time, knots.map(|k| k.plane(0)), bark.map(|b| b.plane(0)), plane);
                }
                if let Some(bark) = bark {
                    late.iter_mut().zip(bark.plane(0)).for_each(|(late, s)| *late *= 1.0 - s);
                }
            },
        );
    }

    /// Adds sapwood, knots and bark to a channel.
    #[inline(always)]
    fn tint(&self, k: usize, time: &[f32], knots: Option<&[f32]>, bark: Option<&[f32]>, plane: &mut [f32]) {
        let mean = self.mean[k];
        if let Some((from, inverse, sap)) = self.sap {
            let more = sap[k] / mean - 1.0;
            for (c, t) in plane.iter_mut().zip(time) {
                *c *= 1.0 + math::smooth((t - from) * inverse + 0.5) * more;
            }
        }
        if let (Some(share), Some(color)) = (knots, self.knots) {
            for (c, share) in plane.iter_mut().zip(share) {
                let s = math::smooth((share - 0.08) * (1.0 / 0.54));
                // Knots keep their rings, in the colour of knots and with less contrast.
                let ring = (*c / mean).sqrt();
                *c = math::lerp(*c, color[k] * ring, s);
            }
        }
        if let (Some(bark), Some(color)) = (bark, self.bark) {
            plane.iter_mut().zip(bark).for_each(|(c, s)| *c = math::lerp(*c, color[k], *s));
        }
    }

    /// The time, with ring borders frayed along the fibres.
    fn jag(&self, time: &[f32], patch: &Patch<'_>, fiber: Option<&Planes<'_>>) -> Option<Vec<f32>> {
        if self.feather == 0.0 {
            return None;
        }
        let [x, y, z] = match fiber {
            Some(planes) => [planes.plane(0), planes.plane(1), planes.plane(2)],
            None => patch.place,
        };
        let (fine, coarse) = (0.6 * visible(0.4, patch.pixel), 0.8 * visible(1.4, patch.pixel));
        let mut out = time.to_vec();
        let (fine, coarse) = (self.feather * fine, self.feather * coarse);
        dispatch(
            #[inline(always)]
            || {
                let at = [x, y, z];
                if fine > 0.0 {
                    self.noise[0].each(at, [2.5, 2.5, 1.0 / 14.0], 0.0, &mut out, |t, v| t + fine * v);
                }
                if coarse > 0.0 {
                    self.noise[1].each(at, [0.7, 0.7, 1.0 / 45.0], 0.0, &mut out, |t, v| t + coarse * v);
                }
            },
        );
        Some(out)
    }
}

impl RingColor {
    fn lookup(&self, pattern: &ColorPattern, hash: Hash) -> Lookup {
        let late = late_share(&pattern.table, pattern.entries);
        let vary = Variation { depth: self.late_variation, phase: self.phase_variation };
        let same = vary.depth == 0.0 && vary.phase == 0.0 && pattern.table.len() == pattern.entries;
        if self.filter == RingFilter::None && same {
            return Lookup::Table(pattern.table.clone(), late, self.interpolate);
        }
        let years = if same { 1 } else { (self.years as usize).max(pattern.table.len() / pattern.entries.max(1)) };
        let table = if same && self.filter == RingFilter::Exact {
            let entry = |(i, c): (usize, &[f32; 3])| [c[0], c[1], c[2], late[i]];
            YearTable::of_table(&pattern.table.iter().enumerate().map(entry).collect::<Vec<_>>(), pattern.entries)
        } else {
            YearTable::new(&pattern.table, pattern.entries, &late, years, vary, hash)
        };
        match self.filter {
            RingFilter::Exact => Lookup::Mean(table),
            RingFilter::None => Lookup::Point(table),
        }
    }
}

impl Node for RingColor {
    const VERSION: u32 = 3;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour, scene-linear."),
        Output::new("late", Type::Solid, "How much of the point is late wood, 0..1 and a little more in deep years."),
        Output::new("year", Type::Solid, "The number of the year in which the point grew, from 0."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (calendar_time, table) = (cx.get(&self.time)?, cx.get(&self.pattern)?);
        let hash = Hash::new(cx.seed(self.seed));
        let mut lookup = self.lookup(&table, hash);
        // Time that follows a calendar has kinks within pixels; the even time has none.
        let mut time = calendar_time.clone();
        let mut sap_from = self.age - self.sap_years;
        if let (Lookup::Mean(table), Some((even, calendar))) = (&lookup, ByCalendar::of(&calendar_time))
            && let Some(table) = table.by_even_time(&calendar)
        {
            (lookup, time, sap_from) = (Lookup::Mean(table), even.clone(), calendar.even(sap_from));
        }
        let n = table.table.len().max(1) as f32;
        let mean: [f32; 3] = std::array::from_fn(|c| (table.table.iter().map(|e| e[c]).sum::<f32>() / n).max(1e-4));
        let optional = |port: &Option<In<SolidNumber>>| cx.get_opt(port);
        let (knots, bark, fiber) = (optional(&self.knots)?, optional(&self.bark)?, cx.get_opt(&self.fiber)?);
        let sap = (self.sap_years > 0.0).then(|| (narrow(sap_from), narrow(1.0 / self.sap_softness), self.sap_color.0));
        let painter = Arc::new(Painter {
            lookup,
            mean,
            feather: narrow(self.feather),
            border: [0.0, ON_SURFACES].map(|usual| narrow(self.border.unwrap_or(usual))),
            noise: [Noise3::new(hash, 1 << 20), Noise3::new(hash, (1 << 20) + 1)],
            has_fiber: fiber.is_some(),
            knots: knots.as_ref().map(|_| self.knot_color.0),
            bark: bark.as_ref().map(|_| self.bark_color.0),
            sap,
        });
        let bytes = match &painter.lookup {
            Lookup::Mean(table) | Lookup::Point(table) => table.bytes(),
            Lookup::Table(table, ..) => table.len() * 16,
        };
        let inputs: Vec<Solid> = [Some(time), fiber, knots, bark].into_iter().flatten().collect();
        let paint = painter.clone();
        let code =
            Code::of_place(move |patch, inputs, out| paint.paint(patch, inputs, out)).with_quads().holding(bytes);
        let all = Solid::bundle(4, inputs, code);
        let all = cx.shared("all", all);
        let year = Code::of_inputs(|_, inputs, out| {
            out[0].iter_mut().zip(inputs[0].plane(0)).for_each(|(out, t)| *out = t.floor());
        })
        .with_exact(|_, inputs| inputs[0].iter().map(|t| t.floor()).collect());
        Ok(Outputs::one(all.pick(Type::SolidColor, &[0, 1, 2]))
            .with("late", all.channel(3))
            .with("year", year.solid(Type::Solid, vec![calendar_time])))
    }
}
