//! [`Synthesize`]: any amount of a texture from an exemplar.
//!
//! Source: JP5149288B2 II and III, claims 1 to 5, 10, 16 (rows C2 to C15, C31 to C34). The preset `Patent` is exactly
//! the method of the source: it compares colours, starts from zeros, and uses no random numbers. The other presets work
//! in appearance space, with candidate sets, a start at random or on the exemplar's lattice, and even use of the
//! exemplar. Cost: O(pixels · passes).
use super::analysis::{self, add_alike, find_lattice, levels_of};
use super::inputs::FieldInputs;
use super::patent::{self, PatentSpec};
use super::stages;
use glam::{DVec2, IVec2, UVec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::analysis::AnalysisSpec;
use shibo_kernel::synthesis::coverage::EvenUse;
use shibo_kernel::synthesis::driver::{self, Analysed, Settings, Start};
use shibo_kernel::synthesis::lattice::Basis;
use shibo_kernel::synthesis::region::Output as Pixels;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, JacobianField, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Exemplar, ExemplarLattice, ExemplarLevel, Stop, Type};
use std::sync::Arc;

/// A set of parameters. A parameter that is given replaces that of the preset.
#[choice]
pub enum Preset {
    /// Exactly the method of the source: it gives the exemplar itself, tiled, unless a Jacobian or `jitter` varies it.
    Patent,
    /// For irregular textures, such as grain, stone or bark.
    Stochastic,
    /// For any texture: keeps features whole, and detects whether the exemplar is regular.
    #[default]
    Structured,
    /// For brickwork, cloth or tiles: strictly in phase, with no visible repeats.
    Regular,
    /// Larger pieces of the exemplar, unchanged.
    Faithful,
    /// Like `Structured`, but joints between pieces are not mended: takes about half the time, but features are torn
    /// there.
    Fast,
    /// Like `Structured`, but joints between pieces are mended in more rounds: the fewest torn features.
    Best,
}

/// Area over which the use of the exemplar is evened out.
#[choice]
pub enum Scope {
    /// Locally, so that a larger output contains a smaller one
    #[default]
    Auto,
    /// The whole output. Then a larger output does not contain a smaller one.
    Whole,
    /// Squares of 128 pixels.
    Local,
}

/// The first coordinates.
#[choice]
pub enum StartMode {
    /// On the lattice of the exemplar if it has one, otherwise random.
    #[default]
    Auto,
    /// Random places of the exemplar.
    Random,
}

