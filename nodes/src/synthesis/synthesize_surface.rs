//! [`SynthesizeSurface`]: grows a texture on a surface.
//!
//! Source: JP5149288B2 III, claims 6, 7, 11 to 14 (rows C18 to C26): synthesis directly on the pixels of an atlas,
//! along `J = (t b)⁺ J_f`, reading across borders of charts through an indirection map. The preset `Patent` is exactly
//! this method. Beyond the source: pointers between pixels, random numbers by place on the surface, and further passes
//! over pixels near borders. Cost: O(texels · passes).
use super::analysis;
use super::indirection_map::{Jumps, map_size};
use super::inputs::FieldInputs;
use super::jacobian_from_mesh::of_one_mesh;
use super::patent::PatentSpec;
use super::patent_surface;
use super::surface_inputs::SurfaceFields;
use super::synthesize::{Preset, Scope, Synthesize};
use glam::{IVec2, UVec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::levels::{LevelsSpec, indirection};
use shibo_kernel::synthesis::coverage::EvenUse;
use shibo_kernel::synthesis::driver::{Analysed, Settings, Start};
use shibo_kernel::synthesis::sheet::{Sheet, usable_levels};
use shibo_kernel::synthesis::surface::{Grown, Surfaces, run};
use shibo_kernel::synthesis::surface_measure::{Measured, seam};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, CoordMap, Exemplar, Frames, IndirectionMap, Stop, Surface, Tiling, Type};
use std::sync::Arc;

/// The first coordinates on a surface.
#[choice]
pub enum SurfaceStart {
    /// Zeros for the preset `Patent`, otherwise random.
    #[default]
    Auto,
    /// Random places of the exemplar.
    Random,
    /// The exemplar's first corner, for the preset `Patent`.
    Zero,
}

/// Grows a texture from an exemplar directly on a surface: finds for every texel of an atlas its place in the exemplar.
///
/// Features follow the directions of `frames` and continue across the borders of charts, independent of the layout of
/// charts on the canvas. Works at the exemplar's pixel size on the surface, independent of the output's resolution.
/// `SampleExemplar` shows the coordinates; `DilateGutter` then fills the space between charts.
///
/// Elsewhere: no counterpart in Substance or Blender, whose *tri-planar* projections overlay three pictures.
///
/// ```ron
/// "cells": Worley(size: 8, jitter: 0.8),
/// "input": GradientMap(input: "cells.border", stops: [(0.0, "#2a1a10"), (0.25, "#8a5a34"), (1.0, "#c99a66")]),
/// "exemplar": Exemplar(input: "input", size: (64, 64)),
/// "ring": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ring"),
/// "flow": TangentField(mesh: "ring", from: Around),
/// "coords": SynthesizeSurface(exemplar: "exemplar", atlas: "atlas", frames: "flow", size: 192),
/// "example": SampleExemplar(coords: "coords", input: "input"),
/// ```
#[node]
pub struct SynthesizeSurface {
    /// The exemplar. Without `AppearanceSpace` or `CandidateSets` before it, their work is done here with defaults.
    pub exemplar: In<Exemplar>,
    /// The surface and its charts.
    pub atlas: In<Atlas>,
    /// Directions on its mesh.
    pub frames: In<Frames>,
    /// Rotation of the directions in the surface in degrees, clockwise seen from outside.
    pub angle: Option<In<Gray>>,
    /// Factor on the size of features.
    pub scale: Option<In<Gray>>,
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
    /// A set of parameters; on a surface there is no `Regular`. A parameter given below replaces that of the preset.
    #[default(Preset::Structured)]
    pub preset: Preset,
    /// Columns over the canvas; rows follow. By default texels are as large as the exemplar's pixels, on average.
    #[schemars(extend("minimum" = 16.0, "maximum" = 16384.0))]
    pub size: Option<u32>,
    /// Size of the pieces that are copied whole: 1.5 is small, 2.5 the value of most presets, 3 large.
    #[schemars(range(min = 1, max = 10))]
    pub copy_size: Option<f64>,
    /// Strength of the even use of all parts of the exemplar: 0 is none, 1 the value of the presets.
    #[schemars(range(min = 0, max = 1.5))]
    pub even_use: Option<f64>,
    /// Area over which the use of the exemplar is evened out: by default cubes in space with sides of 128 exemplar
    /// pixels.
    #[default(Scope::Auto)]
    pub scope: Scope,
    /// The first coordinates.
    #[default(SurfaceStart::Auto)]
    pub start_mode: SurfaceStart,
    /// Spacing of the first coordinates in texels, rounded down to a power of two. By default a quarter of the
    /// exemplar.
    #[schemars(range(min = 1, max = 16384))]
    pub start_size: Option<u32>,
    /// Number of corrections of all texels at each level.
    #[schemars(range(min = 0, max = 16))]
    #[default(2)]
    pub passes: u32,
    /// Number of additional corrections of texels near borders of charts. 2 by default, 0 for `Patent`.
    #[schemars(range(min = 0, max = 8))]
    pub border_passes: Option<u32>,
    /// For the preset `Patent`: number of groups of texels that are corrected one after another; 1 corrects all texels
    /// at once.
    #[schemars(range(min = 1, max = 256))]
    #[default(4)]
    pub sub_passes: u32,
    /// Precision of the place of a neighbour across a border: by default exact; for `Patent` the nearest texel.
    pub jumps: Option<Jumps>,
    /// Random displacement of texels at all coarse levels, in texels of the level: more variety, less order.
    #[schemars(range(min = 0, max = 4))]
    pub jitter: f64,
    /// Weight of the guide.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub guide_weight: f64,
    /// True to average three predictions where features are rotated or scaled.
    #[default(true)]
    pub averaged: bool,
    /// Another seed gives another texture of the same kind.
    pub seed: u64,
}

