//! [`VaryGrowth`]: growth that is irregular in space and from year to year.
//!
//! Momoi & Takatera 2014 mention irregular growth in §5.1 and §5.3 without a description (rows B31, B32); the method is
//! beyond the source. Cost: about 5 ns a point and wave.
use super::trees::even;
use crate::by_calendar::ByCalendar;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::wood::solids::{Code, places};
use shibo_kernel::wood::trunk::Trunk;
use shibo_kernel::wood::vary::{Shape, WAVES, Wave, reserve};
use shibo_kernel::wood::years::{Calendar, series};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{ColorPattern, Curve, Solid, Stop, Tree, Type};
use std::sync::Arc;

/// The widths of years.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Series {
    /// All years have the same width.
    #[default]
    Even,
    /// Random widths with `sigma` and `memory`, log-normal as in real trees.
    Generated,
    /// These relative widths, from the pith outwards. After the last width the list repeats.
    List(Vec<f64>),
    /// The widths of the years in the picture of `pattern`.
    FromPattern,
}

/// Makes growth irregular: rings that are not round, that waver along the stem, and years of different widths.
///
/// Use the node twice: with the shape (`eccentricity`, `waves`) between the trunk's time and `BlendTimes`, and with the
/// `series` after `BlendTimes`. Time stays continuous and increases outwards; a check ensures this.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "even": TrunkTime(tree: "tree"),
/// "shape": VaryGrowth(time: "even", tree: "tree", eccentricity: 0.1, waves: [(2.2, 45, 520), (0.55, 12, 150)]),
/// "time": VaryGrowth(time: "shape", series: Generated),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "example": CutPlane(solid: "wood", preset: EndGrain, distance: 12),
/// ```
#[node]
pub struct VaryGrowth {
    /// The time of even growth.
    pub time: In<SolidNumber>,
    /// The tree around whose trunk the shape varies; by default the z axis.
    pub tree: Option<In<Tree>>,
    /// The pattern whose widths of years `series: FromPattern` uses.
    pub pattern: Option<In<ColorPattern>>,
    /// The widths of years.
    #[default(Series::Even)]
    pub series: Series,
    /// With `Generated`: variation of widths, as the standard deviation of their logarithm.
    #[schemars(range(min = 0, max = 1.5))]
    #[default(0.28)]
    pub sigma: f64,
    /// With `Generated`: correlation of a year with the one before.
    #[schemars(range(min = 0, max = 0.99))]
    #[default(0.5)]
    pub memory: f64,
    /// With `Generated`: number of years after which widths repeat.
    #[schemars(range(min = 8, max = 4096))]
    #[default(256)]
    pub years: u32,
    /// Deviation of cross-sections from circles, as a share of the radius.
    #[schemars(range(min = 0, max = 0.5))]
    pub eccentricity: f64,
    /// Waves of rings, each `(amplitude, across, along)` in mm; at most 8. Time must still increase outwards: the sum
    /// of amplitude / across must stay below (1 - 1.5 eccentricity) / 3.1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    pub waves: Vec<(f64, f64, f64)>,
    /// True to allow time to decrease outwards in some places, as in burls.
    pub allow_folds: bool,
    /// Another seed gives other variation of the same kind.
    pub seed: u64,
}

impl VaryGrowth {
    fn waves(&self) -> Vec<Wave> {
        self.waves.iter().map(|&(amplitude, across, along)| Wave { amplitude, across, along }).collect()
    }

    fn calendar(&self, cx: &Context<'_>, hash: Hash) -> Result<Option<Calendar>, Stop> {
        Ok(match &self.series {
            Series::Even => None,
            Series::Generated => {
                Some(Calendar::new(&series(self.years as usize, self.sigma, self.memory, hash.with(1))))
            }
            Series::List(widths) => Some(Calendar::new(widths)),
            Series::FromPattern => {
                let pattern = cx.get_opt(&self.pattern)?;
                let widths: Vec<f64> = pattern.iter().flat_map(|p| p.widths.iter().map(|w| f64::from(*w))).collect();
                if widths.len() < 2 {
                    let message = "series is `FromPattern`, but the pattern was sampled from fewer than 2 years";
                    let help = "connect a `ColorPattern` with `image` and `line` across several years";
                    return Err(Problem::new(ErrorCode::BadValue, message).at("series").help(help).into());
                }
                Some(Calendar::new(&widths))
            }
        })
    }