/// Grows any amount of a texture from an exemplar: finds for every pixel its place in the exemplar.
///
/// Works at the exemplar's pixel size from the canvas' corner, independent of the output's resolution: a larger canvas
/// shows more. In directions in which the canvas tiles, opposite sides of the result fit each other. If it tiles in
/// both, its edge is placed where it cuts the fewest features, unless an input depends on the place: a guide, given
/// coordinates, or a Jacobian that varies. `SampleExemplar` shows the coordinates with any aligned picture. Structure
/// wider than half the exemplar is not kept; control it by `guide` or `jacobian`.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "input": GradientMap(input: "cells.border", stops: [(0.0, "#2a1a10"), (0.25, "#8a5a34"), (1.0, "#c99a66")]),
/// "exemplar": Exemplar(input: "input", size: (64, 64)),
/// "example": Synthesize(exemplar: "exemplar", size: (256, 256)),
/// ```
///
/// Elsewhere: Substance 3D Sampler *Make It Tile*.
#[node]
pub struct Synthesize {
    /// The exemplar. Without `AppearanceSpace`, `CandidateSets` or `DetectLattice` before it, their work is done here
    /// with defaults.
    pub exemplar: In<Exemplar>,
    /// The Jacobian from output to exemplar, which rotates and scales features. The unit matrix by default.
    pub jacobian: Option<In<JacobianField>>,
    /// The wanted guide value at each place, 0..1; needs an exemplar with a guide.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub guide: Option<In<Gray>>,
    /// Given coordinates. They stay where `fixed_mask` is at least 0.5, and all other coordinates are fitted to them.
    pub fixed: Option<In<CoordMap>>,
    /// Mask of the coordinates of `fixed` that stay; everywhere by default.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub fixed_mask: Option<In<Gray>>,
    /// Coordinates to start from instead of random ones.
    pub start: Option<In<CoordMap>>,
    /// Factor on `jitter`.
    pub jitter_mask: Option<In<Gray>>,
    /// A set of parameters. A parameter given below replaces that of the preset.
    #[default(Preset::Structured)]
    pub preset: Preset,
    /// Columns and rows over the canvas. By default such that pixels have the size of the exemplar's pixels.
    #[schemars(extend("minimum" = 1.0, "maximum" = 65536.0))]
    pub size: Option<(u32, u32)>,
    /// The pixel of the unbounded texture that lies at the canvas' corner.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6))]
    #[default((0, 0))]
    pub origin: (i32, i32),
    /// Size of the pieces that are copied whole: 1.5 is small, 2.5 the value of most presets, 3 large.
    #[schemars(range(min = 1, max = 10))]
    pub copy_size: Option<f64>,
    /// Strength of the even use of all parts of the exemplar; 0 is none. By default 1, or 1.25 if a lattice is found
    /// and the preset is not `Regular`.
    #[schemars(range(min = 0, max = 1.5))]
    pub even_use: Option<f64>,
    /// Area over which the use of the exemplar is evened out.
    #[default(Scope::Auto)]
    pub scope: Scope,
    /// The first coordinates.
    #[default(StartMode::Auto)]
    pub start_mode: StartMode,
    /// Spacing of the first coordinates in pixels, rounded down to a power of two. By default a quarter of the
    /// exemplar, or about the period of its lattice.
    #[schemars(range(min = 1, max = 16384))]
    pub start_size: Option<u32>,
    /// Number of corrections of all pixels at each level.
    #[schemars(range(min = 0, max = 16))]
    #[default(2)]
    pub passes: u32,
    /// Rounds of mending the joints between pieces: in this number of rounds the texture at joints is looked up in the
    /// exemplar, and in as many further rounds places that are still torn are replaced. 0 mends nothing; most presets
    /// have 2, `Best` has 4. Nothing is mended where a Jacobian rotates or scales.
    #[schemars(range(min = 0, max = 8))]
    pub mend: Option<u32>,
    /// For the preset `Patent`: number of groups of pixels that are corrected one after another; 1 corrects all pixels
    /// at once.
    #[schemars(range(min = 1, max = 256))]
    #[default(SUB_PASSES)]
    pub sub_passes: u32,
    /// Random displacement of pixels at all coarse levels, in pixels of the level: more variety, less order.
    #[schemars(range(min = 0, max = 4))]
    pub jitter: f64,
    /// Weight of the guide.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub guide_weight: f64,
    /// True to average three predictions where a Jacobian rotates or scales.
    #[default(true)]
    pub averaged: bool,
    /// Another seed gives another texture of the same kind.
    pub seed: u64,
}

/// Default number of groups of pixels that are corrected one after another.
const SUB_PASSES: u32 = 4;

/// Side of the squares over which use is evened out locally.
const TILE: usize = 128;

impl Synthesize {
    /// Pixels over the canvas, and their size in mm.
    fn pixels(&self, cx: &Context<'_>, exemplar: &Exemplar) -> Result<(UVec2, DVec2), Stop> {
        let canvas = cx.size_mm();
        let tiling = cx.tiling();
        let (size, pitch) = match self.size {
            Some((w, h)) => (DVec2::new(f64::from(w), f64::from(h)), canvas / DVec2::new(f64::from(w), f64::from(h))),
            None => {
                let count = canvas / exemplar.frame.pitch;
                // In directions in which the canvas tiles, a whole number of pixels covers it.
                let axis = |tiles: bool, n: f64| if tiles { n.round().max(1.0) } else { (n - 1e-9).ceil().max(1.0) };
                let size = DVec2::new(axis(tiling.x, count.x), axis(tiling.y, count.y));
                let pitch = |tiles: bool, whole: f64, n: f64, pitch: f64| if tiles { whole / n } else { pitch };
                let x = pitch(tiling.x, canvas.x, size.x, exemplar.frame.pitch.x);
                (size, DVec2::new(x, pitch(tiling.y, canvas.y, size.y, exemplar.frame.pitch.y)))
            }
        };
        // Bytes for positions; for indices if there is no Jacobian; and for comparisons and matches while joints are
        // mended.
        let per_pixel = if self.jacobian.is_some() || self.rounds() > 0 { 56.0 } else { 24.0 };
        let bytes = size.x * size.y * per_pixel;
        if bytes > cx.evaluator.memory() as f64 || size.max_element() > 65_536.0 {
            let message = format!(
                "the canvas takes `{}x{}` pixels of the exemplar's size, {:.0} MiB; {} MiB are allowed",
                size.x,
                size.y,
                bytes / 1_048_576.0,
                cx.evaluator.memory() >> 20
            );
            let help = "enlarge the exemplar's `size_mm`, set `size`, or raise --memory";
            return Err(Problem::new(Code::TooLarge, message).at("exemplar").help(help).into());
        }
        Ok((size.as_uvec2(), pitch))
    }