/// Side of the cubes over which the use of the exemplar is evened out, in exemplar pixels.
const TILE: usize = 128;

/// Largest default number of columns.
const MOST: f64 = 4096.0;

impl SynthesizeSurface {
    fn patent(&self) -> bool {
        self.preset == Preset::Patent
    }

    /// Columns and rows.
    fn pixels(&self, cx: &Context<'_>, atlas: &Atlas, exemplar: &Exemplar) -> Result<[u32; 2], Stop> {
        let pitch = exemplar.frame.pitch.element_product().sqrt();
        let extent = exemplar_extent(atlas);
        if pitch > 0.1 * extent {
            let message = format!("a pixel of the exemplar is `{pitch:.3}` mm wide, the mesh only {extent:.3} mm");
            let help = "set the exemplar's `size_mm` to its size on the surface, or the mesh's `unit`";
            return Err(Problem::new(Code::BadValue, message).at("exemplar").help(help).into());
        }
        let wanted = atlas.scale() * atlas.size_mm.x / pitch;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to a few thousand")]
        let columns = self.size.unwrap_or(wanted.clamp(16.0, MOST).round() as u32);
        if wanted > 2.0 * f64::from(columns) {
            let message = format!(
                "texels are {:.1} times as wide as the exemplar's pixels, whose details are lost",
                wanted / f64::from(columns)
            );
            let help = "raise `size`, or show the coordinates with MagnifyCoords";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("size").help(help));
        }
        map_size(cx, atlas, columns, 52)
    }

    /// The indirection map, from the finest level to the level at which synthesis starts.
    fn map(&self, inputs: &SurfaceFields<'_>, coarsest: u32) -> Result<IndirectionMap, Stop> {
        let (cx, size, ends) = (inputs.fields.cx, inputs.fields.size.to_array(), inputs.frames.ends());
        let nearest = self.jumps.unwrap_or(if self.patent() { Jumps::Nearest } else { Jumps::Exact }) == Jumps::Nearest;
        let spec = LevelsSpec { size, levels: coarsest.ilog2() + 1, exact: !nearest, ring: 0, ends: &ends };
        let mut map = indirection(&inputs.atlas, &spec, &|| cx.check().is_err());
        cx.check()?;
        map.levels.truncate(usable_levels(&map, map.levels.len()));
        Ok(map)
    }

    fn settings(&self, cx: &Context<'_>, exemplar: &Exemplar, coarsest: usize) -> Settings {
        let even = self.even_use.unwrap_or(1.0);
        let local = self.scope != Scope::Whole;
        Settings {
            kappa: narrow(self.copy_size.unwrap_or(if self.preset == Preset::Faithful { 3.0 } else { 2.5 })),
            even: (even > 0.0).then(|| EvenUse { amount: narrow(even), tile: local.then_some(TILE), halved: false }),
            passes: self.passes,
            rounds: 0,
            enough: 0.015,
            averaged: self.averaged,
            jitter: narrow(self.jitter),
            guide_weight: narrow(self.guide_weight),
            margin: exemplar.margin,
            coarsest,
            start: if self.start.is_some() { Start::Given } else { Start::Random },
            adrift: false,
            hash: Hash::new(cx.seed(self.seed)),
        }
    }

    fn inputs<'a>(&self, cx: &'a Context<'a>, exemplar: &Exemplar, size: [u32; 2]) -> Result<SurfaceFields<'a>, Stop> {
        let (atlas, frames) = (cx.get(&self.atlas)?, cx.get(&self.frames)?);
        let fixed = match cx.get_opt(&self.fixed)? {
            Some(map) => Some((map, cx.get_opt(&self.fixed_mask)?)),
            None => None,
        };
        let size = UVec2::from(size);
        let fields = FieldInputs {
            cx,
            jacobian: None,
            guide: if exemplar.guide.is_empty() { None } else { cx.get_opt(&self.guide)? },
            fixed,
            jitter: cx.get_opt(&self.jitter_mask)?,
            start: cx.get_opt(&self.start)?,
            pitch: atlas.size_mm / size.as_dvec2(),
            size,
            origin: IVec2::ZERO,
        };
        let (angle, scale) = (cx.get_opt(&self.angle)?, cx.get_opt(&self.scale)?);
        Ok(SurfaceFields { fields, atlas, frames, angle, scale, exemplar: exemplar.frame.pitch })
    }

    /// Coordinates and Jacobians of the finest level.
    fn grow(&self, exemplar: &Exemplar, map: &IndirectionMap, inputs: &SurfaceFields<'_>) -> Result<Grown, Stop> {
        let cx = inputs.fields.cx;
        if self.patent() {
            let spec = PatentSpec {
                averaged: self.averaged,
                sub_passes: self.sub_passes,
                passes: self.passes,
                jitter: self.jitter,
                hash: Hash::new(cx.seed(self.seed)),
            };
            return patent_surface::run(&spec, self.start_mode != SurfaceStart::Random, exemplar, map, inputs);
        }
        let levels = Synthesize::levels(cx, exemplar)?;
        let analysed = Analysed {
            plane: analysis::plane(exemplar),
            levels: &levels,
            usable: &exemplar.usable,
            guide: if inputs.fields.guide.is_some() { &exemplar.guide } else { &[] },
            picture: None,
        };
        let surface = Surfaces { map, pitch: exemplar.frame.pitch.x, border_passes: self.border_passes.unwrap_or(2) };
        run(&analysed, &surface, &self.settings(cx, exemplar, 1 << (map.levels.len() - 1)), inputs)
    }

    /// Advice about inputs that will not give the expected result.
    fn advise(&self, cx: &Context<'_>, exemplar: &Exemplar, frames: &Frames) {
        if self.guide.is_some() && exemplar.guide.is_empty() {
            let problem = Problem::new(Code::Advice, "the exemplar has no guide, so that of the output does nothing");
            cx.evaluator.warn(problem.at("guide").help("connect `guide` of the Exemplar too"));
        }
        let ends = frames.ends_mm();
        if ends > 0.0 {
            let message =
                format!("the directions turn along {ends:.0} mm of lines on the surface, where the texture is torn");
            let help = "set `symmetry: 1` in TangentField, or lead the directions by strokes";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("frames").help(help));
        }
    }
}