    fn shaped(&self, cx: &Context<'_>, time: &Solid, hash: Hash) -> Result<Solid, Stop> {
        if self.eccentricity == 0.0 && self.waves.is_empty() {
            return Ok(time.clone());
        }
        let trunk = match cx.get_opt(&self.tree)? {
            Some(tree) => Trunk::<f32>::new(&even(&tree.skeleton, "tree")?),
            None => Trunk::new(&[]),
        };
        let shape = Shape::new(self.eccentricity, &self.waves(), hash.with(2));
        let place = Code::of_place(move |patch, _, out| {
            if let [x, y, z] = out {
                shape.place(&trunk, &places(patch), patch.pixel, [&mut **x, &mut **y, &mut **z]);
            }
        });
        let place = place.passing().solid(Type::SolidVector, Vec::new());
        let place = cx.shared("place", place);
        Ok(time.moved(place, true))
    }
}

impl Node for VaryGrowth {
    const VERSION: u32 = 3;
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "The time of irregular growth.").in_unit("years"),
        Output::new("calendar", Type::Curve, "Where years begin: points (even time, year, 0)."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let bad = |message: String, field: &str| vec![Problem::new(ErrorCode::BadValue, message).at(field)];
        if self.waves.len() > WAVES {
            return bad(format!("waves has {} entries; at most {WAVES} are allowed", self.waves.len()), "waves");
        }
        if let Some(w) = self.waves.iter().find(|w| w.1 < 0.01 || w.2 < 0.01) {
            return bad(format!("a wave is `{} × {}` mm; both sizes must be at least 0.01 mm", w.1, w.2), "waves");
        }
        let left = reserve(self.eccentricity, &self.waves());
        if left <= 0.0 && !self.allow_folds {
            let sum: f64 = self.waves.iter().map(|w| w.0 / w.1).sum();
            let message = format!(
                "time would not rise outward everywhere: the sum of amplitude / across is {sum:.3}; it must be below {:.3}",
                (1.0 - 1.5 * self.eccentricity).max(0.0) / shibo_kernel::noise::noise3::SLOPE
            );
            let problem = Problem::new(ErrorCode::BadValue, message).at("waves");
            return vec![problem.help("lower the amplitudes, widen the waves, or say `allow_folds: true`")];
        }
        match &self.series {
            Series::List(widths) if widths.is_empty() || widths.len() > 4096 => {
                bad(format!("series has {} widths; there must be 1 to 4096", widths.len()), "series")
            }
            Series::List(widths) if widths.iter().any(|w| !(w.is_finite() && *w > 0.0)) => {
                bad("series has a width that is not greater than 0".to_owned(), "series")
            }
            Series::FromPattern if self.pattern.is_none() => {
                bad("series is `FromPattern`, which needs `pattern`".to_owned(), "series")
            }
            _ => Vec::new(),
        }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let time = self.shaped(cx, &cx.get(&self.time)?, hash)?;
        let Some(calendar) = self.calendar(cx, hash)?.map(Arc::new) else {
            let points = vec![DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)];
            return Ok(Outputs::one(time).with("calendar", Curve { points }));
        };
        let points: Vec<_> = calendar.points().map(|(time, year)| DVec3::new(time, year, 0.0)).collect();
        let exact = calendar.clone();
        let code = Code::of_inputs(move |_, inputs, out| {
            dispatch(
                #[inline(always)]
                || {
                    for (out, time) in out[0].iter_mut().zip(inputs[0].plane(0)) {
                        *out = narrow(calendar.at(f64::from(*time)));
                    }
                },
            );
        });
        let code = code.with_exact(move |_, inputs| inputs[0].iter().map(|t| exact.at(*t)).collect());
        let note = ByCalendar { even: time.clone(), years: Curve { points: points.clone() } };
        let time = Solid::new(Type::Solid, vec![time], code.kept()).noted(note);
        Ok(Outputs::one(time).with("calendar", Curve { points }))
    }
}