    fn lattice(&self, exemplar: &Exemplar) -> Option<Basis> {
        if self.start_mode == StartMode::Random || matches!(self.preset, Preset::Patent | Preset::Stochastic) {
            return None;
        }
        let found: ExemplarLattice = exemplar.lattice.unwrap_or_else(|| find_lattice(exemplar));
        found.vectors.map(|[a, b]| Basis { a: a.to_array(), b: b.to_array() })
    }

    /// True if an input asks for something particular at some place of the canvas.
    fn is_placed(&self) -> bool {
        self.guide.is_some() || self.fixed.is_some() || self.start.is_some() || self.jitter_mask.is_some()
    }

    /// Number of rounds of mending joints between pieces.
    fn rounds(&self) -> u32 {
        self.mend.unwrap_or(match self.preset {
            Preset::Patent | Preset::Fast => 0,
            Preset::Best => 4,
            _ => 2,
        })
    }

    fn settings(&self, cx: &Context<'_>, exemplar: &Exemplar, basis: Option<Basis>) -> Settings {
        let side = exemplar.frame.size.min_element();
        let regular = self.preset == Preset::Regular;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
        let period = basis.map(|basis| (basis.shortest() / if regular { 2.0 } else { 1.0 }).max(1.0) as u32);
        let wanted = self.start_size.or(period).unwrap_or(side / 4).clamp(1, (side / 4).max(1));
        let kappa = self.copy_size.unwrap_or(match self.preset {
            Preset::Regular => 2.0,
            Preset::Faithful => 3.0,
            _ => 2.5,
        });
        // In a regular texture other parts fit as well, so a stronger even use avoids repeats and tears no more
        // features.
        let even = self.even_use.unwrap_or(if basis.is_some() && !regular { 1.25 } else { 1.0 });
        Settings {
            kappa: narrow(kappa),
            even: (even > 0.0).then(|| EvenUse {
                amount: narrow(even),
                tile: (self.scope != Scope::Whole).then_some(TILE),
                halved: false,
            }),
            passes: self.passes,
            rounds: self.rounds(),
            enough: if self.preset == Preset::Best { 0.01 } else { 0.015 },
            averaged: self.averaged,
            jitter: narrow(self.jitter),
            guide_weight: narrow(self.guide_weight),
            margin: exemplar.margin,
            coarsest: 1 << wanted.ilog2(),
            start: match (self.start.is_some(), basis) {
                (true, _) => Start::Given,
                (false, Some(basis)) => Start::Lattice(basis),
                (false, None) => Start::Random,
            },
            adrift: !self.is_placed(),
            hash: Hash::new(cx.seed(self.seed)),
        }
    }

    /// The levels of the exemplar, analysed now if they were not before.
    pub(super) fn levels(cx: &Context<'_>, exemplar: &Exemplar) -> Result<Arc<Vec<ExemplarLevel>>, Stop> {
        let seconds = exemplar.levels.iter().any(|level| !level.second.is_empty());
        if !exemplar.levels.is_empty() && seconds {
            return Ok(exemplar.levels.clone());
        }
        let until = || cx.check().is_err();
        let mut levels = match exemplar.levels.is_empty() {
            true => levels_of(exemplar, &AnalysisSpec::default(), &until),
            false => exemplar.levels.to_vec(),
        };
        cx.check()?;
        add_alike(exemplar, &mut levels, 2, 0.05, &until);
        cx.check()?;
        Ok(Arc::new(levels))
    }

    fn advise(&self, cx: &Context<'_>, exemplar: &Exemplar) {
        for (port, why) in self.idle() {
            let problem = Problem::new(Code::Advice, format!("`{port}` does nothing: {why}")).at(port);
            cx.evaluator.warn(problem.help("leave it out, or choose another `preset`"));
        }
        if self.guide.is_some() && exemplar.guide.is_empty() {
            let problem = Problem::new(Code::Advice, "the exemplar has no guide, so that of the output does nothing");
            cx.evaluator.warn(problem.at("guide").help("connect `guide` of the Exemplar too"));
        }
    }
}