/// The largest side of the bounding box of a mesh.
fn exemplar_extent(atlas: &Atlas) -> f64 {
    let [low, high] = atlas.mesh.bounds();
    (high - low).max_element()
}

impl Node for SynthesizeSurface {
    const VERSION: u32 = 3;
    const FACTS: &'static [Fact] = &[Fact::Seed];
    const OUTPUTS: &'static [Output] =
        &[Output::new("coords", Type::CoordMap, "For each texel its position in the exemplar.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        if self.fixed_mask.is_some() && self.fixed.is_none() {
            let message = "`fixed_mask` says where coordinates are given, but there are none";
            problems.push(Problem::new(Code::MissingInput, message).at("fixed_mask").help("connect `fixed` too"));
        }
        if self.preset == Preset::Regular {
            let message = "no lattice can be kept in phase all over a surface; `Regular` is for the plane";
            problems.push(Problem::new(Code::BadValue, message).at("preset").help("on a surface take `Faithful`"));
        }
        if self.start_mode == SurfaceStart::Zero && !self.patent() {
            let message = "only the preset `Patent` starts from zeros";
            problems
                .push(Problem::new(Code::BadValue, message).at("start_mode").help("take `preset: Patent` or `Random`"));
        }
        problems
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (exemplar, atlas, frames) = (cx.get(&self.exemplar)?, cx.get(&self.atlas)?, cx.get(&self.frames)?);
        of_one_mesh(&atlas, &frames)?;
        self.advise(cx, &exemplar, &frames);
        let size = self.pixels(cx, &atlas, &exemplar)?;
        let side = exemplar.frame.size.min_element();
        let most = if self.patent() { side } else { (side / 4).max(1) };
        let most = most.min(256);
        let coarsest = self.start_size.unwrap_or(most).clamp(1, most);
        let inputs = self.inputs(cx, &exemplar, size)?;
        let map = self.map(&inputs, coarsest)?;
        let (mut coords, jacobians) = self.grow(&exemplar, &map, &inputs)?;
        cx.check()?;
        let sheet = Sheet::new(&map, 0);
        let measured = Measured {
            sheet: &sheet,
            coords: &coords,
            jacobians: &jacobians,
            color: |at| analysis::color(&exemplar, at),
        };
        let (coherence, seam) = (measured.coherence(), seam(&measured.steps()));
        coords
            .iter_mut()
            .zip(&map.levels[0].owner)
            .filter(|(_, owner)| **owner == 0)
            .for_each(|(at, _)| *at = [f32::NAN; 2]);
        let Some(level) = map.levels.into_iter().next() else {
            return Err(Problem::new(Code::BadValue, "the map has no levels").at("size").into());
        };
        let surface = Surface { atlas, finest: size, level, jacobians, seam: Some(seam) };
        Ok(Outputs::one(CoordMap {
            size: UVec2::from(size),
            start: IVec2::ZERO,
            pitch: inputs.fields.pitch,
            periodic: Tiling::NONE,
            spacing: 1,
            coords: Arc::new(coords),
            exemplar: Some(exemplar.frame),
            coherence,
            coverage: 0.0,
            surface: Some(Arc::new(surface)),
        }))
    }
}