impl Synthesize {
    /// Given parameters that have no effect, with the reason.
    fn idle(&self) -> Vec<(&'static str, &'static str)> {
        const PATENT: &str = "the preset `Patent` is the method of the source, which has no such thing";
        if self.preset != Preset::Patent {
            let why = "only the preset `Patent` divides pixels into another number of groups than 4";
            return if self.sub_passes == SUB_PASSES { Vec::new() } else { vec![("sub_passes", why)] };
        }
        let given = [
            ("guide", self.guide.is_some()),
            ("fixed", self.fixed.is_some()),
            ("copy_size", self.copy_size.is_some()),
            ("even_use", self.even_use.is_some()),
            ("scope", self.scope != Scope::Auto),
            ("start_mode", self.start_mode != StartMode::Auto),
            ("mend", self.mend.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(name, _)| (name, PATENT)).collect()
    }
}

impl Node for Synthesize {
    const VERSION: u32 = 12;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];
    const OUTPUTS: &'static [Output] =
        &[Output::new("coords", Type::CoordMap, "For every pixel, where in the exemplar it comes from.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.fixed_mask.is_some() && self.fixed.is_none() {
            let message = "`fixed_mask` says where coordinates are given, but there are none";
            return vec![Problem::new(Code::MissingInput, message).at("fixed_mask").help("connect `fixed` too")];
        }
        Vec::new()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let exemplar = cx.get(&self.exemplar)?;
        self.advise(cx, &exemplar);
        let (size, pitch) = self.pixels(cx, &exemplar)?;
        let tiling = cx.tiling();
        let guide = if exemplar.guide.is_empty() { None } else { cx.get_opt(&self.guide)? };
        let fixed = match cx.get_opt(&self.fixed)? {
            Some(map) => Some((map, cx.get_opt(&self.fixed_mask)?)),
            None => None,
        };
        let inputs = FieldInputs {
            cx,
            jacobian: cx.get_opt(&self.jacobian)?,
            guide,
            fixed,
            jitter: cx.get_opt(&self.jitter_mask)?,
            start: cx.get_opt(&self.start)?,
            pitch,
            size,
            origin: IVec2::new(self.origin.0, self.origin.1),
        };
        let map = CoordMap {
            size,
            start: IVec2::ZERO,
            pitch,
            periodic: tiling,
            spacing: 1,
            coords: Arc::default(),
            exemplar: Some(exemplar.frame),
            coherence: 0.0,
            coverage: 0.0,
            surface: None,
        };
        if self.preset == Preset::Patent {
            let spec = PatentSpec {
                averaged: self.averaged,
                sub_passes: self.sub_passes,
                passes: self.passes,
                jitter: self.jitter,
                hash: Hash::new(cx.seed(self.seed)),
            };
            let coords = patent::run(&spec, self.start_size, &exemplar, &inputs)?;
            return Ok(Outputs::one(CoordMap { coords: Arc::new(coords), ..map }));
        }
        let levels = Self::levels(cx, &exemplar)?;
        let settings = self.settings(cx, &exemplar, self.lattice(&exemplar));
        let settings = Settings { rounds: if inputs.bends() { 0 } else { settings.rounds }, ..settings };
        let features = analysis::features(&exemplar);
        let output = Pixels {
            start: [0, 1].map(|d| if [tiling.x, tiling.y][d] { 0 } else { inputs.origin[d] }),
            size: [size.x as usize, size.y as usize],
            wrap: [tiling.x, tiling.y],
        };
        let analysed = Analysed {
            plane: analysis::plane(&exemplar),
            levels: &levels,
            usable: &exemplar.usable,
            guide: if inputs.guide.is_some() { &exemplar.guide } else { &[] },
            picture: (!inputs.bends()).then_some((&features, exemplar.pyramid)),
        };
        let made = driver::run(&analysed, &output, &settings, &inputs)?;
        let coords = stages::rolled(made.coords, size, self.origin, [tiling.x, tiling.y]);
        let (coherence, coverage) = (made.coherence, made.coverage);
        Ok(Outputs::one(CoordMap { coords: Arc::new(coords), coherence, coverage, ..map }))
    }
}
